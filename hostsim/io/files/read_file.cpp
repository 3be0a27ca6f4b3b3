// SPDX-License-Identifier: MIT
#include "io/files/read_file.hpp"

#include <array>
#include <cstdio>
#include <memory>

#include "io/errors.hpp"

namespace cbcan::io {

std::optional<std::string> read_file(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) return std::nullopt;
  std::string text;
  std::array<char, 65536> part;
  while (const std::size_t got = std::fread(part.data(), 1, part.size(), file.get()))
    if (text.append(part.data(), got).size() > kMostFileBytes)
      throw UsageError(path + ": more than 16 MiB; write a plant, EDS or parameter file");
  if (std::ferror(file.get()) != 0) return std::nullopt;
  return text;
}

}  // namespace cbcan::io
