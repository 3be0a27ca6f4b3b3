// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "NMT service: write to 1F82h", and the services of docs/reference/registers.md.

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

/// Writes these numbers to 1F82h for one node and for all, and checks the sent frames.
void check_service(const Words& numbers, const char* to_node_66, const char* to_all) {
  for (const std::uint16_t number : numbers) {
    Window window;
    window.command(66, number, to_node_66);
    window.command(128, number, to_all);
  }
}

std::uint16_t own_state(Window& window) {
  window.read(0, 0x300C, 0, 0).check_done();
  return window.reg(3706);
}

}  // namespace

TEST_CASE("[NMT-1] [NMT-2] one node, and all nodes") {
  Window window;
  for (const auto& [node, sent] : std::map<std::uint16_t, const char*>{
           {1, "000#0101"}, {66, "000#0142"}, {126, "000#017E"}, {128, "000#0100"}}) {
    window.command(node, 1, sent);
  }
}

TEST_CASE("[NMT-3] no such node") {
  for (const std::uint16_t sub : Words{0, 129, 255, 256, 65535}) {
    Window window;
    window.write(0, 0x1F82, sub, 1, {1}).check_failed(0x06090011);
    window.expect_silence();
  }
}

TEST_CASE("[NMT-4] services by either number") {
  Window window;
  for (const std::uint16_t number : Words{1, 5}) {
    window.command(66, number, "000#0142");
  }
  for (const std::uint16_t number : Words{0, 3, 8, 9, 126, 131, 255, 0x0101, 65535}) {
    for (const std::uint16_t sub : Words{66, 127, 128}) {
      window.write(0, 0x1F82, sub, 1, {number}).check_failed(0x06090030);
      window.expect_silence();
    }
  }
}

TEST_CASE("[1F82h-5] [1F82h-4] [1F82h-127] [1F82h-6] [1F82h-7] each command, by both of its numbers") {
  check_service({5, 1}, "000#0142", "000#0100");
  check_service({4, 2}, "000#0242", "000#0200");
  check_service({127, 128}, "000#8042", "000#8000");
  check_service({6, 129}, "000#8142", "000#8100");
  check_service({7, 130}, "000#8242", "000#8200");
}

TEST_CASE("[NMT-5] done when the controller has the frame") {
  Window window;
  CONTRACT_NEEDS(window, Ability::kRefusal);
  window.target().refuse_frames(true);
  window.write(0, 0x1F82, 128, 1, {1});
  SECTION("handed over after a while") {
    window.pass(500ms);
    CHECK(window.busy());
    window.target().refuse_frames(false);
    window.pass(10ms).expect("000#0100");
    window.check_done();
  }
  SECTION("not within the SDO timeout") {
    window.pass_nearly(1s);
    CHECK(window.busy());
    window.pass_rest().check_failed(0x05040000);
    window.target().refuse_frames(false);
    window.pass(3s).expect_silence();
  }
}

TEST_CASE("[NMT-6] the own node") {
  Window window;
  struct Row {
    std::uint16_t number, state;
  };
  CHECK(own_state(window) == 127);
  for (const Row& row : {Row{1, 5}, Row{2, 4}, Row{128, 127}, Row{5, 5}, Row{4, 4}, Row{127, 127}}) {
    window.write(0, 0x1F82, 127, 1, {row.number}).check_done();
    window.expect_silence();
    CHECK(own_state(window) == row.state);
    for (const char* all : {"000#0100", "000#0200"}) {
      window.write(0, 0x1F82, 128, 1, {static_cast<std::uint16_t>(all[5] - '0')});
      window.expect(all);
      CHECK(own_state(window) == row.state);
    }
  }
  for (const std::uint16_t reset : Words{6, 129, 7, 130}) {
    window.write(0, 0x1F82, 127, 1, {1});
    CHECK(own_state(window) == 5);
    window.command(127, reset, "77F#00");
    CHECK(own_state(window) == 127);
  }
}

TEST_CASE("[NMT-7] in every own state") {
  for (const std::uint16_t command : Words{1, 2, 128}) {
    Window window;
    window.write(0, 0x1F82, 127, 1, {command}).check_done();

    window.read(5, 0x2000, 1, 4).exchange({{"605#4000200100000000", "585#4300200111223344"}});
    window.check_done();
    window.write(5, 0x2000, 1, 2, {0x2211}).exchange({{"605#2B00200111220000", "585#6000200100000000"}});
    window.check_done();
    window.command(66, 1, "000#0142");
    window.read(5, 0x300C, 0, 0).exchange({{"705#R1", "705#05"}});
    window.check_done();
    window.read(0, 0x3001, 0, 1).check_done();
    window.configure(0x3003, 0, 2, {500});
  }
}
