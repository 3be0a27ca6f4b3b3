// SPDX-License-Identifier: MIT
#pragma once

/// Text of EDS files, written by hand.

#include <string>

namespace cbcan::test {

/// A section.
struct Line {
  std::string index;
  std::string type;    ///< empty: missing in the file
  std::string access;  ///< empty: missing in the file
  std::string value;   ///< empty: missing in the file
  bool mappable = true;
};

inline std::string text_of(const Line& line) {
  const auto key = [](const char* name, const std::string& value) {
    return value.empty() ? std::string() : std::string(name) + "=" + value + "\n";
  };
  return "[" + line.index + "]\nParameterName=x\nObjectType=7\n" + key("DataType", line.type) +
         key("AccessType", line.access) + key("DefaultValue", line.value) +
         key("PDOMapping", line.mappable ? "1" : "") + "\n";
}

/// The section of an array (8) or a record (9), without those of its `subs` sub-indices.
inline std::string head_of(const std::string& index, char object_type, char subs) {
  return "[" + index + "]\nParameterName=x\nObjectType=" + object_type + "\nSubNumber=" + subs + "\n";
}

/// An array of two numbers, such as 608Fh.
inline std::string pair_of(const std::string& index, const std::string& first, const std::string& second,
                           const std::string& type = "7", const std::string& second_type = "") {
  return head_of(index, '8', '3') + text_of({index + "sub0", "5", "ro", "2"}) +
         text_of({index + "sub1", type, "rw", first}) +
         text_of({index + "sub2", second_type.empty() ? type : second_type, "rw", second});
}

inline std::string number_of(const std::string& index, const std::string& value) {
  return text_of({index, "7", "rw", value});
}

}  // namespace cbcan::test
