// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <utility>

#include "base/text.hpp"
#include "plant/command_words.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::plant {

/// A frame on a bus, as reports show it: "0.000000 2/5C2#4300100091010F00".
inline std::string frame_line(std::size_t network, const Frame& frame, Time at) {
  return fmt::format("{} {}{}", base::seconds_text(at), prefix_of(network), sim::frame_text(frame));
}

/// The last frames on the buses, `most` of them.
class LastFrames final : private Listener {
 public:
  explicit LastFrames(View& view, std::size_t most = 12) : Listener(view), most_(most) {}

  /// For a report: a line for each, after `indent`.
  std::string lines(std::string_view indent) const {
    std::string text;
    for (const auto& [network, frame, at] : frames_)
      text += fmt::format("{}{}\n", indent, frame_line(network, frame, at));
    return text;
  }

  struct Seen {
    std::size_t network;
    Frame frame;
    Time at;
  };
  /// All since the last call.
  std::deque<Seen> take() { return std::exchange(frames_, {}); }

 private:
  void on_frame(std::size_t network, const Frame& frame, Time now) override {
    frames_.push_back({network, frame, now});
    if (frames_.size() > most_) frames_.pop_front();
  }

  std::size_t most_;
  std::deque<Seen> frames_;
};

}  // namespace cbcan::plant
