// SPDX-License-Identifier: MIT
#include "descriptions/attribute_reader.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "base/numbers.hpp"
#include "base/utf8.hpp"
#include "base/words.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "descriptions/diagnostics.hpp"
#include "descriptions/eds_reader.hpp"

namespace cbcan::descriptions {

namespace {

constexpr Key kSizeKey = "CBCAN_Size";

struct AccessName {
  std::string_view name;
  Access access;
};

/// The last two are not in CiA 306, but occur in files.
constexpr std::array<AccessName, 8> kAccessNames = {{{"ro", Access::kReadOnly},
                                                     {"wo", Access::kWriteOnly},
                                                     {"rw", Access::kReadWrite},
                                                     {"rwr", Access::kReadWriteInput},
                                                     {"rww", Access::kReadWriteOutput},
                                                     {"const", Access::kConstant},
                                                     {"r", Access::kReadOnly},
                                                     {"w", Access::kWriteOnly}}};

bool less_than(std::int64_t a, std::int64_t b, DataType type) {
  return is_signed(type) ? a < b : static_cast<std::uint64_t>(a) < static_cast<std::uint64_t>(b);
}

std::int64_t number_in(const Object& object) {
  return from_bits(load_little_endian(object.value), object.type);
}

/// LowLimit and HighLimit are read for these types.
bool has_limits(DataType type) {
  return size_of(type) > 0 && !is_real(type) && type != DataType::kTimeOfDay &&
         type != DataType::kTimeDifference;
}

}  // namespace

std::optional<ObjectType> AttributeReader::object_type(const Section& section) {
  const KeyValue* const entry = section.find("ObjectType");
  if (entry == nullptr) return std::nullopt;
  const std::optional<std::uint64_t> code = values_.number(section, "ObjectType", 0xFF);
  if (!code) return std::nullopt;
  const bool known = *code == 0 || *code == 2 || (*code >= 5 && *code <= 9);
  if (known) return static_cast<ObjectType>(*code);
  findings_.warning(entry->line, "ObjectType " + quoted(entry->value) + " is unknown: VAR is assumed");
  return ObjectType::kVar;
}

Object AttributeReader::read(const Section& section, const Whole& whole, std::uint8_t sub) {
  const bool is_count = sub == 0 && is_structure(whole.type);
  Object object;
  object.index = whole.index;
  object.first_sub = object.last_sub = sub;
  object.line = section.line;
  const KeyValue* const name = section.find("ParameterName");
  object.name = name != nullptr ? ValueReader::text(*name) : base::to_utf8(section.name);
  object.type = data_type(section, whole.index, is_count);
  object.access = access(section);
  object.pdo_mapping = values_.number(section, "PDOMapping", 1).value_or(0) != 0;
  read_capacity(object, section);
  read_value(object, section);
  if (is_count) check_count(object, whole.highest_sub);
  read_limits(object, section);
  if (object.has_value) check_value_against_limits(object);
  return object;
}

DataType AttributeReader::data_type(const Section& section, std::uint16_t index, bool is_count) {
  const std::optional<std::uint64_t> type = values_.number(section, "DataType", 0xFFFF);
  if (type && is_known(*type)) return static_cast<DataType>(*type);
  if (type) {
    findings_.warning(section.find("DataType")->line,
                      "DataType " + base::hex(*type, 4) + "h is unknown: OCTET_STRING is assumed");
    return DataType::kOctetString;
  }
  if (object_type(section) == ObjectType::kDomain) return DataType::kDomain;
  const auto standard = standard_type_ != nullptr ? standard_type_(index) : std::nullopt;
  const DataType assumed = is_count ? DataType::kUnsigned8 : standard.value_or(DataType::kUnsigned32);
  findings_.warning(section.line, bracketed(section.name) +
                                      " has no DataType: " + std::string(name_of(assumed)) + " is assumed");
  return assumed;
}

Access AttributeReader::access(const Section& section) {
  const KeyValue* const entry = section.find("AccessType");
  if (entry == nullptr) {
    if (object_type(section) != ObjectType::kDomain)
      findings_.warning(section.line, bracketed(section.name) + " has no AccessType: rw is assumed");
    return Access::kReadWrite;
  }
  for (const AccessName& known : kAccessNames)
    if (base::same_text(known.name, entry->value)) return known.access;
  findings_.warning(entry->line, "AccessType " + quoted(entry->value) + " is unknown: rw is assumed");
  return Access::kReadWrite;
}

void AttributeReader::read_capacity(Object& object, const Section& section) {
  const std::size_t fixed = size_of(object.type);
  const KeyValue* const entry = section.find(kSizeKey);
  object.capacity = static_cast<std::uint32_t>(fixed);
  if (fixed == 0) object.capacity = object.type == DataType::kDomain ? kDomainCapacity : kStringCapacity;
  if (entry == nullptr) return;
  if (fixed > 0) {
    findings_.warning(entry->line,
                      std::string(kSizeKey.text()) + " is for strings and DOMAINs only: ignored");
    return;
  }
  const auto size = values_.number(section, kSizeKey, kMostCapacity, 1);
  if (!size) return;
  object.capacity = static_cast<std::uint32_t>(*size);
  const bool starts_full = object.type == DataType::kOctetString || object.type == DataType::kDomain;
  if (starts_full) object.value.assign(object.capacity, 0);
}

void AttributeReader::read_value(Object& object, const Section& section) {
  for (const bool configured : {true, false}) {
    const KeyValue* const entry = configured ? section.find("ParameterValue") : section.find("DefaultValue");
    if (entry == nullptr || !set_value(object, section, *entry)) continue;
    object.configured = configured;
    return;
  }
  object.value.resize(std::max(object.value.size(), size_of(object.type)));
}

bool AttributeReader::set_value(Object& object, const Section& section, const KeyValue& entry) {
  std::optional<Value> value = values_.value(entry, object.type);
  if (!value) return false;
  const bool has_size = section.find(kSizeKey) != nullptr;
  const std::uint32_t most = has_size ? object.capacity : kMostCapacity;
  if (value->bytes.size() > most && size_of(object.type) == 0) {
    findings_.warning(entry.line, shortened(entry.key) + " is longer than " + std::to_string(most) +
                                      " bytes: the rest is cut off");
    value->bytes.resize(most);
  }
  object.value = std::move(value->bytes);
  object.has_value = true;
  object.node_ids = value->node_ids;
  object.capacity = std::max(object.capacity, static_cast<std::uint32_t>(object.value.size()));
  return true;
}

void AttributeReader::read_limits(Object& object, const Section& section) {
  if (!has_limits(object.type)) {
    for (const Key key : {Key("LowLimit"), Key("HighLimit")})
      if (const KeyValue* const entry = section.find(key); entry != nullptr && is_real(object.type))
        findings_.warning(entry->line, shortened(entry->key) + " of a " + std::string(name_of(object.type)) +
                                           " is not checked");
    return;
  }
  const auto limit = [&](const Key& key) -> std::optional<std::int64_t> {
    const KeyValue* const entry = section.find(key);
    const auto number = entry == nullptr ? std::nullopt : values_.pattern(*entry, object.type);
    return number ? std::optional(from_bits(number->bits, object.type)) : std::nullopt;
  };
  object.low = limit("LowLimit");
  object.high = limit("HighLimit");
  if (object.low && object.high && less_than(*object.high, *object.low, object.type)) {
    findings_.warning(section.find("LowLimit")->line, "LowLimit is above HighLimit: both are ignored");
    object.low = object.high = std::nullopt;
  }
}

void AttributeReader::check_value_against_limits(const Object& object) {
  const std::int64_t value = number_in(object);
  const bool too_low = object.low && less_than(value, *object.low, object.type);
  const bool too_high = object.high && less_than(*object.high, value, object.type);
  if (too_low || too_high)
    findings_.warning(
        object.line,
        "the value is " + std::string(too_low ? "below LowLimit" : "above HighLimit") + ": it is kept");
}

void AttributeReader::check_count(Object& object, std::uint8_t highest_sub) {
  const bool read_only = object.access == Access::kReadOnly || object.access == Access::kConstant;
  if (!read_only || object.value.empty()) return;
  if (!object.has_value) {
    object.value.front() = highest_sub;
  } else if (number_in(object) != highest_sub) {
    findings_.warning(object.line, "sub-index 0 says " + std::to_string(number_in(object)) +
                                       ", but the highest sub-index is " + std::to_string(highest_sub) +
                                       ": it is kept");
  }
}

}  // namespace cbcan::descriptions
