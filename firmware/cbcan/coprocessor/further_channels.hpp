// SPDX-License-Identifier: MIT
#pragma once

/// Channels 2..16 of a Coprocessor: as many more SDO clients, each with its own scanner window, so that
/// requests to different nodes can be in progress at the same time (docs/reference/contract.md, "Channels").
/// Channel 1 is the Coprocessor's own, with R3700..R3769.
///
/// Requests to one node are executed in order of arrival, and none while another channel's client has the
/// node in quarantine. NMT commands are also executed in order of arrival, as are the requests for one node's
/// state.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "cbcan/coprocessor/coprocessor.hpp"

namespace cbcan {

class FurtherChannels final : public OtherChannels {
 public:
  static constexpr std::size_t kMost = regmap::kMostChannels - 1;
  /// Memory for one channel.
  using Memory = std::optional<Channel>;

  /// Adds them to a coprocessor before its start(), and then is used by it alone. `memory`: for at most kMost
  /// channels; it outlives this, and this outlives the coprocessor's last call. `scanners`: their scanner
  /// windows; that of channel n begins kScannerStride * (n - 1) registers after that of channel 1.
  FurtherChannels(Coprocessor& coprocessor, std::span<const ScannerWindow> scanners,
                  std::span<Memory> memory);

 private:
  void begin_or_hold_back(Channel& channel, Time now) override;
  Time node_free_from(std::uint8_t node, Time now) override;
  void on_sdo_response(const Frame& frame, Time now) override;
  void on_news(std::uint8_t node, NodeMonitor::News news, Time now) override;
  void on_registers_written(std::size_t first, std::size_t count, Time now) override;
  void poll(Time now) override;
  void add_to(Channel::Counters& sums) const override;

  /// Requests in the same line wait for each other: NMT commands, transfers with each node, states of each
  /// node. Those in kNone do not wait.
  using Line = std::uint8_t;
  static constexpr Line kNmt = 0;
  static constexpr Line kNone = nmt::kMaxNode + 1;
  static constexpr Line kState = kNone;  ///< + node ID
  static constexpr std::size_t kLines = kState + nmt::kMaxNode + 1;

  Channel& channel(std::uint8_t number) { return number == 0 ? first_ : *more_[number - 1u]; }
  /// Numbers of the channels whose requests wait, in order of arrival.
  std::span<std::uint8_t> waiting() { return {waiting_.data(), waiting_count_}; }
  Line line_of(const Channel::Request& request) const;
  Time manager_free_from(Line line, Time now);
  Time free_from(Line line, const Channel& channel, Time now);
  bool is_next(Line line, const Channel& channel);
  Time turn(Line line, const Channel& channel, Time now);
  void leave_line(const Channel& channel);
  void ask_again(Time now);
  void reset();
  /// Something may have ended that a request waits for.
  void look_at_waiting(Time now) {
    if (any_waits()) wake_at(now);
  }
  void wake_at(Time time) {
    due_ = earlier(due_, time);
    first_.wake_at(time);
  }

  Channel& first_;
  LocalNode& node_;
  std::span<Memory> more_;
  Time due_ = 0;             ///< of these channels, or of a waiting request
  std::uint8_t resets_ = 0;  ///< of the own node, as known to these channels
  bool written_ = false;     ///< a waiting request may have been replaced
  /// Number of the channel that had a line last, by line; not used for kNone.
  std::array<std::uint8_t, kLines> owner_{};
  std::array<std::uint8_t, kMost + 1> waiting_{};
  std::array<Line, kMost + 1> line_{};  ///< in which they wait, by channel
};

}  // namespace cbcan
