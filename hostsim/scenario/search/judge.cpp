// SPDX-License-Identifier: MIT
#include "scenario/search/judge.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "journal/event_text.hpp"

namespace cbcan::search {

namespace {

using journal::Kind;

constexpr journal::Kinds kFollowed =
    journal::kinds_of({Kind::kModbus, Kind::kBegun, Kind::kEnded, Kind::kFault, Kind::kAdvice});

/// No name is needed: a transaction's text names the object by its index.
const descriptions::Object* no_name(std::uint8_t, std::uint8_t, std::uint16_t, std::uint8_t) {
  return nullptr;
}

}  // namespace

/// The last frames are registered before the judge, so they include the one that breaks a rule.
Judge::Judge(plant::Control& of_plant, const Settings& of_file, const Trial& of_run,
             std::function<void(Time)> let_pass)
    : JudgedRun{of_plant, of_file, of_run, std::move(let_pass)},
      Listener(of_plant),
      cursor_(journal, kFollowed),
      always_(conditions("always", settings.always)),
      done_(conditions("done", settings.done)),
      gave_up_(conditions("gave_up", settings.gave_up)),
      reached_(conditions("reached", settings.reached)) {
  result.reached.resize(reached_.size());
  find_counters();
}

std::vector<Judge::Held> Judge::conditions(std::string_view key, const std::vector<Line>& lines) {
  std::vector<Held> made;
  for (const Line& line : lines) {
    try {
      made.push_back({plant::make_condition(line.text, control), line.text});
    } catch (const plant::Refused& refused) {
      throw base::UsageError(
          fmt::format("{}:{}: explore.{}: {}", settings.file, line.number, key, refused.what()));
    }
  }
  return made;
}

void Judge::on_frame(std::size_t network, const Frame& frame, Time now) {
  if (trial.baseline == nullptr) record.frames.push_back(plant::frame_line(network, frame, now));
  const BusFrame seen{static_cast<std::uint8_t>(network), frame, now};
  if (seen.is(sdo::kResponseId)) record.nodes.insert(plant::prefix_of(network) + std::to_string(seen.node()));
  for (const auto& rule : rules_)
    rule->on_frame(*this, seen);
}

void Judge::read_journal() {
  cursor_.look([this](std::uint64_t /*number*/, const journal::Event& event) {
    follow(event);
    return true;
  });
}

bool Judge::look() {
  read_journal();
  check(always_, "always");
  for (std::size_t i = 0; i < reached_.size(); ++i)
    result.reached[i] = result.reached[i] ||
                        (reached_[i].condition->applies(control) && reached_[i].condition->holds(control));
  for (const auto& rule : rules_)
    rule->on_look(*this);
  if (settings.ends && counts()) record.matches = matches();
  return result.verdict != Verdict::kBroken && !is_over();
}

void Judge::check(const std::vector<Held>& held, std::string_view name) {
  for (const auto& [condition, text] : held)
    if (condition->applies(control) && !condition->holds(control))
      broken(fmt::format("{} {}", name, text), condition->seen(control));
}

void Judge::follow(const journal::Event& event) {
  if (event.kind == Kind::kModbus) {
    request = text_of(event, journal, no_name);
    return;
  }
  if (event.kind == Kind::kAdvice) return on_advice(event);
  if (event.kind == Kind::kFault) {
    const std::string_view text = journal.text(event);
    fault_at = event.at;
    if (!std::exchange(result.happened, true)) {
      requests_at_fault_ = requests();
      if (text.starts_with("plc: ")) result.disturbed = text.substr(text.rfind(": ") + 2);
    }
    for (const auto& rule : rules_)
      rule->on_fault(*this, event);
    return;
  }
  during = request_text(event, journal, no_name);
  const bool has_begun = event.kind == Kind::kBegun;
  transactions += has_begun ? 1U : 0U;
  if (!has_begun && transactions != 0) --transactions;
  if (!has_begun && counts())
    record.transactions.push_back(
        {during + " " + result_text(event), base::hex(journal.bytes(event), ""), matches()});
  if (event.service == journal::Service::kRead) during.resize(std::min(during.size(), during.find(" = ")));
  if (!has_begun && event.node != 0)
    record.nodes.insert(plant::prefix_of(event.network) + std::to_string(event.node));
  for (const auto& rule : rules_) {
    if (has_begun)
      rule->on_begun(*this, event);
    else
      rule->on_ended(*this, event);
  }
}

/// A mistake fails the run without faults only: with them a right program repeats requests and loses results.
void Judge::on_advice(const journal::Event& advice) {
  const std::string_view name = name_of(static_cast<journal::Mistake>(advice.state));
  const auto ignores = [name](const Line& line) { return line.text == name || line.text == kIgnore; };
  if (trial.baseline == nullptr && std::ranges::none_of(settings.advice, ignores))
    broken(fmt::format("advice {}", name), std::string(journal.text(advice)));
}

void Judge::settle() {
  is_settling_ = true;
  pass(settle_time());
  is_settling_ = false;
  look();
}

TrialReport Judge::end(std::optional<int> exit_code) {
  record.duration = control.now();
  if (is_over() && exit_code) exit_code = 0;
  for (std::size_t network = 1; network <= control.networks(); ++network)
    control.network(network).advice(true);
  look();
  if (counts()) record.matches = matches();
  has_ended = true;
  record.requests = requests();
  const bool gave_up = exit_code == kGaveUpCode;
  if (exit_code.value_or(0) != 0 && !gave_up)
    broken("the exit code is 0 or 75", fmt::format("it is {}", *exit_code));
  if (result.verdict != Verdict::kBroken) {
    if (gave_up) result.verdict = Verdict::kGaveUp;
    if (gave_up && trial.must_survive) broken("survive", "it gave up");
    if (!is_over() && settles()) settle();
    check(gave_up ? gave_up_ : done_, gave_up ? "gave_up" : "done");
  }
  if (result.verdict != Verdict::kBroken)
    for (const auto& rule : rules_)
      rule->on_settled(*this);
  if (result.verdict == Verdict::kBroken && exit_code == 0 && requests_at_fault_ == requests())
    result.verdict = Verdict::kLate;
  result.duration = record.duration;
  return {std::move(result), std::move(record)};
}

/// The faults that count are in the order of their variants.
void Judge::find_counters() {
  std::map<std::string_view, std::size_t> next;  // of a place
  for (const Variant& variant : trial.counted) {
    if (!has_moments(variant)) {
      counters_.push_back({&control.world(1).faults(), 0});
      continue;
    }
    const auto [network, name] = plant::where(variant.place, control.networks());
    const sim::FaultSet& set = name == "bus"   ? control.world(network).faults()
                               : name == "plc" ? control.network(network).plc_faults()
                                               : plant::node_of(control, variant.place).faults();
    std::size_t& place = next[variant.place];
    const auto list = set.list();
    while (place < list.size() && list[place].fault.after != kCounting - 1)
      ++place;
    counters_.push_back({&set, place < list.size() ? list[place++].number : 0});
  }
}

std::vector<std::uint32_t> Judge::matches() const {
  std::vector<std::uint32_t> counts;
  for (const auto& [set, number] : counters_) {
    const auto found = std::ranges::find(set->list(), number, &sim::SetFault::number);
    counts.push_back(found == set->list().end() ? 0 : static_cast<std::uint32_t>(found->occasions));
  }
  return counts;
}

}  // namespace cbcan::search
