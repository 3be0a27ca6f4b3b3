// SPDX-License-Identifier: MIT
#pragma once

/// Text of EDS files, written by hand.

#include <string>

namespace cbcan::test {

/// A section.
struct Line {
  const char* index;
  const char* type;    ///< empty: missing in the file
  const char* access;  ///< empty: missing in the file
  const char* value;   ///< empty: missing in the file
};

inline std::string text_of(const Line& line) {
  const auto key = [](const char* name, const std::string& value) {
    return value.empty() ? std::string() : std::string(name) + "=" + value + "\n";
  };
  return "[" + std::string(line.index) + "]\nParameterName=x\nObjectType=7\n" + key("DataType", line.type) +
         key("AccessType", line.access) + key("DefaultValue", line.value) + "PDOMapping=1\n\n";
}

/// An array of two numbers, such as 608Fh.
inline std::string pair_of(const char* index, const char* first, const char* second, const char* type = "7",
                           const char* second_type = nullptr) {
  const std::string name(index);
  const std::string subs =
      text_of({(name + "sub0").c_str(), "5", "ro", "2"}) +
      text_of({(name + "sub1").c_str(), type, "rw", first}) +
      text_of({(name + "sub2").c_str(), second_type != nullptr ? second_type : type, "rw", second});
  return "[" + name + "]\nParameterName=x\nObjectType=8\nSubNumber=3\n" + subs;
}

inline std::string number_of(const char* index, const char* value) {
  return text_of({index, "7", "rw", value});
}

}  // namespace cbcan::test
