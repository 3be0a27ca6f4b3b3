// SPDX-License-Identifier: MIT
#include "canopen/time_stamp.hpp"

#include "canopen/cob_id.hpp"
#include "canopen/little_endian.hpp"

namespace cbcan {

namespace {

constexpr std::uint64_t kMillisecondsOfDay = 86'400'000;
constexpr std::uint32_t kMillisecondBits = 0x0FFFFFFF;
constexpr std::uint8_t kMessageBytes = 6;

}  // namespace

void TimeStamp::reset(Time now) {
  outbox_.drop();
  running_ = false;
  configure(now);
}

AbortCode TimeStamp::check(const ObjectEntry& entry, std::span<const std::uint8_t> value) const {
  if (entry.index != kCobId) return AbortCode::kNone;
  const auto number = static_cast<std::uint32_t>(load_little_endian(value));
  const bool moves_in_use = (produces_ || consumes_) && cob::id_of(number) != id_;
  const std::uint32_t identifier = number & ~(cob::kConsumes | cob::kProduces);
  return cob::is_usable(identifier) && !moves_in_use ? AbortCode::kNone : AbortCode::kValue;
}

void TimeStamp::configure(Time now) {
  const auto cob_id = static_cast<std::uint32_t>(dictionary_.get(kCobId, 0));
  id_ = cob::id_of(cob_id);
  consumes_ = (cob_id & cob::kConsumes) != 0;
  produces_ = (cob_id & cob::kProduces) != 0;
  produce_every(period_, now);
}

void TimeStamp::produce_every(Time period, Time now) {
  const bool keeps_its_beat = period == period_ && due_ != kNever;
  period_ = period;
  if (!produces_ || !running_ || period == 0) {
    due_ = kNever;
  } else if (!keeps_its_beat) {
    due_ = now + period;
  }
}

void TimeStamp::set_running(bool running, Time now) {
  running_ = running;
  if (!running) outbox_.drop();
  produce_every(period_, now);
}

bool TimeStamp::on_frame(const Frame& frame, Time now) {
  if (!running_ || !consumes_ || frame.id != id_ || frame.flags != 0 || frame.length != kMessageBytes)
    return false;
  const auto milliseconds = static_cast<std::uint32_t>(load_little_endian(std::span(frame.data).first<4>()));
  const auto days = static_cast<std::uint16_t>(load_little_endian(std::span(frame.data).subspan<4, 2>()));
  set({milliseconds & kMillisecondBits, days}, now);
  return true;
}

void TimeStamp::poll(Time now) {
  if (now < due_) {
    outbox_.retry(now);
    return;
  }
  due_ = next_after(due_, period_, now);
  const TimeOfDay time = at(now);
  Frame frame;
  frame.id = id_;
  frame.length = kMessageBytes;
  store_little_endian(std::span(frame.data).first<4>(), time.milliseconds);
  store_little_endian(std::span(frame.data).subspan<4, 2>(), time.days);
  outbox_.send(frame, now);
}

void TimeStamp::set(const TimeOfDay& time_of_day, Time now) {
  milliseconds_at_zero_ =
      time_of_day.days * kMillisecondsOfDay + time_of_day.milliseconds - now / kMillisecond;
}

TimeOfDay TimeStamp::at(Time now) const {
  const std::uint64_t total = milliseconds_at_zero_ + now / kMillisecond;
  return {static_cast<std::uint32_t>(total % kMillisecondsOfDay),
          static_cast<std::uint16_t>(total / kMillisecondsOfDay)};
}

}  // namespace cbcan
