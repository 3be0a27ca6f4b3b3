// SPDX-License-Identifier: MIT
#pragma once

/// A Coprocessor with up to 16 channels: as many SDO clients, each with its own scanner window, so that requests
/// to different nodes can be in progress at the same time (docs/reference/contract.md, "Channels"). Channel 1 is
/// the Coprocessor's own, with R3700..R3769. Used like a Coprocessor.
///
/// Requests to one node are executed in order of arrival, and none while another channel's client has the node in
/// quarantine. NMT commands are also executed in order of arrival, as are the requests for one node's state.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "cbcan/coprocessor/coprocessor.hpp"

namespace cbcan {

class MultiChannelCoprocessor final : public Coprocessor, private ChannelTurns {
 public:
  static constexpr std::size_t kMostChannels = regmap::kMostChannels;
  /// Memory for one more channel.
  using Memory = std::optional<Channel>;

  /// `scanners`: the scanner window of each channel; that of channel n begins kScannerStride * (n - 1) registers
  /// after the first. `more`: memory for the channels except the first, at most 15; it outlives this.
  MultiChannelCoprocessor(RegisterWindow window, ProcessRegisters process, CanPort& port,
                          const Settings& settings, std::span<const ScannerWindow> scanners,
                          std::span<Memory> more);

  void start(Time now);
  void on_frame(const Frame& frame, Time now);
  void on_registers_written(std::size_t first, std::size_t count, Time now);
  Time poll(Time now);
  Time deadline() const { return earlier(first_channel().due(), more_due_); }

  /// The sums of all channels.
  Counters counters() const;

 private:
  void begin_or_hold_back(Channel& channel, Time now) override;
  Time node_free_from(std::uint8_t node, Time now) override;
  void on_more_written(std::size_t first, std::size_t count, Time now);
  void on_response(const Frame& frame, Channel& asking, Time now);
  void pass_news(std::uint8_t node, NodeMonitor::News news, Time now);

  /// Requests in the same line wait for each other: NMT commands, transfers with each node, states of each node.
  /// Those in kNone do not wait.
  using Line = std::uint8_t;
  static constexpr Line kNmt = 0;
  static constexpr Line kNone = nmt::kMaxNode + 1;
  static constexpr Line kState = kNone;  ///< + node ID
  static constexpr std::size_t kLines = kState + nmt::kMaxNode + 1;

  Channel& channel(std::uint8_t number) { return number == 0 ? first_channel() : *more_[number - 1u]; }
  /// Line of a request, as in Channel::begin(); one that is rejected there may wait before that.
  Line line_of(const Channel::Request& request) {
    if (request.command == regmap::kSdoWrite && request.index == regmap::kNmtService) return kNmt;
    if (const std::uint8_t server = first_channel().server_of(request); server != 0) return server;
    const bool other = request.node - 1u < nmt::kMaxNode && request.node != settings().node_id;
    return static_cast<Line>(other ? kState + request.node : kNone);
  }
  Time manager_free_from(Line line, Time now);
  void join_line(Line line, Channel& channel, Time now);
  Time free_from(Line line, const Channel& channel, Time now);
  bool is_next(Line line, const Channel& channel) const;
  Time turn(Line line, const Channel& channel, Time now);
  void leave_line(const Channel& channel);
  void ask_again(Time now);
  void poll_more(Time now);
  void reset_more();
  /// Something may have ended that a request waits for.
  void look_at_waiting(Time now) {
    if (waiting_count_ != 0) wake_more_at(now);
  }
  void wake_more_at(Time time) { more_due_ = earlier(more_due_, time); }

  std::span<Memory> more_;
  Time more_due_ = kNever;   ///< of the other channels, or of a waiting request
  std::uint8_t resets_ = 0;  ///< of the own node, as known to the other channels
  /// Number of the channel that had a line last, by line; not used for kNone.
  std::array<std::uint8_t, kLines> owner_{};
  std::array<std::uint8_t, kMostChannels> waiting_{};  ///< channels whose requests wait, in order of arrival
  std::size_t waiting_count_ = 0;
  std::array<Line, kMostChannels> line_{};  ///< in which they wait, by channel
  bool written_ = false;                    ///< a waiting request may have been replaced
};

}  // namespace cbcan
