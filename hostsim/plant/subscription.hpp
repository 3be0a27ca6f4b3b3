// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "journal/journal.hpp"
#include "plant/control.hpp"

namespace cbcan::plant {

/// What can be told of: "frames", "emcy", "transactions".
std::span<const std::string_view> event_kinds();

/// Tells of what happens from now on, a line each: a view of the journal.
class Subscription {
 public:
  using Sink = std::function<void(std::string_view lines)>;

  /// `kinds`: names of event_kinds(); none are all.
  Subscription(Control& control, const Words& kinds, Sink sink);

  /// Tells what has happened since.
  void poll();

 private:
  void tell(const journal::Event& event) const;

  Sink sink_;
  journal::Cursor cursor_;
};

}  // namespace cbcan::plant
