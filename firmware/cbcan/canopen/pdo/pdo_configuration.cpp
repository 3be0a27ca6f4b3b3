// SPDX-License-Identifier: MIT
// The objects 1400h.., 1600h.., 1800h.. and 1A00h..: what may be written, and what it means.
#include <utility>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "cbcan/canopen/sync.hpp"

namespace cbcan {

namespace {

constexpr std::uint16_t kNumberMask = 0x1FF;
/// Set in mappings 1600h, 1A00h; not in parameters 1400h, 1800h.
constexpr std::uint16_t kMappingBit = 0x200;

// Sub-indices of 1400h+n and 1800h+n.
constexpr std::uint8_t kCobId = 1;
constexpr std::uint8_t kType = 2;
constexpr std::uint8_t kInhibitTime = 3;
constexpr std::uint8_t kEventTimer = 5;
constexpr std::uint8_t kStartValue = 6;

constexpr std::uint32_t kTimerUnit = 1000;  // us

constexpr bool is_receive(std::uint16_t index) {
  return index < object::kTpdoParameter;
}

constexpr bool is_valid(std::uint32_t cob_id) {
  return (cob_id & cob::kInvalid) == 0 && cob::is_usable(cob_id);
}

/// 1400h, 1600h, 1800h or 1A00h: the first index of its range.
constexpr std::uint16_t first_of(std::uint16_t index) {
  return static_cast<std::uint16_t>(index & ~kNumberMask);
}

constexpr std::uint16_t number_of(std::uint16_t index) {
  return static_cast<std::uint16_t>(index & kNumberMask);
}

template <class Room>
Room* find_number(std::span<Room> pdos, std::uint32_t number) {
  for (Room& pdo : pdos)
    if (pdo.number == number) return &pdo;
  return nullptr;
}

}  // namespace

std::size_t Pdo::count(std::span<const ObjectEntry> entries, std::uint16_t first) {
  std::size_t count = 0;
  std::uint16_t previous = 0;
  for (const ObjectEntry& entry : entries) {
    if (first_of(entry.index) == first && entry.index != previous) count += entry.more_indices + 1u;
    previous = entry.index;
  }
  return count;
}

void Pdo::reset(std::uint8_t /*node_id*/, Time now) {
  on_state(nmt::State::kInitialising, now);
  std::size_t rpdos = 0;
  std::size_t tpdos = 0;
  std::uint16_t previous = 0;
  for (const ObjectEntry& entry : dictionary_.entries()) {
    if (entry.index == std::exchange(previous, entry.index)) continue;
    for (std::uint32_t more = 0; more <= entry.more_indices; ++more) {
      const auto index = static_cast<std::uint16_t>(entry.index + more);
      if (first_of(index) == object::kRpdoParameter && rpdos < room_.rpdos.size())
        room_.rpdos[rpdos++].begin(number_of(index));
      else if (first_of(index) == object::kTpdoParameter && tpdos < room_.tpdos.size())
        room_.tpdos[tpdos++].begin(number_of(index));
    }
  }
  rpdos_ = room_.rpdos.first(rpdos);
  tpdos_ = room_.tpdos.first(tpdos);
}

bool Pdo::load_one(std::size_t k, Time now) {
  begin(now);
  if (k == rpdos_.size() + tpdos_.size()) {
    index_rpdos();
    find_tpdos();
    return false;
  }
  if (k < rpdos_.size())
    load(rpdos_[k], true);
  else
    load(tpdos_[k - rpdos_.size()], true);
  return true;
}

AbortCode Pdo::check(std::uint16_t object, std::uint8_t sub, std::uint32_t value) const {
  const auto index = static_cast<std::uint16_t>(object & ~kMappingBit);
  const std::uint32_t cob_id = parameter(index, kCobId);
  const AbortCode unless_invalid = is_valid(cob_id) ? AbortCode::kDeviceState : AbortCode::kNone;
  if (object != index)
    return unless_invalid != AbortCode::kNone ? unless_invalid : check_mapping(object, sub, value);
  switch (sub) {
    case kCobId: return check_cob_id(index, value, cob_id);
    case kType: return is_type(index, value) ? AbortCode::kNone : AbortCode::kValue;
    case kInhibitTime: return is_receive(index) ? AbortCode::kNone : unless_invalid;
    case kStartValue: return value > Sync::kHighestCounter ? AbortCode::kValue : unless_invalid;
    default: return AbortCode::kNone;
  }
}

AbortCode Pdo::check_mapping(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const {
  if (sub == 0) return take_mapping(static_cast<std::uint16_t>(index & ~kMappingBit), value, true);
  if (parameter(index, 0) != 0) return AbortCode::kDeviceState;
  return value == 0 ? AbortCode::kNone : PdoMapping::check(dictionary_, index, value);
}

AbortCode Pdo::check_cob_id(std::uint16_t index, std::uint32_t value, std::uint32_t current) const {
  if ((value & cob::kReserved) != 0) return AbortCode::kValue;
  if ((value & cob::kInvalid) != 0) return AbortCode::kNone;
  if (!cob::is_usable(value)) return AbortCode::kValue;
  if (is_valid(current))
    return cob::id_of(value) == cob::id_of(current) ? AbortCode::kNone : AbortCode::kValue;
  return has_mapping(index) ? AbortCode::kNone : AbortCode::kDeviceState;
}

/// Resolves the `count` mapped objects of the PDO with parameters `index`, which is not valid, for when it
/// becomes valid; if that has been done already, only with `again`.
AbortCode Pdo::take_mapping(std::uint16_t index, std::uint32_t count, bool again) const {
  PdoMapping without_room;
  PdoMapping* mapping = &without_room;
  std::span<PdoMapping::Piece> pieces;
  if (Rpdo* const rpdo = is_receive(index) ? find_number(rpdos_, number_of(index)) : nullptr) {
    mapping = &rpdo->mapping;
    pieces = pieces_of(static_cast<std::size_t>(rpdo - rpdos_.data()));
  } else if (Tpdo* const tpdo = is_receive(index) ? nullptr : find_number(tpdos_, number_of(index))) {
    mapping = &tpdo->mapping;
    pieces = pieces_of(room_.rpdos.size() + static_cast<std::size_t>(tpdo - tpdos_.data()));
  }
  if (!again && mapping->bytes() != 0) return AbortCode::kNone;
  return mapping->resolve(dictionary_, static_cast<std::uint16_t>(index | kMappingBit), count, pieces);
}

/// It maps at least one object, and all of them are valid.
bool Pdo::has_mapping(std::uint16_t index) const {
  const std::uint32_t count = parameter(index | kMappingBit, 0);
  return count != 0 && take_mapping(index, count, false) == AbortCode::kNone;
}

/// The memory for the PDO in this place, RPDOs first.
std::span<PdoMapping::Piece> Pdo::pieces_of(std::size_t place) const {
  const std::size_t each = room_.pieces.size() / (room_.rpdos.size() + room_.tpdos.size());
  return room_.pieces.subspan(place * each, each);
}

void Pdo::configure(std::uint16_t index, Time now) {
  if ((index & kMappingBit) != 0) return;  // used when the COB-ID makes the PDO valid
  begin(now);
  const std::uint16_t number = number_of(index);
  if (is_receive(index)) {
    Rpdo* const rpdo = find_number(rpdos_, number);
    if (rpdo == nullptr) return;
    load(*rpdo, false);
    index_rpdos();
  } else {
    Tpdo* const tpdo = find_number(tpdos_, number);
    if (tpdo == nullptr) return;
    const bool was_active = tpdo->active;
    load(*tpdo, false);
    find_tpdos();
    if (!operational_ || outputs_ == Outputs::kNone || !tpdo->active) return;
    start(tpdo, tpdo + 1, !was_active);
  }
}

/// Loads what both kinds have; returns the COB-ID. `after_reset`: the mapping has not been taken yet.
std::uint32_t Pdo::load_common(Common& pdo, std::uint16_t index, bool after_reset) {
  const std::uint32_t cob_id = parameter(index, kCobId);
  pdo.active = is_valid(cob_id) && (!after_reset || has_mapping(index));
  if (!pdo.active) return cob_id;
  pdo.type = static_cast<std::uint8_t>(parameter(index, kType));
  pdo.timer = parameter(index, kEventTimer) * kTimerUnit;
  return cob_id;
}

void Pdo::load(Rpdo& rpdo, bool after_reset) {
  const auto index = static_cast<std::uint16_t>(object::kRpdoParameter + rpdo.number);
  rpdo.id = static_cast<std::uint16_t>(cob::id_of(load_common(rpdo, index, after_reset)));
  if (after_reset) rpdo.ignored = false;
  if (rpdo.active) rpdo.mapping.sample(dictionary_, rpdo.data);
  start(rpdo);
}

void Pdo::load(Tpdo& tpdo, bool after_reset) {
  const auto index = static_cast<std::uint16_t>(object::kTpdoParameter + tpdo.number);
  const std::uint32_t cob_id = load_common(tpdo, index, after_reset);
  if (!tpdo.active) return;
  tpdo.remote = (cob_id & cob::kNoRemote) == 0;
  tpdo.inhibit_time = parameter(index, kInhibitTime) * object::kInhibitUnit;
  if (tpdo.type < kFirstEvent) tpdo.inhibit_time = tpdo.timer = 0;
  tpdo.start_value = static_cast<std::uint8_t>(parameter(index, kStartValue));
  tpdo.frame.id = cob::id_of(cob_id);
  tpdo.frame.length = tpdo.mapping.bytes();
}

/// All up to the last valid one.
template <class Kind>
Pdo::Used<Kind> Pdo::used(std::span<Kind> pdos) {
  Used<Kind> all{pdos.data(), pdos.data() + pdos.size()};
  while (all.first != all.last && !all.last[-1].active)
    --all.last;
  return all;
}

void Pdo::find_tpdos() {
  used_tpdos_ = outputs_ == Outputs::kNone ? Used<Tpdo>{} : used(tpdos_);
}

void Pdo::index_rpdos() {
  first_of_.fill(0);
  used_rpdos_ = used(rpdos_);
  for (auto k = static_cast<std::uint16_t>(used_rpdos_.end() - used_rpdos_.begin()); k > 0; --k) {
    Rpdo& rpdo = rpdos_[k - 1u];
    if (!rpdo.active || rpdo.ignored) continue;
    std::uint16_t& first = first_of_[place_of(rpdo.id)];
    rpdo.just_waits = is_synchronous(rpdo.type) && rpdo.timer == 0 && with_id(rpdo.id, first) == nullptr;
    rpdo.next = std::exchange(first, k);
  }
}

}  // namespace cbcan
