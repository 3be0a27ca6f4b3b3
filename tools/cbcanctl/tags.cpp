// SPDX-License-Identifier: MIT
#include "cbcanctl/tags.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "base/text.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::tools {

namespace {

constexpr std::size_t kRegisterBits = 16;
constexpr std::size_t kMostOfNode = 12;
constexpr std::size_t kMostOfComment = 300;
constexpr std::size_t kMostRead = 125;  ///< registers of a request, FC 3
constexpr std::size_t kMostFurther = regmap::kFurtherWords / 2;
/// Further registers are in the PLC's memory as if they began with this one, after the program's words.
constexpr int kFurtherPlace = regmap::kProcessFirst + 320;

/// Keywords, types and functions of IEC 61131-3 that continue after a _, such as END_IF and R_TRIG: no node
/// has such a name.
constexpr std::string_view kBegins =
    " ADD AND BCD BOOL BYTE CHAR CONCAT CTD CTU CTUD DATE DIV DINT DT DWORD END F FUNCTION INT IS LDATE LDT "
    "LINT LREAL LTIME "
    "LTOD LWORD MUL OR R READ REAL SINT SUB TIME TO TOD TRUNC UDINT UINT ULINT USINT VAR WORD WSTRING STRING "
    "CBCAN ";

constexpr bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return text;
}

/// Identifier of at most `most` letters, digits and single _ between them.
std::string identifier(std::string_view text, std::size_t most) {
  std::string name;
  for (const char c : text)
    if (is_letter(c) || is_digit(c))
      name += c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  name.resize(std::min(name.size(), most));
  if (name.ends_with('_')) name.pop_back();
  return name;
}

std::size_t registers_of(const Tag& tag) {
  return (tag.bit + tag.bits + kRegisterBits - 1) / kRegisterBits;
}

std::string name_of_part(const std::string& name, std::size_t word) {
  return fmt::format("{}_w{}", name, word);
}

std::string name_of(const descriptions::PlannedNode& node) {
  std::string name = identifier(node.name, kMostOfNode);
  const bool is_reserved = kBegins.find(" " + upper(name) + " ") != std::string_view::npos;
  if (name.empty() || is_reserved) return fmt::format("n{}", node.id);
  return is_digit(name.front()) ? "n" + name : name;
}

class Names {
 public:
  /// Gives the tag its name: `wanted`, or the same with `object` or a number, whichever is free first.
  void give(Tag& tag, const std::string& wanted, const std::string& object) {
    const std::size_t words = registers_of(tag);
    const std::size_t most = kMostOfName - (words > 1 ? name_of_part({}, 0).size() : 0);
    for (unsigned number = 0;; ++number) {
      const std::string suffix = number == 0 ? "" : number == 1 ? "_" + object : fmt::format("_{}", number);
      tag.name = identifier(wanted, most - suffix.size()) + suffix;
      if (take(tag.name, words)) return;
    }
  }

 private:
  bool take(const std::string& name, std::size_t words) {
    std::vector<std::string> all{upper(name)};
    for (std::size_t word = 0; words > 1 && word < words; ++word)
      all.push_back(upper(name_of_part(name, word)));
    if (std::ranges::any_of(all, [this](const std::string& each) { return taken_.contains(each); }))
      return false;
    taken_.insert(all.begin(), all.end());
    return true;
  }

  std::set<std::string> taken_;  ///< in capitals
};

std::string comment_of(const std::string& text) {
  return std::string(base::head(base::to_utf8(text), kMostOfComment));
}

class Tags {
 public:
  void add_status(const descriptions::PlannedNetwork& network) {
    constexpr std::size_t kOfNodes = regmap::kStatusFirst + regmap::kStatusNodes;
    for (const regmap::RegisterRow& row : regmap::kStatus) {
      if (row.first == row.last && row.first < kOfNodes)
        add_word(row.first, 0, std::string(row.name), std::string(row.meaning));
      if (row.first != row.last && row.first != kOfNodes) add_map(row, network);
    }
    for (const descriptions::PlannedNode& node : network.all)
      add_word(
          kOfNodes + node.id, node.id, "NODE_" + name_of(node),
          fmt::format("node {}: NMT state in the low byte; its step in the high byte, 1 = running", node.id));
  }

  void add(const descriptions::PlannedNetwork& network, const descriptions::PlannedNode& node,
           const descriptions::PlannedPdo& pdo) {
    const std::size_t first = descriptions::register_of(network, pdo);
    std::size_t bits = pdo.at % 2u * 8;
    for (const descriptions::MappedObject& mapped : pdo.objects) {
      Tag tag{.first = static_cast<std::uint16_t>(first + bits / kRegisterBits),
              .shift = pdo.at < descriptions::kFurtherAt ? 0 : kFurtherPlace - network.further_first,
              .bit = static_cast<std::uint8_t>(bits % kRegisterBits),
              .bits = mapped.bits,
              .direction = pdo.input() ? Direction::kInput : Direction::kOutput,
              .high_first = network.words == descriptions::Words::kHighFirst && mapped.bits == 32,
              .node = node.id,
              .object = fmt::format("{:04X}h:{:02X}", mapped.index, mapped.sub)};
      bits += mapped.bits;
      describe(tag, mapped.object);
      const std::string object = fmt::format("{:04X}_{:02X}", mapped.index, mapped.sub);
      const std::string name = identifier(mapped.object == nullptr ? "" : mapped.object->name, kMostOfName);
      names_.give(tag, fmt::format("{}_{}", name_of(node), name.empty() ? "o" + object : name), object);
      all.push_back(std::move(tag));
    }
  }

  std::vector<Tag> all{};

 private:
  /// Adds the registers that have a bit of a listed node.
  void add_map(const regmap::RegisterRow& row, const descriptions::PlannedNetwork& network) {
    std::set<std::size_t> parts;
    for (const descriptions::PlannedNode& node : network.all)
      parts.insert(node.id / kRegisterBits);
    for (const std::size_t part : parts) {
      const std::size_t first = kRegisterBits * part;
      add_word(row.first + part, 0, fmt::format("{}_{}", row.name, part),
               fmt::format("nodes {} to {}: {}", first, first + kRegisterBits - 1, row.meaning));
    }
  }

  void add_word(std::size_t first, std::uint8_t node, const std::string& name, const std::string& comment) {
    Tag tag{.comment = comment_of(comment), .first = static_cast<std::uint16_t>(first), .node = node};
    names_.give(tag, "cbcan_" + name, std::to_string(node));
    all.push_back(std::move(tag));
  }

  static void describe(Tag& tag, const descriptions::Object* object) {
    tag.comment = fmt::format("node {} {}", tag.node, tag.object);
    if (object == nullptr) return;
    tag.type = object->type;
    const auto text = [&](const std::optional<std::int64_t>& limit) {
      if (!limit) return std::string();
      return is_signed(object->type) ? std::to_string(*limit)
                                     : std::to_string(static_cast<std::uint64_t>(*limit));
    };
    tag.low = text(object->low);
    tag.high = text(object->high);
    tag.comment = comment_of(fmt::format("{} {}", tag.comment, object->name));
    if (object->low && object->high) tag.comment += fmt::format(" [{}..{}]", tag.low, tag.high);
  }

  Names names_{};
};

}  // namespace

std::vector<Tag> tags_of(const descriptions::PlannedNetwork& network) {
  Tags tags;
  tags.add_status(network);
  for (const descriptions::PlannedNode& node : network.all)
    for (const descriptions::PlannedPdo& pdo : node.pdos)
      tags.add(network, node, pdo);
  return std::move(tags.all);
}

std::vector<Tag> parts_of(const Tag& tag) {
  const std::size_t words = registers_of(tag);
  std::vector<Tag> parts(words, tag);
  for (std::size_t word = 0; word < words; ++word) {
    Tag& part = parts[word];
    const std::size_t from = word == 0 ? 0 : kRegisterBits * word - tag.bit;
    const std::size_t last = std::min<std::size_t>(kRegisterBits * (word + 1) - tag.bit, tag.bits) - 1;
    part.first = static_cast<std::uint16_t>(tag.first + (tag.high_first ? words - 1 - word : word));
    part.bits = kRegisterBits;
    part.type.reset();
    if (words > 1) part.name = name_of_part(tag.name, word);
    const std::size_t place = word == 0 ? tag.bit : 0;
    part.comment += tag.bits == 1 ? fmt::format(" (bit {})", place)
                                  : fmt::format(" (its bits {}..{} from bit {} on)", from, last, place);
    part.bit = 0;
  }
  return parts;
}

std::vector<Exchange> exchanges_of(const std::vector<Tag>& tags) {
  constexpr std::size_t kOfNodes = regmap::kStatusFirst + regmap::kStatusNodes;
  const auto has = [&](Direction direction) {
    return std::ranges::find(tags, direction, &Tag::direction) != tags.end();
  };
  const std::size_t end = std::ranges::max(tags, {}, &Tag::first).first + std::size_t{1};
  std::vector<Exchange> all;
  if (has(Direction::kInput))
    all.push_back({"cbcan_in_words", regmap::kProcessFirst, regmap::kInputWords, false});
  if (has(Direction::kOutput))
    all.push_back(
        {"cbcan_out_words", regmap::kProcessFirst + regmap::kInputWords, regmap::kOutputWords, true});
  all.push_back({"cbcan_status_words", regmap::kStatusFirst, regmap::kStatusNodes, false});
  if (end > kOfNodes) all.push_back({"cbcan_states", kOfNodes, std::min(end - kOfNodes, kMostRead), false});
  if (end > kOfNodes + kMostRead)
    all.push_back({"cbcan_last_states", kOfNodes + kMostRead, end - kOfNodes - kMostRead, false});
  for (const Direction direction : {Direction::kInput, Direction::kOutput}) {
    const auto end_of = [&](const Tag& tag) {
      return tag.shift != 0 && tag.direction == direction ? tag.first + registers_of(tag) : 0;
    };
    const Tag& last = std::ranges::max(tags, {}, end_of);
    const bool is_write = direction == Direction::kOutput;
    std::size_t first =
        kFurtherPlace + (is_write ? regmap::kFurtherWords : 0) - static_cast<std::size_t>(last.shift);
    for (unsigned number = 2; first < end_of(last); ++number, first += kMostFurther)
      all.push_back({fmt::format("cbcan_{}_words_{}", is_write ? "out" : "in", number), first,
                     std::min(end_of(last) - first, kMostFurther), is_write, last.shift});
  }
  return all;
}

}  // namespace cbcan::tools
