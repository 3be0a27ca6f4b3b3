// SPDX-License-Identifier: MIT
#include "scenario/search/trial.hpp"

#include <fmt/core.h>

#include <array>

#include "base/text.hpp"

namespace cbcan::search {

std::string report(const Result& result) {
  constexpr std::array<std::string_view, 4> kVerdicts{"done", "gave up", "broken", "late"};
  if (result.what.empty()) return fmt::format("{}\n", kVerdicts[static_cast<std::size_t>(result.verdict)]);
  const auto line = [](std::string_view name, const std::string& text) {
    return text.empty() ? "" : fmt::format("  {}: {}\n", name, text);
  };
  const bool says_why = result.during.empty() && !result.said.empty();
  return base::lines_to_utf8(fmt::format("{}: {}\n{}{}{}{}{}", result.what, result.seen,
                                         line("in", result.during), line("fault in", result.disturbed),
                                         line("last request", result.request), result.said,
                                         says_why ? "" : result.frames));
}

}  // namespace cbcan::search
