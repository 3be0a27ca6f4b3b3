// SPDX-License-Identifier: MIT
#pragma once

#include <fstream>
#include <iterator>
#include <string>

namespace cbcan::test {

/// A file of the source tree; empty if it is not there.
inline std::string source_file(const std::string& path) {
  std::ifstream file(CBCAN_SOURCE_DIR "/" + path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace cbcan::test
