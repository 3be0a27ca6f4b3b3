// SPDX-License-Identifier: MIT
#include "drive_bench.hpp"
namespace cbcan::test {
TEST_CASE("placeholder") {
  DriveBench bench;
  CHECK(bench.get(0x6502) == 0x3AD);
}
}  // namespace cbcan::test
