// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/further_channels.hpp"

#include <algorithm>
#include <utility>

namespace cbcan {

FurtherChannels::FurtherChannels(Coprocessor& coprocessor, std::span<const ScannerWindow> scanners,
                                 std::span<Memory> memory)
    : first_(coprocessor.channel_), node_(coprocessor.node_), more_(memory) {
  node_.add(*this);
  count_ = more_.size();
  std::uint8_t number = 0;
  for (Memory& channel : more_) {
    const ScannerWindow& scanner = scanners[number++];
    channel.emplace(RegisterWindow(), scanner, node_, first_.port(), first_.settings(), number).start(0);
  }
}

void FurtherChannels::poll(Time now) {
  if (now >= due_) {
    due_ = kNever;
    for (Memory& channel : more_)
      due_ = earlier(due_, channel->poll(now));
    first_.follow_node();
  }
  if (waiting_count_ != 0) ask_again(now);
  first_.wake_at(due_);
}

/// The own node has been reset since the last request began.
void FurtherChannels::reset() {
  resets_ = node_.resets();
  for (Memory& channel : more_)
    channel->reset();
}

void FurtherChannels::add_to(Channel::Counters& sums) const {
  for (const Memory& channel : more_) {
    sums.executed += channel->counters().executed;
    sums.failed += channel->counters().failed;
    sums.cancelled += channel->counters().cancelled;
  }
}

/// A response is for the channel that sent the last request to the node.
void FurtherChannels::on_sdo_response(const Frame& frame, Time now) {
  look_at_waiting(now);
  Channel& asking = channel(owner_[frame.id & nmt::kMaxNode]);
  asking.on_sdo_response(frame, now);
  if (&asking != &first_) wake_at(asking.due());
}

/// Only channels with a transfer with this node, or a request for its state, are concerned.
void FurtherChannels::on_news(std::uint8_t node, NodeMonitor::News news, Time now) {
  look_at_waiting(now);
  Channel& last = channel(owner_[node]);
  Channel& asking = channel(owner_[kState + node]);
  if (&last != &first_) last.on_news(node, news, now);
  if (&asking != &first_ && &asking != &last) asking.on_news(node, news, now);
  wake_at(earlier(last.due(), asking.due()));
}

void FurtherChannels::on_registers_written(std::size_t first, std::size_t count, Time now) {
  written_ = true;
  look_at_waiting(now);
  std::size_t out = first_.settings().scanner_out_first;
  if (first >= out + (more_.size() + 1) * regmap::kScannerStride || first + count <= out) return;
  for (std::uint8_t number = 0; number <= more_.size(); ++number, out += regmap::kScannerStride) {
    if (first >= out + kScannerOutWords || out >= first + count) continue;
    channel(number).on_registers_written(out, first, count, now);
    wake_at(channel(number).due());
  }
}

// ---- Lines

/// Line of a request, as in Channel::begin(); one that is rejected there may wait before that.
FurtherChannels::Line FurtherChannels::line_of(const Channel::Request& request) const {
  if (request.command == regmap::kSdoWrite && request.index == regmap::kNmtService) return kNmt;
  if (const std::uint8_t server = first_.server_of(request); server != 0) return server;
  const bool other = request.node - 1u < nmt::kMaxNode && request.node != first_.settings().node_id;
  return static_cast<Line>(other ? kState + request.node : kNone);
}

/// When the manager releases it, or may have.
Time FurtherChannels::manager_free_from(Line line, Time now) {
  if (!kServices.manager() || line == kNmt || line >= kNone) return now;
  const Time from = node_.manager()->node_free_from(line, now);
  return from == kNever ? now + Manager::kPause : from;
}

Time FurtherChannels::node_free_from(std::uint8_t node, Time now) {
  for (const std::uint8_t number : waiting())
    if (line_[number] == node) return kNever;
  return channel(owner_[node]).node_free_from(node, now);
}

/// When the channel that had the line last releases it for this channel; kNever = at the end of its request.
Time FurtherChannels::free_from(Line line, const Channel& channel, Time now) {
  if (const Time from = manager_free_from(line, now); from > now) return from;
  Channel& last = this->channel(owner_[line]);
  if (&last == &channel) return now;
  if (line == kNmt || line > kState)
    return last.in_service() && line_of(last.request()) == line ? kNever : now;
  return last.node_free_from(line, now);
}

/// No other channel has been waiting longer in this line.
bool FurtherChannels::is_next(Line line, const Channel& channel) {
  for (const std::uint8_t number : waiting()) {
    if (number == channel.number()) break;
    if (line_[number] == line) return false;
  }
  return true;
}

/// When it is this channel's turn in this line; kNever = after that of another channel.
Time FurtherChannels::turn(Line line, const Channel& channel, Time now) {
  if (line == kNone) return now;
  return is_next(line, channel) ? free_from(line, channel, now) : kNever;
}

void FurtherChannels::begin_or_hold_back(Channel& channel, Time now) {
  if (resets_ != node_.resets()) reset();
  const Line line = line_of(channel.request());
  const Time from = turn(line, channel, now);
  if (from <= now) {
    owner_[line] = channel.number();
    leave_line(channel);
    return channel.begin(now);
  }
  wake_at(from);
  channel.hold_back();
  line_[channel.number()] = line;
  if (std::ranges::find(waiting(), channel.number()) == waiting().end())
    waiting_[waiting_count_++] = channel.number();
}

void FurtherChannels::leave_line(const Channel& channel) {
  const auto end = std::remove(waiting().begin(), waiting().end(), channel.number());
  waiting_count_ = static_cast<std::size_t>(end - waiting().begin());
}

/// Asks in the order of arrival. A request is read only when its turn has come, or after a complete write: in
/// between its words may be partly written.
void FurtherChannels::ask_again(Time now) {
  if (node_.slave().resetting()) return wake_at(now);
  const auto asking = waiting_;
  const std::size_t count = waiting_count_;
  const bool written = std::exchange(written_, false);
  for (std::size_t i = 0; i < count; ++i) {
    Channel& channel = this->channel(asking[i]);
    if (channel.held_back()) {
      const Time from = turn(line_[asking[i]], channel, now);
      if (written || from <= now) channel.resume(now);
      wake_at(from > now ? from : channel.due());
    }
    if (!channel.held_back()) leave_line(channel);
  }
}

}  // namespace cbcan
