// SPDX-License-Identifier: MIT
#include "config/diagnostic.hpp"

#include <algorithm>
#include <utility>

#include "base/text.hpp"

namespace cbcan::config {

Diagnostic about_option(std::string_view typed, std::string message) {
  return {{std::string(typed), 0}, std::move(message)};
}

std::string to_string(const Place& place) {
  return place.line == 0 ? place.source : place.source + ":" + std::to_string(place.line);
}

std::string to_string(const Diagnostic& diagnostic) {
  return base::to_utf8(to_string(diagnostic.place) + ": " + diagnostic.message);
}

void sort_by_place(Diagnostics& diagnostics) {
  std::ranges::stable_sort(diagnostics, {}, [](const Diagnostic& diagnostic) {
    return std::pair(diagnostic.place.line == 0, diagnostic.place.line);
  });
}

}  // namespace cbcan::config
