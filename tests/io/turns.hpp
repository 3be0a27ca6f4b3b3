// SPDX-License-Identifier: MIT
#pragma once

#include "io/loop/reactor.hpp"
#include "support/catch.hpp"

namespace cbcan::io::test {

/// Calls `turn` until `done`; fails after a minute, because a busy machine takes long.
template <typename Turn, typename Done>
void turn_until(Turn turn, Done done) {
  const Time limit = Reactor::now() + 60 * kSecond;
  while (!done()) {
    REQUIRE(Reactor::now() < limit);
    turn();
  }
}

}  // namespace cbcan::io::test
