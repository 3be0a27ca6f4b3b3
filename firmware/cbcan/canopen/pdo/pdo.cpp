// SPDX-License-Identifier: MIT
#include "cbcan/canopen/pdo/pdo.hpp"

#include <bit>
#include <utility>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/sync.hpp"

namespace cbcan {

namespace {

constexpr std::uint16_t kNoError = 0;
constexpr std::uint16_t kNumberMask = 0x1FF;
constexpr std::uint16_t kMappingBit = 0x200;  ///< set in mappings 1600h, 1A00h; not in parameters 1400h, 1800h

// Sub-indices of 1400h+n and 1800h+n.
constexpr std::uint8_t kCobId = 1;
constexpr std::uint8_t kType = 2;
constexpr std::uint8_t kInhibitTime = 3;
constexpr std::uint8_t kEventTimer = 5;
constexpr std::uint8_t kStartValue = 6;

constexpr std::uint32_t kTimerUnit = 1000;  // us

constexpr bool is_synchronous(std::uint8_t type) {
  return type <= Pdo::kLastSynchronous;
}

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

/// True for a SYNC at which this TPDO is sampled.
bool takes_sync(Pdo::Tpdo& tpdo, std::uint8_t counter) {
  if (tpdo.type == Pdo::kAcyclic) return std::exchange(tpdo.event, false);
  if (!is_synchronous(tpdo.type)) return tpdo.type == Pdo::kRemoteSynchronous;
  if (tpdo.syncs_left == 0) {
    const bool awaited = tpdo.start_value == 0 || counter == 0 || counter == tpdo.start_value;
    if (!awaited) return false;
    tpdo.syncs_left = tpdo.type;
  }
  if (--tpdo.syncs_left != 0) return false;
  tpdo.syncs_left = tpdo.type;
  return true;
}

}  // namespace

/// Called at the start of a call. All is overdue after a long time without one, by more than any timer.
void Pdo::begin(Time now) {
  ticks_ += static_cast<Ticks>(std::min(static_cast<std::int64_t>(now - now_), std::int64_t{kMost}));
  now_ = now;
  if (ticks_ < kMost) return;
  const Ticks by = ticks_ - kPast;
  ticks_ = kPast;
  move(due_, by);
  move(retry_at_, by);
  for (Rpdo& rpdo : used_rpdos_)
    move(rpdo.timer_at, by);
  for (Tpdo& tpdo : used_tpdos_) {
    move(tpdo.timer_at, by);
    move(tpdo.inhibited_until, by);
  }
}

// ---- The application

void Pdo::notify(auto call) {
  notifying_ = true;
  call();
  notifying_ = false;
}

void Pdo::update() {
  notify([&] { application_.refresh(now_); });
}

/// An error of an RPDO lasts until the RPDO is received correctly.
void Pdo::note(std::uint16_t emergency_code, Rpdo& rpdo) {
  const std::uint16_t before = std::exchange(rpdo.error, emergency_code);
  notify([&] {
    const auto number = static_cast<std::uint16_t>(rpdo.number + 1);
    if (emergency_code != kNoError) application_.on_pdo_error(emergency_code, number, now_);
    if (before == kNoError || before == emergency_code) return;
    for (const Rpdo& other : rpdos_)
      if (other.error == before) return;
    application_.on_pdo_error_over(before, now_);
  });
}

// ---- Configuration

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
    if (!operational_ || tpdos_held_ || !tpdo->active) return;
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
  used_tpdos_ = tpdos_held_ ? Used<Tpdo>{} : used(tpdos_);
}

void Pdo::index_rpdos() {
  first_of_.fill(0);
  used_rpdos_ = used(rpdos_);
  for (auto k = static_cast<std::uint16_t>(used_rpdos_.end() - used_rpdos_.begin()); k > 0; --k) {
    Rpdo& rpdo = rpdos_[k - 1u];
    if (!rpdo.active) continue;
    std::uint16_t& first = first_of_[place_of(rpdo.id)];
    rpdo.just_waits = is_synchronous(rpdo.type) && rpdo.timer == 0 && with_id(rpdo.id, first) == nullptr;
    rpdo.next = std::exchange(first, k);
  }
}

// ---- Operation

void Pdo::on_state(nmt::State state, Time now) {
  const bool operational = state == nmt::State::kOperational;
  if (operational == operational_) return;
  operational_ = operational;
  begin(now);
  due_ = kNoTick;
  retry_at_ = 0;
  window_end_ = kNever;
  if (!operational) return;
  for (Rpdo& rpdo : rpdos_)
    start(rpdo);
  start(used_tpdos_.first, used_tpdos_.last, true);
}

/// The timer starts with the first reception.
void Pdo::start(Rpdo& rpdo) {
  rpdo.timer_at = kNoTick;
  rpdo.fresh = rpdo.received = false;
  if (rpdo.error != kNoError) note(kNoError, rpdo);
}

void Pdo::start(Tpdo* first, Tpdo* last, bool send) {
  if (first == last) return;
  update();
  for (Tpdo& tpdo : Used<Tpdo>{first, last}) {
    if (!tpdo.active) continue;
    tpdo.event = tpdo.windowed = false;
    tpdo.syncs_left = 0;
    tpdo.inhibited_until = 0;
    tpdo.timer_at = tpdo.timer == 0 ? kNoTick : ticks_ + tpdo.timer;
    tpdo.wanted = send && tpdo.type >= kFirstEvent;
    if (!tpdo.wanted) sample(tpdo);  // otherwise when it is sent
  }
  due_ = ticks_;
  go_on();
}

inline bool Pdo::receive(Rpdo& rpdo, const Frame& frame) {
  if (is_synchronous(rpdo.type) && now_ > window_end_) return false;
  if (!fits_as_before(rpdo, frame) && !fits(rpdo, frame.length)) return false;
  if (rpdo.timer != 0) {
    rpdo.timer_at = ticks_ + rpdo.timer;
    due_ = std::min(due_, rpdo.timer_at);
  }
  if (is_synchronous(rpdo.type)) {
    keep(rpdo, frame);
    return false;
  }
  rpdo.received = true;
  rpdo.mapping.apply(dictionary_, frame.data);
  return true;
}

/// Receives the frame with this RPDO and the following ones with the same CAN-ID.
void Pdo::receive_all(Rpdo& first, const Frame& frame, Time now) {
  begin(now);
  bool stored = false;
  for (Rpdo* rpdo = &first; rpdo != nullptr; rpdo = with_id(frame.id, rpdo->next))
    stored |= receive(*rpdo, frame);
  if (!stored) return;
  notify([&] { application_.on_written(now_); });
  go_on();
}

/// Longer frames are accepted too. Reports that a length error has occurred or ended.
inline bool Pdo::fits(Rpdo& rpdo, std::size_t length) {
  const std::size_t mapped = rpdo.mapping.bytes();
  note(length < mapped ? kTooShort : length > mapped ? kTooLong : kNoError, rpdo);
  return length >= mapped;
}

bool Pdo::on_remote(const Frame& frame, Time now) {
  if (frame.flags != Frame::kRemote) return false;
  for (Tpdo& asked : used_tpdos_)
    if (asked.active && asked.remote && asked.frame.id == frame.id) want(asked);
  poll(now);
  return true;
}

bool Pdo::on_sync(std::uint8_t counter, Time window, Time now) {
  if (!operational_) return false;
  begin(now);
  const Ticks before = due_;
  drop_windowed();
  window_end_ = window == 0 ? kNever : now_ + window;
  for (Rpdo& waiting : used_rpdos_)
    if (std::exchange(waiting.fresh, false)) waiting.mapping.apply(dictionary_, waiting.data);
  notify([&] { application_.on_sync(now_); });
  sample_and_send(counter);
  go_on();
  return due_ != before;
}

/// Drops the TPDOs still to be sent in the window of the last SYNC if it has ended.
void Pdo::drop_windowed() {
  if (now_ <= window_end_) return;
  for (Tpdo& tpdo : used_tpdos_)
    if (tpdo.windowed) tpdo.wanted = false;
}

inline void Pdo::send(Tpdo& tpdo) {
  if (!port_.try_send(tpdo.frame)) {
    retry_at_ = ticks_ + Ticks{kRetryInterval};
    return;
  }
  tpdo.wanted = false;
  tpdo.inhibited_until = ticks_ + tpdo.inhibit_time;
  if (tpdo.timer == 0) return;
  const bool on_time = ticks_ - tpdo.timer_at < tpdo.timer;
  tpdo.timer_at = (on_time ? tpdo.timer_at : ticks_) + tpdo.timer;
}

inline void Pdo::sample_and_send(std::uint8_t counter) {
  bool updated = false;
  for (Tpdo& sampled : used_tpdos_) {
    if (!sampled.active || !takes_sync(sampled, counter)) continue;
    if (!std::exchange(updated, true)) update();
    sample(sampled);
    if (sampled.type == kRemoteSynchronous) continue;
    sampled.wanted = true;
    sampled.windowed = true;
    if (ticks_ >= retry_at_) send(sampled);
    if (sampled.wanted) due_ = std::min(due_, retry_at_);
  }
}

void Pdo::changed(std::uint16_t index, std::uint8_t sub, Time now) {
  ObjectEntry entry;
  if (!operational_ || dictionary_.find(index, sub, entry) != AbortCode::kNone) return;
  if (entry.has(ObjectFlags::kComputed)) return;
  const bool process = entry.has(ObjectFlags::kProcess);
  const auto first_bit = static_cast<std::uint32_t>(ObjectDictionary::first_bit(entry, sub));
  for (Tpdo& tpdo : used_tpdos_)
    if (tpdo.active && tpdo.mapping.holds(process, first_bit)) on_event(tpdo);
  poll(now);
}

void Pdo::look_for_changes(Time now) {
  if (!operational_) return;
  for (Tpdo& tpdo : used_tpdos_) {
    const bool waits = tpdo.type == kAcyclic || tpdo.type >= kFirstEvent;
    if (!tpdo.active || !waits) continue;
    std::array<std::uint8_t, PdoMapping::kMostBytes> data = tpdo.frame.data;
    tpdo.mapping.sample(dictionary_, data);
    if (std::bit_cast<std::uint64_t>(data) != std::bit_cast<std::uint64_t>(tpdo.frame.data)) on_event(tpdo);
  }
  poll(now);
}

void Pdo::request(std::uint16_t number, Time now) {
  if (!operational_) return;
  for (Tpdo& tpdo : used_tpdos_)
    if (tpdo.active && (number == 0 || tpdo.number == number - 1)) on_event(tpdo);
  poll(now);
}

void Pdo::on_event(Tpdo& tpdo) {
  if (tpdo.type == kAcyclic) tpdo.event = true;
  if (tpdo.type >= kFirstEvent) want(tpdo);
}

void Pdo::poll(Time now) {
  if (due_ == kNoTick) return;
  begin(now);
  go_on();
}

/// The application updates its values once, before the first frame: what it then asks to be sent is sent too.
void Pdo::go_on() {
  if (ticks_ < due_ || notifying_) return;
  Ticks next = kNoTick;
  for (Rpdo& watched : used_rpdos_) {
    if (watched.timer_at >= next) continue;
    if (ticks_ < watched.timer_at) {
      next = watched.timer_at;
    } else {
      watched.timer_at = kNoTick;
      note(kTimedOut, watched);
    }
  }
  drop_windowed();
  bool samples = false;
  for (Tpdo& due : used_tpdos_) {
    if (!due.active) continue;
    if (ticks_ >= due.timer_at) due.wanted = true;
    samples = samples || (due.is_sampled_late() && ticks_ >= due_of(due));
  }
  if (samples) update();
  for (Tpdo& due : used_tpdos_) {
    if (!due.active) continue;
    if (ticks_ >= due_of(due)) {
      if (due.is_sampled_late()) sample(due);
      send(due);
    }
    next = std::min(next, due_of(due));
  }
  due_ = next;
}

}  // namespace cbcan
