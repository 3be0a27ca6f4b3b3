// SPDX-License-Identifier: MIT
#pragma once

/// What makes a simulated node a device: behaviour on its dictionary. The node does all the communication; a
/// behaviour reads and writes values. docs/how-to/lua-device.md shows how to write one.
///
/// The node calls update() before a value is read (SDO upload, sampling of a TPDO), after a value has been
/// written (SDO, RPDO, a signal), and at the time that the last update() returned. A behaviour works on the
/// present values; it does not learn which one has changed. Time is an argument and never goes back. A
/// behaviour reads no clock, uses only seeded random numbers, opens nothing, and never calls back into the
/// bus.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/time.hpp"

namespace cbcan::sim {

/// What a device has for people: inputs to set, outputs and values to look at. The page, the HTTP interface
/// and the command `points` show them.
struct Point {
  enum class Kind : std::uint8_t {
    kInput,   ///< set_input() sets it, as a signal or a wire does
    kOutput,  ///< what the device does with the master's values
    kCurve,   ///< a value over time
  };

  Kind kind = Kind::kCurve;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::string name{};                   ///< empty: that of the object
  std::string unit{};                   ///< empty = none, or not known
  std::optional<double> low{}, high{};  ///< the range to show
  std::vector<std::string> bits{};      ///< names of the bits, from bit 0; empty = a number
  std::uint16_t target = 0;             ///< the object to which the value is to go; 0 = none
  bool level = false;                   ///< how full a vessel is
  std::uint64_t alarm = 0;              ///< bits that report something wrong
};

/// Names of the kinds, in their order.
inline constexpr std::array<std::string_view, 3> kPointKinds{"input", "output", "curve"};
constexpr std::string_view name_of(Point::Kind kind) {
  return kPointKinds[static_cast<std::size_t>(kind)];
}

/// The five manufacturer-specific bytes of an EMCY message.
using EmergencyInfo = Emergency::Info;

using cbcan::NetworkFailure;

/// What a behaviour may ask of its node.
class DeviceNode {
 public:
  virtual ObjectDictionary& dictionary() = 0;

  /// Writes as an SDO download does, whatever faults refuse those.
  virtual void write_own(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value,
                         Time now) {
    static_cast<void>(dictionary().write_whole(index, sub, value, now));
  }

  /// An error has occurred: one EMCY with this code, and `register_bits` are set in 1001h until the error
  /// ends (CiA 301, 7.2.7). An error that is already present is not reported again.
  virtual void error(std::uint16_t code, std::uint8_t register_bits, const EmergencyInfo& info, Time now) = 0;
  /// The error with this code has ended: EMCY 0000h is sent, with what is left in 1001h.
  virtual void error_over(std::uint16_t code, Time now) = 0;

  /// Triggers the event-driven TPDOs that this object is mapped into; they are sent when the inhibit time
  /// allows.
  virtual void changed(std::uint16_t index, std::uint8_t sub, Time now) = 0;

  /// The value at these terminals of the device has changed.
  virtual void terminals(std::uint16_t /*index*/, std::uint8_t /*sub*/, std::int32_t /*before*/,
                         std::int32_t /*after*/, Time /*now*/) {}

  /// A message for people; it goes where injected faults are reported.
  virtual void tell(std::string_view /*text*/, Time /*now*/) {}
  /// Injects a fault of the node, written as in commands. Returns what is wrong with it; empty = nothing.
  virtual std::string inject(std::string_view /*fault*/, Time /*now*/) { return {}; }

 protected:
  ~DeviceNode() = default;
};

/// This base class leaves values as they were written. What the constructor of a derived class writes into
/// the dictionary is the power-on value there; Bound does so for objects that have no value in the file.
class Behaviour {
 public:
  virtual ~Behaviour() = default;

  /// Called after power-on, reset node and reset communication, when the values have been restored. With
  /// `application` the device stops whatever it was doing; a reset of the communication alone does not affect
  /// it.
  virtual void reset(bool /*application*/, Time /*now*/) {}

  /// Brings all values up to `now` and acts on what has been written. Returns when to be called next; kNever
  /// = only after a change.
  virtual Time update(Time /*now*/) { return kNever; }

  /// Called before a value is stored by SDO: kNone, or why the device refuses it. Length, access and limits
  /// have been checked; update() follows if it is stored.
  virtual AbortCode check(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/,
                          std::span<const std::uint8_t> /*value*/, Time /*now*/) {
    return AbortCode::kNone;
  }

  /// A SYNC: synchronous RPDOs have been applied; synchronous TPDOs are sampled afterwards. update() follows.
  virtual void on_sync(Time /*now*/) {}

  /// This state has been entered, possibly again. update() follows.
  virtual void on_state(nmt::State /*state*/, Time /*now*/) {}

  /// The network has failed or the node has left Operational because of it: outputs take their error values,
  /// drives follow their option codes. update() follows. Starting the node again ends this.
  virtual void on_network_failure(NetworkFailure /*failure*/, Time /*now*/) {}

  /// The device acts on commands this long after they have been written, until this is called again.
  virtual void delay_commands(Time /*delay*/) {}

  /// Commands and set points from the master: 1010h stores neither them nor measured values.
  virtual bool is_set_point(std::uint16_t /*index*/) const { return false; }
  /// Values that clients cannot write, and that 1010h stores: the offset that a preset has made.
  virtual bool is_kept(std::uint16_t /*index*/) { return false; }

  /// An input gets this value from a signal of the plant file or a command at run time. False = this device
  /// has no such input: the node then stores the value in the dictionary, if the object exists. update()
  /// follows.
  virtual bool set_input(std::uint16_t /*index*/, std::uint8_t /*sub*/, double /*value*/, Time /*now*/) {
    return false;
  }

  /// The value at the terminals of an output, after everything that the device does with the value of this
  /// object, or of an input whose object shows something else; none = the device has no such terminals. As of
  /// the last update().
  virtual std::optional<double> output(std::uint16_t /*index*/, std::uint8_t /*sub*/) const {
    return std::nullopt;
  }

  /// What people can set and look at, in this order. A point whose object is not in the dictionary is left
  /// out.
  virtual std::vector<Point> points() const { return {}; }

  /// Names of the incidents that can happen to this device: "overtemperature", "limit-switch-positive".
  virtual std::vector<std::string_view> incidents() const { return {}; }
  /// Those that mean that something is wrong, unlike a limit switch or an open door.
  virtual std::vector<std::string_view> alarms() const { return {}; }
  /// The one at this place begins, or ends. update() follows.
  virtual void set_incident(std::size_t /*place*/, bool /*present*/, Time /*now*/) {}
};

/// Why a behaviour cannot be made: "tank.lua:12: ...".
class BehaviourProblem : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes the behaviour of a node; both live as long as the node. `seed` is that of the node, for noise. May
/// throw BehaviourProblem.
using BehaviourMaker = std::function<std::unique_ptr<Behaviour>(DeviceNode& node, std::uint64_t seed)>;

}  // namespace cbcan::sim
