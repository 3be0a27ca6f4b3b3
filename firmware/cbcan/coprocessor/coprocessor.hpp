// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor: turns what a PLC program writes to R3700..R3769, or to the scanner window, into CANopen
/// services and writes the results back. The only room that knows both registers and CANopen. The contract is
/// docs/reference/contract.md.
///
/// How to run it, on anything:
///   start(now) once; on_frame(frame, now) for every frame that arrives; on_bus_state() when the CAN
///   controller's state changes; on_registers_written() after each request of the PLC that has written
///   registers of the scanner window or of process data, on_plc() after each request at all; poll(now) at the
///   time that the last poll returned, and whenever R3700 may have been written, something else has been
///   called or the port has room again. Times are microseconds, monotonic (cbcan/time.hpp).
///
/// Both windows share it: one request at a time, in turns where both have one. A request is copied when its
/// turn comes.
///
/// Nothing blocks, nothing is allocated, there are no globals: several coprocessors may run in one program.
/// Not re-entrant: all calls come from one place (a loop, one interrupt level). Only the register words are
/// shared. An idle poll costs two loads and two compares, whatever the number of nodes.

#include <cstddef>

#include "cbcan/can_port.hpp"
#include "cbcan/coprocessor/channel.hpp"
#include "cbcan/coprocessor/local_node.hpp"
#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/coprocessor/scanner_window.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class Coprocessor {
 public:
  using Counters = Channel::Counters;
  using Settings = Channel::Settings;

  Coprocessor(RegisterWindow window, ProcessRegisters process, CanPort& port, const Settings& settings,
              ScannerWindow scanner = {}, ChannelTurns* turns = nullptr);

  /// Before start(): where 1010h stores the own node's parameters; outlives this. Without it stores nothing.
  void keep_in(ParameterMemory& memory) { node_.keep_in(memory); }

  /// Sends the boot-up message. A CA0Eh that already stands in R3700 is executed at the next poll.
  void start(Time now);

  void on_frame(const Frame& frame, Time now);
  void on_bus_state(BusState state, Time now);
  /// One request of the PLC has written registers first..first+count-1, whole.
  void on_registers_written(std::size_t first, std::size_t count, Time now);
  /// The PLC has shown that it is there: a valid Modbus request, or a response to one.
  void on_plc(Time now);

  /// Returns the time of the next call at the latest; kNever = only when something happens.
  Time poll(Time now);

  const Counters& counters() const { return channel_.counters(); }
  const SdoClient& sdo_client() const { return channel_.sdo_client(); }
  const NodeMonitor& node_monitor() const { return node_.monitor(); }
  const Slave& own_node() const { return node_.slave(); }
  const ObjectDictionary& own_objects() const { return node_.dictionary(); }

 protected:
  LocalNode& node() { return node_; }
  Channel& first_channel() { return channel_; }
  const Settings& settings() const { return channel_.settings(); }

 private:
  void work(Time now);
  void on_scanner_written(std::size_t first, std::size_t count, Time now);
  void on_outputs_written(std::size_t first, std::size_t count, Time now);
  void watch_plc(Time now);
  void on_error_control(const Frame& frame, Time now);

  Channel channel_;
  Time plc_heard_at_ = 0;
  Time plc_due_ = kNever;  ///< when to look whether the PLC is silent for too long
  LocalNode node_;
};

}  // namespace cbcan
