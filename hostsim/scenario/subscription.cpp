// SPDX-License-Identifier: MIT
#include "scenario/subscription.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "cbcan/regmap.hpp"
#include "sim/frame_text.hpp"
#include "text/numbers.hpp"

namespace cbcan::scenario {

namespace {

constexpr std::string_view kFrames = "frames";
constexpr std::string_view kEmergencies = "emcy";
constexpr std::string_view kTransactions = "transactions";
constexpr std::array kEventKinds{kFrames, kEmergencies, kTransactions};

}  // namespace

std::span<const std::string_view> event_kinds() {
  return kEventKinds;
}

Subscription::Subscription(Control& control, const Words& kinds, Sink sink)
    : control_(control), kinds_(kinds.begin(), kinds.end()), sink_(std::move(sink)) {
  for (std::size_t network = 1; network <= control_.networks(); ++network)
    known_.push_back(known(network));
  control_.add(*this);
}

Subscription::~Subscription() {
  control_.remove(*this);
}

bool Subscription::wants(std::string_view kind) const {
  return kinds_.empty() || std::ranges::find(kinds_, kind) != kinds_.end();
}

void Subscription::tell(std::string_view what) const {
  sink_(fmt::format("at {} {}\n", text::seconds_text(control_.now()), what));
}

void Subscription::on_frame(std::size_t network, const Frame& frame, Time now) {
  const std::string at = fmt::format("at {} ", text::seconds_text(now));
  if (wants(kFrames)) sink_(fmt::format("{}frame {}{}\n", at, prefix_of(network), sim::frame_text(frame)));
  const bool is_emergency =
      frame.id > 0x80 && frame.id <= 0x80u + nmt::kMaxNode && frame.flags == 0 && frame.length == 8;
  if (is_emergency && wants(kEmergencies))
    sink_(fmt::format("{}emcy {}{} 0x{:04X}\n", at, prefix_of(network), frame.id - 0x80,
                      frame.data[0] + 256u * frame.data[1]));
}

Subscription::Known Subscription::known(std::size_t network) const {
  const auto registers = control_.network(network).registers();
  if (registers.empty()) return {};
  return {control_.transactions(network), registers[regmap::kWindowFirst] == regmap::kExecute};
}

void Subscription::look() {
  if (!wants(kTransactions)) return;
  for (std::size_t network = 1; network <= control_.networks(); ++network) {
    const Known before = std::exchange(known_[network - 1], known(network));
    const Known now = known_[network - 1];
    const std::string prefix = prefix_of(network);
    bool open = before.under_way;
    for (std::uint32_t begun = before.begun; begun != now.begun; ++begun) {
      if (open) tell(fmt::format("transaction {}ended", prefix));
      tell(fmt::format("transaction {}started", prefix));
      open = true;
    }
    if (open && !now.under_way) tell(fmt::format("transaction {}ended", prefix));
  }
}

}  // namespace cbcan::scenario
