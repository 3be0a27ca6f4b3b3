// SPDX-License-Identifier: MIT
#pragma once

/// Results of scenarios, as text and as JUnit XML.

#include <span>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "options/exit_code.hpp"

namespace cbcan::scenario {

enum class Verdict : char { kPassed = 'p', kFailed = 'f', kSkipped = 's', kWrong = 'w' };

struct Outcome {
  Verdict verdict = Verdict::kPassed;
  Time duration = 0;  ///< on the plant's clock, the same on every machine
  std::string text;   ///< lines with the reason why it has not passed
};

/// "passed scenarios/x.toml: 2.000000 s", or FAILED and the reason.
std::string report(std::string_view file, const Outcome& outcome);

/// "12 passed, 1 failed"
std::string summary(std::span<const Outcome> outcomes);

/// In the format that Jenkins and GitLab read. `outcomes`: one for each of `files`.
std::string junit(std::span<const std::string> files, std::span<const Outcome> outcomes);

/// Of a program that has played them.
options::ExitCode exit_code_of(std::span<const Outcome> outcomes);

}  // namespace cbcan::scenario
