// SPDX-License-Identifier: MIT
#pragma once

/// Commands at run time, one line each, from a socket (--control), from standard input on a manual clock,
/// from a scenario: what the world does to the plant, and what one may want to know of it.
/// docs/reference/commands.md is the page about them. The last line of every response is "ok", with a value
/// where there is one, "at" and the time, or "error: " and what is wrong.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/time.hpp"
#include "plant/condition.hpp"
#include "plant/network.hpp"
#include "plant/wait.hpp"

namespace cbcan::plant {

/// Those of all commands, for `help` and docs/reference/commands.md.
std::vector<Usage> command_usages();

inline constexpr std::string_view kError = "error: ";

/// What has become of a line.
struct Reply {
  std::string text = {};            ///< the response, whole lines; none for an empty line
  std::unique_ptr<Wait> wait = {};  ///< it has the response, later
  bool shutdown = false;            ///< the program is to end
};

/// Of a response: its last line, which says how it went, without its end; and what stands before that.
struct ResponseParts {
  std::string_view lines;
  std::string_view last;
};
ResponseParts parts_of(std::string_view response);

/// The command with this name does more than to tell something.
bool changes_plant(std::string_view name);

/// Throws Refused where the line is no command with so many words, or one of wait and pass, which scenarios
/// write otherwise.
void check_command(std::string_view line);

class Control final : public View {
 public:
  /// `networks`: all, in order, at least one; they outlive it. `started`: when they are.
  Control(std::vector<Network*> networks, Time started);
  ~Control();
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;

  /// Does what the line says, at this time. What follows on the bus has not happened yet: advance the worlds
  /// before anybody sees the response.
  Reply execute(std::string_view line, Time now);

  /// What time it is in the worlds, until it is said again: for waits. Never goes back.
  void set_now(Time now) { now_ = now; }

  // What is, for conditions.
  Time now() const override { return now_ - started_; }
  Time started() const override { return started_; }
  std::size_t networks() const override { return networks_.size(); }
  std::vector<std::uint16_t> read(std::size_t network, std::uint32_t first, std::size_t count) override;
  std::uint32_t transactions(std::size_t network) override;
  sim::World& world(std::size_t network) override { return networks_[network - 1]->world(); }
  Network& network(std::size_t number) { return *networks_[number - 1]; }

  /// What happens on all networks, from the first call on.
  journal::Journal& journal();
  /// Called when views of the journal should look, lest they miss something.
  std::function<void()> on_journal_filled = [] {};

  void add(Listener& listener);
  void remove(Listener& listener);

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
