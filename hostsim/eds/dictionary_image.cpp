// SPDX-License-Identifier: MIT
#include "eds/dictionary_image.hpp"

#include <limits>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "eds/values.hpp"

namespace cbcan::eds {

namespace {

std::uint16_t access_flags(Access access) {
  switch (access) {
    case Access::kReadOnly:
    case Access::kConstant: return ObjectFlags::kRead;
    case Access::kWriteOnly: return ObjectFlags::kWrite;
    case Access::kReadWrite:
    case Access::kReadWriteInput:
    case Access::kReadWriteOutput: return ObjectFlags::kReadWrite;
  }
  return ObjectFlags::kReadWrite;
}

std::uint16_t mapping_flags(Access access) {
  switch (access) {
    case Access::kReadOnly:
    case Access::kConstant:
    case Access::kReadWriteInput: return ObjectFlags::kMapTpdo;
    case Access::kWriteOnly:
    case Access::kReadWriteOutput: return ObjectFlags::kMapRpdo;
    case Access::kReadWrite: break;
  }
  return ObjectFlags::kMapRpdo | ObjectFlags::kMapTpdo;
}

bool is_variable(DataType type) {
  return size_of(type) == 0;
}

/// The whole range of the type, as from_bits() returns numbers.
ObjectLimits widest(const Object& object) {
  const std::uint64_t pattern =
      size_of(object.type) >= 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * size_of(object.type)) - 1;
  const std::uint64_t highest_positive = pattern >> 1;
  if (!is_signed(object.type)) return {object.index, 0, 0, static_cast<std::int64_t>(pattern)};
  return {object.index, 0, from_bits(highest_positive + 1, object.type),
          static_cast<std::int64_t>(highest_positive)};
}

ObjectLimits limits_of(const Object& object) {
  ObjectLimits limits = widest(object);
  limits.low = object.low.value_or(limits.low);
  limits.high = object.high.value_or(limits.high);
  return limits;
}

bool is_limited(const Object& object) {
  if (is_variable(object.type) || (!object.low && !object.high)) return false;
  const ObjectLimits all = widest(object);
  const ObjectLimits own = limits_of(object);
  return own.low != all.low || own.high != all.high;
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
  ObjectLimits limits = limits_of(object);
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

std::uint16_t object_flags(const Object& object) {
  unsigned flags = access_flags(object.access);
  if (object.pdo_mapping) flags |= mapping_flags(object.access);
  if (is_variable(object.type)) flags |= ObjectFlags::kVariable;
  if (is_limited(object)) flags |= ObjectFlags::kLimited;
  if (!object.has_value) flags |= ObjectFlags::kUnset;
  return static_cast<std::uint16_t>(flags);
}

DictionaryImage dictionary_image(const DeviceDescription& device) {
  DictionaryImage image;
  for (const Object& object : device.objects)
    if (object.index >= object::kFirstCommunication) append(object, image);
  return image;
}

}  // namespace cbcan::eds
