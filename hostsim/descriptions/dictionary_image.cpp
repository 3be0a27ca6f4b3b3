// SPDX-License-Identifier: MIT
#include "descriptions/dictionary_image.hpp"

#include <algorithm>
#include <array>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "descriptions/eds_reader.hpp"
#include "descriptions/values.hpp"

namespace cbcan::descriptions {

namespace {

struct AccessFlags {
  std::uint16_t sdo;
  std::uint16_t pdo;  ///< for an object that may be mapped
};
/// Flags by Access.
constexpr std::array<AccessFlags, 6> kAccessFlags{{
    {ObjectFlags::kRead, ObjectFlags::kMapTpdo},
    {ObjectFlags::kWrite, ObjectFlags::kMapRpdo},
    {ObjectFlags::kReadWrite, ObjectFlags::kMapRpdo | ObjectFlags::kMapTpdo},
    {ObjectFlags::kReadWrite, ObjectFlags::kMapTpdo},
    {ObjectFlags::kReadWrite, ObjectFlags::kMapRpdo},
    {ObjectFlags::kRead, ObjectFlags::kMapTpdo},
}};

/// Most bytes of a piece of a streamed download, and of a sub-block.
constexpr std::uint32_t kPieceCapacity = 18 * 7;

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

/// The flags for access, PDO mapping and a missing value. rwr maps into TPDOs only, rww into RPDOs only (CiA
/// 306, 4.6.3).
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

/// What a default mapping names may be mapped, also with PDOMapping=0: real files contradict themselves.
void allow_mapped(const Object& mapping, std::vector<ObjectEntry>& entries) {
  const bool receive = mapping.index < object::kTpdoParameter;
  const std::uint64_t mapped = load_little_endian(mapping.value);
  const auto sub = static_cast<std::uint8_t>(mapped >> 8);
  for (auto entry = std::ranges::lower_bound(entries, mapped >> 16, {}, &ObjectEntry::index);
       entry != entries.end() && entry->index == mapped >> 16; ++entry)
    if (entry->first_sub <= sub && sub <= entry->last_sub &&
        entry->has(receive ? ObjectFlags::kWrite : ObjectFlags::kRead))
      entry->flags |= receive ? ObjectFlags::kMapRpdo : ObjectFlags::kMapTpdo;
}

/// The value fits its type with every node ID, and nothing but the value depends on it.
bool follows_node_id(const Object& object) {
  if (object.node_ids == 0) return true;
  const std::int64_t value = from_bits(load_little_endian(object.value), object.type);
  const std::uint64_t highest = highest_pattern(object.value.size()) >> (is_signed(object.type) ? 1 : 0);
  const std::uint64_t most = std::uint64_t{object.node_ids} * nmt::kMaxNode;
  const bool may_be_count = object.last_sub == 0 && object.value.size() == 1;
  const bool is_checked = object.low || object.high || may_be_count;
  return !is_checked && value >= 0 && most <= highest && static_cast<std::uint64_t>(value) <= highest - most;
}

/// A DOMAIN that can only be written, as CiA 302-3 has it.
bool is_program_data(const ObjectEntry& entry) {
  return entry.index == object::kProgramData && entry.type == DataType::kDomain &&
         entry.has(ObjectFlags::kWrite) && !entry.has(ObjectFlags::kRead);
}

void prepare_program(ObjectEntry& entry) {
  if (is_program_data(entry)) {
    entry.flags = ObjectFlags::kWrite | ObjectFlags::kComputed | ObjectFlags::kStreamed;
    entry.capacity = 0;
  }
  if (is_program_number(entry.index)) entry.flags |= ObjectFlags::kComputed | ObjectFlags::kSetPoint;
}

}  // namespace

DictionaryImage dictionary_image(const DeviceDescription& device) {
  DictionaryImage image;
  for (const Object& object : device.objects)
    if (object.index >= object::kFirstCommunication) append(object, image);
  for (const Object& object : device.objects)
    if (is_mapping(object.index) && object.first_sub != 0) allow_mapped(object, image.entries);
  return image;
}

bool only_values_differ(std::string_view text, const std::vector<Object>& objects) {
  std::size_t found = 0;
  for (const Object& object : objects)
    found += object.node_ids;
  return found == static_cast<std::size_t>(std::ranges::count(text, '$')) &&
         std::ranges::all_of(objects, follows_node_id);
}

DictionaryImage prepared(DictionaryImage image) {
  const bool programs = std::ranges::any_of(image.entries, is_program_data);
  for (ObjectEntry& entry : image.entries) {
    entry.flags |= ObjectFlags::kChecked;
    const bool is_command = entry.index == object::kStore || entry.index == object::kRestore;
    if (is_command && entry.first_sub != 0) entry.flags |= ObjectFlags::kComputed;
    if (is_command || entry.index == object::kErrorHistory) entry.flags |= ObjectFlags::kSetPoint;
    if (programs && entry.first_sub != 0) prepare_program(entry);
  }
  return image;
}

void mark_mapped(std::vector<ObjectEntry>& entries, const ObjectDictionary& dictionary) {
  for (const ObjectEntry& mapping : entries)
    for (unsigned sub = mapping.first_sub; is_mapping(mapping.index) && sub <= mapping.last_sub; ++sub) {
      const std::uint64_t mapped = dictionary.get(mapping.index, static_cast<std::uint8_t>(sub));
      for (ObjectEntry& entry : entries)
        if (entry.index == mapped >> 16 && entry.first_sub <= (mapped >> 8 & 0xFF) &&
            (mapped >> 8 & 0xFF) <= entry.last_sub)
          entry.flags |= ObjectFlags::kSetPoint;
    }
}

DeviceMemory memory_of(const std::vector<ObjectEntry>& entries) {
  DeviceMemory memory{.rpdos = Pdo::count(entries, object::kRpdoParameter),
                      .tpdos = Pdo::count(entries, object::kTpdoParameter)};
  for (const ObjectEntry& entry : entries) {
    const bool given = entry.has(ObjectFlags::kAsked) && entry.has(ObjectFlags::kVariable);
    memory.largest_value =
        std::max<std::size_t>({memory.largest_value, entry.capacity, given ? kStringCapacity : 0,
                               entry.has(ObjectFlags::kStreamed) ? kPieceCapacity : 0});
    if (is_mapping(entry.index))
      memory.objects_of_pdo =
          std::max(memory.objects_of_pdo, std::min<std::size_t>(entry.last_sub, PdoMapping::kMostObjects));
    if (entry.index == object::kConsumerHeartbeatTime) memory.watched_nodes = entry.last_sub;
  }
  return memory;
}

bool is_mapping(std::uint16_t index) {
  return (index >= object::kRpdoMapping && index < object::kTpdoParameter) ||
         (index >= object::kTpdoMapping && index <= object::kLastPdo);
}

}  // namespace cbcan::descriptions
