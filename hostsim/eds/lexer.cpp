// SPDX-License-Identifier: MIT
#include "eds/lexer.hpp"

#include <algorithm>
#include <string>

#include "eds/diagnostics.hpp"
#include "text/words.hpp"

namespace cbcan::eds {

namespace {

/// Of the last section, which is complete.
void drop_repeated_keys(std::vector<Section>& sections, Findings& findings) {
  if (sections.empty()) return;
  std::vector<KeyValue>& entries = sections.back().entries;
  std::ranges::stable_sort(entries, text::less_text, &KeyValue::key);
  const auto repeats = [&](const KeyValue& first, const KeyValue& again) {
    if (!text::same_text(first.key, again.key)) return false;
    findings.warning(again.line, "key " + quoted(again.key) + " is here again: the value of line " +
                                     std::to_string(first.line) + " is used");
    return true;
  };
  entries.erase(std::unique(entries.begin(), entries.end(), repeats), entries.end());
  std::ranges::sort(entries, {}, &KeyValue::line);
}

/// `text` is the line after its "[".
Section section_from(std::string_view text, std::size_t line, Findings& findings) {
  const std::size_t end = text.find(']');
  const std::string_view name = text::trim(text.substr(0, end));
  if (end == std::string_view::npos) {
    findings.warning(line, "the section name has no \"]\": taken as " + bracketed(name));
  } else if (const auto rest = text::trim(text.substr(end + 1)); !rest.empty() && rest.front() != ';') {
    findings.warning(line, quoted(rest) + " after the section name is ignored");
  }
  return {name, line, {}};
}

void take_entry(std::string_view text, std::size_t line, std::vector<Section>& sections, Findings& findings) {
  const auto sides = text::split(text, '=');
  if (!sides) {
    findings.warning(line, quoted(text) + " is neither [section], key=value nor ;comment: ignored");
  } else if (sections.empty()) {
    findings.warning(line, quoted(text) + " comes before the first [section]: ignored");
  } else {
    sections.back().entries.push_back({text::trim(sides->first), text::trim(sides->second), line});
  }
}

}  // namespace

const KeyValue* Section::find(std::string_view key) const {
  for (const KeyValue& entry : entries)
    if (text::same_text(entry.key, key)) return entry.value.empty() ? nullptr : &entry;
  return nullptr;
}

std::vector<Section> split_sections(std::string_view text, Findings& findings) {
  std::vector<Section> sections;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string_view content = text::trim(text.substr(0, end));
    if (content.starts_with('[')) {
      drop_repeated_keys(sections, findings);
      sections.push_back(section_from(content.substr(1), line, findings));
    } else if (!content.empty() && content.front() != ';') {
      take_entry(content, line, sections, findings);
    }
    const std::size_t line_end = text.substr(end, 2) == "\r\n" ? 2 : 1;
    text.remove_prefix(std::min(end + line_end, text.size()));
  }
  drop_repeated_keys(sections, findings);
  return sections;
}

}  // namespace cbcan::eds
