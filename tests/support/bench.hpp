// SPDX-License-Identifier: MIT
#pragma once

#include <type_traits>

#include "cbcan/coprocessor/coprocessor.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"
#include "support/register_file.hpp"

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

/// A part of the stack on a wire, in virtual time: it hears frames, and is polled at its deadlines alone.
template <class Stack>
struct StackRig : Wire {
  /// Lets frames arrive; after each one everything due is done.
  template <class... More>
  StackRig& arrive(const std::string& frame, const More&... more) {
    hear(frame_from(frame));
    pass(0);
    if constexpr (sizeof...(more) != 0) arrive(more...);
    return *this;
  }
  StackRig& pass(Time duration) {
    const Time end = now + duration;
    for (unsigned polls = 0; stack_.deadline() <= end; ++polls) {
      REQUIRE(polls < 100'000);
      now = std::max(now, stack_.deadline());
      stack_.poll(now);
      if (at_once_) REQUIRE(stack_.deadline() > now);
    }
    now = end;
    return *this;
  }

  Time now = 0;

 protected:
  /// `at_once`: one poll does everything that is due.
  explicit StackRig(Stack& stack, bool at_once = false) : stack_(stack), at_once_(at_once) {}

 private:
  void hear(const Frame& frame) {
    if constexpr (std::is_void_v<decltype(stack_.on_frame(frame, now))>) {
      stack_.on_frame(frame, now);
    } else {
      const Time due = stack_.deadline();
      if (!stack_.on_frame(frame, now)) CHECK(stack_.deadline() == due);
    }
  }

  Stack& stack_;
  bool at_once_;
};

/// A coprocessor that is not started yet; the test acts as PLC and as bus.
struct CoprocessorRig : StackRig<Coprocessor> {
  explicit CoprocessorRig(const Coprocessor::Settings& settings)
      : StackRig(coprocessor),
        coprocessor(registers.window(), registers.process(), port, settings, registers.scanner()) {
    now = 1000;
  }
  /// The boot-up message has its own test.
  void start() {
    coprocessor.start(now);
    port.sent.clear();
  }

  // The PLC.
  std::uint16_t& reg(unsigned address) { return registers[address]; }
  CoprocessorRig& execute() {
    reg(3700) = 0xCA0E;
    poll();
    return *this;
  }
  CoprocessorRig& request(std::initializer_list<std::uint16_t> words) {
    registers.put(3701, words);
    return execute();
  }
  CoprocessorRig& read(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t room) {
    return request({5055, node, index, sub, room});
  }
  CoprocessorRig& write(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t size,
                        std::initializer_list<std::uint16_t> words) {
    registers.put(3706, words);
    return request({5066, node, index, sub, size});
  }
  /// One request of the PLC to the other registers.
  void put(unsigned first, std::initializer_list<std::uint16_t> words) {
    registers.put(first, words);
    coprocessor.on_registers_written(first, words.size(), now);
  }
  bool busy() { return reg(3700) == 0xCA0E; }
  /// Checks R3700; check_failed() also checks the abort code.
  void check_done() { CHECK(reg(3700) == 0); }
  void check_failed(std::uint32_t code) {
    CHECK(reg(3700) == 4);
    const std::uint32_t found = reg(3706) | static_cast<std::uint32_t>(reg(3707)) << 16;
    CHECK(found == code);
  }
  /// R3700 may have been written.
  StackRig& poll() {
    coprocessor.poll(now);
    return pass(0);
  }

  RegisterFile registers;
  Coprocessor coprocessor;
};

struct Bench : CoprocessorRig {
  explicit Bench(const Coprocessor::Settings& settings = {}) : CoprocessorRig(settings) { start(); }
};

}  // namespace cbcan::test
