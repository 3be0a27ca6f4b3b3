// SPDX-License-Identifier: MIT
#include "cbcan/canopen/manager/network_objects.hpp"

#include <algorithm>

#include "cbcan/canopen/sdo/crc16.hpp"

namespace cbcan {

namespace {

/// It is what the object's type requires.
bool is_value(std::uint16_t index, NetworkObjects::Bytes value) {
  if (value.empty()) return true;  // not set
  const std::size_t entries = value.size() / RpdoSource::kEntryBytes;
  switch (index) {
    case object::kConciseDcf: return ConciseDcf(value).is_valid();
    case object::kRpdoSource:
      return value.size() == RpdoSource::kHead + entries * RpdoSource::kEntryBytes &&
             entries <= RpdoSource::kMostEntries && value[0] <= nmt::kMaxNode &&
             RpdoSource::bits(value) <= 64;
    case object::kOutputsMode: return value.size() == 1 && OutputsMode::is_valid(value[0]);
    case object::kRestoreConfiguration:
    case object::kSlaveLss: return value.size() == 1;
    case object::kSlaveSdoTimeout: return value.size() == 2;
    default: return !NetworkObjects::is_network(index) || value.size() == 4;
  }
}

}  // namespace

std::size_t RpdoSource::bits(std::span<const std::uint8_t> source) {
  std::size_t bits = 0;
  for (std::size_t at = kHead; at < source.size(); at += kEntryBytes)
    bits += source[at];
  return bits;
}

bool NetworkObjects::use(std::span<std::uint8_t> memory, std::size_t used) {
  memory = memory.first(std::min(memory.size(), kMostBytes));
  if (used == 0 && memory.size() >= ConciseDcf::kFirst + kCheckBytes) {
    used = ConciseDcf::kFirst + kCheckBytes;  // without objects all of it is 0
    std::ranges::fill(memory.first(used), std::uint8_t{0});
  }
  return used <= memory.size() && take(memory.first(used), memory);
}

bool NetworkObjects::take(Bytes image, std::span<std::uint8_t> memory) {
  const std::size_t size = ConciseDcf(image).length();
  const bool whole = size != 0 && size <= kMostBytes && image.size() - size >= kCheckBytes &&
                     load_little_endian(image.subspan(size, kCheckBytes)) == crc16(image.first(size));
  dcf_ = ConciseDcf(image.first(size));
  memory_ = memory;
  if (whole && find_groups()) return true;
  dcf_ = ConciseDcf(kEmpty);
  memory_ = {};
  find_groups();
  return false;
}

/// False: the objects of a node are not together, one of no node follows them, or one has not its type's
/// length.
bool NetworkObjects::find_groups() {
  group_.fill(0);
  first_group_ = dcf_.size();
  std::uint8_t last = 0;
  for (std::size_t at = ConciseDcf::kFirst; at < dcf_.size(); at = dcf_.after(at)) {
    const ConciseDcf::Entry entry = dcf_.at(at);
    const bool is_checked_later = entry.index == object::kConciseDcf;  // it fails its node alone
    if (!is_checked_later && !is_value(entry.index, entry.value)) return false;
    const std::uint8_t group = group_of(entry);
    if (group == last) continue;
    if (group == 0 || group_[group] != 0) return false;
    if (last == 0) first_group_ = at;
    group_[group] = static_cast<std::uint16_t>(at);
    last = group;
  }
  return true;
}

/// size() = not set.
std::size_t NetworkObjects::offset_of(std::uint16_t index, std::uint8_t sub) const {
  const std::uint8_t group = group_of({index, sub, {}});
  std::size_t at = group == 0 ? ConciseDcf::kFirst : group_[group];
  if (at == 0) return dcf_.size();
  for (; at < dcf_.size(); at = dcf_.after(at)) {
    const ConciseDcf::Entry entry = dcf_.at(at);
    if (group_of(entry) != group) return dcf_.size();
    if (entry.index == index && entry.sub == sub) return at;
  }
  return at;
}

NetworkObjects::Bytes NetworkObjects::find(std::uint16_t index, std::uint8_t sub) const {
  const std::size_t at = offset_of(index, sub);
  return at == dcf_.size() ? Bytes{} : dcf_.at(at).value;
}

std::size_t NetworkObjects::end_of(std::uint8_t group) const {
  if (group == 0) return first_group_;
  std::size_t at = group_[group];
  if (at == 0) return dcf_.size();
  while (at < dcf_.size() && group_of(dcf_.at(at)) == group)
    at = dcf_.after(at);
  return at;
}

AbortCode NetworkObjects::write(std::uint16_t index, std::uint8_t sub, Bytes value) {
  if (!is_value(index, value)) return AbortCode::kValue;
  if (memory_.empty()) return AbortCode::kReadOnly;
  const std::size_t found = offset_of(index, sub);
  const std::size_t removed = found == dcf_.size() ? 0 : dcf_.after(found) - found;
  const bool kept = std::any_of(value.begin(), value.end(), [](std::uint8_t byte) { return byte != 0; });
  const std::size_t added = kept ? ConciseDcf::kHeader + value.size() : 0;
  if (dcf_.size() - removed + added > memory_.size()) return AbortCode::kStore;
  const std::size_t at = removed != 0 ? found : end_of(group_of({index, sub, {}}));
  replace(at, removed, added);
  if (kept) {
    std::uint8_t* const header = &memory_[at];
    store_little_endian({header, 2}, index);
    header[2] = sub;
    store_little_endian({header + 3, 4}, value.size());
    std::copy(value.begin(), value.end(), header + ConciseDcf::kHeader);
  }
  find_groups();
  return AbortCode::kNone;
}

/// Makes room, or closes it, and counts the objects.
void NetworkObjects::replace(std::size_t at, std::size_t removed, std::size_t added) {
  const std::size_t size = dcf_.size();
  std::uint8_t* const from = memory_.data() + at + removed;
  std::uint8_t* const end = memory_.data() + size;
  if (added > removed)
    std::copy_backward(from, end, end + (added - removed));
  else
    std::copy(from, end, memory_.data() + at + added);
  const std::uint32_t count = load_word(memory_.data()) + (added != 0) - (removed != 0);
  store_little_endian(memory_.first(ConciseDcf::kFirst), count);
  dcf_ = ConciseDcf(memory_.first(size - removed + added));
}

}  // namespace cbcan
