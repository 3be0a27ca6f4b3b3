// SPDX-License-Identifier: MIT
// The tables of kinds and keys, then faults from text or from keys and values, and back to text.
#include "sim/faults/fault.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <vector>

#include "base/suggestion.hpp"
#include "base/words.hpp"

namespace cbcan::sim {

namespace {

using base::Form;
using base::Row;
using enum FaultKind;
using enum FaultPlace;

constexpr std::int64_t kDayInMs = 24 * 3600 * 1000;
constexpr std::int64_t kMostId = 0x1FFFFFFF;

constexpr std::array<std::string_view, 7> kSteps{
    "any", "initiate", "segment", "block-segment", "block-acknowledge", "block-end", "abort"};
constexpr std::array<std::string_view, 4> kParts{"any", "id", "dlc", "data"};
constexpr std::array<std::string_view, 5> kModuleCommands{"reset-node", "reset-comm", "stop", "preop", "start"};

template <auto kMember>
constexpr auto key(FaultKind first, FaultKind last, Row row) {
  row.kinds = {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(last)};
  return base::setting<Fault, kMember>(row);
}
template <auto kMember>
constexpr auto key(FaultKind only, Row row) {
  return key<kMember>(only, only, row);
}
template <auto kMember>
constexpr auto time(FaultKind first, FaultKind last, Row row) {
  row.high = kDayInMs;
  row.scale = kMillisecond;
  return key<kMember>(first, last, row);
}
constexpr auto delay(FaultKind only, std::string_view help) {
  return time<&Fault::delay>(only, only, {.key = "delay_ms", .help = help});
}
constexpr auto interval(FaultKind only) {
  return time<&Fault::interval>(only, only,
                                {.key = "interval_ms", .help = "Time between two of them", .low = 1});
}

// clang-format off
constexpr auto kKinds = std::to_array<FaultRow>({
    {"response-never", kNode, "An SDO response is not sent.", {}},
    {"response-late", kNode, "An SDO response is sent late.", {.delay = 50 * kMillisecond}},
    {"response-twice", kNode, "An SDO response is sent twice.", {}},
    {"response-out-of-order", kNode, "An SDO response is sent after the next frame of the node.", {.delay = 100 * kMillisecond}},
    {"response-other-toggle", kNode, "The toggle bit of the response to a segment is inverted.", {}},
    {"response-other-specifier", kNode, "An SDO response has another command specifier; segments of blocks have none.", {}},
    {"response-other-index", kNode, "The response to an initiate request, or an abort, is about another object.", {}},
    {"response-other-size", kNode, "A response of an upload claims another number of bytes than it has.", {}},
    {"response-other-crc", kNode, "The CRC at the end of a block upload has all bits inverted.", {}},
    {"response-other-sequence", kNode,
     "A block segment has the next number; an acknowledgement has one segment less, or one instead of none.", {}},
    {"abort", kNode, "An abort instead of an SDO response.", {.code = 0x08000000}},
    {"short-frame", kNode, "An SDO response is a frame with fewer bytes.", {}},
    {"refuse", kNode, "A write by SDO is refused: an abort, and nothing is stored.", {.code = 0x08000020}},
    {"request-lost", kNode, "An SDO request does not reach the node.", {}},
    {"silent", kNode, "Nothing that the node sends leaves it.", {}},
    {"heartbeat-stops", kNode, "Heartbeats, boot-up messages and responses to node guarding do not leave the node.", {}},
    {"state-wrong", kNode, "Heartbeats and responses to node guarding report another state.", {}},
    {"duplicate-node-id", kNode,
     "A second device has the node's ID: SDO responses, with their data inverted, and error control come from it too.", {}},
    {"boot-up-storm", kNode, "Boot-up messages, one after the other.", {}},
    {"emcy-storm", kNode, "EMCY messages, one after the other.", {.code = 0x1000}},
    {"frame-loss", kBus, "A frame reaches no node.", {}},
    {"frame-twice", kBus, "A frame arrives twice.", {}},
    {"frame-late", kBus, "A frame arrives late.", {.delay = 10 * kMillisecond}},
    {"frame-corrupt", kBus, "A frame arrives with one bit inverted.", {}},
    {"cut", kPlc, "A Modbus request is executed, and its connection closed without a response.", {}},
    {"cut-before", kPlc, "The connection of a Modbus request is closed, and the request not executed.", {}},
    {"late", kPlc, "The response to a Modbus request comes late, while the plant goes on.", {.delay = 500 * kMillisecond}},
    {"exception", kPlc, "A Modbus request is answered by an exception, and not executed.", {.code = 4}},
    {"plc-restart", kPlc, "The command after -- is killed and starts again, while the plant goes on.", {}},
    {"module-restart", kPlc, "The module is switched off and on: all registers are 0, and connections are closed.", {}},
    {"module-nmt", kBus, "Another master sends an NMT command to the module, after a frame of it.", {}},
    {"power", kNode, "The node loses its power, with the frame that it would get or send.", {}},
    {"bus-off", kNodeOrBus, "The controller, or every one on the bus, is bus-off.", {}},
    {"module-bus-off", kBus, "The module's controller is bus-off.", {}},
    {"error-passive", kNodeOrBus, "The controller, or every one on the bus, is error-passive.", {}},
    {"overflow", kNodeOrBus, "The controller, or every one on the bus, reports lost frames.", {}},
    {"slow", kNode, "A drive acts on a controlword late, and of the words until then only on the last.", {.delay = 50 * kMillisecond}},
    {"bus-load", kBus, "Another node sends all the time.", {}},
});
static_assert(kKinds.size() == kFaultKinds);

constexpr std::array kKeys{
    delay(kResponseLate, "Delay in ms"),
    delay(kResponseTwice, "Delay after the first, in ms"),
    delay(kResponseOutOfOrder, "Longest delay, if the node sends no other frame"),
    key<&Fault::specifier>(kResponseOtherSpecifier, {
        .key = "specifier", .help = "Upper three bits of the first byte", .high = 7}),
    key<&Fault::other_index>(kResponseOtherIndex, {
        .key = "other_index", .help = "Index in the response", .form = Form::kHexadecimal, .high = 0xFFFF, .absent = "one more"}),
    key<&Fault::other_sub>(kResponseOtherIndex, {
        .key = "other_sub", .help = "Sub-index in the response", .high = 0xFF, .absent = "the right one"}),
    key<&Fault::size>(kResponseOtherSize, {
        .key = "size", .help = "Bytes to claim, as far as the field holds them", .high = 0xFFFFFFFF, .absent = "one less"}),
    key<&Fault::code>(kAbort, {.key = "code", .help = "SDO abort code", .form = Form::kHexadecimal}),
    key<&Fault::code>(kRefuse, {
        .key = "code", .help = "SDO abort code", .form = Form::kHexadecimal, .low = 1, .high = 0xFFFFFFFF}),
    key<&Fault::length>(kShortFrame, {.key = "length", .help = "DLC that is left", .high = 7}),
    key<&Fault::state>(kStateWrong, {.key = "state", .help = "NMT state that is reported", .high = 127}),
    interval(kBootUpStorm),
    key<&Fault::code>(kEmcyStorm, {
        .key = "code", .help = "EMCY error code", .form = Form::kHexadecimal, .high = 0xFFFF}),
    interval(kEmcyStorm),
    delay(kFrameLate, "Delay in ms"),
    key<&Fault::part>(kFrameCorrupt, {.key = "part", .help = "Where the bit is", .choices = kParts}),
    delay(kLate, "Delay in ms"),
    key<&Fault::code>(kException, {.key = "code", .help = "Exception code", .low = 1, .high = 255}),
    key<&Fault::command>(kModuleNmt, {.key = "command", .help = "The command", .choices = kModuleCommands}),
    delay(kSlow, "Delay in ms"),
    key<&Fault::percent>(kBusLoad, {
        .key = "percent", .help = "Of the bit rate; of 1 Mbit/s where there is none", .low = 1, .high = 100}),
    key<&Fault::rate>(kBusLoad, {
        .key = "frames_per_s", .help = "Instead of a part of the bus; 0 = as percent says", .high = 20000}),
    key<&Fault::id>(kBusLoad, {
        .key = "id", .help = "CAN-ID of the frames, which have eight bytes 0", .form = Form::kHexadecimal, .high = 0x7FF}),

    key<&Fault::after>(kResponseNever, kOverflow, {.key = "after", .help = "Matching frames to skip first"}),
    key<&Fault::count>(kResponseNever, kPower, {
        .key = "count", .help = "How often the fault acts; 0 = no limit"}),
    key<&Fault::probability>(kResponseNever, kPower, {
        .key = "probability", .help = "Chance for each matching frame", .high = 1}),
    key<&Fault::seed>(kResponseNever, kPower, {.key = "seed", .help = "Selects another random sequence"}),
    time<&Fault::from>(kResponseNever, kBusLoad, {.key = "from_ms", .help = "Delay before the fault starts, in ms"}),
    time<&Fault::until>(kResponseNever, kBusLoad, {
        .key = "until_ms", .help = "When it ends, in ms after it was set", .low = 1, .absent = "never"}),
    time<&Fault::lasts>(kPower, kOverflow, {.key = "for_ms", .help = "How long it lasts, in ms", .low = 1, .absent = "to the end"}),
    key<&Fault::index>(kResponseNever, kRequestLost, {
        .key = "index", .help = "Transfers of this object only", .form = Form::kHexadecimal, .high = 0xFFFF, .absent = "any"}),
    key<&Fault::sub>(kResponseNever, kRequestLost, {
        .key = "sub", .help = "Transfers of this sub-index only", .high = 0xFF, .absent = "any"}),
    key<&Fault::step>(kResponseNever, kShortFrame, {
        .key = "step", .help = "Responses only that are this within their transfer", .choices = kSteps}),
    key<&Fault::first_id>(kFrameLoss, kFrameCorrupt, {
        .key = "first_id", .help = "Frames with this CAN-ID or a higher one only", .form = Form::kHexadecimal, .high = kMostId}),
    key<&Fault::last_id>(kFrameLoss, kFrameCorrupt, {
        .key = "last_id", .help = "Frames with this CAN-ID or a lower one only", .form = Form::kHexadecimal, .high = kMostId}),
};
// clang-format on

}  // namespace

std::span<const FaultRow> fault_rows() {
  return kKinds;
}

const FaultRow& row_of(FaultKind kind) {
  return kKinds[static_cast<std::size_t>(kind)];
}

std::span<const base::Setting<Fault>> fault_settings() {
  return kKeys;
}

bool allowed(FaultPlace of_kind, FaultPlace here) {
  return of_kind == here || (of_kind == kNodeOrBus && here != kPlc);
}

std::string_view name_of(FaultPlace place) {
  constexpr std::array<std::string_view, 4> kNames{"a node", "the bus", "the PLC", "a node or the bus"};
  return kNames[static_cast<std::size_t>(place)];
}

// ---- Text

namespace {

/// The keys of the kind.
std::vector<const base::Setting<Fault>*> settings_of(FaultKind kind) {
  std::vector<const base::Setting<Fault>*> settings;
  for (const auto& setting : kKeys)
    if (setting.kinds.has(static_cast<std::size_t>(kind))) settings.push_back(&setting);
  return settings;
}

const base::Setting<Fault>* find(FaultKind kind, std::string_view key) {
  const auto settings = settings_of(kind);
  const auto found = std::ranges::find(settings, key, [](const auto* setting) { return setting->key; });
  return found == settings.end() ? nullptr : *found;
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
  std::vector<std::string_view> keys;
  for (const auto* setting : settings_of(kind))
    keys.push_back(setting->key);
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

namespace {

std::string written(const Fault& fault, bool with_own) {
  const FaultRow& row = row_of(fault.kind);
  std::string text(row.name);
  for (const auto* setting : settings_of(fault.kind)) {
    const base::Value value = setting->load(*setting, fault);
    const bool own = setting->kinds.first == setting->kinds.last && setting->absent.empty();
    if ((own && with_own) || value != setting->load(*setting, row.standard))
      text += fmt::format(" {}={}", setting->key, base::written(*setting, value));
  }
  return text;
}

}  // namespace

std::string text_of(const Fault& fault) {
  return written(fault, true);
}

std::string short_text_of(const Fault& fault) {
  return written(fault, false);
}

bool has_key(FaultKind kind, std::string_view key) {
  return find(kind, key) != nullptr;
}

}  // namespace cbcan::sim
