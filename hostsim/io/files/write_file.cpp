// SPDX-License-Identifier: MIT
#include "io/files/write_file.hpp"

#include <cerrno>
#include <fstream>

#include "io/errors.hpp"

namespace cbcan::io {

void write_file(const std::string& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw EnvironmentError(path + ": " + reason(errno) + "; write another file");
}

}  // namespace cbcan::io
