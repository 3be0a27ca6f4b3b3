// SPDX-License-Identifier: MIT
#include "eds/dictionary_image.hpp"

#include <array>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "eds/values.hpp"

namespace cbcan::eds {

namespace {

struct AccessFlags {
  std::uint16_t sdo;
  std::uint16_t pdo;  ///< for an object that may be mapped
};
/// By Access.
constexpr std::array<AccessFlags, 6> kAccessFlags{{
    {ObjectFlags::kRead, ObjectFlags::kMapTpdo},
    {ObjectFlags::kWrite, ObjectFlags::kMapRpdo},
    {ObjectFlags::kReadWrite, ObjectFlags::kMapRpdo | ObjectFlags::kMapTpdo},
    {ObjectFlags::kReadWrite, ObjectFlags::kMapTpdo},
    {ObjectFlags::kReadWrite, ObjectFlags::kMapRpdo},
    {ObjectFlags::kRead, ObjectFlags::kMapTpdo},
}};

bool is_variable(DataType type) {
  return size_of(type) == 0;
}

/// The whole range of the type, as from_bits() returns numbers.
ObjectLimits widest(const Object& object) {
  const std::uint64_t pattern = highest_pattern(size_of(object.type));
  const std::uint64_t highest_positive = pattern >> 1;
  if (!is_signed(object.type)) return {object.index, 0, 0, static_cast<std::int64_t>(pattern)};
  return {object.index, 0, from_bits(highest_positive + 1, object.type),
          static_cast<std::int64_t>(highest_positive)};
}

bool is_limited(const Object& object) {
  const ObjectLimits all = widest(object);
  return object.low.value_or(all.low) != all.low || object.high.value_or(all.high) != all.high;
}

/// The flags for access, PDO mapping and a missing value. rwr maps into TPDOs only, rww into RPDOs only (CiA 306,
/// 4.6.3).
std::uint16_t object_flags(const Object& object) {
  const AccessFlags& access = kAccessFlags[static_cast<std::size_t>(object.access)];
  unsigned flags = access.sdo;
  if (object.pdo_mapping) flags |= access.pdo;
  if (is_variable(object.type)) flags |= ObjectFlags::kVariable;
  if (is_limited(object)) flags |= ObjectFlags::kLimited;
  if (!object.has_value) flags |= ObjectFlags::kUnset;
  return static_cast<std::uint16_t>(flags);
}

void append_element(const Object& object, std::vector<std::uint8_t>& values) {
  if (is_variable(object.type)) {
    const std::vector<std::uint8_t> length = to_bytes(object.value.size(), ObjectEntry::kLengthBytes);
    values.insert(values.end(), length.begin(), length.end());
  }
  values.insert(values.end(), object.value.begin(), object.value.end());
  values.resize(values.size() + object.capacity - object.value.size());
}

void append(const Object& object, DictionaryImage& image) {
  const std::size_t ahead = is_variable(object.type) ? ObjectEntry::kLengthBytes : 0;
  image.entries.push_back({object.index, object.first_sub, object.last_sub, object.type, 0,
                           object_flags(object), static_cast<std::uint32_t>(image.values.size() + ahead),
                           object.capacity});
  ObjectLimits limits = widest(object);
  limits.low = object.low.value_or(limits.low);
  limits.high = object.high.value_or(limits.high);
  for (unsigned sub = object.first_sub; sub <= object.last_sub; ++sub) {
    if (object.node_ids != 0)
      image.node_id_values.push_back({static_cast<std::uint32_t>(image.values.size()), object.node_ids,
                                      static_cast<std::uint8_t>(object.value.size())});
    append_element(object, image.values);
    limits.sub = static_cast<std::uint8_t>(sub);
    if (is_limited(object)) image.limits.push_back(limits);
  }
}

}  // namespace

DictionaryImage dictionary_image(const DeviceDescription& device) {
  DictionaryImage image;
  for (const Object& object : device.objects)
    if (object.index >= object::kFirstCommunication) append(object, image);
  return image;
}

}  // namespace cbcan::eds
