// SPDX-License-Identifier: MIT
// Plays the steps of a Scenario.
#include <fmt/core.h>

#include <stdexcept>

#include "base/text.hpp"
#include "cbcan/regmap.hpp"
#include "plant/command_words.hpp"
#include "plant/control.hpp"
#include "scenario/scenario.hpp"

namespace cbcan::scenario {

namespace {

constexpr std::size_t kRegistersShown = 10;

/// The failure of a scenario, with its line.
class Failed : public std::runtime_error {
 public:
  Failed(const Line& where, const std::string& why) : std::runtime_error(why), line(where.number) {}
  std::size_t line;
};

/// A condition and the line that has it.
struct LineCondition {
  const Line& line;
  std::unique_ptr<plant::Condition> condition;
};

class Player {
 public:
  Player(const Scenario& scenario, plant::Bench& bench, bool disturbed, const std::function<void()>& judge)
      : scenario_(scenario), bench_(bench), disturbed_(disturbed), judge_(judge) {}

  Outcome play() {
    Outcome outcome;
    try {
      for (const Step& step : scenario_.steps)
        play(step);
    } catch (const Failed& failed) {
      const std::string frames = last_frames_.lines("    ");
      outcome.verdict = Verdict::kFailed;
      outcome.text = fmt::format("{}:{}: {}\n  at {}\n{}{}{}{}", base::to_utf8(scenario_.file), failed.line,
                                 base::to_utf8(failed.what()), base::seconds_text(now()), registers(), said(),
                                 frames.empty() ? "" : "  the last frames:\n", frames);
    }
    outcome.duration = now();
    return outcome;
  }

 private:
  struct Repeated {
    const Step* step;
    Time next;
  };

  Time now() { return view_.now(); }

  std::vector<LineCondition> conditions(const std::vector<Line>& lines) {
    std::vector<LineCondition> all;
    for (const Line& line : lines) {
      try {
        all.push_back({line, plant::make_condition(line.text, view_)});
      } catch (const plant::Refused& refused) {
        throw Failed(line, refused.what());
      }
    }
    return all;
  }

  [[noreturn]] void fail(const LineCondition& broken, std::string_view opening) {
    throw Failed(broken.line,
                 fmt::format("{}{}: {}", opening, broken.line.text, broken.condition->seen(view_)));
  }

  void play(const Step& step) {
    const auto expected = conditions(step.expectations);
    const auto must = conditions(step.musts);
    const auto waited = conditions(step.waits);
    const Line here{"", step.line};
    if (step.at && *step.at < now() && !disturbed_)
      throw Failed(here, fmt::format("at: it is {} already", base::seconds_text(now())));
    advance_to(step.at ? std::max(*step.at, now()) : now() + step.after.value_or(0), nullptr);
    execute(step);
    if (step.every) repeated_.push_back({&step, now() + *step.every});
    const Time within = step.within.value_or(plant::kWaitWithin);
    for (const LineCondition& each : waited)
      if (!advance_to(now() + within, each.condition.get()) && !disturbed_)
        fail(each, fmt::format("not within {} s: ", base::seconds_text(within)));
    for (const LineCondition& each : expected)
      if (!disturbed_ && !each.condition->holds(view_)) fail(each, "expected ");
    for (const LineCondition& each : must)
      if (!each.condition->holds(view_)) fail(each, "must ");
  }

  void execute(const Step& step) {
    for (const Line& line : step.commands) {
      const std::string response = bench_.execute(line.text);
      if (judge_) judge_();
      if (response.starts_with(plant::kError) && !disturbed_)
        throw Failed(line,
                     fmt::format("{}: {}", line.text, base::trim(response.substr(plant::kError.size()))));
    }
  }

  /// Ends early if the condition holds: true.
  bool advance_to(Time time, plant::Condition* condition) {
    while (true) {
      if (condition != nullptr && condition->holds(view_)) return true;
      if (now() >= time) return false;
      const Time next = condition != nullptr ? earlier(time, condition->next_deadline(view_)) : time;
      bench_.advance(earlier(next, sim::earliest(repeated_, &Repeated::next)));
      if (judge_) judge_();
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
                         base::joined(view_.read(1, regmap::kWindowFirst, kRegistersShown)));
    } catch (const plant::Refused&) {
      return {};
    }
  }

  /// The messages of nodes and faults.
  std::string said() const {
    std::string lines;
    if (judge_) return lines;
    for (const std::string& line : bench_.said())
      lines += fmt::format("  said {}\n", line);
    return lines;
  }

  const Scenario& scenario_;
  plant::Bench& bench_;
  plant::View& view_ = bench_.view();
  plant::LastFrames last_frames_{view_};
  std::vector<Repeated> repeated_;
  bool disturbed_;
  const std::function<void()>& judge_;
};

}  // namespace

Outcome play(const Scenario& scenario, plant::Bench& bench, bool disturbed,
             const std::function<void()>& judge) {
  return Player(scenario, bench, disturbed, judge).play();
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
