// SPDX-License-Identifier: MIT
// The tables: keys, groups of keys, kinds.
#include <array>
#include <type_traits>

#include "sim/faults/fault.hpp"

namespace cbcan::sim {

namespace {

using Form = FaultParameter::Form;

template <auto kMember, std::uint32_t kUnit>
void store(Fault& fault, double value) {
  using Number = std::remove_reference_t<decltype(fault.*kMember)>;
  fault.*kMember = static_cast<Number>(value * kUnit);
}

template <auto kMember, std::uint32_t kUnit>
double load(const Fault& fault) {
  return static_cast<double>(fault.*kMember) / kUnit;
}

template <auto kMember, std::uint32_t kUnit = 1>
constexpr FaultParameter number(std::string_view key, double low, double high, double standard,
                                std::string_view meaning, Form form = Form::kDecimal,
                                std::string_view absent = {}) {
  return {key, form, low, high, standard, absent, {}, meaning, store<kMember, kUnit>, load<kMember, kUnit>};
}

template <auto kMember>
constexpr FaultParameter choice(std::string_view key, std::span<const std::string_view> choices,
                                std::string_view meaning) {
  const auto last = static_cast<double>(choices.size() - 1);
  return {key, Form::kChoice, 0, last, 0, {}, choices, meaning, store<kMember, 1>, load<kMember, 1>};
}

void store_until(Fault& fault, double value) {
  fault.until = value < 0 ? kNever : static_cast<Time>(value) * kMillisecond;
}
double load_until(const Fault& fault) {
  return fault.until == kNever ? double{Fault::kUnset} : static_cast<double>(fault.until / kMillisecond);
}

constexpr double kMostMs = 24 * 3600 * 1000.0;
constexpr double kMost32 = 0xFFFFFFFFp0;
constexpr double kMostId = 0x1FFFFFFFp0;
constexpr double kNone = Fault::kUnset;

constexpr std::array<std::string_view, 7> kSteps{
    "any", "initiate", "segment", "block-segment", "block-acknowledge", "block-end", "abort"};
constexpr std::array<std::string_view, 4> kParts{"any", "id", "dlc", "data"};

// ---- Keys that kinds share

constexpr std::array kWindow{
    number<&Fault::from, 1000>("from_ms", 0, kMostMs, 0, "Begins so long after it has been set."),
    FaultParameter{"until_ms",
                   Form::kDecimal,
                   1,
                   kMostMs,
                   kNone,
                   "for ever",
                   {},
                   "Is over so long after it has been set.",
                   store_until,
                   load_until},
};
constexpr std::array kOccasions{
    number<&Fault::after>("after", 0, kMost32, 0, "So many occasions pass unharmed first."),
    number<&Fault::count>("count", 0, kMost32, 0, "Happens so many times, then no more; 0 = for ever."),
    number<&Fault::probability>("probability", 0, 1, 1, "That it happens on an occasion.", Form::kFraction),
    number<&Fault::seed>("seed", 0, kMost32, 0, "Makes another random sequence."),
};
constexpr std::array kResponses{
    number<&Fault::index>("index", 0, 0xFFFF, kNone, "Transfers of this object only.", Form::kHex, "any"),
    number<&Fault::sub>("sub", 0, 0xFF, kNone, "Transfers of this sub-index only.", Form::kDecimal, "any"),
    choice<&Fault::step>("step", kSteps, "Responses only that are this within their transfer."),
};
constexpr std::array kIdentifiers{
    number<&Fault::first_id>("first_id", 0, kMostId, 0, "Frames with this CAN-ID or a higher one only.",
                             Form::kHex),
    number<&Fault::last_id>("last_id", 0, kMostId, kMostId, "Frames with this CAN-ID or a lower one only.",
                            Form::kHex),
};

using Keys = std::span<const FaultParameter>;
constexpr std::array<Keys, 4> kAllGroups{kOccasions, kWindow, kResponses, kIdentifiers};
constexpr std::array<Keys, 3> kOfResponses{kOccasions, kWindow, kResponses};
constexpr std::array<Keys, 2> kOfOccasions{kOccasions, kWindow};
constexpr std::array<Keys, 3> kOfFrames{kOccasions, kWindow, kIdentifiers};
constexpr std::array<Keys, 1> kOfStates{kWindow};

// ---- Keys of one kind

constexpr FaultParameter delay(double standard, std::string_view meaning) {
  return number<&Fault::delay, 1000>("delay_ms", 0, kMostMs, standard, meaning);
}
constexpr FaultParameter interval(double standard) {
  return number<&Fault::interval, 1000>("interval_ms", 1, kMostMs, standard, "Time between two of them.");
}

constexpr std::array kLate{delay(50, "How late.")};
constexpr std::array kTwice{delay(0, "How long after the first.")};
constexpr std::array kOutOfOrder{delay(100, "Comes after so long if nothing else is sent before.")};
constexpr std::array kSpecifier{
    number<&Fault::specifier>("specifier", 0, 7, 7, "Upper three bits of the first byte.")};
constexpr std::array kOtherObject{
    number<&Fault::other_index>("other_index", 0, 0xFFFF, kNone, "Index in the response.", Form::kHex,
                                "one more"),
    number<&Fault::other_sub>("other_sub", 0, 0xFF, kNone, "Sub-index in the response.", Form::kDecimal,
                              "the right one"),
};
constexpr std::array kSize{
    number<&Fault::size>("size", 0, kMost32, kNone, "Bytes to claim, as far as the field holds them.",
                         Form::kDecimal, "one less"),
};
constexpr std::array kAbortCode{
    number<&Fault::code>("code", 0, kMost32, 0x08000000, "SDO abort code.", Form::kHex)};
constexpr std::array kLength{number<&Fault::length>("length", 0, 7, 7, "DLC that is left.")};
constexpr std::array kState{number<&Fault::state>("state", 0, 127, 4, "NMT state that is reported.")};
constexpr std::array kBootUps{interval(10)};
constexpr std::array kEmcys{
    number<&Fault::code>("code", 0, 0xFFFF, 0x1000, "EMCY error code.", Form::kHex),
    interval(10),
};
constexpr std::array kFrameDelay{delay(10, "How late.")};
constexpr std::array kPart{choice<&Fault::part>("part", kParts, "Where the bit is.")};
constexpr std::array kLoad{
    number<&Fault::percent>("percent", 1, 100, 50, "Of the bit rate; of 1 Mbit/s where there is none."),
    number<&Fault::rate>("frames_per_s", 0, 20000, 0, "Instead of a part of the bus; 0 = as percent says."),
    number<&Fault::id>("id", 0, 0x7FF, 0x7FF, "CAN-ID of the frames, which have eight bytes 0.", Form::kHex),
};

using enum FaultKind;
using enum FaultPlace;

constexpr std::array<FaultRow, kFaultKinds> kRows{{
    {kResponseNever, "response-never", kNode, {}, kOfResponses, "An SDO response is not sent."},
    {kResponseLate, "response-late", kNode, kLate, kOfResponses, "An SDO response is sent late."},
    {kResponseTwice, "response-twice", kNode, kTwice, kOfResponses, "An SDO response is sent twice."},
    {kResponseOutOfOrder, "response-out-of-order", kNode, kOutOfOrder, kOfResponses,
     "An SDO response is sent after the next frame of the node."},
    {kResponseOtherToggle,
     "response-other-toggle",
     kNode,
     {},
     kOfResponses,
     "The toggle bit of a segment's response is the other one."},
    {kResponseOtherSpecifier, "response-other-specifier", kNode, kSpecifier, kOfResponses,
     "An SDO response has another command specifier; segments of blocks have none."},
    {kResponseOtherIndex, "response-other-index", kNode, kOtherObject, kOfResponses,
     "The response to an initiate request, or an abort, is about another object."},
    {kResponseOtherSize, "response-other-size", kNode, kSize, kOfResponses,
     "A response of an upload claims another number of bytes than it has."},
    {kResponseOtherCrc,
     "response-other-crc",
     kNode,
     {},
     kOfResponses,
     "The CRC at the end of a block upload is inverted."},
    {kResponseOtherSequence,
     "response-other-sequence",
     kNode,
     {},
     kOfResponses,
     "A block segment has the next number; an acknowledgement tells of one segment less, or of one for "
     "none."},
    {kAbort, "abort", kNode, kAbortCode, kOfResponses, "An abort instead of an SDO response."},
    {kShortFrame, "short-frame", kNode, kLength, kOfResponses,
     "An SDO response is a frame with fewer bytes."},
    {kSilent, "silent", kNode, {}, kOfOccasions, "Nothing that the node sends leaves it."},
    {kHeartbeatStops,
     "heartbeat-stops",
     kNode,
     {},
     kOfOccasions,
     "Heartbeats, boot-up messages and responses to node guarding do not leave the node."},
    {kStateWrong, "state-wrong", kNode, kState, kOfOccasions,
     "Heartbeats and responses to node guarding report another state."},
    {kDuplicateNodeId,
     "duplicate-node-id",
     kNode,
     {},
     kOfOccasions,
     "A second device has the node's ID: SDO responses, its data inverted, and error control come from it "
     "too."},
    {kBootUpStorm, "boot-up-storm", kNode, kBootUps, kOfOccasions, "Boot-up messages, one after the other."},
    {kEmcyStorm, "emcy-storm", kNode, kEmcys, kOfOccasions, "EMCY messages, one after the other."},
    {kFrameLoss, "frame-loss", kBus, {}, kOfFrames, "A frame reaches nobody."},
    {kFrameTwice, "frame-twice", kBus, {}, kOfFrames, "A frame arrives twice."},
    {kFrameLate, "frame-late", kBus, kFrameDelay, kOfFrames, "A frame arrives late."},
    {kFrameCorrupt, "frame-corrupt", kBus, kPart, kOfFrames, "A frame arrives with one bit inverted."},
    {kBusOff, "bus-off", kNodeOrBus, {}, kOfStates, "The controller, or every one on the bus, is bus-off."},
    {kErrorPassive,
     "error-passive",
     kNodeOrBus,
     {},
     kOfStates,
     "The controller, or every one on the bus, is error-passive."},
    {kOverflow,
     "overflow",
     kNodeOrBus,
     {},
     kOfStates,
     "The controller, or every one on the bus, tells of lost frames."},
    {kBusLoad, "bus-load", kBus, kLoad, kOfStates, "Somebody else sends all the time."},
}};

constexpr bool in_order() {
  for (std::size_t i = 0; i < kRows.size(); ++i)
    if (kRows[i].kind != static_cast<FaultKind>(i)) return false;
  return true;
}
static_assert(in_order());

}  // namespace

std::span<const FaultRow> fault_rows() {
  return kRows;
}

const FaultRow& row_of(FaultKind kind) {
  return kRows[static_cast<std::size_t>(kind)];
}

std::span<const std::span<const FaultParameter>> fault_groups() {
  return kAllGroups;
}

bool allowed(FaultPlace of_kind, FaultPlace here) {
  return of_kind == kNodeOrBus || of_kind == here;
}

}  // namespace cbcan::sim
