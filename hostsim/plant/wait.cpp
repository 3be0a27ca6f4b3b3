// SPDX-License-Identifier: MIT
#include "plant/wait.hpp"

#include <fmt/core.h>

#include <utility>

#include "base/numbers.hpp"
#include "plant/control.hpp"

namespace cbcan::plant {

Wait::Wait(Control& control, std::unique_ptr<Condition> condition, std::string text, Time within,
           bool is_pass)
    : control_(control),
      condition_(std::move(condition)),
      text_(std::move(text)),
      since_(control.now()),
      within_(within),
      is_pass_(is_pass) {}

std::optional<std::string> Wait::poll() {
  if (condition_->holds(control_))
    return fmt::format("{} {}\n", is_pass_ ? "at" : "ok", base::seconds_text(control_.now()));
  return control_.now() < since_ + within_ ? std::nullopt : std::optional(give_up());
}

Time Wait::next_deadline() const {
  return earlier(condition_->next_deadline(control_), since_ + within_);
}

bool Wait::is_up_to_plc() const {
  return condition_->is_up_to_plc(control_);
}

std::string Wait::give_up() const {
  return fmt::format("{}{} s: {}: {}\n", kNotWithin, base::seconds_text(within_), text_,
                     condition_->seen(control_));
}

}  // namespace cbcan::plant
