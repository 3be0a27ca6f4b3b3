// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <string>

namespace cbcan::test {

/// Prints how many cases ran; false if none did.
inline bool any_ran(std::size_t ran) {
  std::cout << ran << " cases ran" << std::endl;
  return ran != 0;
}

/// Prints how many cases were skipped, as a whole or in part; false if that is not CBCAN_SKIPS (from
/// CMakeLists.txt; empty = 0), where that is set.
inline bool as_many_skipped(std::size_t skipped) {
  const char* const announced = std::getenv("CBCAN_SKIPS");
  if (skipped != 0) std::cout << skipped << " cases skipped" << std::endl;
  const std::size_t known = announced == nullptr || *announced == 0 ? 0 : std::stoul(announced);
  if (announced == nullptr || skipped == known) return true;
  std::cout << "but " << known << " are announced; if that is meant, commit SKIPS " << skipped
            << " for this test in its CMakeLists.txt" << std::endl;
  return false;
}

}  // namespace cbcan::test
