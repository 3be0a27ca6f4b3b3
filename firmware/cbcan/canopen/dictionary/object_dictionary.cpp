// SPDX-License-Identifier: MIT
#include "cbcan/canopen/dictionary/object_dictionary.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/copy_bytes.hpp"

namespace cbcan {

namespace {

/// Flags of the entry that find_count() creates.
constexpr std::uint16_t kCount = ObjectFlags::kRead | ObjectFlags::kComputed | ObjectFlags::kCounted;

constexpr std::uint32_t order_of(std::uint16_t index, std::uint8_t sub) {
  return std::uint32_t{index} << 8 | sub;
}

}  // namespace

void restore_values(std::span<const ObjectEntry> entries, std::span<const std::uint8_t> power_on,
                    std::span<std::uint8_t> values, std::uint16_t first_index, std::uint16_t last_index) {
  for (const ObjectEntry& entry : entries) {
    const bool own = entry.has(ObjectFlags::kAsked) && !entry.has(ObjectFlags::kWrite);
    const bool stored = !entry.has(ObjectFlags::kComputed) && !entry.has(ObjectFlags::kProcess) && !own;
    if (entry.index < first_index || entry.index > last_index || !stored) continue;
    const std::size_t from = entry.offset - entry.front();
    const std::size_t bytes = std::size_t{entry.stride()} * entry.count();
    if (from >= power_on.size())
      std::fill_n(values.data() + from, bytes, std::uint8_t{0});
    else
      copy_bytes(power_on.data() + from, values.data() + from, bytes);
  }
}

ObjectDictionary::ObjectDictionary(const Tables& tables, ObjectHandler* handler)
    : tables_(tables), handler_(handler) {}

AbortCode ObjectDictionary::find(std::uint16_t index, std::uint8_t sub, ObjectEntry& entry) const {
  if (found_ >= tables_.entries.size() || !tables_.entries[found_].holds(index, sub)) {
    found_ = search(index, sub);
    if (found_ == tables_.entries.size() || !tables_.entries[found_].holds(index, sub))
      return find_count(index, sub, entry);
  }
  entry = tables_.entries[found_];
  if (entry.more_indices == 0) return AbortCode::kNone;
  entry.offset += static_cast<ObjectSize>(entry.stride() * entry.subs() * (index - entry.index));
  entry.index = index;
  entry.more_indices = 0;
  return AbortCode::kNone;
}

/// The first entry that is not before this object.
std::size_t ObjectDictionary::search(std::uint16_t index, std::uint8_t sub) const {
  const auto found =
      std::partition_point(tables_.entries.begin(), tables_.entries.end(), [&](const ObjectEntry& candidate) {
        return candidate.last_index() < index || (candidate.index <= index && candidate.last_sub < sub);
      });
  return static_cast<std::size_t>(found - tables_.entries.begin());
}

/// Sub-index 0 of a kCounted entry; or the reason why there is none. Its place would be found_: an entry of the
/// same index is at found_ or immediately before it.
AbortCode ObjectDictionary::find_count(std::uint16_t index, std::uint8_t sub, ObjectEntry& entry) const {
  const bool here = found_ != tables_.entries.size() && tables_.entries[found_].has_index(index);
  if (here && sub == 0 && tables_.entries[found_].has(ObjectFlags::kCounted)) {
    entry = {index, 0, tables_.entries[found_].last_sub, DataType::kUnsigned8, 0, kCount, 0, 1};
    return AbortCode::kNone;
  }
  const bool object_here = here || (found_ != 0 && tables_.entries[found_ - 1].has_index(index));
  return object_here ? AbortCode::kNoSubIndex : AbortCode::kNoObject;
}

std::span<std::uint8_t> ObjectDictionary::value(const ObjectEntry& entry, std::uint8_t sub) const {
  if (entry.has(ObjectFlags::kComputed)) return {};
  const std::size_t offset = offset_of(entry, sub);
  if (entry.has(ObjectFlags::kPacked)) return tables_.process.subspan(offset / 8, 1);
  if (entry.has(ObjectFlags::kProcess)) return tables_.process.subspan(offset, entry.capacity);
  std::size_t size = entry.capacity;
  if (entry.has(ObjectFlags::kVariable))
    size = load_word(tables_.values.data() + offset - ObjectEntry::kLengthBytes);
  return tables_.values.subspan(offset, size);
}

AbortCode ObjectDictionary::read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> out,
                                 std::size_t& size, Time now) const {
  ObjectEntry entry;
  if (const AbortCode missing = find(index, sub, entry); missing != AbortCode::kNone) return missing;
  if (!entry.has(ObjectFlags::kRead)) return AbortCode::kWriteOnly;
  if (entry.has(ObjectFlags::kComputed)) {
    if (entry.capacity > out.size() && !entry.has(ObjectFlags::kVariable)) return AbortCode::kReadLength;
    if (sub == 0 && entry.has(ObjectFlags::kCounted)) {
      size = 1;
      out[0] = entry.last_sub;
      return AbortCode::kNone;
    }
    return handler_->on_read(entry, sub, out, size, now);
  }
  const std::span<const std::uint8_t> bytes = value(entry, sub);
  if (bytes.size() > out.size()) return AbortCode::kReadLength;
  copy_bytes(bytes.data(), out.data(), bytes.size());
  if (entry.has(ObjectFlags::kPacked))
    out[0] = static_cast<std::uint8_t>(out[0] >> first_bit(entry, sub) % 8 & 1);
  size = bytes.size();
  return entry.has(ObjectFlags::kAsked) ? handler_->on_read(entry, sub, out, size, now) : AbortCode::kNone;
}

AbortCode ObjectDictionary::write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> bytes,
                                  Time now) {
  ObjectEntry entry;
  if (const AbortCode missing = find(index, sub, entry); missing != AbortCode::kNone) return missing;
  if (!entry.has(ObjectFlags::kWrite)) return AbortCode::kReadOnly;
  if (entry.is_streamed()) return AbortCode::kIncompatible;
  if (const AbortCode bad = check(entry, sub, bytes); bad != AbortCode::kNone) return bad;
  const bool handled = entry.has(ObjectFlags::kChecked) || entry.has(ObjectFlags::kComputed);
  const AbortCode refused = handled ? handler_->on_write(entry, sub, bytes, now) : AbortCode::kNone;
  if (refused != AbortCode::kNone) return refused;
  if (!entry.has(ObjectFlags::kComputed)) store(entry, sub, bytes);
  if (handled) handler_->on_stored(entry, sub, now);
  return AbortCode::kNone;
}

void ObjectDictionary::store(const ObjectEntry& entry, std::uint8_t sub,
                             std::span<const std::uint8_t> bytes) {
  const std::size_t offset = offset_of(entry, sub);
  if (entry.has(ObjectFlags::kPacked))
    return assign_bit(tables_.process[offset / 8], offset % 8, bytes[0] != 0);
  const auto block = entry.has(ObjectFlags::kProcess) ? tables_.process : tables_.values;
  copy_bytes(bytes.data(), block.data() + offset, bytes.size());
  if (entry.has(ObjectFlags::kVariable))
    store_little_endian(tables_.values.subspan(offset - ObjectEntry::kLengthBytes, ObjectEntry::kLengthBytes),
                        bytes.size());
}

AbortCode ObjectDictionary::check_limits(const ObjectEntry& entry, std::uint8_t sub,
                                         std::span<const std::uint8_t> bytes) const {
  if (!kServices.other_devices || !entry.has(ObjectFlags::kLimited) || bytes.empty() || bytes.size() > 8)
    return AbortCode::kNone;
  const auto limits = std::partition_point(
      tables_.limits.begin(), tables_.limits.end(),
      [&](const ObjectLimits& row) { return order_of(row.index, row.sub) < order_of(entry.index, sub); });
  if (limits == tables_.limits.end() || limits->index != entry.index || limits->sub != sub)
    return AbortCode::kNone;
  const std::uint64_t raw = load_little_endian(bytes);
  if (is_signed(entry.type)) {
    const std::int64_t number = sign_extend(raw, bytes.size());
    if (number > limits->high) return AbortCode::kValueHigh;
    return number < limits->low ? AbortCode::kValueLow : AbortCode::kNone;
  }
  if (raw > static_cast<std::uint64_t>(limits->high)) return AbortCode::kValueHigh;
  return raw < static_cast<std::uint64_t>(limits->low) ? AbortCode::kValueLow : AbortCode::kNone;
}

std::uint64_t ObjectDictionary::get(std::uint16_t index, std::uint8_t sub) const {
  ObjectEntry entry;
  return find(index, sub, entry) == AbortCode::kNone ? number(entry, sub) : 0;
}

std::uint64_t ObjectDictionary::number(const ObjectEntry& entry, std::uint8_t sub) const {
  const std::span<const std::uint8_t> bytes = value(entry, sub);
  return bytes.size() <= 8 ? load_little_endian(bytes) : 0;
}

bool ObjectDictionary::set(std::uint16_t index, std::uint8_t sub, std::uint64_t number) {
  ObjectEntry entry;
  if (find(index, sub, entry) != AbortCode::kNone) return false;
  const std::span<std::uint8_t> bytes = value(entry, sub);
  if (bytes.empty() || bytes.size() > 8) return false;
  store_little_endian(bytes, number);
  return true;
}

}  // namespace cbcan
