// SPDX-License-Identifier: MIT
// docs/reference/registers.md, the commands and the result codes, as literals of their own.

#include "contract/window.hpp"

using namespace cbcan::contract;

TEST_CASE("[R3701-5055] SDO_READ") {
  Window window;
  window.start({5055, 5, 0x2000, 1, 4, 0x7777, 0x7777});
  window.exchange({{"605#4000200100000000", "585#4300200111223344"}});
  CHECK(window.target().read(3700, 8) == Words{0, 5055, 5, 0x2000, 1, 4, 0x2211, 0x4433});
}

TEST_CASE("[R3701-5066] SDO_WRITE") {
  Window window;
  window.start({5066, 5, 0x2000, 1, 4, 0x2211, 0x4433});
  window.exchange({{"605#2300200111223344", "585#6000200100000000"}});
  CHECK(window.target().read(3700, 8) == Words{0, 5066, 5, 0x2000, 1, 4, 0x2211, 0x4433});
}

TEST_CASE("[R3700-0] OK") {
  Window window;
  SECTION("a read") {
    window.read(0, 0x3001, 0, 1);
  }
  SECTION("a write") {
    window.write(0, 0x3003, 0, 2, {1000});
  }
  SECTION("an NMT service") {
    window.write(0, 0x1F82, 128, 0, {1}).expect("000#0100");
  }
  SECTION("a node state") {
    window.read(0, 0x300C, 0, 0);
  }
  CHECK(window.reg(3700) == 0);
}

TEST_CASE("[R3700-1] CMD_CODE_ERR") {
  Window window;
  window.start({5056, 5, 0x2000, 1, 4});
  CHECK(window.reg(3700) == 1);
}

TEST_CASE("[R3700-2] NODE_ID_ERR") {
  Window window;
  window.start({5055, 128, 0x2000, 1, 4});
  CHECK(window.reg(3700) == 2);
}

TEST_CASE("[R3700-4] SDO_EXEC_ERR") {
  Window window;
  window.read(5, 0x2000, 1, 4).exchange({{"605#4000200100000000", "585#8000200178563412"}});
  CHECK(window.reg(3700) == 4);
  CHECK(window.reg(3706) == 0x5678);
  CHECK(window.reg(3707) == 0x1234);
}
