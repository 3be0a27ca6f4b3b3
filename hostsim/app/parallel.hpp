// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace cbcan::app {

/// Calls work(i, thread), which throws nothing, for i = 0..count-1 on up to `threads` threads, this one
/// included. Threads count from 0.
void in_parallel(std::size_t count, std::size_t threads, const auto& work) {
  std::atomic<std::size_t> next = 0;
  const auto take = [&](std::size_t thread) {
    for (std::size_t i = next++; i < count; i = next++)
      work(i, thread);
  };
  std::vector<std::jthread> others;
  for (std::size_t thread = 1; thread < std::min(threads, count); ++thread)
    others.emplace_back(take, thread);
  take(0);
}

}  // namespace cbcan::app
