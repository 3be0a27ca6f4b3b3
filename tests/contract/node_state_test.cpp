// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Node state service: read of 300Ch sub-index 0", and the states of
// docs/reference/registers.md.

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

constexpr std::uint16_t kPreOperational = 127, kNotDetected = 6;

void check_result(Window& window, std::uint16_t state) {
  window.check_done();
  CHECK(window.reg(3705) == 1);
  CHECK(window.reg(3706) == state);
}

/// Requests the state of a node, for which no frame is needed.
void check_state(Window& window, std::uint16_t state, std::uint16_t node = 5) {
  window.read(node, 0x300C, 0, 0).expect_silence();
  check_result(window, state);
}

/// Requests the state of a node, which responds to node guarding: "705#05".
void check_state_by_guarding(Window& window, const std::string& response, std::uint16_t state,
                             std::uint16_t node = 5) {
  const std::string request = response.substr(0, 4) + "R1";
  window.read(node, 0x300C, 0, 0).exchange({{request.c_str(), response.c_str()}});
  check_result(window, state);
}

/// Requests the state of node 5, which does not respond to node guarding.
void check_state_without_response(Window& window, std::uint16_t state) {
  window.read(5, 0x300C, 0, 0).expect("705#R1");
  CHECK(window.busy());
  window.pass(100ms);
  window.pass_rest();
  check_result(window, state);
}

}  // namespace

TEST_CASE("[STATE-1] which node") {
  Window window;
  window.arrive("705#04");
  check_state(window, 4);
  check_state_by_guarding(window, "742#05", 5, 66);
  for (const std::uint16_t own : Words{0, Window::kOwnNode})
    check_state(window, kPreOperational, own);
}

TEST_CASE("[STATE-2] [300Ch-4] [300Ch-5] [300Ch-6] [300Ch-127] values and size") {
  Window window;
  for (const auto& [message, state] :
       std::map<std::string, std::uint16_t>{{"705#04", 4}, {"705#05", 5}, {"705#7F", 127}}) {
    window.arrive(message);
    check_state(window, state);
  }
  window.pass(2s);
  window.pass_rest();
  check_state_without_response(window, 6);
}

TEST_CASE("[STATE-3] the last report while it is fresh") {
  Window window;
  SECTION("within 2 s, or within a shorter or a longer consumer heartbeat time") {
    const auto [sub, time] = GENERATE(std::pair(0, 2000), std::pair(1, 300), std::pair(127, 10'000));
    if (sub != 0)
      window.configure(0x1016, static_cast<std::uint16_t>(sub), 4, {static_cast<std::uint16_t>(time), 5});
    window.arrive("705#04", "705#05");
    window.pass_nearly(std::chrono::milliseconds(time));
    check_state(window, 5);
    window.pass_rest();
    check_state_without_response(window, kNotDetected);
  }
  SECTION("each message is news") {
    for (int i = 0; i < 5; ++i) {
      window.arrive("705#05");
      window.pass_nearly(2s);
      check_state(window, 5);
    }
  }
  SECTION("what is no state, or not from it, is no news") {
    window.arrive("705#05");
    window.pass(1s);
    window.arrive("705#33", "705#", "705#R1", "706#04", "00000705#04");
    check_state(window, 5);
    window.pass_nearly(1s);
    window.pass_rest();
    check_state_without_response(window, kNotDetected);
  }
}

TEST_CASE("[STATE-4] a boot-up is pre-operational") {
  Window window;
  window.arrive("705#00");
  check_state(window, kPreOperational);
}

TEST_CASE("[STATE-5] node guarding when nothing is fresh") {
  Window window;
  window.read(5, 0x300C, 0, 0).expect("705#R1");
  SECTION("either toggle bit") {
    const auto [response, state] = GENERATE(std::pair("705#05", 5), std::pair("705#84", 4));
    window.arrive(response);
    CHECK(window.reg(3706) == state);
  }
  SECTION("just in time") {
    window.pass_nearly(100ms);
    window.arrive("706#04");
    window.arrive("705#33");  // no such state
    CHECK(window.busy());
    window.arrive("705#05");
    CHECK(window.reg(3706) == 5);
  }
  SECTION("too late") {
    window.pass_nearly(100ms);
    CHECK(window.busy());
    window.pass_rest();
    CHECK(window.reg(3706) == kNotDetected);
  }
  window.check_done();
  CHECK(window.reg(3705) == 1);
  window.expect_silence();
}

TEST_CASE("[STATE-6] both times are settings") {
  Settings settings;
  settings.state_fresh_for = 700ms;
  settings.guard_timeout = 30ms;
  Window window(settings);
  CONTRACT_NEEDS(window, Ability::kSettings);
  window.arrive("705#05");
  window.pass_nearly(700ms);
  check_state(window, 5);
  window.pass_rest();
  window.read(5, 0x300C, 0, 0).expect("705#R1");
  window.pass_nearly(30ms);
  CHECK(window.busy());
  window.pass_rest().check_done();
  CHECK(window.reg(3706) == kNotDetected);
}

TEST_CASE("[STATE-7] in doubt after an NMT command") {
  Window window;
  window.arrive("705#7F", "706#7F");
  window.command(5, 1, "000#0105");
  SECTION("a node that was not addressed is not asked") {
    check_state(window, kPreOperational, 6);
  }
  SECTION("its next message ends the doubt") {
    window.arrive("705#05");
    check_state(window, 5);
  }
  SECTION("it is asked, and answers") {
    check_state_by_guarding(window, "705#85", 5);
    check_state(window, 5);
  }
  SECTION("it is asked, and does not answer: its last report stands while it is fresh") {
    check_state_without_response(window, kPreOperational);
    window.pass(2s);
    check_state_without_response(window, kNotDetected);
  }
  SECTION("a command to all puts every node in doubt") {
    window.write(0, 0x1F82, 128, 1, {1}).expect("000#0100");
    check_state_by_guarding(window, "706#05", 5, 6);
  }
}

TEST_CASE("[STATE-9] a command of another master") {
  Window window;
  window.arrive("705#04");
  SECTION("to the node, to all, longer than it need be") {
    window.arrive(GENERATE("000#0105", "000#0100", "000#010500"));
  }
  SECTION("what is none, or for another node, changes nothing") {
    window.arrive("000#01", "000#0305", "000#0106", "000#R2", "00000000#0105");
    return check_state(window, 4);
  }
  check_state_by_guarding(window, "705#05", 5);
  check_state(window, 5);
}

TEST_CASE("[STATE-8] started right after its boot-up") {
  Window window;
  window.arrive("705#00");
  window.command(5, 1, "000#0105");
  check_state_by_guarding(window, "705#05", 5);
}
