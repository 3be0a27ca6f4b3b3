// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor: executes the CANopen services that a PLC program requests in R3700..R3769, or in the
/// scanner window, and writes back the results. Only this directory uses both registers and CANopen. The
/// contract is docs/reference/contract.md.
///
/// How to run it:
///   start(now) once; on_frame(frame, now) for every frame that arrives; on_bus_state() when the CAN
///   controller's state changes; on_registers_written() after each request of the PLC that has written
///   registers of the scanner window or of process data; on_plc() before it, for every valid request;
///   poll(now) at deadline(), which each of these functions may bring forward, and whenever R3700 may have
///   been written or the port has room again. Times are microseconds, monotonic (cbcan/time.hpp).
///
/// Both windows share it: one request at a time, in turns if both have one. A request is copied when its turn
/// comes. FurtherChannels add SDO clients, each with a scanner window.
///
/// Nothing blocks, nothing is allocated, there are no globals: several coprocessors may run in one program.
/// Not re-entrant: make all calls from one place (a loop, one interrupt level). Only the register words are
/// shared. An idle poll costs two loads and two compares, whatever the number of nodes.

#include <cstddef>
#include <cstdint>

#include "cbcan/can_port.hpp"
#include "cbcan/coprocessor/channel.hpp"
#include "cbcan/coprocessor/local_node.hpp"
#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/coprocessor/scanner_window.hpp"
#include "cbcan/coprocessor/settings.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// Answers the manager of the own node.
class CoprocessorAnswers : public ManagerApplication {
 public:
  CoprocessorAnswers(Channel& channel, LocalNode& node) : channel_(channel), node_(node) {}

  Time node_free_from(std::uint8_t node, Time now) override;
  void on_node(std::uint8_t node) override { node_.show(node); }

 protected:
  ~CoprocessorAnswers() = default;

 private:
  Channel& channel_;
  LocalNode& node_;
};

class Coprocessor {
 public:
  using Counters = Channel::Counters;
  using Settings = CoprocessorSettings;

  Coprocessor(RegisterWindow window, ProcessRegisters process, CanPort& port, const Settings& settings,
              ScannerWindow scanner = {});

  /// Call it before start(): where 1010h stores the own node's parameters; outlives this. By default nothing
  /// is stored.
  void keep_in(ParameterMemory& memory) { node_.keep_in(memory); }
  /// Call it before start(): the memory of R3928..R4099, and of R4142 and R4143; outlives this. By default
  /// there are none.
  void show_status_in(StatusRegisters words, NodeRequestRegisters requests) {
    node_.show_status_in(words, requests);
  }
  /// Call it before start(): the network that the own node boots, see NetworkObjects::use(). False also in a
  /// build without a manager.
  bool use_network(std::span<const std::uint8_t> image) {
    return kServices.manager() && node_.manager()->use(image);
  }
  bool use_network(std::span<std::uint8_t> memory, std::size_t used) {
    return kServices.manager() && node_.manager()->use(memory, used);
  }

  /// Sends the boot-up message. A CA0Eh that is already in R3700 is executed at the next poll.
  void start(Time now);

  void on_frame(const Frame& frame, Time now);
  void on_bus_state(BusState state, Time now);
  /// One request of the PLC has written registers first..first+count-1; call it after all are written.
  void on_registers_written(std::size_t first, std::size_t count, Time now);
  /// The same for the further registers of process data in Settings::more: inputs, or also outputs.
  void on_further_written(bool outputs, Time now);
  /// A valid Modbus request of this client, a connection or a line, which writes registers
  /// first..first+count-1, 0 = none. The PLC is the client that wrote outputs, R3700..R3769 or the OUT words
  /// of a scanner window last, and its requests show that it is alive; until one has, those of all.
  void on_plc(std::uint32_t client, std::size_t first, std::size_t count, Time now);

  /// Returns deadline().
  Time poll(Time now);
  /// The latest time of the next poll(); kNever = only after another call.
  Time deadline() const { return channel_.due(); }

  /// The sums of all channels.
  Counters counters() const;
  /// Time of the PLC's last request, or of start(); with a plc_timeout_ms.
  Time plc_heard_at() const { return plc_heard_at_; }
  bool executes_registers() const { return channel_.executes_registers(); }
  const SdoClient& sdo_client() const { return channel_.sdo_client(); }
  const NodeMonitor& node_monitor() const { return node_.monitor(); }
  const Slave& own_node() const { return node_.slave(); }
  /// Boots the network; an empty Part in a build without it.
  const auto& manager() const { return node_.manager(); }
  const ObjectDictionary& own_objects() const { return node_.dictionary(); }

 private:
  friend class FurtherChannels;

  const Settings& settings() const { return channel_.settings(); }
  void work(Time now);
  void on_watched_written(std::size_t first, std::size_t count, Time now);
  void on_others_written(std::size_t first, std::size_t count, Time now);
  void on_status_written(std::size_t first, std::size_t count, Time now);
  void on_other_response(const Frame& frame, Time now);
  bool controls(std::size_t first, std::size_t count) const;
  void watch_plc(Time now);
  void on_error_control(const Frame& frame, Time now);

  Channel channel_;
  [[no_unique_address]] BuiltIf<kServices.manager(), CoprocessorAnswers> answers_;
  bool plc_known_ = false;
  std::uint32_t plc_ = 0;  ///< client that has written last
  Time plc_heard_at_ = 0;
  Time plc_due_ = kNever;  ///< when to check whether the PLC has been silent for too long
  LocalNode node_;
};

}  // namespace cbcan
