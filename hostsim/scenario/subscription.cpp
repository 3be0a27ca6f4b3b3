// SPDX-License-Identifier: MIT
#include "scenario/subscription.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "journal/watch.hpp"
#include "sim/frame_text.hpp"
#include "text/numbers.hpp"

namespace cbcan::scenario {

namespace {

enum : std::size_t { kFrames, kEmergencies, kTransactions };
constexpr std::array<std::string_view, 3> kEventKinds{"frames", "emcy", "transactions"};

}  // namespace

std::span<const std::string_view> event_kinds() {
  return kEventKinds;
}

Subscription::Subscription(Control& control, const Words& kinds, Sink sink)
    : sink_(std::move(sink)), cursor_(control.journal()) {
  std::ranges::transform(kEventKinds, wanted_.begin(), [&](std::string_view kind) {
    return kinds.empty() || std::ranges::find(kinds, kind) != kinds.end();
  });
}

void Subscription::look() {
  const std::uint64_t missed = cursor_.look([this](std::uint64_t /*number*/, const journal::Event& event) {
    tell(event);
    return true;
  });
  if (missed != 0) sink_(fmt::format("missed {}\n", missed));
}

void Subscription::tell(const journal::Event& event) const {
  using journal::Kind;
  const auto say = [&](std::size_t kind, std::string_view name, const std::string& what) {
    if (wanted_[kind])
      sink_(
          fmt::format("at {} {} {}{}\n", text::seconds_text(event.at), name, prefix_of(event.network), what));
  };
  switch (event.kind) {
    case Kind::kFrame: return say(kFrames, "frame", sim::frame_text(event.frame));
    case Kind::kBegun: return say(kTransactions, "transaction", "started");
    case Kind::kEnded: return say(kTransactions, "transaction", "ended");
    case Kind::kEmergency: {
      const auto emergency = journal::emergency_of(event.frame);
      return say(kEmergencies, "emcy", fmt::format("{} 0x{:04X}", emergency->node, emergency->code));
    }
    default: return;
  }
}

}  // namespace cbcan::scenario
