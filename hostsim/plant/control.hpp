// SPDX-License-Identifier: MIT
#pragma once

/// Commands at run time (docs/reference/commands.md), one line each: from a socket (--control), from standard
/// input on a manual clock, from a scenario. The last line of every response is "ok", with a value if there
/// is one, "at" and the time, or "error: " and the reason.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/time.hpp"
#include "plant/command_words.hpp"
#include "plant/network.hpp"

namespace cbcan::plant {

/// Conditions of `wait` and scenarios: "register 3700 = 0", "frame 5C2#4B*", "state 5 operational". Events
/// (frames, EMCY messages, transactions) count from the construction of the condition.
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

/// The plant, real or virtual, that a scenario is played on.
class Bench {
 public:
  virtual ~Bench() = default;
  virtual View& view() = 0;
  /// Throws Refused for an invalid or unsupported command, as far as this shows without executing it.
  virtual void check(std::string_view line) = 0;
  /// A command of docs/reference/commands.md; its effects have happened when it returns the response. wait
  /// and pass let time pass.
  virtual std::string execute(std::string_view line) = 0;
  /// Lets time pass to the next event, at most to `until`, since the plant's start.
  virtual void advance(Time until) = 0;
  /// The last messages of nodes and faults, lines with the time.
  virtual std::vector<std::string> said() const { return {}; }
};

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
