// SPDX-License-Identifier: MIT
#pragma once

/// What has come of scenarios, for people and as JUnit XML.

#include <span>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"

namespace cbcan::app {

enum class Verdict : char { kPassed = 'p', kFailed = 'f', kSkipped = 's', kWrong = 'w' };

struct Outcome {
  Verdict verdict = Verdict::kPassed;
  Time duration = 0;  ///< of the plant's time, which is the same on every machine
  std::string text;   ///< why it has not passed: lines
};

/// "passed scenarios/x.toml: 2.000000 s", or FAILED and why.
std::string report(std::string_view file, const Outcome& outcome);

/// "12 passed, 1 failed"
std::string summary(std::span<const Outcome> outcomes);

/// `files` and `outcomes` belong together. The format that Jenkins and GitLab read.
std::string junit(std::span<const std::string> files, std::span<const Outcome> outcomes);

}  // namespace cbcan::app
