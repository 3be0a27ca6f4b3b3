// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <string>

namespace cbcan::test {

/// Prints how many cases ran; false if that is fewer than CBCAN_CASES (from CMakeLists.txt).
inline bool enough_ran(std::size_t ran) {
  std::cout << ran << " cases ran" << std::endl;
  const char* const committed = std::getenv("CBCAN_CASES");
  if (committed == nullptr || ran >= std::stoul(committed)) return true;
  std::cout << "but " << committed
            << " are committed: some were lost, or skip themselves; if that is meant, commit CASES " << ran
            << " for this test in its CMakeLists.txt" << std::endl;
  return false;
}

/// Prints how many cases were skipped, as a whole or in part; false if that is not CBCAN_SKIPS (from
/// CMakeLists.txt; 0 without it).
inline bool as_many_skipped(std::size_t skipped) {
  const char* const announced = std::getenv("CBCAN_SKIPS");
  const std::size_t known = announced == nullptr || *announced == 0 ? 0 : std::stoul(announced);
  if (skipped != 0) std::cout << skipped << " cases skipped" << std::endl;
  if (skipped == known || std::getenv("CBCAN_CASES") == nullptr) return true;
  std::cout << "but " << known << " are announced; if that is meant, commit SKIPS " << skipped
            << " for this test in its CMakeLists.txt" << std::endl;
  return false;
}

}  // namespace cbcan::test
