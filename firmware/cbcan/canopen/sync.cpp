// SPDX-License-Identifier: MIT
#include "cbcan/canopen/sync.hpp"

#include "cbcan/canopen/dictionary/cob_id.hpp"

namespace cbcan {

void Sync::reset(std::uint8_t /*node_id*/, Time now) {
  outbox_.drop();
  due_ = kNever;
  period_ = 0;
  counter_ = 0;
  misfits_ = false;
  running_ = false;
  configure(object::kSyncCobId, now);
}

AbortCode Sync::check(std::uint16_t index, std::uint8_t /*sub*/, std::uint32_t number) const {
  if (index == object::kSyncCobId) {
    const bool produces = (dictionary_.get(object::kSyncCobId, 0) & cob::kProduces) != 0;
    const bool moves_while_producing = produces && cob::id_of(number) != id_;
    return cob::is_usable(number) && !moves_while_producing ? AbortCode::kNone : AbortCode::kValue;
  }
  if (index != object::kSyncCounterOverflow) return AbortCode::kNone;
  // CiA 301, 7.5.2.22: only while no period is set.
  if (dictionary_.get(object::kSyncPeriod, 0) != 0) return AbortCode::kDeviceState;
  return number == 1 || number > kHighestCounter ? AbortCode::kValue : AbortCode::kNone;
}

void Sync::configure(std::uint16_t /*index*/, Time now) {
  const auto cob_id = static_cast<std::uint32_t>(dictionary_.get(object::kSyncCobId, 0));
  if (cob_id != 0) id_ = cob::id_of(cob_id);
  window_ = static_cast<std::uint32_t>(dictionary_.get(object::kSyncWindow, 0));
  const auto overflow = static_cast<std::uint8_t>(dictionary_.get(object::kSyncCounterOverflow, 0));
  if (overflow != overflow_) counter_ = 0;
  overflow_ = overflow;
  const std::uint32_t period = (cob_id & cob::kProduces) != 0
                                   ? static_cast<std::uint32_t>(dictionary_.get(object::kSyncPeriod, 0))
                                   : 0;
  if (period != period_) {
    due_ = period == 0 || !running_ ? kNever : now + period;
    counter_ = 0;
  }
  period_ = period;
}

void Sync::on_state(nmt::State state, Time now) {
  const bool running = nmt::is_running(state);
  if (running == running_) return;
  running_ = running;
  counter_ = 0;
  if (!running) outbox_.drop();
  if (period_ != 0) due_ = running ? now + period_ : kNever;
}

bool Sync::on_frame(const Frame& frame, Time /*now*/) {
  if (!running_ || frame.id != id_ || frame.flags != 0) return false;
  counter_ = frame.length == 1 ? frame.data[0] : std::uint8_t{0};
  misfits_ = frame.length != (overflow_ == 0 ? 0 : 1);
  came_ = true;
  return true;
}

void Sync::poll(Time now) {
  if (now < due_) {
    came_ |= outbox_.retry(now);
    return;
  }
  due_ = next_after(due_, period_, now);
  Frame& frame = outbox_.frame();
  frame.id = id_;
  frame.length = 0;
  frame.data[0] = 0;
  if (overflow_ != 0) {
    counter_ = counter_ >= overflow_ ? std::uint8_t{1} : static_cast<std::uint8_t>(counter_ + 1);
    frame.length = 1;
    frame.data[0] = counter_;
  }
  came_ |= outbox_.send(now);
}

}  // namespace cbcan
