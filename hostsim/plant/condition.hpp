// SPDX-License-Identifier: MIT
#pragma once

/// Conditions about a plant, as `wait` and scenarios write them: "register 3700 = 0", "frame 5C2#4B*", "state
/// 5 operational". Events (frames, EMCY messages, transactions) count from the making of the condition on.

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "plant/words.hpp"

namespace cbcan::plant {

/// Hears everything that is on the buses.
class Listener {
 public:
  /// `network`: from 1; `now` since the plant's start.
  virtual void on_frame(std::size_t network, const Frame& frame, Time now) = 0;

 protected:
  ~Listener() = default;
};

class Condition : public Listener {
 public:
  virtual ~Condition() = default;
  void on_frame(std::size_t /*network*/, const Frame& /*frame*/, Time /*now*/) override {}

  virtual bool holds(View& view) = 0;
  /// Of one that does not hold: "it is 4", "2 of them".
  virtual std::string seen(View& view) = 0;
  /// When it may hold though nothing happens; kNever = it will not.
  virtual Time next_deadline(View& /*view*/) const { return kNever; }
  /// The PLC has to do something first: no time should pass before.
  virtual bool is_up_to_plc(View& /*view*/) const { return false; }
};

/// Throws Refused. The view outlives it.
std::unique_ptr<Condition> make_condition(std::string_view text, View& view);

/// All there are, for the page.
std::span<const Usage> condition_usages();

}  // namespace cbcan::plant
