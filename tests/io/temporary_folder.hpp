// SPDX-License-Identifier: MIT
#pragma once

#include <stdlib.h>

#include <filesystem>

#include "support/catch.hpp"

namespace cbcan::io::test {

/// Removed with its files by the destructor.
struct TemporaryFolder {
  TemporaryFolder() { REQUIRE(mkdtemp(name.data()) != nullptr); }
  ~TemporaryFolder() { std::filesystem::remove_all(name); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string file(const std::string& file_name) const { return name + "/" + file_name; }

  std::string name = "/tmp/cbcan_io_XXXXXX";
};

inline std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

}  // namespace cbcan::io::test
