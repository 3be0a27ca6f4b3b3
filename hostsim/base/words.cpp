// SPDX-License-Identifier: MIT
#include "base/words.hpp"

namespace cbcan::base {
namespace {

constexpr std::size_t kColumns = 80;

constexpr char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::vector<std::string_view> words_of(std::string_view text, std::string_view marks) {
  std::vector<std::string_view> words;
  for (auto at = text.find_first_not_of(marks); at != std::string_view::npos;) {
    const auto end = std::min(text.find_first_of(marks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(marks, end);
  }
  return words;
}

std::optional<std::pair<std::string_view, std::string_view>> split(std::string_view text, char mark) {
  const auto at = text.find(mark);
  if (at == std::string_view::npos) return std::nullopt;
  return std::pair(text.substr(0, at), text.substr(at + 1));
}

std::string_view take_part(std::string_view& rest, char mark) {
  const std::string_view part = rest.substr(0, rest.find(mark));
  rest.remove_prefix(std::min(rest.size(), part.size() + 1));
  return part;
}

std::string_view take_line(std::string_view& rest) {
  return take_part(rest, '\n');
}

bool same_letters(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, {}, lower, lower);
}

std::string_view table_of(std::string_view key) {
  const auto dot = key.rfind('.');
  return dot == std::string_view::npos ? std::string_view{} : key.substr(0, dot);
}

std::string_view leaf_of(std::string_view key) {
  return key.substr(key.rfind('.') + 1);
}

std::string listed(std::span<const std::string_view> words, std::string_view last) {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i != 0) list += i + 1 == words.size() ? last : ", ";
    list += words[i];
  }
  return list;
}

std::string beside(std::string_view left, std::string_view right, std::size_t column) {
  std::string text;
  std::string line = "  " + std::string(left);
  if (line.size() + 1 >= column) {
    text = line + "\n";
    line.clear();
  }
  line.resize(column - 1, ' ');
  for (const std::string_view word : words_of(right)) {
    if (line.size() + 1 + word.size() > kColumns) {
      text += line + "\n";
      line.assign(column - 1, ' ');
    }
    line.append(" ").append(word);
  }
  return text + line + "\n";
}

}  // namespace cbcan::base
