// SPDX-License-Identifier: MIT
#pragma once

/// One axis of a drive (CiA 402, IEC 61800-7-201): the power state machine and the modes profile position,
/// velocity, profile velocity, profile torque, homing, interpolated position, cyclic synchronous position,
/// velocity and torque, if 6502h lists them. Axes is a node with several.
///
/// The axis follows its demand exactly, unless the plant file gives it a load. There are no ticks: positions
/// are calculated on demand, and update() returns the time of the next change; a moving load
/// changes every millisecond. Choices that CiA 402 leaves open are described at each part: power_stage.hpp,
/// modes.hpp, ...
///
/// Positions are in user units (6064h, 607Ah, ...), converted by 608Fh, 6091h and 6092h and rounded to the
/// nearest increment inside (6063h, 60FCh), to the nearest user unit outside.
///
/// Bit 11 of 6041h is also set while the axis is outside the software position limits (607Dh), in every mode.
///
/// 60FDh shows the switches of AxisLayout (bit 0 negative limit, 1 positive limit, 2 home). A limit switch
/// (from AxisLayout or an incident) stops the axis with the quick stop ramp and allows motion only in the
/// other direction; in homing only those of incidents do. With 607Bh narrower than INTEGER32 the axis is
/// rotary and has no limit switches.
///
/// Event-driven TPDOs are triggered by a change of statusword (6041h), mode (6061h) or inputs (60FDh), not of
/// positions.
///
/// In the cyclic modes, and in interpolated position without a buffer, once SYNCs have come at the period of
/// 60C2h, three periods without one are a fault: EMCY 8700h until the next SYNC, and 6007h.
///
/// 6007h acts when the network fails, and when NMT stops the node while operation is enabled. Going to
/// Pre-operational has no effect, because the drive can be commanded by SDO. The node sends the EMCY of a
/// network failure.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "devices/common.hpp"
#include "devices/drive/axis.hpp"
#include "devices/drive/modes.hpp"
#include "devices/drive/objects.hpp"
#include "devices/drive/power_stage.hpp"
#include "sim/behaviour.hpp"

namespace cbcan::devices {

/// The two touch probes (60B8h..60BDh). A probe's event is an edge of its input, or the index pulse of the
/// encoder (60B8h bit 2), which is both edges at its exact position. An edge is stored once until its bit (4,
/// 5) or the probe (0) is switched off; one of the input may also be stored each time (bit 1).
class TouchProbes {
 public:
  TouchProbes(DriveObjects& objects, Axis& axis) : objects_(objects), axis_(axis) {}

  bool exist() const { return objects_.probe_function.exists(); }
  /// Input of the first (0) or the second probe (1); seen by the next update().
  void set_level(std::size_t probe, bool level) { probes_[probe].level = level; }
  bool level(std::size_t probe) const { return probes_[probe].level; }
  /// True = 60B9h has changed.
  bool update(Time now);
  /// The next index pulse that would be stored.
  Time deadline(Time now) const;

 private:
  struct Probe {
    bool level = false;
    bool level_before = false;
    bool on = false;
    std::uint8_t stored = 0;  ///< bits of 60B9h
  };
  std::uint8_t function(std::size_t probe) const;
  void switch_on(std::size_t probe, std::uint8_t function);
  void note_pulse(std::size_t probe, double before, double now);
  void store(std::size_t probe, std::size_t edge, double position);

  DriveObjects& objects_;
  Axis& axis_;
  std::array<Probe, 2> probes_{};
  double place_ = 0;  ///< at the last update
};

enum class Incident : std::uint8_t {
  // Faults: EMCY, 603Fh and transition 13. They last until a fault reset after the cause has ended.
  kOvercurrent,
  kShortCircuit,
  kOvervoltage,
  kUndervoltage,
  kOvertemperature,
  kEncoder,
  kFollowingError,
  // These are not faults.
  kMotorBlocked,
  kNegativeLimit,
  kPositiveLimit,
  kWarning,
};

inline constexpr std::size_t kFaultKinds = 7;

/// Rows by Incident.
inline constexpr auto kDriveIncidents = std::to_array<IncidentKind>({
    {"overcurrent", 0x2310, ErrorRegister::kGeneric | ErrorRegister::kCurrent},
    {"short-circuit", 0x2320, ErrorRegister::kGeneric | ErrorRegister::kCurrent},
    {"overvoltage", 0x3210, ErrorRegister::kGeneric | ErrorRegister::kVoltage},
    {"undervoltage", 0x3220, ErrorRegister::kGeneric | ErrorRegister::kVoltage},
    {"overtemperature", 0x4210, ErrorRegister::kGeneric | ErrorRegister::kTemperature},
    {"encoder", 0x7305, ErrorRegister::kGeneric | ErrorRegister::kProfile},
    {"following-error", 0x8611, ErrorRegister::kGeneric | ErrorRegister::kProfile},
    {.name = "motor-blocked", .alarm = true},
    {"limit-switch-negative"},
    {"limit-switch-positive"},
    {"warning"},
});

// 603Fh after a network failure. The node sends the EMCY, except for a missed SYNC.
inline constexpr std::uint16_t kCommunicationFault = 0x8100;
inline constexpr std::uint16_t kSyncFault = 0x8700;
inline constexpr std::uint16_t kHeartbeatFault = static_cast<std::uint16_t>(EmergencyCode::kHeartbeat);
inline constexpr std::uint16_t kBusOffFault = static_cast<std::uint16_t>(EmergencyCode::kBusOffRecovered);

constexpr std::uint32_t bit_of(Incident incident) {
  return std::uint32_t{1} << static_cast<unsigned>(incident);
}

class Drive final : public DeviceWithIncidents {
 public:
  /// `offset` of its objects, as of DriveObjects.
  explicit Drive(sim::DeviceNode& node, const AxisLayout& layout = {}, std::uint16_t offset = 0);
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;

  void reset(bool application, Time now) override;
  Time update(Time now) override;
  AbortCode check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                  Time now) override;
  void on_sync(Time now) override;
  void on_state(nmt::State state, Time now) override;
  void on_network_failure(sim::NetworkFailure failure, Time now) override;
  void delay_commands(Time delay) override { command_delay_ = delay; }
  bool is_set_point(std::uint16_t index) const override;
  std::vector<sim::Point> points() const override;
  /// 60BAh and 60BCh: the levels at the touch probes, from 0.5 on 1.
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override;
  std::optional<double> output(std::uint16_t index, std::uint8_t sub) const override;

  const Axis& axis() const { return axis_; }

 private:
  /// The first axis has this object at the returned index.
  std::uint16_t own(std::uint16_t index) const {
    return static_cast<std::uint16_t>(index - objects_.d.offset);
  }
  void tell_changed(std::uint16_t index, Time now) {
    node_.changed(static_cast<std::uint16_t>(index + objects_.d.offset), 0, now);
  }
  bool has(Incident incident) const { return present(static_cast<std::size_t>(incident)); }
  ModeInput input(Time now) const;
  Mode* mode_of(std::int8_t number);
  bool supports(std::int8_t mode);

  void take_command(Time now);
  void network_failed(std::uint16_t code, Time now);
  void begin_faults(Time now);
  void end_faults(Time now);
  void watch_following(Time now);
  void run_mode(Time now);
  void publish(Time now);
  void publish_motion(Time now);
  bool brake_holds();
  void hold_motor(Time now);
  void watch_sync(Time now);
  std::uint32_t digital_inputs(Time now) const;
  std::uint32_t link_voltage() const;
  std::uint16_t status(Time now) const;
  Time deadline(Time now) const;
  Time following_deadline(Time now) const;

  DriveObjects objects_;
  Axis axis_;
  PowerStage stage_;
  ProfilePosition profile_position_{objects_, axis_};
  Velocity velocity_{objects_, axis_};
  ProfileVelocity profile_velocity_{objects_, axis_};
  ProfileTorque profile_torque_{objects_, axis_};
  Homing homing_{objects_, axis_};
  InterpolatedPosition interpolated_position_{objects_, axis_};
  CyclicPosition cyclic_position_{objects_, axis_};
  CyclicVelocity cyclic_velocity_{objects_, axis_};
  CyclicTorque cyclic_torque_{objects_, axis_};
  /// Modes by their number in 6060h.
  const std::array<Mode*, 11> modes_{
      nullptr,  &profile_position_,      &velocity_,        &profile_velocity_, &profile_torque_, nullptr,
      &homing_, &interpolated_position_, &cyclic_position_, &cyclic_velocity_,  &cyclic_torque_};
  TouchProbes probes_{objects_, axis_};

  Mode* mode_ = nullptr;  ///< of 6061h
  bool operating_ = false;
  bool follows_sync_ = false;
  bool had_power_ = false;
  bool brake_opened_ = false;  ///< by power, although 60FEh sets the brake
  Time lagging_since_ = kNever;
  bool lost_ = false;  ///< the following error has lasted too long
  Time last_sync_ = kNever;
  Time sync_due_ = kNever;  ///< deadline for the next SYNC; kNever = none is expected
  bool sync_missed_ = false;
  Time command_delay_ = 0;
  Time command_due_ = kNever;      ///< when the next controlword is acted on
  std::uint32_t nominal_voltage_;  ///< mV
};

/// Those whose controlword and statusword are in the dictionary; at least 1.
std::size_t axis_count(const ObjectDictionary& dictionary);

/// `layouts` of the first axes; the others have the default.
std::unique_ptr<sim::Behaviour> make_drive(sim::DeviceNode& node, std::span<const AxisLayout> layouts);

}  // namespace cbcan::devices
