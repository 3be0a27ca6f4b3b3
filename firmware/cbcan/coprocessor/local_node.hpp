// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's own node: a Device with CBCAN's local objects, process data in the PLC's registers, and
/// the states and EMCY messages of other nodes. Does not use the window or transactions.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/built_if.hpp"
#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/device_lss.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"
#include "cbcan/canopen/lss_master.hpp"
#include "cbcan/canopen/manager/manager.hpp"
#include "cbcan/canopen/nmt/node_monitor.hpp"
#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/coprocessor/local_objects.hpp"
#include "cbcan/coprocessor/network_status.hpp"
#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/coprocessor/settings.hpp"
#include "cbcan/copy_bytes.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// Answers the manager; a build without one has no such class.
using ManagerAnswers = std::conditional_t<kServices.manager(), ManagerApplication, Part>;

class OtherChannels;

/// Memory of the caller for an own node with more PDOs and network variables than kServices has. The entries
/// are those of local::entries() with these; `process` is that of all network variables.
struct OwnNodeMemory {
  std::span<const ObjectEntry> entries;
  std::span<const std::uint8_t> power_on;
  std::span<std::uint8_t> values;
  std::span<std::uint16_t> process;
  Pdo::Storage pdos;
};

/// 3003h and 3004h of one window. SDO clients access those of R3700..R3769.
struct Transfers {
  std::uint16_t timeout_ms;
  SdoClient::Mode mode;
};

class LocalNode final : private DeviceApplication {
 public:
  /// Off the bus until start(). A reset of the node also resets `transfers` and `client` to the settings; the
  /// first of `transfers` belongs to R3700..R3769. `answers`: answers the manager.
  LocalNode(ProcessRegisters registers, CanPort& port, SdoClient& client, std::span<Transfers, 2> transfers,
            const CoprocessorSettings& settings, ManagerAnswers& answers);
  LocalNode(const LocalNode&) = delete;
  LocalNode& operator=(const LocalNode&) = delete;

  /// Call it before start(): where 1010h stores parameters.
  void keep_in(ParameterMemory& memory) { memory_ = &memory; }
  void show_status_in(StatusRegisters words, NodeRequestRegisters requests) {
    if constexpr (kServices.manager()) status_->show_in(words, requests);
    passes_reports_ = kServices.manager();
  }
  /// Call it before start(): channels that share the node with the first one.
  void add(OtherChannels& others) {
    others_ = &others;
    passes_reports_ = true;
    watched_ = {0, 0xFFFF};
  }
  /// Null without them.
  OtherChannels* others() const { return kHasChannels ? others_ : nullptr; }
  /// A write to these registers may concern a scanner window, or a request that waits.
  bool is_watched(std::size_t first, std::size_t count) const {
    return kServices.scanner_window && first <= watched_.last && watched_.first < first + count;
  }
  /// The manager knows something new about this node; 0 = about the own node.
  void show(std::uint8_t node) {
    if constexpr (kServices.manager()) status_->update(node);
  }
  void start(Time now) { device_.start(now); }
  ObjectDictionary& dictionary() { return device_.dictionary(); }
  const ObjectDictionary& dictionary() const { return device_.dictionary(); }

  /// Any frame except error control of other nodes, which on_error_control() takes. True: deadline() may have
  /// changed.
  bool on_frame(const Frame& frame, Time now) {
    return frame.id <= EmergencyConsumer::kLastId ? on_low_id(frame, now) : device_.on_frame(frame, now);
  }
  NodeMonitor::News on_error_control(const Frame& frame, Time now) {
    const NodeMonitor::News news = monitor_.on_frame(frame, now);
    if (news != NodeMonitor::News::kNone && (manages() || passes_reports())) on_report(frame, news, now);
    return news;
  }
  /// An NMT command has been sent to this node, 0 = to all, by the PLC or by another master.
  void on_command(nmt::Command command, std::uint8_t node, bool by_plc, Time now) {
    monitor_.doubt(command, node);
    if constexpr (kServices.manager()) manager_->on_command(command, node, by_plc, now);
  }
  void on_bus_state(BusState state, Time now);
  /// A request of another SDO client, to any node.
  void on_sdo_request(const Frame& frame) {
    if constexpr (kServices.manager())
      manager_->on_request_of_others(static_cast<std::uint8_t>(frame.id & nmt::kMaxNode));
  }

  /// One of the outputs first..first+count-1 has changed since on_outputs_changed(). Most writes change
  /// nothing.
  bool outputs_changed(std::size_t first, std::size_t count) const {
    return kServices.process_data() &&
           differ(registers_.data() + regmap::kInputWords + first, known_outputs_.data() + first, count);
  }
  /// Call it after that. deadline() may have changed.
  void on_outputs_changed(Time now);
  /// The PLC has written outputs, changed or not.
  void on_outputs_written(Time now) {
    if constexpr (kServices.manager()) manager_->on_outputs_written(now);
  }
  /// Inputs have been written by others than RPDOs, which win.
  void restore_inputs() const { device_.restore_received(); }
  /// The PLC has written words of the status registers.
  void on_status_written(std::size_t first, std::size_t count) {
    if constexpr (kServices.manager()) status_->on_written(first, count);
  }
  /// The PLC has written R4142.
  void on_node_request(Time now) {
    if constexpr (kServices.manager()) status_->on_request(now);
  }
  /// The PLC has been silent for too long: the node executes this command, or stops its TPDOs if it manages
  /// the network.
  void on_plc_lost(nmt::Command command, Time now);

  /// Returns the time of the next call.
  Time poll(Time now) {
    lss_.poll(now);
    lss_master_.poll(now);
    manager_.poll(now);
    const Time device_due = device_.poll(now);  // a reset that ends here begins a boot
    return earlier(device_due, earlier(deadline(), lss_.deadline()));
  }
  /// Deadline of all but the LSS slave, whose own on_lss() returns.
  Time deadline() const {
    return earlier(device_.deadline(), earlier(manager_.deadline(), lss_master_.deadline()));
  }
  Time on_lss(const Frame& frame, Time now) {
    lss_.on_frame(frame, now);
    lss_master_.on_frame(frame, now);
    return earlier(lss_.deadline(), manager_.deadline());
  }

  /// From access() to access_own() 3003h and 3004h in dictionary() are those of `transfers`.
  void access(Transfers& transfers) { accessed_ = &transfers; }
  void access_own() { accessed_ = transfers_.data(); }

  std::uint8_t node_id() const { return device_.node_id(); }
  nmt::State state() const { return device_.state(); }
  /// How often 3003h and 3004h have been reset to the settings, modulo 256.
  std::uint8_t resets() const { return resets_; }
  /// Their values after a reset.
  const Transfers& transfers() const { return transfers_[0]; }
  Slave& slave() { return device_.slave(); }
  const Slave& slave() const { return device_.slave(); }
  auto& manager() { return manager_; }
  const auto& manager() const { return manager_; }
  /// The manager is active.
  bool manages() const { return kServices.manager() && manager_->active(); }
  NodeMonitor& monitor() { return monitor_; }
  const NodeMonitor& monitor() const { return monitor_; }

 private:
  static const OwnNodeMemory* memory_in(const OwnNodeMemory* more) { return more; }
  static constexpr const OwnNodeMemory* memory_in(Part /*none*/) { return nullptr; }
  const OwnNodeMemory* more() const { return memory_in(more_); }
  Slave::Tables tables();
  Pdo::Storage pdos();

  static constexpr bool kHasChannels = kServices.scanner_window && kServices.channels;
  bool passes_reports() const { return (kHasChannels || kServices.manager()) && passes_reports_; }

  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) override;
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  ParameterMemory* memory() override { return memory_; }
  void on_emergency_sent(const EmergencyConsumer::Message& message) override {
    if constexpr (kServices.emergencies) emergencies_->note(node_id(), message);
    if constexpr (kServices.manager()) status_->on_emergency(node_id());
  }
  void on_state(nmt::State state, Time now) override {
    if constexpr (kServices.manager()) manager_->on_own_state(state, now);
  }

  void on_report(const Frame& frame, NodeMonitor::News news, Time now);
  AbortCode read_network(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                         std::size_t& size) const;

  bool on_low_id(const Frame& frame, Time now);
  std::uint32_t number_of(std::uint16_t index, std::uint8_t sub, Time now) const;
  AbortCode write_consumer(std::uint8_t sub, std::uint32_t value);
  void set_consumer_time(std::size_t slot, std::uint8_t node, std::uint16_t time_ms);
  AbortCode write_lss(std::span<const std::uint8_t> value, Time now);
  local::DeviceState device_state(std::uint8_t node, Time now) const;

  ProcessRegisters registers_;
  std::array<std::uint16_t, kOutputWords> known_outputs_{};  ///< as at the last on_outputs_changed()
  SdoClient& client_;
  std::uint16_t sdo_timeout_ms_;
  std::uint8_t resets_ = 0;
  [[no_unique_address]] MoreMemory more_;
  std::span<Transfers, 2> transfers_;
  Transfers* accessed_;  ///< whose 3003h and 3004h are read and written
  ParameterMemory* memory_ = nullptr;
  OtherChannels* others_ = nullptr;
  bool passes_reports_ = false;  ///< to the status registers or other channels
  BusState bus_state_ = BusState::kActive;
  struct {
    std::uint16_t first, last;
  } watched_;  ///< see is_watched()
  NodeMonitor monitor_;
  Emergencies emergencies_;
  struct {
    std::array<std::uint8_t, local::kOwnObjectBytes> buffer;
    std::array<Pdo::Rpdo, kServices.rpdos> rpdos;
    std::array<Pdo::Tpdo, kServices.tpdos> tpdos;
    std::array<PdoMapping::Piece, (kServices.rpdos + kServices.tpdos) * kServices.objects_of_pdo> pieces;
    local::LocalValues values;
    std::array<std::uint8_t, nmt::kMaxNode> consumer_node;  ///< node in sub-index n + 1 of 1016h; 0 = none
  } room_{};                                                ///< one struct, so that one call clears it
  Device device_;
  BuiltIf<kServices.lss, DeviceLss> lss_;
  BuiltIf<kServices.lss_master(), LssMaster> lss_master_;
  BuiltIf<kServices.manager(), Manager> manager_;
  BuiltIf<kServices.manager(), NetworkStatus> status_;
};

}  // namespace cbcan
