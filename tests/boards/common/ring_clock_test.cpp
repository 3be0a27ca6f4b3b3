// SPDX-License-Identifier: MIT
#include "boards/common/clock.hpp"
#include "boards/common/ring.hpp"
#include "support/catch.hpp"

using namespace cbcan;
using cbcan::boards::Clock;
using cbcan::boards::Ring;

TEST_CASE("A ring gives back in order what it took, also past its end") {
  Ring<int, 4> ring;
  int item = 0;
  for (int round = 0; round < 5; ++round) {
    CHECK(ring.push(10 * round));
    CHECK(ring.push(10 * round + 1));
    CHECK(ring.push(10 * round + 2));
    for (int i = 0; i < 3; ++i) {
      CHECK(ring.pop(item));
      CHECK(item == 10 * round + i);
    }
  }
  CHECK(!ring.pop(item));
  CHECK(ring.overflows() == 0);
}

TEST_CASE("A full ring takes nothing, keeps what it has and counts") {
  Ring<char, 4> ring;
  for (const char c : {'a', 'b', 'c', 'd'})
    CHECK(ring.push(c));
  CHECK(ring.free() == 0);
  CHECK(!ring.push('e'));
  CHECK(!ring.push('f'));
  CHECK(ring.overflows() == 2);
  char item = 0;
  CHECK(ring.pop(item));
  CHECK(item == 'a');
  CHECK(ring.free() == 1);
  CHECK(ring.push('g'));
  for (const char c : {'b', 'c', 'd', 'g'}) {
    CHECK(ring.pop(item));
    CHECK(item == c);
  }
  CHECK(ring.empty());
}

TEST_CASE("Milliseconds until a time are rounded up, and limited") {
  CHECK(milliseconds_until(4999, 5000, 100) == 0);
  CHECK(milliseconds_until(5000, 5000, 100) == 0);
  CHECK(milliseconds_until(5001, 5000, 100) == 1);
  CHECK(milliseconds_until(6000, 5000, 100) == 1);
  CHECK(milliseconds_until(6001, 5000, 100) == 2);
  CHECK(milliseconds_until(105'000, 5000, 100) == 100);
  CHECK(milliseconds_until(105'001, 5000, 100) == 100);
  CHECK(milliseconds_until(kNever, 0, 0xFFFFFFFF) == 0xFFFFFFFF);
  CHECK(milliseconds_until(3'600'000'000'001, 0, 0xFFFFFFFF) == 3'600'000'001);
}

TEST_CASE("The clock goes on where its counter wraps") {
  Clock clock;
  CHECK(clock.now(0) == 0);
  CHECK(clock.now(0xFFFFFFFF) == 4'294'967'295);
  CHECK(clock.now(0) == 4'294'967'296);
  CHECK(clock.now(0) == 4'294'967'296);
  CHECK(clock.now(5) == 4'294'967'301);
  CHECK(clock.now(4) == 8'589'934'596);
}
