// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor: turns what a PLC program writes to R3700..R3769, or to the scanner window, into CANopen
/// services and writes the results back. The only room that knows both registers and CANopen. The contract is
/// docs/contract.md.
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

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/coprocessor/local_node.hpp"
#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/coprocessor/scanner_window.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class Coprocessor final {
 public:
  struct Settings {
    std::uint8_t node_id = 127;           ///< own node ID, 1..127
    std::uint16_t sdo_timeout_ms = 1000;  ///< 0 = wait for ever; 3003h at run time
    Time state_fresh_for = 2 * kSecond;  ///< age up to which a heartbeat is believed where 1016h sets no time
    Time guard_timeout = 100 * kMillisecond;  ///< wait for the response to a node guarding request
    /// Silence of the PLC after which the own node leaves Operational; 0 = it may be silent for ever.
    std::uint16_t plc_timeout_ms = 0;
    nmt::Command plc_lost = nmt::Command::kEnterPreOperational;  ///< what the own node does then
    // Where the ranges begin, as the PLC and on_registers_written() know them.
    std::uint16_t scanner_out_first = regmap::kScannerOutFirst;
    std::uint16_t scanner_in_first = regmap::kScannerInFirst;
    std::uint16_t process_first = regmap::kProcessFirst;
  };

  Coprocessor(RegisterWindow window, ProcessRegisters process, CanPort& port, const Settings& settings,
              ScannerWindow scanner = {});
  Coprocessor(const Coprocessor&) = delete;
  Coprocessor& operator=(const Coprocessor&) = delete;

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

  struct Counters {
    std::uint32_t executed = 0;   ///< requests begun, of either window
    std::uint32_t failed = 0;     ///< ended with a result other than 0
    std::uint32_t cancelled = 0;  ///< no longer wanted by the PLC while under way
  };
  const Counters& counters() const { return counters_; }
  const SdoClient& sdo_client() const { return client_; }
  const NodeMonitor& node_monitor() const { return node_.monitor(); }
  const Slave& own_node() const { return node_.slave(); }
  const ObjectDictionary& own_objects() const { return node_.dictionary(); }

 private:
  enum class Activity : std::uint8_t { kIdle, kSdo, kNmtCommand, kNodeState };

  struct Request {
    std::uint16_t command;
    std::uint16_t node;
    std::uint16_t index;
    std::uint16_t sub;
    std::uint16_t size;
  };

  void look_at_flag(bool execute, Time now);
  void begin_waiting(Time now);
  void begin(Time now);
  Request request() const;
  const std::uint16_t* words() const;
  std::uint16_t* data_words() const;
  void load_data(std::span<std::uint8_t> bytes) const;
  void store_data(std::span<const std::uint8_t> bytes) const;
  void watch_plc(Time now);
  void begin_nmt(const Request& request, Time now);
  void begin_node_state(std::uint8_t node, Time now);
  void begin_local(const Request& request, Time now);
  void begin_sdo(const Request& request, Time now);
  void cancel(Time now);
  void leave();
  void work(Time now);
  void send_command(Time now);
  void on_sdo_response(const Frame& frame, Time now);
  // Inline, it would cost the others a register.
  [[gnu::noinline]] void on_own_node(const Frame& frame, Time now);
  void on_error_control(const Frame& frame, Time now);
  void on_boot_up(std::uint8_t node, Time now);
  void follow_sdo();
  void end_sdo();
  void end_node_state(nmt::State state) { end_with_state(static_cast<std::uint16_t>(state)); }
  void end_node_state_unanswered(Time now);
  void end_with_state(std::uint16_t state);
  void end_read(std::span<const std::uint8_t> bytes);
  void end(AbortCode code);
  void finish(regmap::Result result, std::size_t size = 0);
  void follow_node() { wake_at(node_.deadline()); }
  void wake_at(Time time) {
    if (time < due_) due_ = time;
  }

  RegisterWindow window_;
  CanPort& port_;
  Settings settings_;
  Time due_ = 0;  ///< poll has work to do from then on; may be early, is never late
  Time plc_heard_at_ = 0;
  Time plc_due_ = kNever;   ///< when to look whether the PLC is silent for too long
  Time deadline_ = kNever;  ///< of an NMT command or a node state request
  Frame command_{};         ///< NMT command or node guarding request of this transaction
  SdoClient client_;
  std::uint8_t state_node_ = 0;  ///< whose state is asked for
  Activity activity_ = Activity::kIdle;
  bool reading_ = false;
  bool command_refused_ = false;
  bool flagged_ = false;              ///< the last poll has seen CA0Eh in R3700: it waits, or is under way
  Window served_ = Window::kScanner;  ///< whose request is under way, or was last
  ScannerWindow scanner_;
  Counters counters_;
  std::array<std::uint8_t, regmap::kMaxDataBytes> data_{};  ///< of the client's transfer
  LocalNode node_;  ///< large: what lies behind it would cost a Cortex-M two instructions more
};

}  // namespace cbcan
