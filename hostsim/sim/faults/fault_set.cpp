// SPDX-License-Identifier: MIT
#include "sim/faults/fault_set.hpp"

#include <algorithm>

#include "sim/frame_text.hpp"

namespace cbcan::sim {

namespace {

/// Numbers and seeds that differ in one bit give unrelated sequences.
std::uint64_t seed_of(std::uint64_t set, std::uint64_t fault, std::uint64_t number) {
  return Random(Random(Random(set).next() ^ fault).next() ^ number).next();
}

bool spent(const SetFault& set) {
  return set.fault.count != 0 && set.fired == set.fault.count;
}

}  // namespace

unsigned FaultSet::add(const Fault& fault, Time now) {
  const unsigned number = ++last_number_;
  const Time begins = now + fault.from;
  const bool waits = is_state(fault.kind) && fault.after != 0;
  SetFault set{.number = number,
               .fault = fault,
               .text = text_of(fault),
               .begins = begins,
               .ends = fault.until == kNever ? kNever : now + fault.until,
               .waits = waits,
               .due = is_storm(fault.kind) || fault.kind == FaultKind::kBusLoad ? begins : kNever,
               .random = Random(seed_of(seed_, fault.seed, number))};
  if (is_state(fault.kind) && !waits && fault.lasts != kNever)
    set.ends = earlier(set.ends, begins + fault.lasts);
  set_.push_back(std::move(set));
  on_change_(now);
  return number;
}

bool FaultSet::remove(unsigned number, Time now) {
  const auto found = std::ranges::find(set_, number, &SetFault::number);
  if (found == set_.end()) return false;
  close(*found, now);
  set_.erase(found);
  on_change_(now);
  return true;
}

void FaultSet::clear(Time now) {
  for (SetFault& set : set_)
    close(set, now);
  set_.clear();
  on_change_(now);
}

void FaultSet::remove_ended(Time now) {
  std::erase_if(set_, [now](const SetFault& set) { return !set.open && (spent(set) || set.ends <= now); });
  on_change_(now);
}

bool FaultSet::happens(SetFault& set, const Frame& frame, Time now) {
  if (!acts(set, now)) return false;
  if (listener_ != nullptr) tell(set, frame_text(frame), now);
  return true;
}

bool FaultSet::acts(SetFault& set, Time now) {
  if (now < set.begins || now >= set.ends || spent(set)) return false;
  if (set.occasions++ < set.fault.after) return false;
  if (set.fault.probability < 1 && set.random.fraction() >= set.fault.probability) return false;
  ++set.fired;
  return true;
}

bool FaultSet::begins(SetFault& set, const Frame& frame, Time now) {
  if (!set.waits || !happens(set, frame, now)) return false;
  set.fired = 0;  // counted as it begins
  set.waits = false;
  set.begins = now;
  if (set.fault.lasts != kNever) set.ends = earlier(set.ends, now + set.fault.lasts);
  return true;
}

bool FaultSet::beat_due(SetFault& set, Time interval, Time now) {
  if (spent(set) || set.due >= set.ends) set.due = kNever;
  if (set.due > now) return false;
  set.due += interval;
  return true;
}

/// The state that a fault sets the controller to.
constexpr BusState state_of(FaultKind kind) {
  switch (kind) {
    case FaultKind::kBusOff: return BusState::kBusOff;
    case FaultKind::kErrorPassive: return BusState::kErrorPassive;
    case FaultKind::kOverflow: return BusState::kOverflow;
    default: return BusState::kActive;
  }
}

BusState FaultSet::follow_states(Time now) {
  BusState worst = BusState::kActive;
  for (SetFault& set : set_) {
    if (!is_state(set.fault.kind)) continue;
    const bool open = !set.waits && now >= set.begins && now < set.ends;
    if (open && !set.open) {
      set.open = true;
      ++set.fired;
      tell(set, "begins", now);
    }
    if (!open) close(set, now);
    if (now >= set.ends) set.begins = kNever;  // perhaps it never began: the node had no power
    if (open) worst = std::max(worst, state_of(set.fault.kind));
  }
  return worst;
}

Time FaultSet::command_delay() const {
  Time delay = 0;
  for (const SetFault& set : set_)
    if (set.open && set.fault.kind == FaultKind::kSlow) delay = std::max(delay, set.fault.delay);
  return delay;
}

Time FaultSet::deadline() const {
  Time next = kNever;
  for (const SetFault& set : set_) {
    next = earlier(next, set.due);
    if (!is_state(set.fault.kind)) continue;
    if (set.open)
      next = earlier(next, set.ends);
    else if (set.fired == 0 && !set.waits)
      next = earlier(next, set.begins);
  }
  return next;
}

void FaultSet::close(SetFault& set, Time now) {
  if (std::exchange(set.open, false)) tell(set, "ends", now);
}

void FaultSet::say(std::string_view text, Time now) {
  if (listener_ != nullptr) listener_->on_fault(subject_ + ": " + std::string(text), now);
}

void FaultSet::tell(const SetFault& set, std::string_view what, Time now) {
  say("fault " + std::to_string(set.number) + ": " + set.text + ": " + std::string(what), now);
}

}  // namespace cbcan::sim
