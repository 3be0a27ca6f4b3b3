// SPDX-License-Identifier: MIT
#pragma once

/// Commands at run time (docs/reference/commands.md), one line each: from a socket (--control), from standard
/// input on a manual clock, from a scenario. The last line of every response is "ok", with a value if there
/// is one, "at" and the time, or "error: " and the reason.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/time.hpp"
#include "plant/condition.hpp"
#include "plant/network.hpp"

namespace cbcan::plant {

/// Commands for `help` and docs/reference/commands.md.
std::vector<Usage> command_usages();
/// The verbs of `nmt`, and the services that they name: "start", "Start Remote Node".
std::vector<std::pair<std::string_view, std::string_view>> nmt_verbs();

inline constexpr std::string_view kError = "error: ";

/// The result of a line.
struct Reply {
  std::string text = {};            ///< the response, whole lines; empty for an empty line
  std::unique_ptr<Wait> wait = {};  ///< has the response later
  bool shutdown = false;            ///< the program is to end
};

/// The last line of a response without its end, and the lines before it.
struct ResponseParts {
  std::string_view lines;
  std::string_view last;
};
ResponseParts parts_of(std::string_view response);

/// Throws Refused if the line is no command, has too few or too many words, or is wait or pass, for which
/// scenarios have keys.
void check_command(std::string_view line);

class Control final : public View {
 public:
  /// `networks`: all, in order, at least one; they outlive it. `started`: time of their start.
  Control(std::vector<Network*> networks, Time started);
  ~Control();
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;

  /// Executes the line at this time. Its effects on the bus are still to come: advance the worlds before
  /// passing on the response.
  Reply execute(std::string_view line, Time now);

  /// Sets the time of the worlds, for waits; it never goes back.
  void set_now(Time now) { now_ = now; }

  // View, for conditions.
  Time now() const override { return now_ - started_; }
  Time started() const override { return started_; }
  std::size_t networks() const override { return networks_.size(); }
  std::vector<std::uint16_t> read(std::size_t network, std::uint32_t first, std::size_t count) override;
  std::uint32_t transactions(std::size_t network) override;
  sim::World& world(std::size_t network) override { return networks_[network - 1]->world(); }
  void add(Listener& listener) override;
  void remove(Listener& listener) override;

  Network& network(std::size_t number) { return *networks_[number - 1]; }

  /// Events of all networks from the first call on, which gives it room for so many.
  journal::Journal& journal(std::size_t events = journal::Journal::kEvents,
                            std::size_t bytes = journal::Journal::kBytes);
  /// Called when views of the journal should read it, before events are overwritten.
  std::function<void()> on_journal_filled = [] {};

 private:
  class BusObserver;

  std::vector<Network*> networks_;
  std::unique_ptr<journal::Journal> journal_;
  std::vector<std::unique_ptr<BusObserver>> observers_;
  std::vector<Listener*> listeners_;
  Time started_;
  Time now_;
};

}  // namespace cbcan::plant
