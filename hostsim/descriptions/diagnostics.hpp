// SPDX-License-Identifier: MIT
#pragma once

/// Warnings and errors about a file.

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

/// A section name for a message: [1018sub1].
std::string bracketed(std::string_view name);

/// Collects diagnostics. After kMost they are only counted, so that a useless file does not produce megabytes.
class Findings {
 public:
  static constexpr std::size_t kMost = 500;

  explicit Findings(std::string file) : file_(std::move(file)) {}

  template <class... Args>
  void warning(std::size_t line, fmt::format_string<Args...> message, Args&&... args) {
    add(line, Severity::kWarning, fmt::format(message, std::forward<Args>(args)...));
  }
  template <class... Args>
  void error(std::size_t line, fmt::format_string<Args...> message, Args&&... args) {
    add(line, Severity::kError, fmt::format(message, std::forward<Args>(args)...));
  }

  /// All diagnostics in the order of lines, and at the end the number of those left out.
  std::vector<Diagnostic> take();

 private:
  void add(std::size_t line, Severity severity, std::string message);

  std::string file_;
  std::vector<Diagnostic> diagnostics_;
  std::size_t left_out_ = 0;
};

}  // namespace cbcan::descriptions
