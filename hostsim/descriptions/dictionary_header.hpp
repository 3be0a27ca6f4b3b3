// SPDX-License-Identifier: MIT
#pragma once

/// A device's EDS or DCF file as a C++ header for firmware: cbcan::EdsDictionary, and the names of its
/// objects.

#include <string>
#include <string_view>
#include <vector>

namespace cbcan::descriptions {

/// Defines `space::kDictionary` and `space::od`. Throws UsageError, "io.eds:12: ...", for a mistake in the
/// file or something that the stack does not have; `remarks`: other mistakes, and what is used instead.
std::string dictionary_header(std::string_view text, const std::string& name, const std::string& space,
                              std::vector<std::string>& remarks);

}  // namespace cbcan::descriptions
