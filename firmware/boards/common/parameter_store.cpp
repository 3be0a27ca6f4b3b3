// SPDX-License-Identifier: MIT
#include "boards/common/parameter_store.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/manager/network_objects.hpp"

namespace cbcan::boards {

namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint16_t kBoardSettings = 0x0FFF;  ///< below all objects; sub-index 1..
constexpr std::size_t kHeadBytes = 4;
constexpr std::size_t kMostValueBytes = 255;
constexpr std::size_t kMostComputedBytes = 8;

struct Value {
  std::uint16_t index;
  std::uint8_t sub;
  Bytes bytes;
  bool in(std::uint16_t first_index, std::uint16_t last_index) const {
    return first_index <= index && index <= last_index;
  }
};

/// Takes the first value of `rest`; false = there is none.
bool take(Bytes& rest, Value& value) {
  if (rest.size() < kHeadBytes || rest.size() - kHeadBytes < rest[3]) return false;
  value = {static_cast<std::uint16_t>(rest[0] | rest[1] << 8), rest[2], rest.subspan(kHeadBytes, rest[3])};
  rest = rest.subspan(kHeadBytes + rest[3]);
  return true;
}

constexpr bool has_settings(std::uint16_t first_index, std::uint16_t last_index) {
  return last_index == kBoardSettings ||
         (first_index <= object::kFirstManufacturer && object::kFirstManufacturer <= last_index);
}

void put(RecordLog::Writer& writer, const Value& value) {
  writer.put(static_cast<std::uint8_t>(value.index));
  writer.put(static_cast<std::uint8_t>(value.index >> 8));
  writer.put(value.sub);
  writer.put(static_cast<std::uint8_t>(value.bytes.size()));
  for (const std::uint8_t byte : value.bytes)
    writer.put(byte);
}

bool is_parameter(const ObjectEntry& entry) {
  return entry.has(ObjectFlags::kRead) && entry.has(ObjectFlags::kWrite) &&
         !entry.has(ObjectFlags::kSetPoint) && !entry.has(ObjectFlags::kProcess) &&
         !NetworkObjects::is_network(entry.index);
}

/// A record's new content: inside the range the node's present values, or nothing; outside what is stored.
struct Contents final : RecordLog::Source {
  Bytes before;
  const ObjectDictionary* objects;  ///< null: the range is cleared
  const PowerOnValues* power_on;
  std::span<const std::uint16_t> settings;
  std::uint16_t first;
  std::uint16_t last;

  void write_to(RecordLog::Writer& writer) const override {
    Value value;
    for (Bytes rest = before; take(rest, value);) {
      const bool is_setting = value.index == kBoardSettings;
      if (!(is_setting ? has_settings(first, last) : value.in(first, last))) put(writer, value);
    }
    if (objects == nullptr) return;
    for (const ObjectEntry& entry : objects->entries())
      if (is_parameter(entry)) put_entry(writer, entry);
    if (has_settings(first, last)) put_settings(writer);
  }

  void put_entry(RecordLog::Writer& writer, const ObjectEntry& entry) const {
    for (unsigned index = std::max(entry.index, first); index <= std::min(entry.last_index(), last); ++index)
      for (unsigned sub = entry.first_sub; sub <= entry.last_sub; ++sub)
        put_value(writer, static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub));
  }

  void put_value(RecordLog::Writer& writer, std::uint16_t index, std::uint8_t sub) const {
    ObjectEntry entry;
    objects->find(index, sub, entry);
    Bytes bytes = objects->value(entry, sub);
    std::array<std::uint8_t, kMostComputedBytes> computed;
    if (entry.has(ObjectFlags::kComputed)) {
      std::size_t size = 0;
      if (objects->read(index, sub, computed, size, 0) != AbortCode::kNone) return;
      bytes = Bytes(computed).first(size);
    }
    if (bytes.size() <= kMostValueBytes && !power_on->is_power_on(*objects, entry, sub, bytes))
      put(writer, {index, sub, bytes});
  }

  void put_settings(RecordLog::Writer& writer) const {
    for (std::size_t i = 0; i < settings.size(); ++i) {
      const std::uint8_t bytes[] = {static_cast<std::uint8_t>(settings[i]),
                                    static_cast<std::uint8_t>(settings[i] >> 8)};
      put(writer, {kBoardSettings, static_cast<std::uint8_t>(i + 1), bytes});
    }
  }
};

}  // namespace

void ParameterStore::start(bool leave_aside) {
  log_.start();
  left_aside_ = leave_aside;
  if (leave_aside) return;
  std::array<std::uint16_t, kMostSettings> words;
  const std::span stored = std::span(words).first(settings_.size());
  std::ranges::copy(settings_, stored.begin());
  Value value;
  for (Bytes rest = log_.latest(); take(rest, value);)
    if (value.index == kBoardSettings && value.sub - 1u < stored.size() && value.bytes.size() == 2)
      stored[value.sub - 1u] = static_cast<std::uint16_t>(load_little_endian(value.bytes));
  if (valid_(stored)) std::ranges::copy(stored, settings_.begin());
}

AbortCode ParameterStore::save(std::uint16_t first_index, std::uint16_t last_index) {
  const bool good = !has_settings(first_index, last_index) || valid_(settings_);
  return good ? keep(first_index, last_index, true) : AbortCode::kValue;
}

AbortCode ParameterStore::forget(std::uint16_t first_index, std::uint16_t last_index) {
  return keep(first_index, last_index, false);
}

bool ParameterStore::keep_address(std::uint8_t node_id, std::uint8_t bit_rate) {
  if (address_.empty()) return false;
  address_[1] = node_id;
  if (bit_rate != kReservedLssBitRate)
    address_[0] = static_cast<std::uint16_t>(kLssBitRates[bit_rate] / 1000);
  return save(kBoardSettings, kBoardSettings) == AbortCode::kNone;
}

AbortCode ParameterStore::keep(std::uint16_t first_index, std::uint16_t last_index, bool save) {
  Contents contents;
  contents.before = log_.latest();
  contents.objects = save ? objects_ : nullptr;
  contents.power_on = &power_on_;
  contents.settings = settings_;
  contents.first = first_index;
  contents.last = last_index;
  return log_.append(contents);
}

void ParameterStore::load(ObjectDictionary& objects, ObjectHandler& handler, std::uint16_t first_index,
                          std::uint16_t last_index) {
  objects_ = &objects;
  if (left_aside_) return;
  Value value;
  for (Bytes rest = log_.latest(); take(rest, value);) {
    ObjectEntry entry;
    if (!value.in(first_index, last_index) ||
        objects.find(value.index, value.sub, entry) != AbortCode::kNone || !is_parameter(entry) ||
        value.bytes.size() > entry.capacity ||
        (value.bytes.size() < entry.capacity && !entry.has(ObjectFlags::kVariable)))
      continue;
    if (entry.has(ObjectFlags::kComputed))
      handler.on_write(entry, value.sub, value.bytes, 0);
    else
      objects.store(entry, value.sub, value.bytes);
  }
}

}  // namespace cbcan::boards
