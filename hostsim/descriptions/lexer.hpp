// SPDX-License-Identifier: MIT
#pragma once

/// Lines, sections and keys of an EDS or DCF (CiA 306, 4.1). Everything is a view into the text, which has to
/// outlive the sections. Line ends are LF, CR or CRLF, in any mixture; lines may be of any length. And
/// warnings and errors about a file.

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/text.hpp"

namespace cbcan::descriptions {

enum class Severity : std::uint8_t {
  kWarning,  ///< something is wrong in the file; the message says what is used instead
  kError,    ///< something is wrong in the file, and a part of it is not used
};

struct Diagnostic {
  std::string file;
  std::size_t line = 0;  ///< 1 = the first
  Severity severity = Severity::kWarning;
  std::string message;
  bool operator==(const Diagnostic&) const = default;
};

/// `file:line: message`
std::string to_string(const Diagnostic& diagnostic);

/// Text of the file for a message: at most about forty characters, as UTF-8 without control characters.
std::string shortened(std::string_view text);

/// The same, in quotes.
std::string quoted(std::string_view text);

/// A section name in a message. It is not part of the kind of a warning.
struct SectionName : std::string {};

/// A section name for a message: [1018sub1].
SectionName bracketed(std::string_view name);

/// Collects diagnostics. Warnings that differ only in section names and numbers are of one kind: the first
/// one says how many follow. After kMost, diagnostics are only counted, so that a useless file does not
/// produce megabytes.
class Findings {
 public:
  static constexpr std::size_t kMost = 500;

  explicit Findings(std::string file) : file_(std::move(file)) {}

  template <class... Args>
  void warning(std::size_t line, fmt::format_string<Args...> message, Args&&... args) {
    add_warning(line, text(message, args...), text(message, kind_part(args)...));
  }
  template <class... Args>
  void error(std::size_t line, fmt::format_string<Args...> message, Args&&... args) {
    add(line, Severity::kError, fmt::format(message, std::forward<Args>(args)...));
  }

  /// All diagnostics in the order of lines, and at the end the number of those left out.
  std::vector<Diagnostic> take();

 private:
  struct Kind {
    std::size_t first = 0, more = 0, last_line = 0;  ///< `first`: its place in diagnostics_
  };

  template <class... Args>
  static std::string text(fmt::string_view message, const Args&... args) {
    return fmt::vformat(message, fmt::make_format_args(args...));
  }
  template <class T>
  static T kind_part(const T& part) {
    return std::is_integral_v<T> || std::is_same_v<T, SectionName> ? T() : part;
  }
  void add(std::size_t line, Severity severity, std::string message);
  void add_warning(std::size_t line, std::string message, const std::string& kind);

  std::string file_;
  std::vector<Diagnostic> diagnostics_;
  std::map<std::string, Kind> kinds_;  ///< of warnings
  std::size_t left_out_ = 0;
};

/// The name of a key; the case of its letters does not matter.
class Key {
 public:
  consteval Key(const char* text) : Key(std::string_view(text)) {}
  constexpr explicit Key(std::string_view text)
      : text_(text),
        head_(head(text)),
        tail_(tail(text)),
        hash_(((head_ | kLowCase) + 3 * (tail_ | kLowCase) + text.size()) * kFactor) {}
  constexpr std::string_view text() const { return text_; }
  /// The same for all spellings.
  constexpr std::uint64_t hash() const { return hash_; }
  /// The same for all spellings; different for all keys of objects in CiA 306.
  constexpr std::uint64_t bit() const { return std::uint64_t{1} << (hash_ >> 58); }
  /// `other` is a spelling of it.
  bool is(std::string_view other) const {
    const bool alike = other.size() == text_.size() && head(other) == head_ && tail(other) == tail_;
    return (alike && other.size() <= 2 * kPart) || base::same_text(other, text_);
  }

 private:
  static constexpr std::size_t kPart = 8;
  static constexpr std::uint64_t kLowCase = 0x2020202020202020;
  static constexpr std::uint64_t kFactor = 0x258C7CA42D1459D5;

  static constexpr std::uint64_t byte(std::string_view text, std::size_t i) {
    return static_cast<unsigned char>(text[i]);
  }
  /// The first eight letters.
  static constexpr std::uint64_t head(std::string_view text) {
    std::uint64_t letters = 0;
    if (text.size() >= kPart) return [&]<std::size_t... I>(std::index_sequence<I...>) {  // a single load
        return (... | (byte(text, I) << 8 * I));
      }
    (std::make_index_sequence<kPart>());
    for (std::size_t i = 0; i < text.size(); ++i)
      letters = letters << 8 | byte(text, i);
    return letters;
  }
  static constexpr std::uint64_t tail(std::string_view text) {
    return head(text.substr(text.size() < kPart ? 0 : text.size() - kPart));
  }

  std::string_view text_;
  std::uint64_t head_;
  std::uint64_t tail_;
  std::uint64_t hash_;
};

/// One `key=value`, both without the blanks around them. A `;` in the value belongs to the value.
struct KeyValue {
  std::string_view key;
  std::string_view value;
  std::size_t line = 0;
  std::uint64_t hash = 0;  ///< that of Key
};

struct Section {
  std::string_view name;
  std::size_t line = 0;
  std::span<const KeyValue> entries;  ///< in the order of the file; if a key occurs twice, only the first one
  std::uint64_t seen = 0;             ///< Key::bit() of all entries

  /// Null if there is no such key or nothing after the `=`.
  const KeyValue* find(const Key& key) const;
};

struct Sections {
  std::vector<Section> list;      ///< in the order of the file; a section that occurs twice is there twice
  std::vector<KeyValue> entries;  ///< of all sections
};

Sections split_sections(std::string_view text, Findings& findings);

}  // namespace cbcan::descriptions
