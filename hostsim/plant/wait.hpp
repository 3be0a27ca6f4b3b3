// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "plant/condition.hpp"

namespace cbcan::plant {

/// The beginning of the response to a wait that has timed out.
inline constexpr std::string_view kNotWithin = "error: not within ";

/// The default limit of a wait.
inline constexpr Time kWaitWithin = 60 * kSecond;

class Control;

/// A command that is answered later: when its condition holds, or at its limit.
class Wait {
 public:
  Wait(Control& control, std::unique_ptr<Condition> condition, std::string text, Time within, bool is_pass);

  /// The response, once it has ended.
  std::optional<std::string> poll();
  /// When it may end without an event; on the scale of Control::now().
  Time next_deadline() const;
  /// See Condition.
  bool is_up_to_plc() const;
  /// The response after the limit.
  std::string give_up() const;
  Time within() const { return within_; }
  /// Whether only time can end it, no event.
  bool is_pass() const { return is_pass_; }

 private:
  Control& control_;
  std::unique_ptr<Condition> condition_;
  std::string text_;
  Time since_;
  Time within_;
  bool is_pass_;
};

}  // namespace cbcan::plant
