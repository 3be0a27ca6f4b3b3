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
constexpr unsigned kPortion = 8;  ///< values or entries in one call

constexpr bool has_settings(std::uint16_t first_index, std::uint16_t last_index) {
  return last_index == kBoardSettings ||
         (first_index <= object::kFirstManufacturer && object::kFirstManufacturer <= last_index);
}

bool is_parameter(const ObjectEntry& entry) {
  return entry.has(ObjectFlags::kRead) && entry.has(ObjectFlags::kWrite) &&
         !entry.has(ObjectFlags::kSetPoint) && !entry.has(ObjectFlags::kProcess) &&
         !NetworkObjects::is_network(entry.index);
}

}  // namespace

struct ParameterStore::Value {
  std::uint16_t index;
  std::uint8_t sub;
  Bytes bytes;
  bool in(std::uint16_t first_index, std::uint16_t last_index) const {
    if (index == kBoardSettings) return has_settings(first_index, last_index);
    return first_index <= index && index <= last_index;
  }
};

/// Takes the first value of `rest`; false = there is none.
bool ParameterStore::take(Bytes& rest, Value& value) {
  if (rest.size() < kHeadBytes || rest.size() - kHeadBytes < rest[3]) return false;
  value = {static_cast<std::uint16_t>(rest[0] | rest[1] << 8), rest[2], rest.subspan(kHeadBytes, rest[3])};
  rest = rest.subspan(kHeadBytes + rest[3]);
  return true;
}

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
  const std::array<std::uint16_t, kAddressWords> before{address_[0], address_[1]};
  address_[1] = node_id;
  if (bit_rate != kReservedLssBitRate)
    address_[0] = static_cast<std::uint16_t>(kLssBitRates[bit_rate] / 1000);
  AbortCode answer = AbortCode::kLater;
  while (answer == AbortCode::kLater)
    answer = save(kBoardSettings, kBoardSettings);
  if (answer != AbortCode::kNone) std::ranges::copy(before, address_.begin());
  return answer == AbortCode::kNone;
}

// ---- Saving

AbortCode ParameterStore::keep(std::uint16_t first_index, std::uint16_t last_index, bool save) {
  if (first_index != first_index_ || last_index != last_index_ || save != saves_) log_.restart();
  first_index_ = first_index;
  last_index_ = last_index;
  saves_ = save;
  return log_.append(*this);
}

/// Inside the range the device's present values, or nothing; outside it what is stored.
bool ParameterStore::put_some(RecordLog& log, bool begins) {
  if (begins) {
    before_ = log.latest();
    entry_ = element_ = 0;
  }
  for (unsigned i = 0; i < kPortion; ++i)
    if (!put_next()) return false;
  return true;
}

bool ParameterStore::put_next() {
  if (Value value; take(before_, value)) {
    if (!value.in(first_index_, last_index_)) put(value);
    return true;
  }
  if (!saves_ || objects_ == nullptr) return false;
  if (entry_ < objects_->entries().size()) {
    put_entry(objects_->entries()[entry_]);
    return true;
  }
  if (has_settings(first_index_, last_index_)) put_settings();
  return false;
}

/// Puts the next element of this entry.
void ParameterStore::put_entry(const ObjectEntry& entry) {
  const auto index = static_cast<std::uint16_t>(entry.index + element_ / entry.subs());
  const auto sub = static_cast<std::uint8_t>(entry.first_sub + element_ % entry.subs());
  const bool stored = is_parameter(entry);
  ObjectEntry found;
  if (stored && first_index_ <= index && index <= last_index_) {
    objects_->find(index, sub, found);
    put_value(found, sub);
  }
  if (stored && ++element_ < entry.count()) return;
  ++entry_;
  element_ = 0;
}

void ParameterStore::put_value(const ObjectEntry& entry, std::uint8_t sub) {
  Bytes bytes = objects_->value(entry, sub);
  std::array<std::uint8_t, kMostComputedBytes> computed;
  if (entry.has(ObjectFlags::kComputed)) {
    std::size_t size = 0;
    if (objects_->read(entry.index, sub, computed, size, 0) != AbortCode::kNone) return;
    bytes = Bytes(computed).first(size);
  }
  if (bytes.size() <= kMostValueBytes && !power_on_.is_power_on(*objects_, entry, sub, bytes))
    put({entry.index, sub, bytes});
}

void ParameterStore::put_settings() {
  for (std::size_t i = 0; i < settings_.size(); ++i) {
    const std::uint8_t bytes[] = {static_cast<std::uint8_t>(settings_[i]),
                                  static_cast<std::uint8_t>(settings_[i] >> 8)};
    put({kBoardSettings, static_cast<std::uint8_t>(i + 1), bytes});
  }
}

void ParameterStore::put(const Value& value) {
  log_.put(static_cast<std::uint8_t>(value.index));
  log_.put(static_cast<std::uint8_t>(value.index >> 8));
  log_.put(value.sub);
  log_.put(static_cast<std::uint8_t>(value.bytes.size()));
  for (const std::uint8_t byte : value.bytes)
    log_.put(byte);
}

// ---- Loading

bool ParameterStore::load(ObjectDictionary& objects, ObjectHandler& handler, std::uint16_t first_index,
                          std::uint16_t last_index, std::uint32_t step) {
  objects_ = &objects;
  if (left_aside_) return false;
  if (step == 0) to_load_ = log_.latest();
  for (unsigned i = 0; i < kPortion; ++i) {
    Value value;
    if (!take(to_load_, value)) return false;
    if (value.in(first_index, last_index)) load_value(value, objects, handler);
  }
  return true;
}

void ParameterStore::load_value(const Value& value, ObjectDictionary& objects, ObjectHandler& handler) const {
  ObjectEntry entry;
  if (objects.find(value.index, value.sub, entry) != AbortCode::kNone || !is_parameter(entry) ||
      objects.check(entry, value.sub, value.bytes) != AbortCode::kNone)
    return;
  if (entry.has(ObjectFlags::kComputed))
    handler.on_write(entry, value.sub, value.bytes, 0);
  else
    objects.store(entry, value.sub, value.bytes);
}

}  // namespace cbcan::boards
