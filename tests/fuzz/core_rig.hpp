// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "cbcan/coprocessor/coprocessor.hpp"
#include "fuzz/core_wire.hpp"

namespace cbcan::fuzz {

inline constexpr Time kMostExactPolls = 48;
inline constexpr Time kLatePolls = 32;
/// The object of the transactions in finish().
inline constexpr std::uint8_t kNode = 9;
inline constexpr std::uint16_t kIndex = 0x2345;

/// The scanner window. Its results are tested in tests/contract/scanner_test.cpp.
struct Scanner {
  /// A number has been taken and is not answered yet.
  bool open() const { return in[2] != in[0]; }
  /// The next number; never 0.
  std::uint16_t next() const {
    return in[2] == 0xFFFF ? std::uint16_t{1} : static_cast<std::uint16_t>(in[2] + 1);
  }

  std::array<std::uint16_t, regmap::kScannerOutWords> out{};
  std::array<std::uint16_t, regmap::kScannerInWords> in{};
  bool used = false;  ///< from then on the two windows share the coprocessor
};

/// A coprocessor in virtual time between a PLC and a bus that both check its contract.
struct Rig {
  static constexpr std::uint8_t kOwnNode = 127;

  Rig()
      : coprocessor(RegisterWindow(RegisterWindow::Words(plc.registers)), process, wire,
                    {.node_id = kOwnNode}, ScannerWindow(scanner.out, scanner.in)) {
    wire.own = &coprocessor.own_node();
    plc.before_frame();
    coprocessor.start(now_);
    plc.after();
    require(scanner.in[1] == 5, "IN+1 tells of the start");
    poll();
  }

  void poll() {
    note_settings();
    do {
      plc.before_poll();
      coprocessor.poll(now_);
      plc.after();
    } while (coprocessor.own_node().resetting());
    note_settings();
  }
  void arrive(const Frame& frame) {
    const bool was_busy = plc.busy();
    plc.before_frame();
    coprocessor.on_frame(frame, now_);
    plc.after();
    const bool is_abort = frame.id >> 7 == 0xB && frame.length == 8 && frame.data[0] == 0x80;
    const bool is_boot_up = frame.id >> 7 == 0xE && frame.length == 1 && (frame.data[0] & 0x7F) == 0;
    const bool from_server =
        plc.request().kind == Plc::Kind::kSdo && (frame.id & 0x7F) == plc.request().node && frame.flags == 0;
    if (was_busy && !plc.busy() && from_server && (is_abort || is_boot_up)) wire.server_knows();
    poll_when_due();
  }
  /// An SDO response of eight bytes; missing bytes are 0.
  void respond(std::uint8_t node, std::span<const std::uint8_t> bytes) {
    Frame frame;
    frame.id = 0x580u + node;
    frame.length = 8;
    std::copy_n(bytes.begin(), std::min<std::size_t>(bytes.size(), 8), frame.data.begin());
    arrive(frame);
  }
  /// Polls at each deadline, up to some dozens; after that polls are late.
  void pass(Time duration) {
    const Time end = now_ + duration;
    for (Time polls = 0; coprocessor.deadline() <= end && polls < kMostExactPolls; ++polls)
      pass_to_deadline();
    const Time step = now_ < end ? (end - now_) / kLatePolls + 1 : 1;
    while (now_ < end) {
      now_ = std::min(end, std::max(now_ + step, std::min(coprocessor.deadline(), end)));
      poll();
    }
  }
  void pass_to_deadline() {
    if (coprocessor.deadline() != kNever) now_ = std::max(now_, coprocessor.deadline());
    poll();
  }
  /// Reports that process data have been written.
  void write_registers() {
    plc.before_frame();
    coprocessor.on_registers_written(regmap::kProcessFirst, regmap::kProcessWords, now_);
    plc.after();
    poll_when_due();
  }
  /// Reports that OUT+first..OUT+first+count-1 have been written.
  void write_scanner(std::size_t first, std::size_t count) {
    plc.before_frame();
    plc.shared = true;
    scanner.used = true;
    coprocessor.on_registers_written(regmap::kScannerOutFirst + first, count, now_);
    plc.after();
    poll_when_due();
  }

  /// Keeps the bus working and silent until nothing can be in progress, then requires that a new transaction
  /// works.
  void finish() {
    settle();
    if (scanner.used) check_scanner();
    plc.shared = false;
    write_own(0x3004, 1, 0);
    write_own(0x3003, 2, 1000);
    wire.requests.clear();
    check_expedited_read();
  }

  Time now() const { return now_; }

  Plc plc{kOwnNode};
  Scanner scanner;
  Wire wire{plc, kOwnNode};
  std::array<std::uint16_t, regmap::kProcessWords> process{};
  Coprocessor coprocessor;

 private:
  void poll_when_due() {
    if (coprocessor.deadline() <= now_) poll();
  }
  void note_settings() {
    const std::uint16_t timeout = coprocessor.sdo_client().timeout_ms();
    longest_timeout_ms_ = std::max(longest_timeout_ms_, timeout);
    if (timeout == 0) had_no_timeout_ = true;
    std::array<std::uint8_t, 1> mode{};
    std::size_t size = 0;
    require(coprocessor.own_objects().read(0x3004, 0, mode, size, 0) == AbortCode::kNone && mode[0] <= 3,
            "there are four modes");
    if (!plc.busy()) wire.mode = mode[0];
  }
  /// Waits for a quarantine and a timeout: twice the longest timeout, and once in reserve.
  void settle() {
    wire.refuse = 0;
    coprocessor.on_bus_state(BusState::kActive, now_);
    // A request that waits may have another timeout.
    const Time longest = milliseconds(scanner.used ? std::uint16_t{0xFFFF} : longest_timeout_ms_);
    poll();
    pass(3 * longest + 200 * kMillisecond);
    if (scanner.used) pass(3 * longest);
    require((!plc.busy() && !scanner.open()) || had_no_timeout_,
            "every transaction ends when nothing comes any more");
    plc.reg(3700) = 0;
    scanner.out[0] = 0;
    if (scanner.used) write_scanner(0, 1);
    poll();
    pass(longest + kMillisecond);
  }
  void write_own(std::uint16_t index, std::uint16_t size, std::uint16_t value) {
    plc.reg(3703) = index;
    plc.reg(3706) = value;
    execute(5066, 0, 0, size);
    require(plc.reg(3700) == 0, "the own settings can always be written");
    plc.reg(3703) = kIndex;
  }
  void execute(std::uint16_t command, std::uint16_t node, std::uint16_t sub, std::uint16_t size) {
    plc.reg(3701) = command;
    plc.reg(3702) = node;
    plc.reg(3704) = sub;
    plc.reg(3705) = size;
    plc.reg(3700) = 0xCA0E;
    poll();
  }
  void expect_request(std::uint8_t node, std::initializer_list<std::uint8_t> bytes) {
    require(wire.requests.size() == 1, "one request for one response");
    Frame expected;
    expected.id = 0x600u + node;
    expected.length = 8;
    std::copy(bytes.begin(), bytes.end(), expected.data.begin());
    require(wire.requests.front() == expected, "a clean transfer's request");
    wire.requests.clear();
  }
  void ask_scanner(std::initializer_list<std::uint16_t> request) {
    scanner.out[0] = scanner.next();
    std::copy(request.begin(), request.end(), scanner.out.begin() + 1);
    write_scanner(0, scanner.out.size());
  }
  void check_scanner() {
    ask_scanner({5055, 0, 0x3001, 0, 1});  // 5, if it is the first since the start
    ask_scanner({5066, 0, 0x3004, 0, 1, 0});
    require(scanner.in[0] == scanner.out[0] && scanner.in[1] == 0, "the own settings can always be written");
    wire.requests.clear();
    ask_scanner({5055, kNode, kIndex, 1, 4});
    expect_request(kNode, {0x40, 0x45, 0x23, 1});
    require(scanner.open(), "done is what the server has sent");
    respond(kNode, std::array<std::uint8_t, 8>{0x43, 0x45, 0x23, 1, 0x11, 0x22, 0x33, 0x44});
    require(scanner.in[0] == scanner.out[0] && scanner.in[1] == 0 && scanner.in[3] == 4,
            "a clean read is good");
    require(scanner.in[4] == 0x2211 && scanner.in[5] == 0x4433, "a clean read gives the server's bytes");
  }
  void check_expedited_read() {
    execute(5055, kNode, 1, 4);
    expect_request(kNode, {0x40, 0x45, 0x23, 1});
    respond(kNode, std::array<std::uint8_t, 8>{0x43, 0x45, 0x23, 1, 0x11, 0x22, 0x33, 0x44});
    require(plc.reg(3700) == 0 && plc.reg(3705) == 4, "a clean read is good");
    require(plc.reg(3706) == 0x2211 && plc.reg(3707) == 0x4433, "a clean read gives the server's bytes");
  }

  Time now_ = 1000;
  std::uint16_t longest_timeout_ms_ = 1000;
  bool had_no_timeout_ = false;  ///< the SDO timeout was 0 for a while
};

}  // namespace cbcan::fuzz
