// SPDX-License-Identifier: MIT
#include "config/diagnostic.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "text/utf8.hpp"

namespace cbcan::config {

Diagnostic about_option(std::string_view typed, std::string message) {
  return {{std::string(typed), 0}, std::move(message)};
}

std::string to_string(const Place& place) {
  return place.line == 0 ? place.source : place.source + ":" + std::to_string(place.line);
}

std::string to_string(const Diagnostic& diagnostic) {
  return text::to_utf8(to_string(diagnostic.place) + ": " + diagnostic.message);
}

void sort_by_place(Diagnostics& diagnostics) {
  const auto rank = [](const Diagnostic& diagnostic) {
    return diagnostic.place.line == 0 ? std::numeric_limits<std::size_t>::max() : diagnostic.place.line;
  };
  std::stable_sort(diagnostics.begin(), diagnostics.end(),
                   [rank](const Diagnostic& a, const Diagnostic& b) { return rank(a) < rank(b); });
}

}  // namespace cbcan::config
