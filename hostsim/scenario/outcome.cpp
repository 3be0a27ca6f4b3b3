// SPDX-License-Identifier: MIT
#include "scenario/outcome.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "base/text.hpp"

namespace cbcan::scenario {

namespace {

constexpr auto kVerdicts =
    std::to_array<std::pair<Verdict, std::string_view>>({{Verdict::kPassed, "passed"},
                                                         {Verdict::kFailed, "failed"},
                                                         {Verdict::kSkipped, "skipped"},
                                                         {Verdict::kWrong, "wrong"}});

std::ptrdiff_t count(std::span<const Outcome> outcomes, Verdict verdict) {
  return std::ranges::count(outcomes, verdict, &Outcome::verdict);
}

std::string test_case(std::string_view file, const Outcome& outcome) {
  const std::size_t slash = file.rfind('/');
  const std::string_view folder = slash == std::string_view::npos ? "." : file.substr(0, slash);
  std::string text = fmt::format("  <testcase classname=\"{}\" name=\"{}\" file=\"{}\" time=\"{}\"",
                                 base::to_xml(folder), base::to_xml(file.substr(slash + 1)),
                                 base::to_xml(file), base::seconds_text(outcome.duration));
  if (outcome.verdict == Verdict::kPassed) return text + "/>\n";
  const std::string_view why = std::string_view(outcome.text).substr(0, outcome.text.find('\n'));
  const std::string_view element = outcome.verdict == Verdict::kSkipped ? "skipped"
                                   : outcome.verdict == Verdict::kWrong ? "error"
                                                                        : "failure";
  return text + fmt::format(">\n    <{0} message=\"{1}\">{2}</{0}>\n  </testcase>\n", element,
                            base::to_xml(why), base::to_xml(outcome.text));
}

}  // namespace

void SeedOutcomes::add(std::uint32_t seed, Outcome outcome) {
  constexpr std::size_t kMostNamed = 20;
  if (count_++ == 0 || outcome.duration > longest_.duration) longest_ = outcome;
  if (outcome.verdict == Verdict::kPassed) return;
  ++not_passed_;
  lowest_.emplace(seed, std::move(outcome));
  if (lowest_.size() > kMostNamed) lowest_.erase(std::prev(lowest_.end()));
}

Outcome SeedOutcomes::sum(std::string_view replay, std::string_view words) const {
  if (count_ == 1 || not_passed_ == 0) return longest_;
  const auto& [seed, first] = *lowest_.begin();
  std::string seeds;
  for (const auto& [failed, outcome] : lowest_)
    seeds += fmt::format(" {}", failed);
  return {first.verdict, longest_.duration,
          fmt::format("with {} of {} seeds:{}{}\nreplay: {} --seeds {} {}\n{}", not_passed_, count_, seeds,
                      lowest_.size() < not_passed_ ? " ..." : "", replay, seed, base::to_utf8(words),
                      first.text)};
}

std::string report(std::string_view path, const Outcome& outcome) {
  const std::string file = base::to_utf8(path);
  switch (outcome.verdict) {
    case Verdict::kPassed:
      return fmt::format("passed {}: {} s{}{}\n", file, base::seconds_text(outcome.duration),
                         outcome.text.empty() ? "" : "; ", outcome.text);
    case Verdict::kSkipped: return fmt::format("skipped {}: {}\n", file, outcome.text);
    case Verdict::kFailed: return fmt::format("FAILED {}\n{}", file, outcome.text);
    case Verdict::kWrong: return fmt::format("WRONG {}\n{}", file, outcome.text);
  }
  return {};
}

std::string summary(std::span<const Outcome> outcomes) {
  std::string text;
  for (const auto& [verdict, name] : kVerdicts)
    if (const auto found = count(outcomes, verdict); found != 0 || verdict == Verdict::kPassed)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", found, name);
  return text;
}

std::string junit(std::span<const std::string> files, std::span<const Outcome> outcomes) {
  Time duration = 0;
  for (const Outcome& outcome : outcomes)
    duration += outcome.duration;
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"cbcan-sim\" tests=\"{}\" "
      "failures=\"{}\" "
      "errors=\"{}\" skipped=\"{}\" time=\"{}\">\n",
      outcomes.size(), count(outcomes, Verdict::kFailed), count(outcomes, Verdict::kWrong),
      count(outcomes, Verdict::kSkipped), base::seconds_text(duration));
  for (std::size_t i = 0; i < files.size(); ++i)
    text += test_case(files[i], outcomes[i]);
  return text + "</testsuite>\n";
}

base::ExitCode exit_code_of(std::span<const Outcome> outcomes) {
  if (count(outcomes, Verdict::kWrong) != 0) return base::ExitCode::kUsage;
  return count(outcomes, Verdict::kFailed) != 0 ? base::ExitCode::kCheckFailed : base::ExitCode::kDone;
}

}  // namespace cbcan::scenario
