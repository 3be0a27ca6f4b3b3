// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <string>

namespace cbcan::test {

/// Says how many cases ran; false when those are fewer than CBCAN_CASES (from CMakeLists.txt) asks for.
inline bool enough_ran(std::size_t ran) {
  std::cout << ran << " cases ran" << std::endl;
  const char* const committed = std::getenv("CBCAN_CASES");
  if (committed == nullptr || ran >= std::stoul(committed)) return true;
  std::cout << "but " << committed
            << " are committed: some were lost, or skip themselves; if that is meant, commit CASES " << ran
            << " for this test in its CMakeLists.txt" << std::endl;
  return false;
}

}  // namespace cbcan::test
