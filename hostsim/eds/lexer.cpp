// SPDX-License-Identifier: MIT
#include "eds/lexer.hpp"

#include <algorithm>
#include <string>

#include "eds/diagnostics.hpp"
#include "text/words.hpp"

namespace cbcan::eds {

namespace {

class Lexer {
 public:
  explicit Lexer(Findings& findings) : findings_(findings) {}

  void take_line(std::string_view raw) {
    ++line_;
    const std::string_view text = text::trim(raw);
    if (text.empty() || text.front() == ';') return;
    if (text.front() == '[') {
      open_section(text.substr(1));
    } else {
      take_entry(text);
    }
  }

  std::vector<Section> finish() {
    drop_repeated_keys();
    return std::move(sections_);
  }

 private:
  void open_section(std::string_view text) {
    drop_repeated_keys();
    const std::size_t end = text.find(']');
    const std::string_view name = text::trim(text.substr(0, end));
    if (end == std::string_view::npos) {
      findings_.warning(line_, "the section name has no \"]\": taken as " + bracketed(name));
    } else if (const auto rest = text::trim(text.substr(end + 1)); !rest.empty() && rest.front() != ';') {
      findings_.warning(line_, quoted(rest) + " after the section name is ignored");
    }
    sections_.push_back({name, line_, {}});
  }

  void take_entry(std::string_view text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos) {
      findings_.warning(line_, quoted(text) + " is neither [section], key=value nor ;comment: ignored");
    } else if (sections_.empty()) {
      findings_.warning(line_, quoted(text) + " comes before the first [section]: ignored");
    } else {
      const std::string_view value = text::trim(text.substr(equals + 1));
      sections_.back().entries.push_back({text::trim(text.substr(0, equals)), value, line_});
    }
  }

  void drop_repeated_keys() {
    if (sections_.empty()) return;
    std::vector<KeyValue>& entries = sections_.back().entries;
    std::stable_sort(entries.begin(), entries.end(),
                     [](const KeyValue& a, const KeyValue& b) { return text::less_text(a.key, b.key); });
    const auto repeats = [this](const KeyValue& first, const KeyValue& again) {
      if (!text::same_text(first.key, again.key)) return false;
      findings_.warning(again.line, "key " + quoted(again.key) + " is here again: the value of line " +
                                        std::to_string(first.line) + " is used");
      return true;
    };
    entries.erase(std::unique(entries.begin(), entries.end(), repeats), entries.end());
    std::sort(entries.begin(), entries.end(),
              [](const KeyValue& a, const KeyValue& b) { return a.line < b.line; });
  }

  Findings& findings_;
  std::vector<Section> sections_;
  std::size_t line_ = 0;
};

}  // namespace

const KeyValue* Section::find(std::string_view key) const {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const KeyValue& entry) { return text::same_text(entry.key, key); });
  return found == entries.end() || found->value.empty() ? nullptr : &*found;
}

std::vector<Section> split_sections(std::string_view text, Findings& findings) {
  Lexer lexer(findings);
  while (!text.empty()) {
    const std::size_t end = text.find_first_of("\r\n");
    lexer.take_line(text.substr(0, end));
    if (end == std::string_view::npos) break;
    const bool both = text.substr(end, 2) == "\r\n";
    text.remove_prefix(end + (both ? 2 : 1));
  }
  return lexer.finish();
}

}  // namespace cbcan::eds
