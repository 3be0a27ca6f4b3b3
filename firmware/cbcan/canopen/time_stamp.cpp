// SPDX-License-Identifier: MIT
#include "cbcan/canopen/time_stamp.hpp"

#include "cbcan/canopen/dictionary/cob_id.hpp"

namespace cbcan {

namespace {

constexpr Time kHour = 3600 * kSecond;
constexpr Time kDay = 24 * kHour;
constexpr std::uint32_t kMillisecondsOfHour = 3'600'000;
constexpr std::uint32_t kMillisecondsOfDay = 24 * kMillisecondsOfHour;
constexpr std::uint32_t kMicroseconds = 1000;  // of a millisecond

}  // namespace

void TimeStamp::reset(std::uint8_t /*node_id*/, Time now) {
  outbox_.drop();
  running_ = false;
  configure(object::kTimeCobId, now);
}

AbortCode TimeStamp::check(std::uint16_t /*index*/, std::uint8_t /*sub*/, std::uint32_t number) const {
  const bool moves_in_use = (produces_ || consumes_) && cob::id_of(number) != id_;
  const std::uint32_t identifier = number & ~(cob::kConsumes | cob::kProduces);
  return cob::is_usable(identifier) && !moves_in_use ? AbortCode::kNone : AbortCode::kValue;
}

void TimeStamp::configure(std::uint16_t /*index*/, Time now) {
  const auto cob_id = static_cast<std::uint32_t>(dictionary_.get(object::kTimeCobId, 0));
  id_ = cob::id_of(cob_id);
  consumes_ = (cob_id & cob::kConsumes) != 0;
  produces_ = (cob_id & cob::kProduces) != 0;
  produce_every(period_, now);
}

void TimeStamp::produce_every(std::uint32_t period, Time now) {
  const bool unchanged = period == period_ && due_ != kNever;
  period_ = period;
  if (!produces_ || !running_ || period == 0) {
    due_ = kNever;
  } else if (!unchanged) {
    due_ = now + period;
  }
}

void TimeStamp::on_state(nmt::State state, Time now) {
  running_ = nmt::is_running(state);
  if (!running_) outbox_.drop();
  produce_every(period_, now);
}

bool TimeStamp::on_frame(const Frame& frame, Time now) {
  if (!running_ || !consumes_ || frame.id != id_ || frame.flags != 0 || frame.length != TimeOfDay::kBytes)
    return false;
  set(TimeOfDay::from(frame.data), now);
  return true;
}

void TimeStamp::poll(Time now) {
  if (now < due_) {
    outbox_.retry(now);
    return;
  }
  due_ = next_after(due_, period_, now);
  produce(now);
}

void TimeStamp::produce(Time now) {
  if (!produces_ || !running_) return;
  Frame& frame = outbox_.frame();
  frame.id = id_;
  frame.length = TimeOfDay::kBytes;
  at(now).put(frame.data);
  outbox_.send(now);
}

void TimeStamp::set(const TimeOfDay& time_of_day, Time now) {
  set_ = time_of_day;
  set_at_ = now;
}

/// Subtracts days and hours so that the rest fits in 32 bits: a 64-bit division would be a library call.
TimeOfDay TimeStamp::at(Time now) const {
  Time since = now - set_at_;
  std::uint32_t days = set_.days;
  std::uint32_t milliseconds = set_.milliseconds;
  for (; since >= kDay; since -= kDay)
    ++days;
  for (; since >= kHour; since -= kHour)
    milliseconds += kMillisecondsOfHour;
  milliseconds += static_cast<std::uint32_t>(since) / kMicroseconds;
  for (; milliseconds >= kMillisecondsOfDay; milliseconds -= kMillisecondsOfDay)
    ++days;
  return {milliseconds, static_cast<std::uint16_t>(days)};
}

}  // namespace cbcan
