// SPDX-License-Identifier: MIT
#include "sim/faults/fault.hpp"

// The tables of kinds and keys, then faults from text or from keys and values, and back to text.

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/text.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::sim {

namespace {

using base::Form;
using base::Row;
using enum FaultPlace;

constexpr std::int64_t kDayInMs = 24 * 3600 * 1000;
constexpr std::int64_t kMostId = 0x1FFFFFFF;

constexpr std::array<std::string_view, 7> kSteps{
    "any", "initiate", "segment", "block-segment", "block-acknowledge", "block-end", "abort"};
constexpr std::array<std::string_view, 4> kParts{"any", "id", "dlc", "data"};
constexpr std::array<std::string_view, 5> kModuleCommands{"reset-node", "reset-comm", "stop", "preop",
                                                          "start"};

template <auto kMember>
constexpr auto time(Row row) {
  row.high = kDayInMs;
  row.scale = kMillisecond;
  return base::setting<kMember>(row);
}
constexpr auto delay(std::string_view help) {
  return time<&Fault::delay>({.key = "delay_ms", .help = help});
}

// clang-format off
/// Groups of keys that kinds share, in the order of the keys in a fault's text; then what kinds have of them.
enum Shared : unsigned {
  kAfter = 1, kChance = 2, kTimes = 4, kLasts = 8, kObject = 16, kStep = 32, kIds = 64,
  kActs = kAfter | kChance | kTimes, kOfRequest = kActs | kObject, kOfResponse = kOfRequest | kStep, kOfFrame = kActs | kIds,
  kPowers = kActs | kLasts, kState = kAfter | kTimes | kLasts,
};

// Keys of one kind.
constexpr std::array kDelay{delay("Delay in ms")};
constexpr std::array kDelayAfterFirst{delay("Delay after the first, in ms")};
constexpr std::array kLongestDelay{delay("Longest delay, if the node sends no other frame")};
constexpr std::array kSpecifier{base::setting<&Fault::specifier>({
    .key = "specifier", .help = "Upper three bits of the first byte", .high = 7})};
constexpr std::array kOther{
    base::setting<&Fault::other_index>({
        .key = "other_index", .help = "Index in the response", .form = Form::kHexadecimal, .high = 0xFFFF, .absent = "one more"}),
    base::setting<&Fault::other_sub>({
        .key = "other_sub", .help = "Sub-index in the response", .high = 0xFF, .absent = "the right one"})};
constexpr std::array kSize{base::setting<&Fault::size>({
    .key = "size", .help = "Bytes to claim, as far as the field holds them", .high = 0xFFFFFFFF, .absent = "one less"})};
constexpr std::array kAbortCode{base::setting<&Fault::code>({
    .key = "code", .help = "SDO abort code", .form = Form::kHexadecimal})};
constexpr std::array kRefusalCode{base::setting<&Fault::code>({
    .key = "code", .help = "SDO abort code", .form = Form::kHexadecimal, .low = 1, .high = 0xFFFFFFFF})};
constexpr std::array kLength{base::setting<&Fault::length>({.key = "length", .help = "DLC that is left", .high = 7})};
constexpr std::array kNmtState{base::setting<&Fault::state>({
    .key = "state", .help = "NMT state that is reported", .high = 127})};
constexpr auto kInterval = time<&Fault::interval>({.key = "interval_ms", .help = "Time between two of them", .low = 1});
constexpr std::array kBootUps{kInterval};
constexpr std::array kEmergencies{
    base::setting<&Fault::code>({.key = "code", .help = "EMCY error code", .form = Form::kHexadecimal, .high = 0xFFFF}),
    kInterval};
constexpr std::array kPart{base::setting<&Fault::part>({.key = "part", .help = "Where the bit is", .choices = kParts})};
constexpr std::array kExceptionCode{base::setting<&Fault::code>({
    .key = "code", .help = "Exception code", .low = 1, .high = 255})};
constexpr std::array kCommand{base::setting<&Fault::command>({
    .key = "command", .help = "The command", .choices = kModuleCommands})};
constexpr std::array kLoad{
    base::setting<&Fault::percent>({
        .key = "percent", .help = "Of the bit rate; of 1 Mbit/s where there is none", .low = 1, .high = 100}),
    base::setting<&Fault::rate>({
        .key = "frames_per_s", .help = "Instead of a part of the bus; 0 = as percent says", .high = 20000}),
    base::setting<&Fault::id>({
        .key = "id", .help = "CAN-ID of the frames, which have eight bytes 0", .form = Form::kHexadecimal, .high = 0x7FF})};

struct SharedKey {
  Shared group;
  base::Setting<Fault> setting;
};
constexpr auto kShared = std::to_array<SharedKey>({
    {kAfter, base::setting<&Fault::after>({.key = "after", .help = "Matching frames to skip first"})},
    {kChance, base::setting<&Fault::count>({.key = "count", .help = "How often the fault acts; 0 = no limit"})},
    {kChance, base::setting<&Fault::probability>({
        .key = "probability", .help = "Chance for each matching frame", .high = 1})},
    {kChance, base::setting<&Fault::seed>({.key = "seed", .help = "Selects another random sequence"})},
    {kTimes, time<&Fault::from>({.key = "from_ms", .help = "Delay before the fault starts, in ms"})},
    {kTimes, time<&Fault::until>({
        .key = "until_ms", .help = "When it ends, in ms after it was set", .low = 1, .absent = "never"})},
    {kLasts, time<&Fault::lasts>({.key = "for_ms", .help = "How long it lasts, in ms", .low = 1, .absent = "to the end"})},
    {kObject, base::setting<&Fault::index>({
        .key = "index", .help = "Transfers of this object only", .form = Form::kHexadecimal, .high = 0xFFFF, .absent = "any"})},
    {kObject, base::setting<&Fault::sub>({
        .key = "sub", .help = "Transfers of this sub-index only", .high = 0xFF, .absent = "any"})},
    {kStep, base::setting<&Fault::step>({
        .key = "step", .help = "Responses only that are this within their transfer", .choices = kSteps})},
    {kIds, base::setting<&Fault::first_id>({
        .key = "first_id", .help = "Frames with this CAN-ID or a higher one only", .form = Form::kHexadecimal, .high = kMostId})},
    {kIds, base::setting<&Fault::last_id>({
        .key = "last_id", .help = "Frames with this CAN-ID or a lower one only", .form = Form::kHexadecimal, .high = kMostId})},
});

constexpr auto kKinds = std::to_array<FaultRow>({
    {"response-never", kOfResponse, {}, kNode, "An SDO response is not sent.", {}},
    {"response-late", kOfResponse, kDelay, kNode, "An SDO response is sent late.", {.delay = 50 * kMillisecond}},
    {"response-twice", kOfResponse, kDelayAfterFirst, kNode, "An SDO response is sent twice.", {}},
    {"response-out-of-order", kOfResponse, kLongestDelay, kNode, "An SDO response is sent after the next frame of the node.", {.delay = 100 * kMillisecond}},
    {"response-other-toggle", kOfResponse, {}, kNode, "The toggle bit of the response to a segment is inverted.", {}},
    {"response-other-specifier", kOfResponse, kSpecifier, kNode, "An SDO response has another command specifier; segments of blocks have none.", {}},
    {"response-other-index", kOfResponse, kOther, kNode, "The response to an initiate request, or an abort, is about another object.", {}},
    {"response-other-size", kOfResponse, kSize, kNode, "A response of an upload claims another number of bytes than it has.", {}},
    {"response-other-crc", kOfResponse, {}, kNode, "The CRC at the end of a block upload has all bits inverted.", {}},
    {"response-other-sequence", kOfResponse, {}, kNode,
     "A block segment has the next number; an acknowledgement has one segment less, or one instead of none.", {}},
    {"abort", kOfResponse, kAbortCode, kNode, "An abort instead of an SDO response.", {.code = 0x08000000}},
    {"short-frame", kOfResponse, kLength, kNode, "An SDO response is a frame with fewer bytes.", {}},
    {"refuse", kOfRequest, kRefusalCode, kNode, "A write by SDO is refused: an abort, and nothing is stored.", {.code = 0x08000020}},
    {"request-lost", kOfRequest, {}, kNode, "An SDO request does not reach the node.", {}},
    {"silent", kActs, {}, kNode, "Nothing that the node sends leaves it.", {}},
    {"heartbeat-stops", kActs, {}, kNode, "Heartbeats, boot-up messages and responses to node guarding do not leave the node.", {}},
    {"state-wrong", kActs, kNmtState, kNode, "Heartbeats and responses to node guarding report another state.", {}},
    {"duplicate-node-id", kActs, {}, kNode,
     "A second device has the node's ID: SDO responses, with their data inverted, and error control come from it too.", {}},
    {"boot-up-storm", kActs, kBootUps, kNode, "Boot-up messages, one after the other.", {}},
    {"emcy-storm", kActs, kEmergencies, kNode, "EMCY messages, one after the other.", {.code = 0x1000}},
    {"frame-loss", kOfFrame, {}, kBus, "A frame reaches no node.", {}},
    {"frame-twice", kOfFrame, {}, kBus, "A frame arrives twice.", {}},
    {"frame-late", kOfFrame, kDelay, kBus, "A frame arrives late.", {.delay = 10 * kMillisecond}},
    {"frame-corrupt", kOfFrame, kPart, kBus, "A frame arrives with one bit inverted.", {}},
    {"cut", kActs, {}, kPlc, "A Modbus request is executed, and its connection closed without a response.", {}},
    {"cut-before", kActs, {}, kPlc, "The connection of a Modbus request is closed, and the request not executed.", {}},
    {"late", kActs, kDelay, kPlc, "The response to a Modbus request comes late, while the plant goes on.", {.delay = 500 * kMillisecond}},
    {"exception", kActs, kExceptionCode, kPlc, "A Modbus request is answered by an exception, and not executed.", {.code = 4}},
    {"plc-restart", kActs, {}, kPlc, "The command after -- is killed and starts again, while the plant goes on.", {}},
    {"module-restart", kActs, {}, kPlc, "The module is switched off and on: all registers are 0, the request's connection closed.", {}},
    {"module-nmt", kActs, kCommand, kBus, "Another master sends an NMT command to the module, after a frame of it.", {}},
    {"power", kPowers, {}, kNode, "The node loses its power, with the frame that it would get or send.", {}},
    {"bus-off", kState, {}, kNodeOrBus, "The controller, or every one on the bus, is bus-off.", {}},
    {"module-bus-off", kState, {}, kBus, "The module's controller is bus-off.", {}},
    {"error-passive", kState, {}, kNodeOrBus, "The controller, or every one on the bus, is error-passive.", {}},
    {"overflow", kState, {}, kNodeOrBus, "The controller, or every one on the bus, reports lost frames.", {}},
    {"slow", kTimes, kDelay, kNode, "A drive acts on a controlword late, and of the words until then only on the last.", {.delay = 50 * kMillisecond}},
    {"bus-load", kTimes, kLoad, kBus, "Another node sends all the time.", {}},
});
static_assert(kKinds.size() == kFaultKinds);

// clang-format on

/// Numbers and seeds that differ in one bit give unrelated sequences.
std::uint64_t seed_of(std::uint64_t set, std::uint64_t fault, std::uint64_t number) {
  return Random(Random(Random(set).next() ^ fault).next() ^ number).next();
}

bool spent(const SetFault& set) {
  return set.fault.count != 0 && set.fired == set.fault.count;
}

/// Null also where kind_of() has found none.
const base::Setting<Fault>* find(FaultKind kind, std::string_view key) {
  if (static_cast<std::size_t>(kind) == kFaultKinds) return nullptr;
  const auto keys = keys_of(row_of(kind));
  const auto found = std::ranges::find(keys, key, [](const auto* setting) { return setting->key; });
  return found == keys.end() ? nullptr : *found;
}

/// The kind of this name; FaultKind(kFaultKinds) = none.
FaultKind kind_of(std::string_view name) {
  return static_cast<FaultKind>(std::ranges::find(kKinds, name, &FaultRow::name) - kKinds.begin());
}

std::string no_such_kind(std::string_view name, FaultPlace here) {
  std::vector<std::string_view> names;
  for (const FaultRow& row : kKinds)
    if (allowed(row.place, here)) names.push_back(row.name);
  const std::string suggestion = base::did_you_mean(name, names);
  return fmt::format("fault \"{}\": no such kind{}", name,
                     suggestion.empty() ? "; there are " + base::listed(names, " and ") : suggestion);
}

std::string no_such_key(FaultKind kind, std::string_view key) {
  const auto keys = base::column(keys_of(row_of(kind)), [](const auto* setting) { return setting->key; });
  return fmt::format("{}: no such key; there are {}", key, base::listed(keys, " and "));
}

std::string store(Fault& fault, const FaultKey& key) {
  const auto* setting = find(fault.kind, key.key);
  if (setting == nullptr) return no_such_key(fault.kind, key.key);
  const base::Problem problem =
      key.value ? base::assign(*setting, fault, *key.value) : base::wrong_form(*setting);
  if (problem.empty()) return {};
  return fmt::format("{}{}: {}", key.key, key.value ? " " + base::value_text(*key.value) : "", problem);
}

std::string store_all(Fault& fault, std::span<const FaultKey> keys) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (std::ranges::count(keys.first(i), keys[i].key, &FaultKey::key) != 0)
      return fmt::format("{}: given twice", keys[i].key);
    if (std::string problem = store(fault, keys[i]); !problem.empty()) return problem;
  }
  if (fault.until <= fault.from) return "until_ms: must be more than from_ms";
  if (fault.last_id < fault.first_id) return "last_id: must not be less than first_id";
  if (fault.sub != Fault::kUnset && fault.index == Fault::kUnset) return "sub: index is missing";
  return {};
}

}  // namespace

std::span<const FaultRow> fault_rows() {
  return kKinds;
}

const FaultRow& row_of(FaultKind kind) {
  return kKinds[static_cast<std::size_t>(kind)];
}

std::vector<const base::Setting<Fault>*> keys_of(const FaultRow& row) {
  std::vector<const base::Setting<Fault>*> keys;
  for (const auto& own : row.own)
    keys.push_back(&own);
  for (const SharedKey& key : kShared)
    if ((row.shared & key.group) != 0) keys.push_back(&key.setting);
  return keys;
}

bool allowed(FaultPlace of_kind, FaultPlace here) {
  return of_kind == here || (of_kind == kNodeOrBus && here != kPlc);
}

std::string_view name_of(FaultPlace place) {
  constexpr std::array<std::string_view, 4> kNames{"a node", "the bus", "the PLC", "a node or the bus"};
  return kNames[static_cast<std::size_t>(place)];
}

// ---- Text

FaultOrProblem make_fault(std::string_view name, std::span<const FaultKey> keys, FaultPlace here) {
  const FaultKind kind = kind_of(name);
  if (static_cast<std::size_t>(kind) == kFaultKinds) return {{}, no_such_kind(name, here)};
  if (!allowed(row_of(kind).place, here))
    return {{},
            fmt::format("{}: a fault of {}, not of {}", name, name_of(row_of(kind).place), name_of(here))};
  Fault fault = row_of(kind).standard;
  fault.kind = kind;
  const std::string problem = store_all(fault, keys);
  return {fault, problem.empty() ? "" : fmt::format("{}: {}", name, problem)};
}

FaultOrProblem parse_fault(std::string_view text, FaultPlace here) {
  const std::vector<std::string_view> words = base::words_of(text);
  if (words.empty()) return make_fault("", {}, here);
  std::vector<FaultKey> keys;
  for (const std::string_view word : std::span(words).subspan(1)) {
    const auto sides = base::split(word, '=');
    if (!sides || sides->second.empty())
      return {{}, fmt::format("{}: \"{}\": write key=value", words[0], word)};
    const auto* setting = find(kind_of(words[0]), sides->first);
    keys.push_back({sides->first, {}});
    if (setting != nullptr) keys.back().value = base::typed(*setting, sides->second);
  }
  return make_fault(words[0], keys, here);
}

std::string text_of(const Fault& fault, bool with_own) {
  const FaultRow& row = row_of(fault.kind);
  std::string text(row.name);
  const auto keys = keys_of(row);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto* const setting = keys[i];
    const base::Value value = setting->load(*setting, fault);
    const bool is_own = i < row.own.size() && setting->absent.empty();
    if ((is_own && with_own) || value != setting->load(*setting, row.standard))
      text += fmt::format(" {}={}", setting->key, base::written(*setting, value));
  }
  return text;
}

bool has_key(FaultKind kind, std::string_view key) {
  return find(kind, key) != nullptr;
}

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
