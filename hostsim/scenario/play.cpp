// SPDX-License-Identifier: MIT
// Plays the steps of a Scenario.
#include <fmt/core.h>

#include <algorithm>
#include <deque>
#include <stdexcept>

#include "base/numbers.hpp"
#include "base/utf8.hpp"
#include "base/words.hpp"
#include "cbcan/regmap.hpp"
#include "plant/control.hpp"
#include "scenario/scenario.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::scenario {

namespace {

constexpr std::size_t kLastFrames = 12;
constexpr std::size_t kRegistersShown = 10;

/// The failure of a scenario, with its line.
class Failed : public std::runtime_error {
 public:
  Failed(const Line& where, const std::string& why) : std::runtime_error(why), line(where.number) {}
  std::size_t line;
};

/// A condition that observes the buses during its lifetime.
class Heard {
 public:
  Heard(const Line& line, plant::Bench& bench) : line_(line), bench_(bench) {
    try {
      condition_ = plant::make_condition(line.text, bench.view());
    } catch (const plant::Refused& refused) {
      throw Failed(line, refused.what());
    }
    bench_.add(*condition_);
  }
  ~Heard() { bench_.remove(*condition_); }
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;

  bool holds() { return condition_->holds(bench_.view()); }
  Time next_deadline() const { return condition_->next_deadline(bench_.view()); }
  [[noreturn]] void fail(std::string_view opening) {
    throw Failed(line_, fmt::format("{}{}: {}", opening, line_.text, condition_->seen(bench_.view())));
  }

 private:
  const Line& line_;
  plant::Bench& bench_;
  std::unique_ptr<plant::Condition> condition_;
};

std::deque<Heard> heard(const std::vector<Line>& lines, plant::Bench& bench) {
  std::deque<Heard> all;
  for (const Line& line : lines)
    all.emplace_back(line, bench);
  return all;
}

class LastFrames final : public plant::Listener {
 public:
  explicit LastFrames(plant::Bench& bench) : bench_(bench) { bench_.add(*this); }
  ~LastFrames() { bench_.remove(*this); }
  LastFrames(const LastFrames&) = delete;
  LastFrames& operator=(const LastFrames&) = delete;

  void on_frame(std::size_t network, const Frame& frame, Time now) override {
    frames_.push_back({network, frame, now});
    if (frames_.size() > kLastFrames) frames_.pop_front();
  }
  std::string text() const {
    std::string lines;
    for (const Seen& seen : frames_)
      lines += fmt::format("    {} {}{}\n", base::seconds_text(seen.at), plant::prefix_of(seen.network),
                           sim::frame_text(seen.frame));
    return lines.empty() ? "" : "  the last frames:\n" + lines;
  }

 private:
  struct Seen {
    std::size_t network;
    Frame frame;
    Time at;
  };
  plant::Bench& bench_;
  std::deque<Seen> frames_;
};

class Player {
 public:
  Player(const Scenario& scenario, plant::Bench& bench, bool disturbed)
      : scenario_(scenario), bench_(bench), last_frames_(bench), disturbed_(disturbed) {}

  Played play() {
    Played outcome;
    try {
      for (const Step& step : scenario_.steps)
        play(step);
    } catch (const Failed& failed) {
      outcome.failure = fmt::format("{}:{}: {}\n  at {}\n{}{}{}", base::to_utf8(scenario_.file), failed.line,
                                    base::to_utf8(failed.what()), base::seconds_text(now()), registers(),
                                    said(), last_frames_.text());
    }
    outcome.duration = now();
    return outcome;
  }

 private:
  struct Repeated {
    const Step* step;
    Time next;
  };

  Time now() { return bench_.view().now(); }

  void play(const Step& step) {
    auto expected = heard(step.expectations, bench_);
    auto must = heard(step.musts, bench_);
    auto waited = heard(step.waits, bench_);
    const Line here{"", step.line};
    if (step.at && *step.at < now() && !disturbed_)
      throw Failed(here, fmt::format("at: it is {} already", base::seconds_text(now())));
    advance_to(step.at ? std::max(*step.at, now()) : now() + step.after.value_or(0), nullptr);
    execute(step);
    if (step.every) repeated_.push_back({&step, now() + *step.every});
    const Time within = step.within.value_or(plant::kWaitWithin);
    for (Heard& condition : waited)
      if (!advance_to(now() + within, &condition) && !disturbed_)
        condition.fail(fmt::format("not within {} s: ", base::seconds_text(within)));
    for (Heard& condition : expected)
      if (!disturbed_ && !condition.holds()) condition.fail("expected ");
    for (Heard& condition : must)
      if (!condition.holds()) condition.fail("must ");
  }

  void execute(const Step& step) {
    for (const Line& line : step.commands) {
      const std::string response = bench_.execute(line.text);
      if (response.starts_with(plant::kError) && !disturbed_)
        throw Failed(line,
                     fmt::format("{}: {}", line.text, base::trim(response.substr(plant::kError.size()))));
    }
  }

  /// Ends early if the condition holds: true.
  bool advance_to(Time time, Heard* condition) {
    while (true) {
      if (condition != nullptr && condition->holds()) return true;
      if (now() >= time) return false;
      Time next = condition != nullptr ? earlier(time, condition->next_deadline()) : time;
      for (const Repeated& repeated : repeated_)
        next = earlier(next, repeated.next);
      bench_.advance(next);
      for (Repeated& repeated : repeated_) {
        if (now() < repeated.next) continue;
        repeated.next += *repeated.step->every;
        execute(*repeated.step);
      }
    }
  }

  std::string registers() {
    try {
      return fmt::format("  R{}..: {}\n", regmap::kWindowFirst,
                         base::joined(bench_.view().read(1, regmap::kWindowFirst, kRegistersShown)));
    } catch (const plant::Refused&) {
      return {};
    }
  }

  /// The messages of nodes and faults.
  std::string said() const {
    std::string lines;
    for (const std::string& line : bench_.said())
      lines += fmt::format("  said {}\n", line);
    return lines;
  }

  const Scenario& scenario_;
  plant::Bench& bench_;
  LastFrames last_frames_;
  std::vector<Repeated> repeated_;
  bool disturbed_;
};

}  // namespace

Played play(const Scenario& scenario, plant::Bench& bench, bool disturbed) {
  return Player(scenario, bench, disturbed).play();
}

std::size_t leave_out_unobservable(Scenario& scenario, plant::Bench& bench) {
  const auto is_unseen = [&bench](const Line& line) {
    try {
      plant::make_condition(line.text, bench.view());
    } catch (const plant::NotObservable&) {
      return true;
    } catch (const plant::Refused&) {
    }
    return false;
  };
  std::size_t count = 0;
  for (Step& step : scenario.steps) {
    const std::size_t unseen =
        std::erase_if(step.expectations, is_unseen) + std::erase_if(step.musts, is_unseen);
    if (unseen != 0 && step.expectations.empty() && step.musts.empty() && step.commands.empty() &&
        step.waits.empty())
      throw plant::NotObservable(
          fmt::format("line {}: nothing of what the step expects can be seen there", step.line));
    count += unseen;
  }
  return count;
}

config::Diagnostics check_steps(const Scenario& scenario, plant::Bench& bench) {
  config::Diagnostics found;
  const auto check = [&](const Line& line, auto act) {
    try {
      act();
    } catch (const plant::Refused& refused) {
      found.push_back({{scenario.file, line.number}, refused.what()});
    }
  };
  for (const Step& step : scenario.steps) {
    for (const Line& line : step.commands)
      check(line, [&] { bench.check(line.text); });
    for (const auto* lines : {&step.waits, &step.expectations, &step.musts})
      for (const Line& line : *lines)
        check(line, [&] { plant::make_condition(line.text, bench.view()); });
  }
  return found;
}

}  // namespace cbcan::scenario
