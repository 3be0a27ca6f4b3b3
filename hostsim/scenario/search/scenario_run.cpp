// SPDX-License-Identifier: MIT
#include "scenario/search/scenario_run.hpp"

#include <utility>

#include "base/utf8.hpp"
#include "plant/virtual_plant.hpp"
#include "scenario/search/search.hpp"

namespace cbcan::search {

namespace {

/// The run is over before the last step.
struct Over {};

/// A plant that is judged whenever something may have happened.
class JudgedPlant final : public plant::Bench {
 public:
  JudgedPlant(plant::VirtualPlant& plant, Judge& judge) : plant_(plant), judge_(judge) {}

  plant::View& view() override { return plant_.view(); }
  void check(std::string_view line) override { plant_.check(line); }
  std::string execute(std::string_view line) override {
    std::string response = plant_.execute(line);
    look();
    return response;
  }
  void advance(Time until) override {
    plant_.advance(until);
    look();
  }
  void add(plant::Listener& listener) override { plant_.add(listener); }
  void remove(plant::Listener& listener) override { plant_.remove(listener); }

 private:
  void look() {
    if (!judge_.look()) throw Over();
  }

  plant::VirtualPlant& plant_;
  Judge& judge_;
};

}  // namespace

Told play(const scenario::Scenario& scenario, const Run& run, const Settings& settings,
          config::EdsFiles& files) {
  config::PlantBuild build = config::build_nodes(run.config, files);
  Told told;
  told.is_usage = !build.good;
  if (!build.good) return told.problem = build.lines.front(), told;
  plant::VirtualPlant plant(run.config, std::move(build));
  Judge judge({plant.control(), settings, run.counted, run.values_may_differ, run.must_survive,
               run.undisturbed, [&](Time duration) { plant.advance_to(plant.now() + duration); }});
  plant.start();
  JudgedPlant bench(plant, judge);
  try {
    const scenario::Played played = scenario::play(scenario, bench, run.undisturbed != nullptr);
    if (!played.failure.empty()) judge.fail(played.failure);
  } catch (const Over&) {
  }
  told.result = judge.end(std::nullopt);
  told.record = judge.record();
  told.record.duration = 0;  // it ends by itself: no limit follows from it
  return told;
}

void check_conditions(const Settings& settings, const config::Config& config, config::PlantBuild build) {
  plant::VirtualPlant plant(config, std::move(build));
  const Judge judge({plant.control(), settings, {}, false, false, nullptr, {}});
}

scenario::Outcome replay(const scenario::Scenario& scenario, const Moments& moments, const Settings& settings,
                         config::EdsFiles& files) {
  const Told undisturbed = play(scenario, {scenario.config}, settings, files);
  const Told told = play(scenario, run_with(moments, scenario.config, undisturbed.record), settings, files);
  for (const Told* each : {&undisturbed, &told})
    if (!each->problem.empty()) return {scenario::Verdict::kWrong, 0, each->problem + "\n"};
  if (!has_happened(moments, told.result))
    return {scenario::Verdict::kFailed, told.result.duration,
            to_string(moments) + ": " + std::string(kNeverHappened) + "\n"};
  const bool broken = told.result.verdict == Verdict::kBroken;
  return {broken ? scenario::Verdict::kFailed : scenario::Verdict::kPassed, told.result.duration,
          broken ? to_string(moments) + ": " + report(told.result) : ""};
}

}  // namespace cbcan::search
