// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "A PLC that is silent".

#include "contract/pdo.hpp"

using namespace cbcan::contract;

namespace {

Settings one_second() {
  Settings settings;
  settings.plc_timeout = 1s;
  return settings;
}

/// The own node's response to node guarding, which is not a request of the PLC.
struct OwnNode {
  explicit OwnNode(Window& window) : window_(window) {}
  void check(unsigned state) {
    char frame[8];
    std::snprintf(frame, sizeof frame, "77F#%02X", state | toggle_);
    toggle_ ^= 0x80;
    window_.arrive("77F#R1");
    window_.expect(frame);
  }

 private:
  Window& window_;
  unsigned toggle_ = 0;
};

}  // namespace

TEST_CASE("[PLC-1] the own node leaves Operational") {
  Window window(one_second());
  OwnNode own(window);
  start_own_node(window);
  SECTION("after the PLC's last request") {
    window.pass_nearly(1s);
    own.check(5);
    window.pass_rest();
  }
  SECTION("requests of any kind keep it there") {
    for (int i = 0; i < 3; ++i) {
      window.pass(600ms);
      window.reg(3700);
      window.pass(600ms);
      window.set(500, {0});
    }
    window.pass_nearly(1s);
    own.check(5);
    window.pass_rest();
  }
  SECTION("frames on the bus do not count") {
    window.pass(600ms);
    window.arrive("705#05");
    window.pass(600ms);
  }
  own.check(127);
}

TEST_CASE("[PLC-1] another state is left alone") {
  Window window(one_second());
  OwnNode own(window);
  command_own_node(window, 2);
  window.pass(2s);
  own.check(4);
}

TEST_CASE("[PLC-2] TPDOs stop, and the heartbeat tells") {
  Window window(one_second());
  set_up_pdo(window, 0x1800, 0x1FF, 255, {0xA5800110});
  window.configure(0x1800, 5, 2, {400});
  window.configure(0x1017, 0, 2, {500});
  start_own_node(window).expect("1FF#0000");
  window.pass(1100ms).exchange({{"1FF#0000", ""}, {"77F#05", ""}, {"1FF#0000", ""}, {"77F#7F", ""}});
  window.pass(500ms).expect("77F#7F");
}

TEST_CASE("[PLC-3] outputs stay as they are") {
  Window window(one_second());
  start_own_node(window, {{0x1400, 0x27F, 255, {0xA1000110}}, {0x1800, 0x1FF, 255, {0xA5800110}}})
      .expect("1FF#0000");
  window.set(kOutputs, {0x2211}).expect("1FF#1122");
  window.arrive("27F#3344");
  window.pass(2s);
  CHECK(window.reg(kOutputs) == 0x2211);
  CHECK(window.reg(kInputs) == 0x4433);
}

TEST_CASE("[PLC-4] the PLC starts the own node again") {
  Window window(one_second());
  OwnNode own(window);
  for (int i = 0; i < 2; ++i) {
    start_own_node(window);
    own.check(5);
    window.pass(2s);
    own.check(127);
    window.reg(3700);
    own.check(127);
  }
}

TEST_CASE("[PLC-5] stopped, where that is set") {
  Settings settings = one_second();
  settings.plc_lost_stopped = true;
  Window window(settings);
  CONTRACT_NEEDS(window, Ability::kSettings);
  OwnNode own(window);
  start_own_node(window);
  window.pass(2s);
  own.check(4);
}

TEST_CASE("[PLC-6] unless set the PLC may be silent") {
  Window window;
  OwnNode own(window);
  start_own_node(window);
  window.pass(10s);
  own.check(5);
}
