// SPDX-License-Identifier: MIT
#include "cbcan/canopen/nmt/heartbeat_consumer.hpp"

namespace cbcan {

namespace {

/// 1016h: bits 23..16 the node, bits 15..0 the time in ms; without either, or above 127, the entry is unused.
constexpr std::uint32_t node_of(std::uint64_t value) {
  return static_cast<std::uint32_t>(value) >> 16;
}
constexpr Time period_of(std::uint64_t value) {
  return (value & 0xFFFF) * kMillisecond;
}
constexpr bool is_used(std::uint64_t value) {
  return node_of(value) - 1 < nmt::kMaxNode && period_of(value) != 0;
}

}  // namespace

void HeartbeatConsumer::configure(std::uint16_t /*index*/, Time /*now*/) {
  slot_of_.fill(kNotWatched);
  count_ = lost_ = 0;
  due_ = kNever;
  ObjectEntry entry{};
  for (std::size_t sub = 1; sub <= slots_.size(); ++sub) {
    if (dictionary_.find(object::kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub), entry) !=
        AbortCode::kNone)
      return;
    const std::uint64_t value =
        dictionary_.get(object::kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub));
    if (!is_used(value)) continue;
    const auto node = static_cast<std::uint8_t>(node_of(value));
    slot_of_[node] = static_cast<std::uint8_t>(count_);
    slots_[count_++] = {period_of(value), kNever, node, false};
  }
}

AbortCode HeartbeatConsumer::check(std::uint16_t /*index*/, std::uint8_t sub, std::uint32_t number) const {
  if (sub == 0) return AbortCode::kNone;
  if (!is_used(number)) return AbortCode::kNone;
  for (std::size_t other = 1; other <= slots_.size(); ++other) {
    const std::uint64_t there =
        dictionary_.get(object::kConsumerHeartbeatTime, static_cast<std::uint8_t>(other));
    if (other != sub && is_used(there) && node_of(there) == node_of(number)) return AbortCode::kIncompatible;
  }
  return AbortCode::kNone;
}

bool HeartbeatConsumer::on_frame(const Frame& frame, Time now) {
  const std::uint32_t node = frame.id - nmt::kErrorControlId;
  if (node > nmt::kMaxNode || frame.flags != 0) return false;
  const std::uint8_t slot = slot_of_[node];
  if (slot == kNotWatched || frame.length == 0) return true;
  Watched& watched = slots_[slot];
  if (watched.lost) --lost_;
  watched.lost = false;
  watched.deadline = now + watched.period;
  due_ = earlier(due_, watched.deadline);
  return true;
}

void HeartbeatConsumer::poll(Time now) {
  if (now < due_) return;
  due_ = kNever;
  for (Watched& watched : slots_.first(count_)) {
    if (watched.deadline <= now) {
      watched.deadline = kNever;
      watched.lost = true;
      ++lost_;
    }
    due_ = earlier(due_, watched.deadline);
  }
}

}  // namespace cbcan
