// SPDX-License-Identifier: MIT
#include "cbcan/canopen/pdo/mapping.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"

namespace cbcan {

namespace {

constexpr std::uint32_t kMostObjects = 64;
constexpr std::uint32_t kMostBits = 64;
constexpr std::uint16_t kLastDataType = 0x1F;

struct MappedObject {
  std::uint8_t* place = nullptr;  ///< of its value; null = a data type
  std::uint32_t bits = 0;
  std::uint8_t bit = 0;  ///< where in its byte it begins
  bool packed = false;   ///< the other bits of its byte belong to others
};

std::uint32_t bits_of(DataType type, std::size_t bytes) {
  return type == DataType::kBoolean ? 1 : static_cast<std::uint32_t>(8 * bytes);
}

AbortCode find_data_type(bool receive, std::uint16_t index, std::uint8_t sub, MappedObject& object) {
  const auto type = static_cast<DataType>(index);
  object.bits = bits_of(type, size_of(type));
  if (object.bits == 0) return AbortCode::kNoObject;
  if (sub != 0) return AbortCode::kNoSubIndex;
  return receive ? AbortCode::kNone : AbortCode::kNotMappable;
}

AbortCode find_object(const ObjectDictionary& dictionary, bool receive, std::uint16_t index, std::uint8_t sub,
                      MappedObject& object) {
  ObjectEntry entry{};
  if (const AbortCode missing = dictionary.find(index, sub, entry); missing != AbortCode::kNone)
    return missing;
  const bool mappable = entry.has(receive ? ObjectFlags::kMapRpdo : ObjectFlags::kMapTpdo);
  if (!mappable || entry.has(ObjectFlags::kVariable) || entry.has(ObjectFlags::kComputed))
    return AbortCode::kNotMappable;
  object.place = dictionary.value(entry, sub).data();
  object.bits = bits_of(entry.type, entry.capacity);
  object.bit = ObjectDictionary::bit_of(entry, sub);
  object.packed = entry.has(ObjectFlags::kPacked);
  return AbortCode::kNone;
}

AbortCode find_mapped(const ObjectDictionary& dictionary, std::uint16_t mapping_index, std::uint32_t mapped,
                      MappedObject& object) {
  const bool receive = mapping_index < object::kTpdoParameter;
  const auto index = static_cast<std::uint16_t>(mapped >> 16);
  const auto sub = static_cast<std::uint8_t>(mapped >> 8);
  const AbortCode wrong = index <= kLastDataType ? find_data_type(receive, index, sub, object)
                                                 : find_object(dictionary, receive, index, sub, object);
  if (wrong != AbortCode::kNone) return wrong;
  const std::uint32_t bits = mapped & 0xFF;
  return bits != 0 && bits == object.bits ? AbortCode::kNone : AbortCode::kNotMappable;
}

/// The k-th object of a mapping, from 1.
AbortCode find_mapped(const ObjectDictionary& dictionary, std::uint16_t mapping_index, std::uint8_t k,
                      MappedObject& object) {
  const auto mapped = static_cast<std::uint32_t>(dictionary.get(mapping_index, k));
  return find_mapped(dictionary, mapping_index, mapped, object);
}

void copy_bits(const std::uint8_t* from, std::uint32_t from_bit, std::uint8_t* to, std::uint32_t to_bit,
               std::uint32_t count) {
  for (const std::uint32_t end = from_bit + count; from_bit < end; ++from_bit, ++to_bit)
    assign_bit(to[to_bit / 8], to_bit % 8, (from[from_bit / 8] >> from_bit % 8 & 1) != 0);
}

}  // namespace

AbortCode PdoMapping::check(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t mapped) {
  MappedObject object;
  return find_mapped(dictionary, index, mapped, object);
}

AbortCode PdoMapping::resolve(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t count) {
  if (count > kMostObjects) return AbortCode::kMappingLength;
  index_ = index;
  count_ = static_cast<std::uint8_t>(count);
  by_bytes_ = true;
  std::uint32_t bits = 0;
  for (std::uint8_t k = 1; k <= count_; ++k) {
    MappedObject object;
    if (const AbortCode wrong = find_mapped(dictionary, index, k, object); wrong != AbortCode::kNone)
      return wrong;
    if (bits + object.bits > kMostBits) return AbortCode::kMappingLength;
    if (object.bits % 8 != 0) by_bytes_ = false;
    for (std::uint32_t i = 0; by_bytes_ && i < object.bits / 8; ++i)
      places_[bits / 8 + i] = object.place == nullptr ? nullptr : object.place + i;
    bits += object.bits;
  }
  bits_ = static_cast<std::uint8_t>(bits);
  return AbortCode::kNone;
}

void PdoMapping::sample(const ObjectDictionary& dictionary, std::span<std::uint8_t, kMostBytes> data) const {
  if (by_bytes_) {
    for (std::size_t i = 0; i < bytes(); ++i)
      data[i] = *places_[i];
    return;
  }
  std::fill(data.begin(), data.end(), std::uint8_t{0});
  std::uint32_t bit = 0;
  for (std::uint8_t k = 1; k <= count_; ++k) {
    MappedObject object;
    find_mapped(dictionary, index_, k, object);
    copy_bits(object.place, object.bit, data.data(), bit, object.bits);
    bit += object.bits;
  }
}

void PdoMapping::apply(const ObjectDictionary& dictionary,
                       std::span<const std::uint8_t, kMostBytes> data) const {
  if (by_bytes_) {
    for (std::size_t i = 0; i < bytes(); ++i)
      if (places_[i] != nullptr) *places_[i] = data[i];
    return;
  }
  std::uint32_t bit = 0;
  for (std::uint8_t k = 1; k <= count_; ++k) {
    MappedObject object;
    find_mapped(dictionary, index_, k, object);
    if (object.place != nullptr) {
      if (!object.packed) *object.place = 0;  // a BOOLEAN is 0 or 1
      copy_bits(data.data(), bit, object.place, object.bit, object.bits);
    }
    bit += object.bits;
  }
}

bool PdoMapping::holds(const ObjectDictionary& dictionary, const std::uint8_t* place) const {
  if (by_bytes_) {
    for (std::size_t i = 0; i < bytes(); ++i)
      if (places_[i] == place) return true;
    return false;
  }
  for (std::uint8_t k = 1; k <= count_; ++k) {
    MappedObject object;
    find_mapped(dictionary, index_, k, object);
    if (object.place == place) return true;
  }
  return false;
}

}  // namespace cbcan
