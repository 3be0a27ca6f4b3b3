// SPDX-License-Identifier: MIT
#pragma once

/// Conditions of `wait` and scenarios: "register 3700 = 0", "frame 5C2#4B*", "state 5 operational". Events
/// (frames, EMCY messages, transactions) count from the construction of the condition.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "plant/words.hpp"

namespace cbcan::plant {

class Condition {
 public:
  virtual ~Condition() = default;

  virtual bool holds(View& view) = 0;
  /// The state if it does not hold: "it is 4", "2 of them".
  virtual std::string seen(View& view) = 0;
  /// False: it is about a node without power, so nothing can be said.
  virtual bool applies(View& /*view*/) const { return true; }
  /// When it may hold without an event; kNever = not without one.
  virtual Time next_deadline(View& /*view*/) const { return kNever; }
  /// It waits for the PLC, and no time should pass until then.
  virtual bool is_up_to_plc(View& /*view*/) const { return false; }
};

/// Throws Refused. The view outlives the condition.
std::unique_ptr<Condition> make_condition(std::string_view text, View& view);

/// All conditions, for the page.
std::vector<Usage> condition_usages();

}  // namespace cbcan::plant
