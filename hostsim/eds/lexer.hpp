// SPDX-License-Identifier: MIT
#pragma once

/// The first look at an EDS or DCF (CiA 306, 4.1): lines, sections, keys. Everything is a view into the text,
/// which has to outlive the sections. Line ends are LF, CR or CRLF, mixed as they come; lines may be of any
/// length.

#include <cstddef>
#include <string_view>
#include <vector>

#include "eds/diagnostics.hpp"

namespace cbcan::eds {

/// One `key=value`, both without the blanks around them. A `;` in the value belongs to the value.
struct KeyValue {
  std::string_view key;
  std::string_view value;
  std::size_t line = 0;
};

struct Section {
  std::string_view name;
  std::size_t line = 0;
  std::vector<KeyValue> entries;  ///< in the order of the file; of a key that comes twice the first one

  /// Null if there is no such key or nothing behind the `=`; the case of the key does not matter.
  const KeyValue* find(std::string_view key) const;
};

/// In the order of the file; a section that comes twice is there twice.
std::vector<Section> split_sections(std::string_view text, Findings& findings);

}  // namespace cbcan::eds
