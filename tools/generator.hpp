// SPDX-License-Identifier: MIT
#pragma once

/// What the programs that make a file of a description have in common.

#include <fmt/core.h>

#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/exit_code.hpp"
#include "base/utf8.hpp"

namespace cbcan::tools {

using Words = std::vector<std::string>;

/// main() of the program: `make` turns the words of its command line into the output.
inline int generate(const char* program, const char* help, int count, char** words,
                    std::string (*make)(const Words& words, Words& remarks)) {
  const Words given(words + 1, words + count);
  try {
    if (given == Words{"--help"}) return std::fputs(help, stdout) < 0;
    Words remarks;
    const std::string output = make(given, remarks);
    for (const std::string& remark : remarks)
      fmt::print(stderr, "{}\n", base::to_utf8(remark));
    if (std::fwrite(output.data(), 1, output.size(), stdout) != output.size() || std::fflush(stdout) != 0)
      throw std::runtime_error("standard output: cannot be written");
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", program, base::to_utf8(error.what()));
    return static_cast<int>(base::ExitCode::kUsage);
  }
}

}  // namespace cbcan::tools
