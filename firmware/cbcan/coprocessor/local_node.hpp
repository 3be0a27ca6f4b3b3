// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's own node: a Device with CBCAN's local objects, process data in the PLC's registers, and
/// what is known of the other nodes (state, EMCY). Knows neither the window nor transactions.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"
#include "cbcan/canopen/nmt/node_monitor.hpp"
#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/coprocessor/local_objects.hpp"
#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// The two ways in for a PLC program's requests. What 3003h and 3004h say holds for the one they are written
/// through; over SDO they are those of R3700..R3769.
enum class Window : std::uint8_t { kRegisters, kScanner };

class LocalNode final : private DeviceApplication {
 public:
  struct Settings {
    std::uint8_t node_id;          ///< 1..127
    std::uint16_t sdo_timeout_ms;  ///< 3003h at power-on
    Time state_fresh_for;          ///< see NodeMonitor
  };

  /// The largest own object that can be transferred by SDO, in bytes.
  static constexpr std::size_t kOwnObjectBytes = 32;

  /// Off the bus until start().
  LocalNode(ProcessRegisters registers, CanPort& port, SdoClient& client, const Settings& settings);
  LocalNode(const LocalNode&) = delete;
  LocalNode& operator=(const LocalNode&) = delete;

  void start(Time now) { device_.start(now); }
  const ObjectDictionary& dictionary() const { return device_.dictionary(); }

  /// Any frame but those of other nodes' error control, which on_error_control() takes. Returns when it wants
  /// poll() because of it.
  Time on_frame(const Frame& frame, Time now) {
    return frame.id <= EmergencyConsumer::kLastId ? on_low_id(frame, now) : device_.on_frame(frame, now);
  }
  NodeMonitor::News on_error_control(const Frame& frame, Time now) { return monitor_.on_frame(frame, now); }
  void on_bus_state(BusState state, Time now);

  /// Registers first..first+count-1 of process data may have been written. False: none is another one now.
  bool on_registers_written(std::size_t first, std::size_t count, Time now);

  void poll(Time now) { device_.poll(now); }
  Time deadline() const { return device_.deadline(); }

  /// Local access with the rights of an SDO client, through a window.
  AbortCode read(Window window, std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> out,
                 std::size_t& size, Time now);
  AbortCode write(Window window, std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value,
                  Time now);

  void command(nmt::Command command, Time now) { device_.slave().command(command, now); }
  std::uint8_t node_id() const { return device_.node_id(); }
  nmt::State state() const { return device_.state(); }
  /// 3003h and 3004h of a window.
  std::uint16_t sdo_timeout_ms(Window window) const { return transfers_[index_of(window)].timeout_ms; }
  SdoClient::Mode transfer_mode(Window window) const { return transfers_[index_of(window)].mode; }
  const Slave& slave() const { return device_.slave(); }
  NodeMonitor& monitor() { return monitor_; }
  const NodeMonitor& monitor() const { return monitor_; }

 private:
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) override;
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  void on_emergency_sent(const EmergencyConsumer::Message& message) override;

  Time on_low_id(const Frame& frame, Time now);
  std::uint32_t number_of(std::uint16_t index, std::uint8_t sub, Time now) const;
  AbortCode write_consumer(std::uint8_t sub, std::uint32_t value);
  AbortCode write_mode(std::uint32_t value);
  void set_clock(std::span<const std::uint8_t> value, Time now);
  void set_consumer_time(std::size_t slot, std::uint8_t node, std::uint16_t time_ms);
  local::DeviceState device_state(std::uint8_t node, Time now) const;

  struct Transfers {
    std::uint16_t timeout_ms;
    SdoClient::Mode mode;
  };
  static constexpr std::size_t index_of(Window window) { return static_cast<std::size_t>(window); }

  ProcessRegisters registers_;
  std::array<std::uint16_t, regmap::kOutputWords> known_outputs_{};  ///< as last looked at
  SdoClient& client_;
  std::uint16_t sdo_timeout_ms_;
  Window accessed_ = Window::kRegisters;  ///< whose 3003h and 3004h are read and written
  std::array<Transfers, 2> transfers_{};  ///< by Window
  BusState bus_state_ = BusState::kActive;
  NodeMonitor monitor_;
  EmergencyConsumer emergencies_;
  local::LocalValues values_{};
  std::array<std::uint8_t, kOwnObjectBytes> buffer_{};
  std::array<Pdo::Rpdo, local::kRpdos> rpdos_{};
  std::array<Pdo::Tpdo, local::kTpdos> tpdos_{};
  std::array<PdoMapping::Piece, (local::kRpdos + local::kTpdos) * local::kObjectsOfPdo> pieces_{};
  std::array<std::uint8_t, nmt::kMaxNode>
      consumer_node_{};  ///< node that sub-index n + 1 of 1016h names; 0 = none
  Device device_;
};

}  // namespace cbcan
