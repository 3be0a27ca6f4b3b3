// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>

namespace cbcan::test {

/// Cases of this program that did not run, or not to their end, and why. catch_main prints them, and fails if
/// their number is not CBCAN_SKIPS (from CMakeLists.txt).
struct Skips {
  std::string running;                     ///< the case that is running now
  std::map<std::string, std::string> why;  ///< by case
};

inline Skips& skips() {
  static Skips all;
  return all;
}

/// To be called where a case has a good reason to return early.
inline void skip_case(const std::string& why) {
  skips().why[skips().running] = why;
}

}  // namespace cbcan::test
