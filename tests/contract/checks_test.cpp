// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Checks, in this order": each case also violates every later check.

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

/// Executes these words from R3701 on, with filled data words; returns the window before the execution.
Words execute(Window& window, const Words& words) {
  window.set(3706, filled_data());
  window.set(3701, words);
  Words before = window.image();
  window.set(3700, {0xCA0E});
  return before;
}

}  // namespace

TEST_CASE("[CHECK-1] [R3700-1] R3701 is neither 5055 nor 5066") {
  for (const std::uint16_t command : Words{0, 1, 5054, 5056, 5065, 5067, 0x5055, 0x5066, 0xCA0E, 65535}) {
    Window window;
    for (const std::uint16_t index : Words{0x1F82, 0x300C, 0x2000}) {
      const Words before = execute(window, {command, 999, index, 999, 0});
      window.check_changes(before, {{3700, 1}});
    }
  }
}

TEST_CASE("[CHECK-2] a write to 1F82h") {
  for (const std::uint16_t node : Words{0, 5, 127, 128, 999, 65535}) {
    for (const std::uint16_t size : Words{0, 1, 129, 65535}) {
      Window window;
      window.write(node, 0x1F82, 66, size, {1}).expect("000#0142");
      window.check_done();
    }
  }
}

TEST_CASE("[CHECK-2] a read of 1F82h is not it") {
  Window window;
  window.read(5, 0x1F82, 66, 4).exchange({{"605#40821F4200000000", "585#80821F4200000206"}});
  window.check_failed(0x06020000);
}

TEST_CASE("[CHECK-3] [R3700-2] R3702 is above 127") {
  for (const std::uint16_t node : Words{128, 255, 256, 65535}) {
    Window window;
    for (const Words& words : {Words{5055, node, 0x300C, 0, 0}, Words{5055, node, 0x1F82, 128, 1},
                               Words{5055, node, 0x2000, 999, 0}, Words{5066, node, 0x2000, 999, 999}}) {
      const Words before = execute(window, words);
      window.check_changes(before, {{3700, 2}});
    }
  }
}

TEST_CASE("[CHECK-4] a read of 300Ch sub-index 0") {
  for (const std::uint16_t size : Words{0, 1, 4, 129, 65535}) {
    Window window;
    window.read(0, 0x300C, 0, size).check_done();
    CHECK(window.reg(3706) == 127);
    window.read(5, 0x300C, 0, size).exchange({{"705#R1", "705#04"}});
    window.check_done();
    CHECK(window.reg(3706) == 4);
  }
}

TEST_CASE("[CHECK-4] another sub-index and a write are SDO services") {
  Window window;
  window.read(5, 0x300C, 1, 4).exchange({{"605#400C300100000000", "585#800C300111000906"}});
  window.check_failed(0x06090011);
  window.write(5, 0x300C, 0, 1, {7}).exchange({{"605#2F0C300007000000", "585#800C300000000206"}});
  window.check_failed(0x06020000);
  window.write(5, 0x300C, 0, 0, {7}).check_failed(0x06040047);
}

TEST_CASE("[CHECK-5] R3704 is above 255") {
  for (const std::uint16_t sub : Words{256, 0x0101, 65535}) {
    Window window;
    for (const std::uint16_t node : Words{0, 5}) {
      for (const std::uint16_t command : Words{5055, 5066}) {
        for (const std::uint16_t size : Words{0, 4, 129}) {
          const Words before = execute(window, {command, node, 0x2000, sub, size});
          window.check_changes(before, {{3700, 4}, {3706, 0x0011}, {3707, 0x0609}});
        }
      }
    }
  }
}

TEST_CASE("[CHECK-6] R3705 is 0 or above 128") {
  for (const std::uint16_t size : Words{0, 129, 256, 65535}) {
    Window window;
    for (const std::uint16_t node : Words{0, 5, 127}) {
      for (const std::uint16_t command : Words{5055, 5066}) {
        const Words before = execute(window, {command, node, 0x2000, 0, size});
        window.check_changes(before, {{3700, 4}, {3706, 0x0047}, {3707, 0x0604}});
      }
    }
  }
}

TEST_CASE("[CHECK-6] 1 and 128 are sizes") {
  Window window;
  for (const std::uint16_t size : Words{1, 128}) {
    window.read(5, 0x2000, 0, size).exchange({{"605#4000200000000000", "585#4F00200022000000"}});
    window.check_done();
  }
}

TEST_CASE("[CHECK-7] this node") {
  for (const std::uint16_t node : Words{0, Window::kOwnNode}) {
    Window window;
    window.read(node, 0x3001, 0, 128).check_done();
    CHECK(window.reg(3705) == 1);
    CHECK(window.reg(3706) == 127);
    window.write(node, 0x3003, 0, 2, {250}).check_done();
    window.read(node, 0x2000, 0, 4).check_failed(0x06020000);
    window.expect_silence();
  }
}

TEST_CASE("[CHECK-8] another node") {
  struct Row {
    std::uint16_t node;
    const char *request, *stranger, *response;
  };
  for (const Row& row : {Row{1, "601#4000200100000000", "582#4F00200111000000", "581#4F00200122000000"},
                         Row{5, "605#4000200100000000", "605#4F00200111000000", "585#4F00200122000000"},
                         Row{0x42, "642#4000200100000000", "5C1#4F00200111000000", "5C2#4F00200122000000"},
                         Row{126, "67E#4000200100000000", "5FF#4F00200111000000", "5FE#4F00200122000000"}}) {
    Window window;
    window.read(row.node, 0x2000, 1, 4);
    window.expect(row.request);
    window.arrive(row.stranger);
    CHECK(window.busy());
    window.arrive(row.response).check_done();
    CHECK(window.reg(3706) == 0x22);
  }
}

TEST_CASE("[CHECK-9] no frame on the bus") {
  Window window;
  struct Row {
    Words words;
    std::uint16_t result;
  };
  for (const Row& row :
       {Row{{5054, 5, 0x2000, 1, 4}, 1}, Row{{5066, 5, 0x1F82, 0, 4}, 4}, Row{{5055, 128, 0x2000, 1, 4}, 2},
        Row{{5066, 128, 0x2000, 1, 4}, 2}, Row{{5055, 0, 0x300C, 0, 4}, 0}, Row{{5055, 5, 0x2000, 256, 4}, 4},
        Row{{5066, 5, 0x2000, 256, 4}, 4}, Row{{5055, 5, 0x2000, 1, 0}, 4},
        Row{{5066, 5, 0x2000, 1, 129}, 4}}) {
    window.start(row.words);
    CHECK(window.reg(3700) == row.result);
    window.pass(3s).expect_silence();
  }
}
