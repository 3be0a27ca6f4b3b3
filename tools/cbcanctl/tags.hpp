// SPDX-License-Identifier: MIT
#pragma once

/// A network's registers as tags of a PLC: a name, a comment and a place for each mapped object and each
/// status word; as files for makers' tools, and the program that exchanges them.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "descriptions/network_file.hpp"

namespace cbcan::tools {

enum class Direction : std::uint8_t { kInput, kOutput, kStatus };

struct Tag {
  std::string name{};  ///< a letter, then letters, digits and single _; unique if case is ignored, with those
                       ///< of its parts
  std::string comment{};    ///< UTF-8 without control characters
  std::uint16_t first = 0;  ///< register with the first bit, the lowest of the value's
  int shift = 0;            ///< of further registers: to their place in the PLC's memory
  std::uint8_t bit = 0;     ///< in this register
  std::uint8_t bits = 16;
  std::optional<DataType> type{};  ///< nullopt = not known
  Direction direction = Direction::kStatus;
  bool high_first = false;    ///< the words of a value with 32 bits are exchanged
  std::uint8_t node = 0;      ///< 0 = none
  std::string object{};       ///< "6401h:01"
  std::string low{}, high{};  ///< of the EDS; empty = none
};

inline constexpr std::size_t kMostOfName = 32;

/// Status words first, so that no object takes their names; then the objects in the order of the file.
std::vector<Tag> tags_of(const descriptions::PlannedNetwork& network);

/// The whole registers that have a part of the value, as words: NAME, or NAME_w0 (the lowest bits) to
/// NAME_w4.
std::vector<Tag> parts_of(const Tag& tag);

/// One request of a PLC that exchanges these tags.
struct Exchange {
  std::string array;  ///< a name for the words in the PLC
  std::size_t first;  ///< register
  std::size_t words;
  bool is_write;
  int shift = 0;  ///< as of a tag
};

/// Inputs, outputs, status and states of nodes, and further inputs and outputs, as far as there are tags.
std::vector<Exchange> exchanges_of(const std::vector<Tag>& tags);

/// Variables, in the order of kForms; then programs.
enum class Form : std::uint8_t { kCsv, kTiaDb, kXsy, kLogix, kCodesys, kTiaDbScl, kXsySt, kCodesysSt };
inline constexpr std::array<std::string_view, 8> kForms{"csv",     "tia-db",     "xsy",    "logix",
                                                        "codesys", "tia-db-scl", "xsy-st", "codesys-st"};

/// The module, as the PLC's program reaches it.
struct Server {
  std::string host;
  std::uint16_t port = 0;
};

/// The whole file. `at`: first address in the PLC, by default that of the form. Throws UsageError if the form
/// has no such address, or needs the host as an IPv4 address and it is none.
std::string text_of(Form form, const std::vector<Tag>& tags, std::optional<unsigned> at,
                    const Server& server);

}  // namespace cbcan::tools
