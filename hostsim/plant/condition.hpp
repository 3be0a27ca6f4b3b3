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

/// Receives every frame on the buses.
class Listener {
 public:
  /// `network`: from 1; `now`: since the plant's start.
  virtual void on_frame(std::size_t network, const Frame& frame, Time now) = 0;

 protected:
  ~Listener() = default;
};

class Condition : public Listener {
 public:
  virtual ~Condition() = default;
  void on_frame(std::size_t /*network*/, const Frame& /*frame*/, Time /*now*/) override {}

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
