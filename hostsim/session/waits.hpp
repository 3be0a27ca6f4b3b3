// SPDX-License-Identifier: MIT
#pragma once

/// Commands that are answered later (docs/reference/commands.md: wait, pass). Those of closed connections are
/// dropped.

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plant/control.hpp"
#include "protocols/dialogue.hpp"

namespace cbcan::session {

class Waits {
 public:
  using Dialogue = std::shared_ptr<protocols::Dialogue>;

  /// `machine_now`: this machine's clock.
  explicit Waits(std::function<Time()> machine_now) : machine_now_(std::move(machine_now)) {}

  /// The response of a command's reply; empty if it comes later.
  std::string take(plant::Reply reply, const Dialogue& dialogue);

  /// Answers those that have ended; true if there was one. The time is that of the Control.
  bool poll() { return !waiting_.empty() && poll_waiting(); }
  /// When one may end without an event, in the plant's time since its start; kNever = none.
  Time next_deadline() const {
    return sim::earliest(waiting_, [](const Waiting& waiting) { return waiting.wait->next_deadline(); });
  }

  bool exist() const { return !waiting_.empty(); }

  // What a manual clock needs:
  /// Whether one of them can end as time passes.
  bool want_time() const;
  /// No event can end any of them.
  bool are_passes() const;
  /// Time on this machine's clock when the first wait for the PLC reaches its limit; give_up_on_plc() ends it
  /// then.
  Time plc_deadline() const;
  void give_up_on_plc(Time now);

 private:
  struct Waiting {
    std::unique_ptr<plant::Wait> wait;
    std::weak_ptr<protocols::Dialogue> dialogue;
    Time since;  ///< on this machine's clock
  };

  bool poll_waiting();
  static void answer(const Waiting& waiting, const std::string& response);

  std::function<Time()> machine_now_;
  std::vector<Waiting> waiting_;
};

}  // namespace cbcan::session
