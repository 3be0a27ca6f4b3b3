// SPDX-License-Identifier: MIT
#pragma once

/// Cases in a text file: a title after "== ", lines that are given, and after each "=> " a line that is
/// expected of them; "=>" alone expects none. A given line after an expected one begins the next case with
/// the same title. Empty lines, and those with "##", do not count.

#include "support/catch.hpp"
#include "support/source_file.hpp"

namespace cbcan::test {

using Lines = std::vector<std::string>;

inline Lines lines_of(const std::string& text) {
  std::istringstream stream(text);
  Lines lines;
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}
/// `lines` without `front`, where they begin with it.
inline Lines without(std::string_view front, Lines lines) {
  for (std::string& line : lines)
    if (line.starts_with(front)) line.erase(0, front.size());
  return lines;
}

struct FileCase {
  std::string place;  ///< "FILE:LINE: TITLE"
  bool first = true;  ///< of those with its title
  Lines given, expected;

  /// The given lines as one text.
  std::string text() const {
    std::string all;
    for (const std::string& line : given)
      all += line + "\n";
    return all;
  }
  /// Compares these lines with the expected ones, of which "..." leaves the end open.
  void check(Lines found) const {
    INFO(place);
    for (std::size_t i = 0; i < std::min(found.size(), expected.size()); ++i)
      if (expected[i].ends_with("...")) found[i] = found[i].substr(0, expected[i].size() - 3) + "...";
    CHECK(found == expected);
  }
};

/// The cases of a file of the source tree.
inline std::vector<FileCase> cases_of(const std::string& path) {
  std::vector<FileCase> cases;
  std::string title;
  bool first = true, ended = true;
  unsigned number = 0;
  for (const std::string& line : lines_of(source_file(path))) {
    ++number;
    if (line.empty() || line.starts_with("##")) continue;
    if (line.starts_with("== ")) {
      title = line.substr(3);
      first = ended = true;
    } else if (line.starts_with("=>")) {
      if (line.size() > 3) cases.back().expected.push_back(line.substr(3));
      ended = true;
    } else {
      if (ended) cases.push_back({path + ":" + std::to_string(number) + ": " + title, first, {}, {}});
      first = ended = false;
      cases.back().given.push_back(line);
    }
  }
  REQUIRE_FALSE(cases.empty());
  return cases;
}

}  // namespace cbcan::test
