// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Local objects: R3702 = 0", 3007h: the states of the nodes.

#include "contract/local_object.hpp"

using namespace cbcan::contract;

namespace {

constexpr std::uint16_t kInit = 0, kResetCommunication = 1, kResetApplication = 2, kPreOperational = 3,
                        kStopped = 4, kOperational = 5, kUnknown = 6, kNotAvailable = 7;

void check_state(Window& window, std::uint16_t node, std::uint32_t state) {
  CHECK(read_local(window, 0x3007, node) == Value{state, 1});
}

/// Consumer heartbeat time of node 5: 300 ms.
void watch(Window& window) {
  window.configure(0x1016, 1, 4, {300, 5});
}

/// A guarding request to node 5, and the response.
void guard(Window& window, const std::string& response) {
  window.read(5, 0x300C, 0, 0).exchange({{"705#R1", response.c_str()}});
  if (response.empty()) {
    window.pass(100ms);
    window.pass_rest();
  }
  window.check_done();
}

}  // namespace

TEST_CASE("[OBJ-7] 3007h") {
  Window window;
  check_state(window, 5, kUnknown);
  watch(window);
  check_state(window, 5, kNotAvailable);
  using Told = std::pair<const char*, std::uint16_t>;
  for (const auto& [message, state] :
       {Told{"705#00", kInit}, {"705#7F", kPreOperational}, {"705#04", kStopped}, {"705#05", kOperational}}) {
    window.arrive(message);
    check_state(window, 5, state);
  }
  window.command(5, 130, "000#8205");
  check_state(window, 5, kResetCommunication);
  window.command(5, 129, "000#8105");
  check_state(window, 5, kResetApplication);
  for (const std::uint16_t node : Words{5, 6, Window::kOwnNode})
    check_read_only(window, 0x3007, node);
  check_missing(window, 0x3007, 128, 0x06090011);
  window.expect_silence();
}

TEST_CASE("[OBJ-27] 3007h: unknown") {
  Window window;
  SECTION("not watched, whatever it sends") {
    for (const char* message : {"705#00", "705#7F", "705#05", "705#04"}) {
      window.arrive(message);
      check_state(window, 5, kUnknown);
    }
    window.command(5, 129, "000#8105");
    check_state(window, 5, kUnknown);
  }
  SECTION("1016h sets a time") {
    watch(window);
    window.arrive("705#05", "706#05");
    check_state(window, 5, kOperational);
    check_state(window, 6, kUnknown);
    window.configure(0x1016, 1, 4, {0, 5});
    check_state(window, 5, kUnknown);
  }
  SECTION("1016h sets a time after it has been heard") {
    window.arrive("705#05");
    watch(window);
    check_state(window, 5, kOperational);
  }
  SECTION("a guarding request has gone to it") {
    guard(window, "705#05");
    check_state(window, 5, kOperational);
    check_state(window, 6, kUnknown);
  }
  SECTION("a guarding request has gone to it, without a response") {
    guard(window, "");
    check_state(window, 5, kNotAvailable);
  }
  SECTION("a state that was fresh: no guarding request has gone") {
    window.arrive("705#05");
    window.read(5, 0x300C, 0, 0);
    CHECK(window.reg(3706) == 5);
    check_state(window, 5, kUnknown);
  }
  SECTION("until the own communication is reset") {
    const auto reset = GENERATE(as<std::uint16_t>(), 129, 130);
    watch(window);
    window.write(0, 0x1F82, Window::kOwnNode, 1, {reset}).expect("77F#00");
    window.arrive("705#05");
    check_state(window, 5, kUnknown);
    window.pass(3s);
    guard(window, "705#05");
    check_state(window, 5, kOperational);
    window.write(0, 0x1F82, Window::kOwnNode, 1, {reset}).expect("77F#00");
    check_state(window, 5, kUnknown);
  }
}

TEST_CASE("[OBJ-28] 3007h: not available") {
  Window window;
  SECTION("a time shorter than 2 s") {
    watch(window);
    check_state(window, 5, kNotAvailable);
    window.arrive("705#05");
    window.pass_nearly(300ms);
    check_state(window, 5, kOperational);
    window.pass_rest();
    check_state(window, 5, kNotAvailable);
    window.arrive("705#04");
    check_state(window, 5, kStopped);
  }
  SECTION("a longer one") {
    window.configure(0x1016, 127, 4, {10000, 5});
    window.arrive("705#05");
    window.pass_nearly(10s);
    check_state(window, 5, kOperational);
    window.pass_rest();
    check_state(window, 5, kNotAvailable);
  }
  SECTION("guarded") {
    guard(window, "705#05");
    window.pass_nearly(2s);
    check_state(window, 5, kOperational);
    window.pass_rest();
    check_state(window, 5, kNotAvailable);
    window.arrive("705#84");
    check_state(window, 5, kStopped);
  }
  SECTION("guarded and with a time of its own") {
    guard(window, "705#05");
    watch(window);
    window.pass_nearly(300ms);
    check_state(window, 5, kOperational);
    window.pass_rest();
    check_state(window, 5, kNotAvailable);
    window.configure(0x1016, 1, 4, {0, 0});
    check_state(window, 5, kOperational);  // still watched, with a report within 2 s
  }
}

TEST_CASE("[OBJ-29] 3007h: init") {
  Window window;
  watch(window);
  SECTION("heartbeat") {
    window.arrive("705#05", "705#00");
    check_state(window, 5, kInit);
    window.arrive("705#7F");
    check_state(window, 5, kPreOperational);
  }
  SECTION("response to a guarding request") {
    window.arrive("705#00");
    window.command(5, 1, "000#0105");
    check_state(window, 5, kInit);
    guard(window, "705#85");
    check_state(window, 5, kOperational);
  }
  SECTION("no other message, and its time is over") {
    window.arrive("705#00", "705#33", "705#");
    window.pass_nearly(300ms);
    check_state(window, 5, kInit);
    window.pass_rest();
    check_state(window, 5, kNotAvailable);
  }
}

TEST_CASE("[OBJ-30] 3007h: reset by the PLC or another master") {
  struct Row {
    std::uint16_t service;
    const char *to_it, *to_all;
    std::uint16_t shown;
  };
  const auto [service, to_it, to_all, shown] =
      GENERATE(values({Row{130, "000#8205", "000#8200", kResetCommunication},
                       Row{6, "000#8105", "000#8100", kResetApplication}}));
  Window window;
  watch(window);
  window.configure(0x1016, 2, 4, {300, 6});
  window.arrive("705#05", "706#05");
  SECTION("to it") {
    window.command(5, service, to_it);
    check_state(window, 5, shown);
    check_state(window, 6, kOperational);
  }
  SECTION("to all") {
    window.command(128, service, to_all);
    check_state(window, 5, shown);
    check_state(window, 6, shown);
    check_state(window, Window::kOwnNode, kPreOperational);
  }
  SECTION("of another master") {
    window.arrive(to_it);
    check_state(window, 5, shown);
    check_state(window, 6, kOperational);
  }
  SECTION("it has not heard the command") {
    window.command(5, service, to_it);
    window.arrive("705#05");
    check_state(window, 5, kOperational);
  }
  SECTION("another command does not end it") {
    window.command(5, service, to_it);
    window.command(5, 1, "000#0105");
    check_state(window, 5, shown);
  }
  SECTION("as long as it has been heard within its time") {
    window.pass(100ms);
    window.command(5, service, to_it);
    window.pass_nearly(200ms);
    check_state(window, 5, shown);
    window.pass_rest();
    check_state(window, 5, kNotAvailable);
    window.command(5, service, to_it);
    check_state(window, 5, kNotAvailable);
  }
  SECTION("a command that is no reset shows nothing") {
    window.command(5, 2, "000#0205");
    check_state(window, 5, kOperational);
  }
  window.arrive("705#00");
  check_state(window, 5, kInit);
}

TEST_CASE("[OBJ-31] 3007h of the own node") {
  Window window;
  struct Row {
    std::uint16_t service, state;
  };
  check_state(window, Window::kOwnNode, kPreOperational);
  for (const Row& row : {Row{1, kOperational}, Row{2, kStopped}, Row{128, kPreOperational}}) {
    window.write(0, 0x1F82, Window::kOwnNode, 1, {row.service});
    check_state(window, Window::kOwnNode, row.state);
  }
  window.write(0, 0x1F82, Window::kOwnNode, 1, {130}).expect("77F#00");
  check_state(window, Window::kOwnNode, kPreOperational);
  window.configure(0x1016, 1, 4, {300, Window::kOwnNode});
  check_state(window, Window::kOwnNode, kPreOperational);
}
