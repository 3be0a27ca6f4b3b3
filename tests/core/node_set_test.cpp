// SPDX-License-Identifier: MIT
#include "cbcan/canopen/nmt/node_set.hpp"
#include "support/catch.hpp"

using cbcan::NodeSet;

TEST_CASE("A set of nodes: in, out, and the next one round") {
  NodeSet set;
  CHECK(set.next(0) == 0);
  CHECK(set.next(127) == 0);
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{1, 31, 32, 63, 64, 127})
    set.insert(node);
  CHECK(set.next(0) == 1);
  CHECK(set.next(1) == 31);
  CHECK(set.next(31) == 32);
  CHECK(set.next(32) == 63);
  CHECK(set.next(63) == 64);
  CHECK(set.next(64) == 127);
  CHECK(set.next(127) == 1);
  CHECK(set.has(127));
  CHECK_FALSE(set.has(126));
  set.erase(127);
  CHECK_FALSE(set.has(127));
  CHECK(set.next(64) == 1);
  CHECK(set.next(100) == 1);
  set.clear();
  CHECK(set.next(5) == 0);
}

TEST_CASE("A set of nodes: the only one comes after itself") {
  NodeSet set;
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{1, 31, 32, 64, 127}) {
    set.insert(node);
    for (unsigned from = 0; from <= 127; ++from)
      REQUIRE(set.next(static_cast<std::uint8_t>(from)) == node);
    set.erase(node);
  }
}
