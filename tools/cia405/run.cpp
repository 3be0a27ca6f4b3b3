// SPDX-License-Identifier: MIT
#include <poll.h>

#include <algorithm>

#include "cbcan/cia405.hpp"

namespace cbcan::cia405 {

namespace {

using std::chrono::milliseconds, std::chrono::steady_clock;

void cycle(Link& link, FunctionBlock& block) {
  const auto since = steady_clock::now().time_since_epoch();
  const Time now = std::chrono::duration_cast<std::chrono::microseconds>(since).count();
  link.poll(now);
  block.call(now);
}

/// For what the link waits for, and not long.
void wait(const Link& link, steady_clock::time_point deadline) {
  const auto left = std::chrono::ceil<milliseconds>(deadline - steady_clock::now());
  pollfd wanted{link.descriptor(), link.events(), 0};
  ::poll(&wanted, 1, static_cast<int>(std::clamp(left, milliseconds(0), milliseconds(10)).count()));
}

bool ended(const FunctionBlock& block) {
  return block.confirm || block.error != KernelError::kNone;
}

/// Takes the execution back, in the module too: that gets a second.
void give_up(Link& link, FunctionBlock& block) {
  const auto patience = steady_clock::now() + std::chrono::seconds(1);
  block.enable = false;
  do {
    cycle(link, block);
    wait(link, patience);
  } while (link.events() != 0 && steady_clock::now() < patience);
  block.error = KernelError::kTimeout;
}

}  // namespace

bool run(FunctionBlock& block, steady_clock::time_point deadline) {
  Link& link = block.link_;
  block.enable = false;
  cycle(link, block);
  block.error = KernelError::kNone;
  block.enable = true;
  while (cycle(link, block), !ended(block)) {
    if (steady_clock::now() >= deadline) {
      give_up(link, block);
      return false;
    }
    wait(link, deadline);
  }
  return block.confirm;
}

}  // namespace cbcan::cia405
