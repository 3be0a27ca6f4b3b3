// SPDX-License-Identifier: MIT
#pragma once

/// Lines, sections and keys of an EDS or DCF (CiA 306, 4.1). Everything is a view into the text, which has to
/// outlive the sections. Line ends are LF, CR or CRLF, in any mixture; lines may be of any length.

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
  std::vector<KeyValue> entries;  ///< in the order of the file; if a key occurs twice, only the first one

  /// Null if there is no such key or nothing after the `=`; the case of the key does not matter.
  const KeyValue* find(std::string_view key) const;
};

/// In the order of the file; a section that occurs twice is there twice.
std::vector<Section> split_sections(std::string_view text, Findings& findings);

}  // namespace cbcan::eds
