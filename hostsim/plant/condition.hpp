// SPDX-License-Identifier: MIT
#pragma once

/// Conditions of `wait` and scenarios: "register 3700 = 0", "frame 5C2#4B*", "state 5 operational". Events
/// (frames, EMCY messages, transactions) count from the construction of the condition.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plant/command_words.hpp"

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

/// The beginning of the response to a wait that has timed out.
inline constexpr std::string_view kNotWithin = "error: not within ";

/// The default limit of a wait.
inline constexpr Time kWaitWithin = 60 * kSecond;

/// A command that is answered later: when its condition holds, or at its limit.
struct Wait {
  /// The response, once it has ended.
  std::optional<std::string> poll() const;
  /// When it may end without an event; on the scale of View::now().
  Time next_deadline() const { return earlier(condition->next_deadline(view), since + within); }
  /// See Condition.
  bool is_up_to_plc() const { return condition->is_up_to_plc(view); }
  /// The response after the limit.
  std::string give_up() const;

  View& view;
  std::unique_ptr<Condition> condition;
  std::string text;  ///< of the condition
  Time within;
  bool is_pass;  ///< only time can end it, no event
  Time since = view.now();
};

}  // namespace cbcan::plant
