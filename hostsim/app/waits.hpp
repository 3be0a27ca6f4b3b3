// SPDX-License-Identifier: MIT
#pragma once

/// Commands that are answered later (docs/reference/commands.md: wait, pass). Those of connections that have
/// ended go.

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/loop/reactor.hpp"
#include "io/sockets/command_session.hpp"
#include "plant/control.hpp"

namespace cbcan::app {

class Waits {
 public:
  using Dialogue = std::shared_ptr<adapters::Dialogue>;

  /// The response to a command whose reply this is; none, if it comes later.
  std::string take(plant::Reply reply, const Dialogue& dialogue);

  /// Answers those that are over; true if there was one. The time is that of the Control.
  bool poll() { return !waiting_.empty() && poll_waiting(); }
  /// When one may be over though nothing happens, of the plant's time since its start; kNever = there is
  /// none.
  Time next_deadline() const { return waiting_.empty() ? kNever : deadline_of_each(); }

  // For a clock that stands.
  /// There is one that time can bring about.
  bool want_time() const;
  /// Nothing that happens can end any of them.
  bool are_passes() const;
  /// Of this machine's clock: when one has waited for the PLC as long as it was to; give_up_on_plc() ends
  /// that.
  Time plc_deadline() const;
  void give_up_on_plc(Time now);

 private:
  struct Waiting {
    std::unique_ptr<plant::Wait> wait;
    std::weak_ptr<adapters::Dialogue> dialogue;
    Time since;  ///< of this machine's clock
  };

  Time deadline_of_each() const;
  bool poll_waiting();
  static void answer(const Waiting& waiting, const std::string& response);

  std::vector<Waiting> waiting_;
};

}  // namespace cbcan::app
