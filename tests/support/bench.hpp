// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/coprocessor/coprocessor.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {

/// A CAN port that records frames; it can be set to refuse them.
struct RecordingPort final : CanPort {
  bool try_send(const Frame& frame) override {
    ++tries;
    if (refuse_next != 0) {
      if (refuse_next != kAlways) --refuse_next;
      return false;
    }
    sent.push_back(text_of(frame));
    return true;
  }

  static constexpr unsigned kAlways = ~0u;
  unsigned refuse_next = 0;
  unsigned tries = 0;
  std::deque<std::string> sent;
};

/// Every frame that is sent has to be expected, in order, and none may be left at the end. Functions that
/// cause frames return the bench, so that the expected frames can follow: `arrive(...).expect(...)`.
struct Wire {
  template <class... More>
  void expect(const std::string& frame, const More&... more) {
    if (port.sent.empty()) {
      FAIL_CHECK("the wire is silent; expected " << frame);
      return;
    }
    CHECK(port.sent.front() == frame);
    port.sent.pop_front();
    if constexpr (sizeof...(more) != 0) expect(more...);
  }
  void expect_silence() {
    for (const std::string& left : port.sent)
      FAIL_CHECK("left over: " << left);
    port.sent.clear();
  }

  RecordingPort port;

 protected:
  Wire() = default;
  ~Wire() noexcept(false) {
    if (std::uncaught_exceptions() == 0) expect_silence();
  }
};

/// Lets time pass until `end`, and polls at deadlines alone.
template <class Polled>
void poll_when_due(Polled& polled, Time& now, Time end) {
  for (unsigned polls = 0; polled.deadline() <= end; ++polls) {
    REQUIRE(polls < 100'000);
    now = std::max(now, polled.deadline());
    polled.poll(now);
  }
  now = end;
}

using Registers = std::array<std::uint16_t, regmap::kWindowWords>;

/// A coprocessor in virtual time, not started yet; the test acts as PLC and as bus.
struct CoprocessorRig : Wire {
  explicit CoprocessorRig(Coprocessor::Settings settings)
      : CoprocessorRig(own_registers, settings, ScannerWindow(out, in)) {}
  /// With the registers in memory of the caller.
  CoprocessorRig(Registers& memory, Coprocessor::Settings settings, ScannerWindow scanner)
      : registers(memory),
        coprocessor(RegisterWindow(RegisterWindow::Words(registers)), process, port, settings, scanner) {}

  // The PLC.
  std::uint16_t& reg(unsigned address) { return registers.at(address - regmap::kWindowFirst); }
  void write(unsigned address, std::initializer_list<std::uint16_t> words) {
    for (const std::uint16_t word : words)
      reg(address++) = word;
  }
  CoprocessorRig& execute() {
    reg(3700) = 0xCA0E;
    poll();
    return *this;
  }
  CoprocessorRig& read(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t room) {
    write(3701, {5055, node, index, sub, room});
    execute();
    return *this;
  }
  CoprocessorRig& write(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t size,
                        std::initializer_list<std::uint16_t> words) {
    write(3701, {5066, node, index, sub, size});
    write(3706, words);
    execute();
    return *this;
  }
  bool busy() { return reg(3700) == 0xCA0E; }
  /// Checks R3700; check_failed() also checks the abort code.
  void check_done() { CHECK(reg(3700) == 0); }
  void check_failed(std::uint32_t code) {
    CHECK(reg(3700) == 4);
    const std::uint32_t found = reg(3706) | static_cast<std::uint32_t>(reg(3707)) << 16;
    CHECK(found == code);
  }

  // The bus.
  template <class... More>
  CoprocessorRig& arrive(const std::string& frame, const More&... more) {
    coprocessor.on_frame(frame_from(frame), now);
    pass(0);
    if constexpr (sizeof...(more) != 0) arrive(more...);
    return *this;
  }

  // Time.
  /// R3700 may have been written.
  CoprocessorRig& poll() {
    coprocessor.poll(now);
    return pass(0);
  }
  /// Lets time pass, and polls at deadlines alone.
  CoprocessorRig& pass(Time duration) {
    poll_when_due(coprocessor, now, now + duration);
    return *this;
  }

  Registers own_registers{};
  std::array<std::uint16_t, regmap::kScannerOutWords> out{};
  std::array<std::uint16_t, regmap::kScannerInWords> in{};
  std::array<std::uint16_t, regmap::kProcessWords> process{};
  Registers& registers;
  Time now = 1000;
  Coprocessor coprocessor;
};

/// One that has sent its boot-up message, which has its own test.
struct Bench : CoprocessorRig {
  explicit Bench(Coprocessor::Settings settings = {}) : CoprocessorRig(settings) { start(); }
  Bench(Registers& memory, Coprocessor::Settings settings, ScannerWindow scanner)
      : CoprocessorRig(memory, settings, scanner) {
    start();
  }

 private:
  void start() {
    coprocessor.start(now);
    port.sent.clear();
  }
};

}  // namespace cbcan::test
