// SPDX-License-Identifier: MIT
#pragma once

/// The programs that make a file of a description, cbcan-eds and cbcan-network, apart from where they run.

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/files.hpp"

namespace cbcan::descriptions {

/// What a program prints, `remarks` as lines on standard error, and the files that it writes: paths and
/// contents.
struct Generated {
  std::string out;
  std::vector<std::string> remarks;
  std::vector<std::pair<std::string, std::string>> files;
  base::ExitCode code = base::ExitCode::kDone;
};

/// Carries out a command line, which begins with the name of one of the two programs.
Generated generate(std::span<const char* const> words, const base::FileReader& read);

}  // namespace cbcan::descriptions
