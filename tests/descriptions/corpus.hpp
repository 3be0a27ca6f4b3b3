// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "descriptions/eds_reader.hpp"
#include "descriptions/values.hpp"
#include "support/source_file.hpp"

namespace cbcan::tests {

inline constexpr std::array<std::string_view, 2> kSeverities = {"warning", "error"};
inline constexpr std::array<std::string_view, 6> kAccesses = {"ro", "wo", "rw", "rwr", "rww", "const"};
inline constexpr std::size_t kMostShown = 32;

inline std::string value_text(const std::vector<std::uint8_t>& value) {
  if (value.empty()) return "-";
  if (value.size() > kMostShown) return "(" + std::to_string(value.size()) + " bytes)";
  std::string text;
  for (const std::uint8_t byte : value)
    text += base::hex(byte, 2);
  return text;
}

inline std::string limit_text(const std::optional<std::int64_t>& limit, DataType type) {
  if (!limit) return {};
  return is_signed(type) ? std::to_string(*limit) : std::to_string(static_cast<std::uint64_t>(*limit));
}

inline std::string object_text(const descriptions::Object& object) {
  std::ostringstream text;
  text << base::hex(object.index, 4) << ':' << base::hex(object.first_sub, 2);
  if (object.last_sub != object.first_sub) text << '-' << base::hex(object.last_sub, 2);
  text << ' ' << descriptions::name_of(object.type) << ' '
       << kAccesses.at(static_cast<std::size_t>(object.access));
  text << (object.pdo_mapping ? " pdo " : " ") << value_text(object.value);
  if (object.low || object.high)
    text << " [" << limit_text(object.low, object.type) << ".." << limit_text(object.high, object.type)
         << ']';
  text << " \"" << object.name << '"';
  return text.str();
}

/// The EDS and DCF files of the corpus, in the order of their names.
inline std::set<std::string> corpus_files() {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(CBCAN_SOURCE_DIR "/tests/descriptions/corpus"))
    if (entry.path().extension() == ".eds" || entry.path().extension() == ".dcf")
      files.insert(entry.path().filename().string());
  return files;
}
inline std::string corpus_text(const std::string& file) {
  return test::source_file("tests/descriptions/corpus/" + file);
}

/// The content of a `.expected` file: the word "diagnostics", one `line: severity: message` a line, the word
/// "objects", one line for each object: index, sub or range of subs, type, access, pdo if mapped, the value
/// in hexadecimal (- if it is empty), [low..high], "name".
inline std::string summary(const descriptions::Result& result) {
  std::ostringstream text;
  text << "diagnostics\n";
  for (const descriptions::Diagnostic& diagnostic : result.diagnostics)
    text << diagnostic.line << ": " << kSeverities.at(static_cast<std::size_t>(diagnostic.severity)) << ": "
         << diagnostic.message << '\n';
  text << "objects\n";
  for (const descriptions::Object& object : result.device.objects)
    text << object_text(object) << '\n';
  return text.str();
}

}  // namespace cbcan::tests
