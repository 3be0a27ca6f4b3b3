// SPDX-License-Identifier: MIT
#include "descriptions/object_sections.hpp"

#include <utility>

#include "base/text.hpp"
#include "descriptions/lexer.hpp"

namespace cbcan::descriptions {

namespace {

/// Longest line in CiA 306, 4.1.
constexpr std::size_t kMostTextBytes = 255;

/// DefaultValue="1x"
std::string key_is(const KeyValue& entry) {
  return shortened(entry.key) + '=' + quoted(entry.value);
}

}  // namespace

std::optional<std::uint64_t> ValueReader::number(const Section& section, const Key& key,
                                                 std::uint64_t highest, std::uint64_t lowest) {
  const KeyValue* const entry = section.find(key);
  return entry == nullptr ? std::nullopt : number(*entry, highest, lowest);
}

std::optional<std::uint64_t> ValueReader::number(const KeyValue& entry, std::uint64_t highest,
                                                 std::uint64_t lowest) {
  const std::optional<Number> number = integer(entry);
  if (!number) return std::nullopt;
  if (!number->negative && number->magnitude >= lowest && number->magnitude <= highest)
    return number->magnitude;
  findings_.warning(entry.line, "{} is not within {}..{}: ignored", key_is(entry), lowest, highest);
  return std::nullopt;
}

std::string ValueReader::text(const KeyValue& entry) {
  return base::to_utf8(base::head(entry.value, kMostTextBytes));
}

std::optional<Pattern> ValueReader::pattern(const KeyValue& entry, DataType type) {
  std::optional<std::uint64_t> bits;
  std::uint32_t node_ids = 0;
  if (is_real(type)) {
    bits = parse_real(without_comment(entry), type);
  } else if (const std::optional<Number> number = integer(entry)) {
    bits = to_bits(*number, type);
    node_ids = number->node_ids;
  } else {
    return std::nullopt;
  }
  if (bits) return Pattern{*bits, node_ids};
  findings_.warning(entry.line, "{} is no {}: ignored", key_is(entry), name_of(type));
  return std::nullopt;
}

std::optional<Value> ValueReader::value(const KeyValue& entry, DataType type) {
  if (const std::size_t size = size_of(type); size > 0) {
    const std::optional<Pattern> number = pattern(entry, type);
    return number ? std::optional(Value{to_bytes(number->bits, size), number->node_ids}) : std::nullopt;
  }
  if (type == DataType::kVisibleString) return Value{{entry.value.begin(), entry.value.end()}};
  if (type == DataType::kUnicodeString) return Value{to_utf16(entry.value)};
  std::optional<std::vector<std::uint8_t>> octets = parse_octets(entry.value);
  if (octets) return Value{std::move(*octets)};
  findings_.warning(entry.line, "{} is not pairs of hexadecimal digits: ignored", key_is(entry));
  return std::nullopt;
}

std::optional<Number> ValueReader::integer(const KeyValue& entry) {
  const std::optional<Number> plain = parse_plain(entry.value);
  return plain ? plain : unusual_integer(entry);
}

std::optional<Number> ValueReader::unusual_integer(const KeyValue& entry) {
  std::optional<Number> number = parse_number(entry.value, node_id_.value_or(0));
  if (!number) number = parse_number(without_comment(entry), node_id_.value_or(0));
  if (!number) {
    findings_.warning(entry.line, "{} is no number of up to 64 bits: ignored", key_is(entry));
    return std::nullopt;
  }
  if (number->no_octal)
    findings_.warning(entry.line, "{} starts like an octal number, but is none: read as decimal",
                      key_is(entry));
  if (number->node_ids != 0 && !node_id_ && !missing_node_id_reported_) {
    findings_.warning(entry.line,
                      "$NODEID is used, but there is no node ID: 0 is used, here and further down");
    missing_node_id_reported_ = true;
  }
  return number;
}

std::string_view ValueReader::without_comment(const KeyValue& entry) {
  const std::size_t comment = entry.value.find(';');
  if (comment == std::string_view::npos) return entry.value;
  findings_.warning(entry.line, "{} has a \";\" in it: what follows is ignored", key_is(entry));
  return base::trim(entry.value.substr(0, comment));
}

}  // namespace cbcan::descriptions
