// SPDX-License-Identifier: MIT
#pragma once

/// Mistakes in a configuration, each with the place where the user can correct it.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cbcan::config {

/// Where something was configured: a line of a plant file, or an option as it was typed (line 0).
struct Place {
  std::string source;
  std::size_t line = 0;
  bool operator==(const Place&) const = default;
};

struct Diagnostic {
  Place place;
  std::string message;
};

using Diagnostics = std::vector<Diagnostic>;

/// Message about an option, or a word of the command line, as it was typed.
Diagnostic about_option(std::string_view typed, std::string message);

/// "plant.toml:12", "--node 5=io_module.eds"
std::string to_string(const Place& place);

/// "plant.toml:12: node.id 300: must be 1..127", without a line end.
std::string to_string(const Diagnostic& diagnostic);

/// Plant file first, in line order; then the command line, in unchanged order.
void sort_by_place(Diagnostics& diagnostics);

}  // namespace cbcan::config
