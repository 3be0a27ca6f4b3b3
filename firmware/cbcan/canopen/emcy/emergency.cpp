// SPDX-License-Identifier: MIT
#include "cbcan/canopen/emcy/emergency.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

void Emergency::forget(bool application) {
  running_ = false;
  waiting_count_ = 0;
  if (application) error_count_ = 0;
}

void Emergency::reset(std::uint8_t /*node_id*/, Time now) {
  next_allowed_ = now;
  update_register();
  clear_history();
  for (std::size_t i = 0; i < waiting_count_; ++i)
    remember(waiting_[(first_waiting_ + i) % kMostWaiting]);
  configure(object::kEmergencyCobId, now);
}

AbortCode Emergency::check(std::uint16_t index, std::uint8_t sub, std::uint32_t number) const {
  if (index == object::kErrorHistory && sub == 0) return number == 0 ? AbortCode::kNone : AbortCode::kValue;
  if (index != object::kEmergencyCobId) return AbortCode::kNone;
  const bool stays_valid = ((number | cob_id_) & cob::kInvalid) == 0;
  if (stays_valid && number != cob_id_) return AbortCode::kValue;
  return cob::is_usable(number & ~cob::kInvalid) ? AbortCode::kNone : AbortCode::kValue;
}

void Emergency::configure(std::uint16_t index, Time now) {
  if (index == object::kErrorHistory) return clear_history();
  cob_id_ = static_cast<std::uint32_t>(dictionary_.get(object::kEmergencyCobId, 0));
  const auto inhibit_time = static_cast<std::uint32_t>(dictionary_.get(object::kEmergencyInhibitTime, 0));
  inhibit_time_ = inhibit_time * object::kInhibitUnit;
  send_waiting(now);
}

void Emergency::clear_history() {
  for (std::uint8_t sub = 0; sub <= kMostRemembered && dictionary_.set(object::kErrorHistory, sub, 0);
       ++sub) {
  }
}

void Emergency::error(std::uint16_t code, std::uint8_t register_bits, const Info& info, Time now) {
  if (has(code)) return;
  if (error_count_ == kMostErrors) {
    ++counters_.lost;
    return;
  }
  errors_[error_count_++] = {code, static_cast<std::uint8_t>(register_bits | ErrorRegister::kGeneric)};
  const Message message{code, update_register(), info};
  remember(message);
  enqueue(message, now);
}

void Emergency::error_over(std::uint16_t code, Time now) {
  const std::size_t over = place_of(code);
  if (over == error_count_) return;
  errors_[over] = errors_[--error_count_];
  enqueue({static_cast<std::uint16_t>(EmergencyCode::kReset), update_register(), {}}, now);
}

/// The index of this error; error_count_ = not present.
std::size_t Emergency::place_of(std::uint16_t code) const {
  std::size_t place = 0;
  while (place != error_count_ && errors_[place].code != code)
    ++place;
  return place;
}

void Emergency::on_state(nmt::State state, Time now) {
  running_ = nmt::is_running(state);
  send_waiting(now);
}

std::uint8_t Emergency::update_register() {
  std::uint8_t bits = 0;
  for (std::size_t i = 0; i < error_count_; ++i)
    bits = static_cast<std::uint8_t>(bits | errors_[i].register_bits);
  dictionary_.set(object::kErrorRegister, 0, bits);
  return bits;
}

/// The newest entry is 1003h:01: the error code in the low word, the manufacturer's first two bytes in the high
/// word. Each older entry moves to the next sub-index.
void Emergency::remember(const Message& message) {
  std::uint32_t value =
      message.code | std::uint32_t{message.info[0]} << 16 | std::uint32_t{message.info[1]} << 24;
  const std::uint32_t last = std::min<std::uint32_t>(
      static_cast<std::uint8_t>(dictionary_.get(object::kErrorHistory, 0)) + 1u, kMostRemembered);
  std::uint8_t sub = 1;
  for (; sub <= last; ++sub) {
    const auto before = static_cast<std::uint32_t>(dictionary_.get(object::kErrorHistory, sub));
    if (!dictionary_.set(object::kErrorHistory, sub, value)) break;
    value = before;
  }
  dictionary_.set(object::kErrorHistory, 0, sub - 1u);
}

void Emergency::enqueue(const Message& message, Time now) {
  if (waiting_count_ == kMostWaiting) {
    ++counters_.lost;
    return;
  }
  waiting_[(first_waiting_ + waiting_count_++) % kMostWaiting] = message;
  send_waiting(now);
}

void Emergency::send_waiting(Time now) {
  due_ = kNever;
  const bool exists = cob_id_ != 0 && (cob_id_ & cob::kInvalid) == 0;
  if (running_ && !exists) waiting_count_ = 0;
  while (running_ && waiting_count_ != 0) {
    if (now < next_allowed_) {
      due_ = next_allowed_;
      return;
    }
    const Message& message = waiting_[first_waiting_];
    Frame frame;
    frame.id = cob::id_of(cob_id_);
    frame.length = 8;
    store_little_endian(std::span(frame.data).first<2>(), message.code);
    frame.data[2] = message.error_register;
    std::copy(message.info.begin(), message.info.end(), frame.data.begin() + 3);
    if (!port_.try_send(frame)) {
      due_ = now + kRetryInterval;
      return;
    }
    ++counters_.sent;
    application_.on_emergency_sent(frame.data);
    first_waiting_ = static_cast<std::uint8_t>((first_waiting_ + 1u) % kMostWaiting);
    --waiting_count_;
    next_allowed_ = now + inhibit_time_;
  }
}

}  // namespace cbcan
