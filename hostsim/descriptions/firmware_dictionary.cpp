// SPDX-License-Identifier: MIT
#include "descriptions/firmware_dictionary.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"

namespace cbcan::descriptions {

namespace {

/// An entry, and where its elements begin in the image, with their lengths.
struct EntryRow {
  ObjectEntry entry;
  std::vector<std::size_t> places;
};
using Rows = std::vector<EntryRow>;

bool is_alike(const ObjectEntry& a, const ObjectEntry& b) {
  return a.type == b.type && a.flags == b.flags && a.capacity == b.capacity;
}

/// A string that cannot be written needs no room for a longer one.
EntryRow row_of(const ObjectEntry& entry, const std::vector<std::uint8_t>& values) {
  EntryRow row{entry, {}};
  for (std::uint32_t element = 0; element < entry.count(); ++element)
    row.places.push_back(entry.offset - entry.front() + std::size_t{element} * entry.stride());
  if (entry.has(ObjectFlags::kVariable) && !entry.has(ObjectFlags::kWrite))
    row.entry.capacity = load_word(&values[row.places[0]]);
  return row;
}

void append(std::vector<std::size_t>& places, const EntryRow& more) {
  places.insert(places.end(), more.places.begin(), more.places.end());
}

/// Null: no value with $NODEID begins there.
const NodeIdValue* relative_at(const DictionaryImage& image, std::size_t place) {
  const auto found = std::ranges::find(image.node_id_values, place, &NodeIdValue::offset);
  return found == image.node_id_values.end() ? nullptr : &*found;
}

/// The entries of each index, with alike neighbours in one.
std::vector<Rows> fold_subs(const DictionaryImage& image) {
  std::vector<Rows> objects;
  for (const ObjectEntry& entry : image.entries) {
    if (objects.empty() || objects.back().front().entry.index != entry.index) objects.emplace_back();
    Rows& rows = objects.back();
    const EntryRow row = row_of(entry, image.values);
    if (!rows.empty() && rows.back().entry.last_sub + 1 == entry.first_sub &&
        is_alike(rows.back().entry, row.entry)) {
      rows.back().entry.last_sub = entry.last_sub;
      append(rows.back().places, row);
    } else {
      rows.push_back(row);
    }
  }
  return objects;
}

/// The stack uses the stored sub-index 0 of a mapping and of 1003h.
void fold_count(Rows& rows, const DictionaryImage& image) {
  constexpr std::uint16_t kForbidden = ObjectFlags::kWrite | ObjectFlags::kMapTpdo | ObjectFlags::kLimited;
  const ObjectEntry& count = rows[0].entry;
  if (rows.size() != 2 || is_mapping(count.index) || count.index == object::kErrorHistory) return;
  if (count.last_sub != 0 || count.type != DataType::kUnsigned8 || !count.has(ObjectFlags::kRead) ||
      count.has(kForbidden) || image.values[rows[0].places[0]] != rows[1].entry.last_sub ||
      relative_at(image, rows[0].places[0]) != nullptr)
    return;
  rows[1].entry.flags |= ObjectFlags::kCounted;
  rows.erase(rows.begin());
}

/// The areas that 1010h stores and a reset restores separately.
int area_of(std::uint16_t index) {
  return (index >= object::kFirstManufacturer) + (index >= object::kFirstProfile) +
         (index > object::kLastProfile);
}

bool is_next(const Rows& rows, const Rows& next) {
  const ObjectEntry& last = rows.front().entry;
  const std::uint16_t index = next.front().entry.index;
  return last.last_index() + 1 == index && last.more_indices != 0xFF &&
         area_of(last.index) == area_of(index) &&
         std::ranges::equal(rows, next, [](const EntryRow& a, const EntryRow& b) {
           return is_alike(a.entry, b.entry) && a.entry.first_sub == b.entry.first_sub &&
                  a.entry.last_sub == b.entry.last_sub;
         });
}

Rows fold(const DictionaryImage& image) {
  std::vector<Rows> folded;
  for (Rows& rows : fold_subs(image)) {
    fold_count(rows, image);
    if (folded.empty() || !is_next(folded.back(), rows)) {
      folded.push_back(std::move(rows));
      continue;
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      ++folded.back()[i].entry.more_indices;
      append(folded.back()[i].places, rows[i]);
    }
  }
  Rows all;
  for (Rows& rows : folded)
    std::ranges::move(rows, std::back_inserter(all));
  return all;
}

/// What the application gives: identity, unless it follows the node ID, texts that describe the device, and
/// what the file has no value for.
void mark_asked(DictionaryImage& image) {
  for (ObjectEntry& entry : image.entries) {
    const bool describes = entry.index >= object::kDeviceName && entry.index <= object::kSoftwareVersion;
    const bool identifies = entry.index == object::kIdentity && entry.last_sub != 0 &&
                            relative_at(image, entry.offset) == nullptr;
    if (describes || identifies || entry.has(ObjectFlags::kUnset)) entry.flags |= ObjectFlags::kAsked;
    entry.flags &= static_cast<std::uint16_t>(~ObjectFlags::kUnset);
  }
}

std::span<const std::uint8_t> bytes_at(std::size_t place, const EntryRow& row, const DictionaryImage& image) {
  return std::span(image.values).subspan(place, row.entry.stride());
}

bool is_zero(const EntryRow& row, const DictionaryImage& image) {
  return std::ranges::all_of(row.places, [&](std::size_t place) {
    return relative_at(image, place) == nullptr &&
           std::ranges::all_of(bytes_at(place, row, image), [](auto byte) { return byte == 0; });
  });
}

/// Values that are 0 are the last ones.
FirmwareDictionary laid_out(Rows rows, const DictionaryImage& image) {
  FirmwareDictionary made;
  std::vector<std::pair<std::uint16_t, NodeIdValue>> relative;  // with the index of each
  const auto place_row = [&](EntryRow& row, bool zeros) {
    row.entry.offset = static_cast<std::uint32_t>(made.value_bytes) + row.entry.front();
    for (const std::size_t place : row.places) {
      if (const NodeIdValue* const value = relative_at(image, place))
        relative.push_back(
            {row.entry.index, {static_cast<std::uint32_t>(made.value_bytes), value->factor, value->size}});
      const auto bytes = bytes_at(place, row, image);
      if (!zeros) made.power_on.insert(made.power_on.end(), bytes.begin(), bytes.end());
      made.value_bytes += bytes.size();
    }
  };
  for (const bool zeros : {false, true})
    for (EntryRow& row : rows)
      if (is_zero(row, image) == zeros) place_row(row, zeros);
  for (const EntryRow& row : rows)
    made.entries.push_back(row.entry);
  std::stable_partition(relative.begin(), relative.end(),
                        [](const auto& value) { return value.first <= object::kLastCommunication; });
  for (const auto& [index, value] : relative) {
    made.node_id_values.push_back(value);
    made.communication_node_id_values += index <= object::kLastCommunication;
  }
  return made;
}

}  // namespace

FirmwareDictionary firmware_dictionary(DictionaryImage image) {
  image = prepared(std::move(image));
  mark_mapped(image.entries, ObjectDictionary(image.entries, image.values, nullptr));
  mark_asked(image);
  FirmwareDictionary made = laid_out(fold(image), image);
  made.limits = image.limits;
  made.memory = memory_of(made.entries);
  return made;
}

}  // namespace cbcan::descriptions
