// SPDX-License-Identifier: MIT
#include "descriptions/diagnostics.hpp"

#include <algorithm>

#include "base/text.hpp"

namespace cbcan::descriptions {

std::string to_string(const Diagnostic& diagnostic) {
  return fmt::format("{}:{}: {}", diagnostic.file, diagnostic.line, diagnostic.message);
}

std::string shortened(std::string_view text) {
  constexpr std::size_t kMessageBytes = 40;
  const std::string_view start = base::head(text, kMessageBytes);
  return base::to_utf8(start) + (start.size() < text.size() ? "..." : "");
}

std::string quoted(std::string_view text) {
  return '"' + shortened(text) + '"';
}

std::string bracketed(std::string_view name) {
  return '[' + shortened(name) + ']';
}

void Findings::add(std::size_t line, Severity severity, std::string message) {
  if (diagnostics_.size() == kMost) {
    ++left_out_;
    return;
  }
  diagnostics_.push_back({file_, line, severity, std::move(message)});
}

std::vector<Diagnostic> Findings::take() {
  std::ranges::stable_sort(diagnostics_, {}, &Diagnostic::line);
  if (left_out_ > 0) {
    const std::size_t last_line = diagnostics_.back().line;
    diagnostics_.push_back({file_, last_line, Severity::kError, fmt::format("and {} more", left_out_)});
  }
  return std::exchange(diagnostics_, {});
}

}  // namespace cbcan::descriptions
