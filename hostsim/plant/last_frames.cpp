// SPDX-License-Identifier: MIT
#include "plant/last_frames.hpp"

#include "base/numbers.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::plant {

std::string frame_line(std::size_t network, const Frame& frame, Time at) {
  return fmt::format("{} {}{}", base::seconds_text(at), prefix_of(network), sim::frame_text(frame));
}

void LastFrames::on_frame(std::size_t network, const Frame& frame, Time now) {
  frames_.push_back({network, frame, now});
  if (frames_.size() > most_) frames_.pop_front();
}

std::string LastFrames::lines(std::string_view indent) const {
  std::string text;
  for (const auto& [network, frame, at] : frames_)
    text += fmt::format("{}{}\n", indent, frame_line(network, frame, at));
  return text;
}

}  // namespace cbcan::plant
