// SPDX-License-Identifier: MIT
#pragma once

/// Results of scenarios, as text and as JUnit XML.

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "cbcan/time.hpp"

namespace cbcan::scenario {

enum class Verdict : char { kPassed = 'p', kFailed = 'f', kSkipped = 's', kWrong = 'w' };

struct Outcome {
  Verdict verdict = Verdict::kPassed;
  Time duration = 0;  ///< on the plant's clock, the same on every machine
  std::string text;   ///< lines with the reason why it has not passed

  bool is_failure() const { return verdict == Verdict::kFailed || verdict == Verdict::kWrong; }
};

/// The outcomes of one file with different values of random.seed, in any order.
class SeedOutcomes {
 public:
  void add(std::uint32_t seed, Outcome outcome);
  /// One for all: that of the lowest seed that has not passed, and which these are. `replay`: the command for
  /// one of them, without the seed and `words`, which follow.
  Outcome sum(std::string_view replay, std::string_view words) const;

 private:
  std::uint64_t count_ = 0;
  std::uint64_t not_passed_ = 0;
  Outcome longest_;
  std::map<std::uint32_t, Outcome> lowest_;  ///< those that have not passed
};

/// "passed scenarios/x.toml: 2.000000 s", or FAILED and the reason.
std::string report(std::string_view file, const Outcome& outcome);

/// "12 passed, 1 failed"
std::string summary(std::span<const Outcome> outcomes);

/// Report in the format that Jenkins and GitLab read. `outcomes`: one for each of `files`.
std::string junit(std::span<const std::string> files, std::span<const Outcome> outcomes);

/// Exit code of a program that has played them.
base::ExitCode exit_code_of(std::span<const Outcome> outcomes);

}  // namespace cbcan::scenario
