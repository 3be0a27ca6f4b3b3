// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "plant/condition.hpp"

namespace cbcan::plant {

/// What the response to a wait that was not over in time begins with.
inline constexpr std::string_view kNotWithin = "error: not within ";

/// The most that a wait may take unless it says another time.
inline constexpr Time kWaitWithin = 60 * kSecond;

class Control;

/// A command that is answered later: when its condition holds, or its time is over.
class Wait {
 public:
  Wait(Control& control, std::unique_ptr<Condition> condition, std::string text, Time within, bool is_pass);
  ~Wait();
  Wait(const Wait&) = delete;
  Wait& operator=(const Wait&) = delete;

  /// The response, when it is over.
  std::optional<std::string> poll();
  /// When that may be though nothing happens; of Control's now().
  Time next_deadline() const;
  /// See Condition.
  bool is_up_to_plc() const;
  /// The response where the time is over.
  std::string give_up() const;
  Time within() const { return within_; }
  /// Only time can end it: nothing that happens meanwhile.
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
