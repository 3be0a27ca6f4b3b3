// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "cbcan/coprocessor/further_channels.hpp"
#include "cbcan/coprocessor/local_node.hpp"
#include "cbcan/modbus/executor.hpp"
#include "sim/bus.hpp"
#include "sim/parameters.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

/// The memory of a module's own node with kPdos RPDOs and TPDOs. Its objects are those of every coprocessor,
/// and the network variables of further registers.
class ProcessData {
 public:
  static constexpr std::size_t kPdos = 64;

  /// `block`: registers, which outlive it. `process`, `further`: places in it of the usual process data, and
  /// of further inputs and outputs; 0 = there are no further ones.
  ProcessData(std::span<std::uint16_t> block, std::size_t process, std::size_t further);

  /// The memory as after power on; valid until the next call.
  const OwnNodeMemory& fresh();

 private:
  std::vector<ObjectEntry> entries_;
  std::vector<std::uint8_t> power_on_, values_;
  std::span<std::uint16_t> block_;
  std::vector<Pdo::Rpdo> rpdos_;
  std::vector<Pdo::Tpdo> tpdos_;
  std::vector<PdoMapping::Piece> pieces_;
  OwnNodeMemory memory_;
};

/// Reads the registers before and after each call into a coprocessor, which may change them.
class ModuleWatch {
 public:
  virtual void before(Time now) = 0;
  virtual void after(Time now) = 0;

 protected:
  ~ModuleWatch() = default;
};

/// The CBCAN module: a coprocessor on a bus, with one channel for each scanner window, at least one. 1010h
/// and LSS of its own node store in `parameters`, null = nowhere; the store outlives the module. A node ID
/// stored there overrides that of the settings. With a stored bit rate other than that of a paced bus the
/// module is bus-off.
class CoprocessorModule final : public Receiver, public Timed {
 public:
  CoprocessorModule(Bus& bus, Schedule& schedule, RegisterWindow window, ProcessRegisters process,
                    const Coprocessor::Settings& settings, std::span<const ScannerWindow> scanners,
                    ParameterStore* parameters = nullptr);

  /// Call it before start(): see Coprocessor.
  void show_status_in(StatusRegisters words, NodeRequestRegisters requests);
  /// Call it before start(): the network that it boots, see NetworkObjects; also after a restart. `all`: the
  /// registers, with further ones of process data from `further_first` on, 0 = none.
  void manage(std::vector<std::uint8_t> image, std::span<std::uint16_t> all = {},
              std::size_t further_first = 0);

  void start(Time now);
  /// Off and on. The registers are the caller's.
  void restart(Time now);
  /// Call it also when R3700 may have been written.
  void poll(Time now) override {
    if (watch_ != nullptr) watch_->before(now);
    wants(coprocessor_->poll(now));
    if (watch_ != nullptr) watch_->after(now);
  }
  /// See Coprocessor.
  void on_registers_written(std::size_t first, std::size_t count, Time now);
  void on_plc(std::uint32_t client, std::size_t first, std::size_t count, Time now) {
    if (further_outputs_.overlaps({first, count})) first = settings_.process_first + regmap::kInputWords;
    coprocessor_->on_plc(client, first, count, now);
  }
  void on_frame(const Frame& frame, Time now) override;
  void on_bus_state(BusState state, Time now) override;
  /// Keeps it bus-off whatever state it is given, or no longer: then it has `otherwise`.
  void keep_off(bool off, BusState otherwise, Time now);

  /// Null removes the watch.
  void watch(ModuleWatch* watch) { watch_ = watch; }

  const Coprocessor& coprocessor() const { return *coprocessor_; }
  Port& port() const { return port_; }
  std::size_t further_first() const { return further_inputs_.first; }
  /// Frames since the start.
  std::uint32_t received() const { return received_; }

 private:
  void make();

  ModuleParameters parameters_;
  bool is_kept_;       ///< in parameters_
  bool hears_ = true;  ///< the bit rate is that of the bus
  bool is_kept_off_ = false;
  Port& port_;
  RegisterWindow window_;
  ProcessRegisters process_;
  ProcessData process_data_;
  modbus::Range further_inputs_, further_outputs_;
  Coprocessor::Settings settings_;
  std::vector<ScannerWindow> scanners_;
  std::optional<Coprocessor> coprocessor_;  ///< always there, as the others
  std::vector<FurtherChannels::Memory> channels_;
  std::optional<FurtherChannels> further_;
  std::optional<std::pair<StatusRegisters, NodeRequestRegisters>> status_;
  std::vector<std::uint8_t> image_;
  std::vector<std::uint8_t> network_;  ///< the memory of NetworkObjects
  ModuleWatch* watch_ = nullptr;
  std::uint32_t received_ = 0;
};

}  // namespace cbcan::sim
