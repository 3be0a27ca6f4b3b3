// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/multi_channel_coprocessor.hpp"

#include <algorithm>
#include <utility>

namespace cbcan {

MultiChannelCoprocessor::MultiChannelCoprocessor(RegisterWindow window, ProcessRegisters process,
                                                 CanPort& port, const Settings& settings,
                                                 std::span<const ScannerWindow> scanners,
                                                 std::span<Memory> more)
    : Coprocessor(window, process, port, settings, scanners[0], this), more_(more) {
  for (std::size_t i = 0; i < more_.size(); ++i)
    more_[i].emplace(RegisterWindow(), scanners[i + 1], node(), port, settings,
                     static_cast<ChannelTurns*>(this), static_cast<std::uint8_t>(i + 1));
}

void MultiChannelCoprocessor::start(Time now) {
  for (Memory& channel : more_)
    channel->start(now);
  Coprocessor::start(now);
}

Time MultiChannelCoprocessor::poll(Time now) {
  Coprocessor::poll(now);
  if (now >= more_due_) poll_more(now);
  if (waiting_count_ != 0) ask_again(now);
  return deadline();
}

void MultiChannelCoprocessor::poll_more(Time now) {
  more_due_ = kNever;
  for (Memory& channel : more_)
    wake_more_at(channel->poll(now));
  first_channel().follow_node();
}

/// The own node has been reset since the last request began.
void MultiChannelCoprocessor::reset_more() {
  resets_ = node().resets();
  for (Memory& channel : more_)
    channel->reset();
}

Coprocessor::Counters MultiChannelCoprocessor::counters() const {
  Counters all = Coprocessor::counters();
  for (const Memory& channel : more_) {
    all.executed += channel->counters().executed;
    all.failed += channel->counters().failed;
    all.cancelled += channel->counters().cancelled;
  }
  return all;
}

// ---- Frames and writes

/// A response is for the channel that sent the last request to the node.
void MultiChannelCoprocessor::on_frame(const Frame& frame, Time now) {
  constexpr std::uint32_t kFunction = ~std::uint32_t{nmt::kMaxNode};
  const std::uint32_t function = frame.id & kFunction;
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  look_at_waiting(now);
  if (function == sdo::kResponseId) {
    if (!this->node().manager().on_response(frame, now))
      return on_response(frame, channel(owner_[node]), now);
    return first_channel().follow_node();
  }
  Coprocessor::on_frame(frame, now);
  if (function == nmt::kErrorControlId && frame.flags == 0 && node != 0)
    pass_news(node, NodeMonitor::news(frame), now);
}

void MultiChannelCoprocessor::on_response(const Frame& frame, Channel& asking, Time now) {
  asking.on_sdo_response(frame, now);
  if (&asking != &first_channel()) wake_more_at(asking.due());
}

/// A node, 1..127, has reported its state: passes that to the other channels with a transfer with this node, or a
/// request for its state.
void MultiChannelCoprocessor::pass_news(std::uint8_t node, NodeMonitor::News news, Time now) {
  if (news == NodeMonitor::News::kNone) return;
  Channel& last = channel(owner_[node]);
  Channel& asking = channel(owner_[kState + node]);
  if (&last != &first_channel()) last.on_news(node, news, now);
  if (&asking != &first_channel() && &asking != &last) asking.on_news(node, news, now);
  wake_more_at(earlier(last.due(), asking.due()));
}

void MultiChannelCoprocessor::on_registers_written(std::size_t first, std::size_t count, Time now) {
  written_ = true;
  look_at_waiting(now);
  const std::size_t out = settings().scanner_out_first + regmap::kScannerStride;
  const std::size_t end = out + more_.size() * regmap::kScannerStride;
  const bool more = first < end && out < first + count;
  more ? on_more_written(first, count, now) : Coprocessor::on_registers_written(first, count, now);
}

/// The range contains a scanner window of another channel.
void MultiChannelCoprocessor::on_more_written(std::size_t first, std::size_t count, Time now) {
  Coprocessor::on_registers_written(first, count, now);
  std::size_t out = settings().scanner_out_first;
  for (Memory& channel : more_) {
    out += regmap::kScannerStride;
    channel->on_registers_written(out, first, count, now);
    wake_more_at(channel->due());
  }
}

// ---- Turns

/// When the manager releases it, or may have.
Time MultiChannelCoprocessor::manager_free_from(Line line, Time now) {
  if (!kServices.manager() || line == kNmt || line >= kNone) return now;
  const Time from = node().manager().node_free_from(line, now);
  return from == kNever ? now + Manager::kPause : from;
}

/// For the manager: requests of the PLC that wait for this node go first.
Time MultiChannelCoprocessor::node_free_from(std::uint8_t node, Time now) {
  for (std::size_t i = 0; i < waiting_count_; ++i)
    if (line_[waiting_[i]] == node) return kNever;
  return channel(owner_[node]).node_free_from(node, now);
}

/// When the channel that had the line last releases it for this channel; kNever = at the end of its request.
Time MultiChannelCoprocessor::free_from(Line line, const Channel& channel, Time now) {
  if (const Time from = manager_free_from(line, now); from > now) return from;
  Channel& last = this->channel(owner_[line]);
  if (&last == &channel) return now;
  if (line == kNmt || line > kState)
    return last.in_service() && line_of(last.request()) == line ? kNever : now;
  return last.node_free_from(line, now);
}

/// No other channel has been waiting longer in this line.
bool MultiChannelCoprocessor::is_next(Line line, const Channel& channel) const {
  for (std::size_t i = 0; i < waiting_count_ && waiting_[i] != channel.number(); ++i)
    if (line_[waiting_[i]] == line) return false;
  return true;
}

/// When it is this channel's turn in this line; kNever = after that of another channel.
Time MultiChannelCoprocessor::turn(Line line, const Channel& channel, Time now) {
  if (line == kNone) return now;
  return is_next(line, channel) ? free_from(line, channel, now) : kNever;
}

void MultiChannelCoprocessor::begin_or_hold_back(Channel& channel, Time now) {
  if (resets_ != node().resets()) reset_more();
  const Line line = line_of(channel.request());
  const bool goes_on =
      waiting_count_ == 0 && owner_[line] == channel.number() && manager_free_from(line, now) <= now;
  goes_on ? channel.begin(now) : join_line(line, channel, now);
}

void MultiChannelCoprocessor::join_line(Line line, Channel& channel, Time now) {
  const Time from = turn(line, channel, now);
  if (from <= now) {
    owner_[line] = channel.number();
    leave_line(channel);
    return channel.begin(now);
  }
  wake_more_at(from);
  channel.hold_back();
  line_[channel.number()] = line;
  const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(waiting_count_);
  if (std::find(waiting_.begin(), end, channel.number()) == end)
    waiting_[waiting_count_++] = channel.number();
}

void MultiChannelCoprocessor::leave_line(const Channel& channel) {
  const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(waiting_count_);
  waiting_count_ =
      static_cast<std::size_t>(std::remove(waiting_.begin(), end, channel.number()) - waiting_.begin());
}

/// In the order of arrival. A request is read only when its turn has come, or after a complete write: in between
/// its words may be partly written.
void MultiChannelCoprocessor::ask_again(Time now) {
  const auto asking = waiting_;
  const std::size_t count = waiting_count_;
  const bool written = std::exchange(written_, false);
  for (std::size_t i = 0; i < count; ++i) {
    Channel& channel = this->channel(asking[i]);
    if (channel.held_back()) {
      const Time from = turn(line_[asking[i]], channel, now);
      if (written || from <= now) channel.resume(now);
      wake_more_at(from > now ? from : channel.due());
    }
    if (!channel.held_back()) leave_line(channel);
  }
}

}  // namespace cbcan
