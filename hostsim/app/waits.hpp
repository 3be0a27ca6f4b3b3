// SPDX-License-Identifier: MIT
#pragma once

/// Commands that are answered later, and connections that are told what happens (docs/reference/commands.md:
/// wait, pass, subscribe). Those of connections that have ended go.

#include <cstddef>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/loop/reactor.hpp"
#include "io/sockets/command_session.hpp"
#include "plant/subscription.hpp"
#include "plant/wait.hpp"

namespace cbcan::app {

class Waits {
 public:
  using Dialogue = std::shared_ptr<adapters::Dialogue>;

  /// `most_unread`: characters that wait for a connection to read them.
  explicit Waits(std::size_t most_unread) : most_unread_(most_unread) {}

  /// The response to a command whose reply this is; none, if it comes later.
  std::string take(plant::Reply reply, plant::Control& control, const Dialogue& dialogue);

  /// Connections are told what has happened.
  void poll_subscriptions() {
    if (!subscribers_.empty()) poll_subscribers();
  }
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
  struct Subscriber {
    std::unique_ptr<plant::Subscription> subscription;
    std::weak_ptr<adapters::Dialogue> dialogue;
    std::size_t missed = 0;  ///< lines
  };

  Time deadline_of_each() const;
  void poll_subscribers();
  bool poll_waiting();
  void subscribe(const plant::Words& kinds, plant::Control& control, const Dialogue& dialogue);
  static void answer(const Waiting& waiting, const std::string& response);

  std::size_t most_unread_;
  std::vector<Waiting> waiting_;
  std::list<Subscriber> subscribers_;
};

}  // namespace cbcan::app
