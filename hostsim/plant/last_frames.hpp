// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <string>
#include <string_view>

#include "plant/command_words.hpp"

namespace cbcan::plant {

/// A frame on a bus, as reports show it: "0.000000 2/5C2#4300100091010F00".
std::string frame_line(std::size_t network, const Frame& frame, Time at);

/// The last frames on the buses, for a report.
class LastFrames final : private Listener {
 public:
  using Listener::Listener;

  /// A line for each, after `indent`.
  std::string lines(std::string_view indent) const;

 private:
  struct Seen {
    std::size_t network;
    Frame frame;
    Time at;
  };
  void on_frame(std::size_t network, const Frame& frame, Time now) override;

  std::deque<Seen> frames_;
};

}  // namespace cbcan::plant
