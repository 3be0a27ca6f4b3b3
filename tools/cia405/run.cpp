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

/// Cycles until `ended`; false = the deadline came first. Between cycles it waits for the link, at most 10
/// ms.
template <typename Ended>
bool cycle_until(Link& link, FunctionBlock& block, steady_clock::time_point deadline, Ended ended) {
  while (cycle(link, block), !ended()) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - steady_clock::now());
    if (left <= milliseconds(0)) return false;
    pollfd wanted{link.descriptor(), link.events(), 0};
    ::poll(&wanted, 1, static_cast<int>(std::min(left, milliseconds(10)).count()));
  }
  return true;
}

}  // namespace

bool run(FunctionBlock& block, steady_clock::time_point deadline) {
  Link& link = block.link_;
  block.enable = false;
  cycle(link, block);
  block.error = KernelError::kNone;
  block.enable = true;
  const auto ended = [&] { return block.confirm || block.error != KernelError::kNone; };
  if (cycle_until(link, block, deadline, ended)) return block.confirm;
  block.enable = false;  // cancels the execution, also in the module: at most one second
  cycle_until(link, block, steady_clock::now() + std::chrono::seconds(1), [&] { return link.events() == 0; });
  block.error = KernelError::kTimeout;
  return false;
}

}  // namespace cbcan::cia405
