// SPDX-License-Identifier: MIT
#pragma once

/// What the programs that make a file of a description have in common.

#include <fmt/core.h>

#include <cstdio>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "base/command.hpp"
#include "base/error.hpp"
#include "base/text.hpp"

namespace cbcan::tools {

using Words = std::vector<std::string>;

/// main() of the program: `make` turns the words of its command line into the output.
inline int generate(const char* program, const char* help, std::span<const std::string_view> options,
                    std::span<const char* const> words,
                    std::string (*make)(const base::ParsedArguments& typed, Words& remarks)) {
  std::vector<std::string_view> known(options.begin(), options.end());
  known.push_back("-h, --help");
  const base::ParsedArguments typed = base::parse_arguments(words.subspan(1), known);
  try {
    for (const base::Argument& argument : typed.options)
      if (argument.option == "--help") return std::fputs(help, stdout) < 0;
    for (const base::WrongWord& wrong : typed.wrong)
      throw base::UsageError(fmt::format("{}: {}; see {} --help", wrong.word, wrong.message, program));
    Words remarks;
    const std::string output = make(typed, remarks);
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
