// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>

namespace cbcan::test {

/// Cases of this program that did not run, or not to their end, and why. catch_main prints them, and fails
/// when there are more or fewer than CBCAN_SKIPS (from CMakeLists.txt) says.
struct Skips {
  std::string running;                     ///< the case that is running now
  std::map<std::string, std::string> why;  ///< by case
};

inline Skips& skips() {
  static Skips all;
  return all;
}

/// To be called where a case leaves early for a good reason.
inline void skip_case(const std::string& why) {
  skips().why[skips().running] = why;
}

}  // namespace cbcan::test
