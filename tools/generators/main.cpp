// SPDX-License-Identifier: MIT
// cbcan-eds or cbcan-network, as CBCAN_PROGRAM says: a description as a file for firmware.

#include <fmt/core.h>

#include <cstdio>
#include <fstream>

#include "base/read_file.hpp"
#include "base/text.hpp"
#include "descriptions/generators.hpp"

namespace {

int fail(const std::string& what) {
  fmt::print(stderr, "{}: {}: cannot be written\n", CBCAN_PROGRAM, cbcan::base::to_utf8(what));
  return static_cast<int>(cbcan::base::ExitCode::kUsage);
}

}  // namespace

int main(int count, char** words) {
  std::vector<const char*> line(words, words + count);
  line.front() = CBCAN_PROGRAM;
  const auto made = cbcan::descriptions::generate(line, cbcan::base::read_file);
  for (const std::string& remark : made.remarks)
    fmt::print(stderr, "{}\n", cbcan::base::to_utf8(remark));
  for (const auto& [path, content] : made.files)
    if (!(std::ofstream(path, std::ios::binary) << content << std::flush)) return fail(path);
  if (std::fwrite(made.out.data(), 1, made.out.size(), stdout) != made.out.size() || std::fflush(stdout) != 0)
    return fail("standard output");
  return static_cast<int>(made.code);
}
