// SPDX-License-Identifier: MIT
#include "plant/subscription.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "journal/watch.hpp"
#include "sim/frame_text.hpp"
#include "text/numbers.hpp"

namespace cbcan::plant {

namespace {

using journal::Kind;

constexpr std::array<std::string_view, 3> kEventKinds{"frames", "emcy", "transactions"};
/// By kEventKinds.
constexpr std::array<journal::Kinds, 3> kOf{journal::kinds_of({Kind::kFrame}),
                                            journal::kinds_of({Kind::kEmergency}),
                                            journal::kinds_of({Kind::kBegun, Kind::kEnded})};

journal::Kinds kinds_in(const Words& words) {
  journal::Kinds kinds = 0;
  for (std::size_t i = 0; i < kOf.size(); ++i)
    if (words.empty() || std::ranges::find(words, kEventKinds[i]) != words.end()) kinds |= kOf[i];
  return kinds;
}

}  // namespace

std::span<const std::string_view> event_kinds() {
  return kEventKinds;
}

Subscription::Subscription(Control& control, const Words& kinds, Sink sink)
    : sink_(std::move(sink)), cursor_(control.journal(), kinds_in(kinds)) {}

void Subscription::poll() {
  const std::uint64_t missed = cursor_.look([this](std::uint64_t /*number*/, const journal::Event& event) {
    tell(event);
    return true;
  });
  if (missed != 0) sink_(fmt::format("missed {}\n", missed));
}

void Subscription::tell(const journal::Event& event) const {
  const auto say = [&](std::string_view name, const std::string& what) {
    sink_(fmt::format("at {} {} {}{}\n", text::seconds_text(event.at), name, prefix_of(event.network), what));
  };
  switch (event.kind) {
    case Kind::kFrame: return say("frame", sim::frame_text(event.frame));
    case Kind::kBegun: return say("transaction", "started");
    case Kind::kEnded: return say("transaction", "ended");
    default: {
      const auto emergency = journal::emergency_of(event.frame);
      return say("emcy", fmt::format("{} 0x{:04X}", emergency->node, emergency->code));
    }
  }
}

}  // namespace cbcan::plant
