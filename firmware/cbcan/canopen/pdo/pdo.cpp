// SPDX-License-Identifier: MIT
#include "cbcan/canopen/pdo/pdo.hpp"

#include <bit>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

namespace {

constexpr std::uint16_t kNoError = 0;

/// True for a SYNC at which this TPDO is sampled.
bool takes_sync(Pdo::Tpdo& tpdo, std::uint8_t counter) {
  if (tpdo.type == Pdo::kAcyclic) return std::exchange(tpdo.event, false);
  if (!Pdo::is_synchronous(tpdo.type)) return tpdo.type == Pdo::kRemoteSynchronous;
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

// ---- Operation

void Pdo::ignore(std::size_t number, bool ignored) {
  if (number >= rpdos_.size() || std::exchange(rpdos_[number].ignored, ignored) == ignored) return;
  index_rpdos();
}

void Pdo::put(std::size_t number, std::uint64_t data, Time now) {
  if (number >= rpdos_.size() || !rpdos_[number].active) return;
  Rpdo& rpdo = rpdos_[number];
  begin(now);
  store_little_endian(rpdo.data, data);
  rpdo.fresh = false;
  rpdo.received = true;
  rpdo.mapping.apply(dictionary_, rpdo.data);
  notify([&] { application_.on_written(now_); });
}

void Pdo::restore_received() const {
  for (const Rpdo& rpdo : used_rpdos_)
    if (rpdo.active && !rpdo.fresh) rpdo.mapping.apply(dictionary_, rpdo.data);
}

void Pdo::send_outputs(Outputs outputs, Time now) {
  if (std::exchange(outputs_, outputs) == outputs) return;
  find_tpdos();
  if (outputs == Outputs::kNone || !operational_) return;
  begin(now);
  start(used_tpdos_.first, used_tpdos_.last, true);
  for (Tpdo& tpdo : used_tpdos_)
    tpdo.event = tpdo.type == kAcyclic;
}

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
  rpdo.data = frame.data;
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

void Pdo::changed(std::uint16_t index, std::uint8_t sub) {
  ObjectEntry entry;
  if (!operational_ || dictionary_.find(index, sub, entry) != AbortCode::kNone) return;
  if (entry.has(ObjectFlags::kComputed)) return;
  const bool process = entry.has(ObjectFlags::kProcess);
  const auto first_bit = static_cast<std::uint32_t>(ObjectDictionary::first_bit(entry, sub));
  for (Tpdo& tpdo : used_tpdos_)
    if (tpdo.active && tpdo.mapping.holds(process, first_bit)) on_event(tpdo);
}

void Pdo::look_for_changes(Time now) {
  if (!operational_ || outputs_ != Outputs::kValues) return;
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
