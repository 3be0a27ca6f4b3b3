// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "SDO service", quarantine: a late response is never taken for the response to
// the next request.

#include "contract/phases.hpp"

using namespace cbcan::contract;

namespace {

/// A read of node 5 that ends with a timeout.
void time_out(Window& window) {
  window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
  window.pass(1s).expect("605#8000200100000405");
  window.check_failed(0x05040000);
}

/// Requests the same object of node 5 again: nothing may be sent yet.
void ask_again(Window& window) {
  window.read(5, 0x2000, 1, 4).expect_silence();
  CHECK(window.busy());
}

/// The delayed request has been sent, and gets its own response.
void check_let_go(Window& window) {
  window.exchange({{"605#4000200100000000", "585#4300200122222222"}}).check_done();
  CHECK(window.reg(3706) == 0x2222);
}

/// Nothing is sent until one SDO timeout after the end of the previous transfer.
void check_only_time_ends_it(Window& window) {
  window.pass_nearly(1s).expect_silence();
  CHECK(window.busy());
  window.pass_rest();
  check_let_go(window);
}

/// This frame ends the quarantine; "" = only time does.
void check_ends(Window& window, const std::string& ending) {
  if (ending.empty()) return check_only_time_ends_it(window);
  window.arrive(ending);
  check_let_go(window);
}

}  // namespace

TEST_CASE("[SDO-27] quarantine after a timeout") {
  Window window;
  time_out(window);
  ask_again(window);
  SECTION("the late response") {
    window.pass(400ms);
    window.arrive("585#4300200111111111");
  }
  SECTION("a late abort, with index and sub-index or without") {
    window.arrive(GENERATE("585#8000200100000206", "585#8000000000000206"));
  }
  SECTION("the node has booted") {
    window.arrive("706#00", "705#05").expect_silence();
    window.arrive("705#00");
  }
  SECTION("one more SDO timeout") {
    window.arrive("586#4300200111111111");
    window.pass_nearly(1s).expect_silence();
    CHECK(window.busy());
    window.pass_rest();
  }
  check_let_go(window);
}

TEST_CASE("[SDO-27] in every phase of a transfer") {
  for (const Phase& phase : phases()) {
    if (phase.asked_again != nullptr) continue;
    INFO(phase.name);
    Window window;
    enter(window, phase);
    window.pass(1s).expect("605#8000200100000405");
    window.set_mode(kAuto);
    ask_again(window);
    window.arrive("585#4300200111111111");
    check_let_go(window);
  }
}

TEST_CASE("[SDO-27] seen before the next request") {
  Window window;
  time_out(window);
  SECTION("the late response, or the node has booted") {
    window.arrive(GENERATE("585#4300200111111111", "705#00"));
  }
  SECTION("one more SDO timeout") {
    window.pass(1s);
    window.pass_rest();
  }
  window.check_failed(0x05040000);
  window.read(5, 0x2000, 1, 4);
  check_let_go(window);
}

TEST_CASE("[SDO-27] what is not that response does not end it") {
  for (const char* frame : {"585#4300200211111111", "585#6001200100000000", "585#8000200200000206", "585#R8",
                            "00000585#4300200111111111", "585#", "585#43002001", "586#4300200111111111"}) {
    INFO(frame);
    Window window;
    time_out(window);
    ask_again(window);
    window.arrive(frame).expect_silence();
    window.arrive("585#4300200111111111");
    check_let_go(window);
  }
}

TEST_CASE("[SDO-28] quarantine of one node alone") {
  Window window;
  time_out(window);
  window.read(6, 0x2000, 1, 4).expect("606#4000200100000000");
  window.arrive("585#4300200111111111");
  CHECK(window.busy());
  window.arrive("586#4300200133333333").check_done();
  CHECK(window.reg(3706) == 0x3333);
  window.command(5, 1, "000#0105");
}

TEST_CASE("[SDO-29] quarantine after a cancel, 0503 0000h, 0504 0001h") {
  struct Row {
    std::vector<Step> steps;
    const char* abort;
  };
  const Row rows[] = {
      {{}, "605#8000200100000008"},  // cancelled
      {{{"", "585#4100200110000000"}, {"605#6000000000000000", "585#1001020304050607"}},
       "605#8000200100000305"},
      {{{"", "585#6000200100000000"}}, "605#8000200101000405"},
  };
  for (const Row& row : rows) {
    for (const char* ending : {"585#4300200111111111", "585#8000200100000405", "705#00", ""}) {
      INFO(row.abort << " and then " << ending);
      Window window;
      window.read(5, 0x2000, 1, 16).expect("605#4000200100000000");
      window.exchange(row.steps);
      if (row.steps.empty()) window.set(3700, {0});
      window.expect(row.abort);
      ask_again(window);
      check_ends(window, ending);
    }
  }
}

TEST_CASE("[SDO-29] also when the delayed request is cancelled") {
  Window window;
  time_out(window);
  ask_again(window);
  window.set(3700, {0}).expect_silence();
  ask_again(window);
  window.arrive("585#4300200111111111");
  check_let_go(window);
}

TEST_CASE("[SDO-30] quarantine after an abandoned block read") {
  struct Row {
    const char *phase, *segment, *abort;
  };
  for (const Row& row : {Row{"block read: no segment", "", "605#8000200100000008"},  // cancelled
                         Row{"block read: one segment", "", "605#8000200100000008"},
                         Row{"block read: one segment", "585#0338390000000000", "605#8000200103000405"},
                         Row{"block read: one segment", "585#0238394142434445", "605#8000200110000706"}}) {
    for (const char* ending : {"", "705#00"}) {
      INFO(row.phase << " and then " << row.segment);
      Window window;
      enter(window, phase_called(row.phase));
      window.exchange({{"", row.segment}});
      if (*row.segment == 0) window.set(3700, {0});
      window.expect(row.abort);
      window.set_mode(kAuto);
      ask_again(window);
      window.arrive("585#4300200111111111");  // segment 67, which looks like a response
      window.arrive("585#4400200111111111").expect_silence();
      check_ends(window, ending);
    }
  }
}

TEST_CASE("[SDO-31] quarantine after a block write aborted") {
  for (const char* ending : {"", "705#00"}) {
    Window window;
    enter(window, phase_called("block write: segments"));
    window.arrive("585#8000200111000906").check_failed(0x06090011);
    window.set_mode(kAuto);
    ask_again(window);
    window.arrive("585#8000200101000405");  // to the segments
    window.arrive("585#8000200101000405").expect_silence();
    check_ends(window, ending);
  }
}

TEST_CASE("[SDO-32] eight nodes in quarantine") {
  Window window;
  for (std::uint16_t node = 1; node <= 8; ++node) {
    const std::string id = "60" + std::to_string(node);
    window.read(node, 0x2000, 1, 4).expect(id + "#4000200100000000");
    window.set(3700, {0}).expect(id + "#8000200100000008");
    window.pass(50ms);
  }
  window.read(9, 0x2000, 1, 4);  // the ninth waits until the first is free, 600 ms from now
  window.pass_nearly(600ms).expect_silence();
  CHECK(window.busy());
  window.pass_rest().exchange({{"609#4000200100000000", "589#4300200122222222"}});
  window.check_done();
  window.read(2, 0x2000, 1, 4).expect_silence();  // all eight nodes were still in quarantine
  window.arrive("582#4300200111111111").exchange({{"602#4000200100000000", "582#4300200133333333"}});
  CHECK(window.reg(3706) == 0x3333);
  window.read(8, 0x2000, 1, 4).expect_silence();
  window.arrive("588#4300200111111111").exchange({{"608#4000200100000000", "588#4300200144444444"}});
  CHECK(window.reg(3706) == 0x4444);
}
