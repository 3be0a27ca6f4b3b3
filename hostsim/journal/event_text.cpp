// SPDX-License-Identifier: MIT
#include "journal/event_text.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/setting.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/canopen/sync.hpp"
#include "cbcan/canopen/time_stamp.hpp"
#include "cbcan/regmap.hpp"
#include "descriptions/failures.hpp"
#include "descriptions/values.hpp"
#include "journal/watch.hpp"
#include "sim/frame_text.hpp"
#include "sim/number.hpp"
#include "sim/wire.hpp"

namespace cbcan::journal {

namespace {

using Bytes = std::span<const std::uint8_t>;
using base::append;
using base::Hex;
using namespace std::string_view_literals;

bool is_one_line(Bytes text) {
  return std::ranges::none_of(text, [](std::uint8_t byte) { return byte < ' ' || byte == 0x7F; });
}

/// "1000h:00 Device type"
void append_object(Buffer& to, std::uint16_t index, std::uint8_t sub, const descriptions::Object* name) {
  append(to, Hex{index, 4}, "h:", Hex{sub, 2});
  if (name != nullptr) append(to, ' ', name->name);
}

void append_nmt(Buffer& to, std::string_view command, std::uint8_t node) {
  append(to, "NMT ", command, ": ");
  node == 0 ? append(to, "all nodes") : append(to, "node ", node);
}

// ---- SDO

/// " = 983441" for an expedited transfer.
void append_expedited(Buffer& to, const Frame& frame, const descriptions::Object* name) {
  const std::uint8_t command = frame.data[0];
  if ((command & sdo::kExpedited) == 0) return;
  const bool sized = (command & sdo::kSizeIndicated) != 0;
  const std::size_t size = sized ? sdo::expedited_size(command) : sdo::kExpeditedBytes;
  append(to, " = ");
  append_value(to, std::span(frame.data).subspan(4, size), name);
}

/// Decodes by the command specifier. Segments of blocks have none: they are shown as what their first byte
/// means in other frames.
void append_sdo(Buffer& to, const Frame& frame, std::uint8_t network, std::uint8_t node,
                const FindName& find) {
  static constexpr std::array<std::string_view, 8> kRequests{"write segment",     "write",     "read",
                                                             "read next segment", "abort",     "block read",
                                                             "block write",       "no command"};
  static constexpr std::array<std::string_view, 8> kResponses{
      "segment", "segment written",       "value of",   "written",
      "abort",   "block write confirmed", "block read", "no command"};
  const bool from_client = (frame.id & 0x80) == 0;
  const std::uint8_t specifier = sdo::specifier_of(frame.data[0]);
  append(to, "SDO node ", node, ": ", (from_client ? kRequests : kResponses)[specifier]);
  const bool is_abort = specifier == static_cast<std::uint8_t>(sdo::Request::kAbort);
  if (!is_abort && specifier != (from_client ? 1 : 3) && specifier != 2) return;
  const sdo::Multiplexer mux = sdo::multiplexer_of(frame);
  const descriptions::Object* const name = find(network, node, sdo::index_of(mux), sdo::sub_of(mux));
  append(to, ' ');
  append_object(to, sdo::index_of(mux), sdo::sub_of(mux), name);
  if (!is_abort) return append_expedited(to, frame, name);
  append(to, ": ");
  append(to, descriptions::abort_text(sdo::tail_of(frame)));
}

void append_error_control(Buffer& to, const Frame& frame, std::uint8_t node) {
  append(to, "node ", node);
  if ((frame.flags & Frame::kRemote) != 0) return append(to, ": node guarding request");
  if (frame.data[0] == 0) return append(to, ": boot-up");
  append(to, ": heartbeat or guarding: ", state_text(frame.data[0] & nmt::kStateMask));
}

void append_emergency(Buffer& to, const Frame& frame) {
  const auto message = descriptions::emergency_from(frame.data);
  append(to, "EMCY node ", frame.id & nmt::kMaxNode, ": ", Hex{message.code, 4}, "h ",
         descriptions::emergency_meaning(message.code));
  std::string_view between = "; ";
  descriptions::for_each_error(message.error_register,
                               [&](std::string_view bit) { append(to, std::exchange(between, ", "), bit); });
}

/// Decodes by the default identifiers of CiA 301.
void append_pdo(Buffer& to, const Frame& frame, std::uint8_t node) {
  const bool transmit = (frame.id & 0x80) != 0;
  append(to, transmit ? 'T' : 'R', "PDO", (frame.id - 0x180) / 0x100 + 1, " node ", node);
}

/// Sub-index 128 of 1F82h is all nodes.
void append_nmt_request(Buffer& to, std::uint64_t code, std::uint8_t sub) {
  const auto row = std::ranges::find_if(regmap::kNmtCommands, [code](const regmap::NmtRow& each) {
    return code == each.state_code || code == each.command_code;
  });
  const std::string name =
      row == std::end(regmap::kNmtCommands) ? std::to_string(code) : std::string(row->name);
  if (sub == regmap::kNmtAllNodes) return append_nmt(to, name, 0);
  append(to, "NMT ", name, ": node ", sub);
}

void append_exchange(Buffer& to, const Event& request, const Journal& journal) {
  const Bytes all = journal.bytes(request);
  if (all.empty()) return append(to, "no longer kept");
  if (request.state != 0)
    return append(to, "FC", unsigned{all[0]}, " exception ", Hex{request.state, 2}, 'h');
  const std::size_t size = request.index;
  append_modbus(to, all.first(size), all.subspan(size));
}

/// Uses the names of docs/reference/commands.md: "output:3 on, output:4 off", "analogue-output:1 = -5".
void append_terminals(Buffer& to, const Event& event) {
  const auto value = static_cast<std::int32_t>(event.code);
  const auto kind = std::ranges::find(sim::kTerminals, event.index, &sim::Terminals::index);
  if (kind == sim::kTerminals.end()) {
    append_object(to, event.index, event.sub, nullptr);
    return append(to, " = ", value);
  }
  if (kind->bits == 0) return append(to, kind->name, ':', event.sub, " = ", value);
  std::string_view between;
  for (unsigned bit = 0; bit < kind->bits; ++bit)
    if ((event.state >> bit & 1) != 0)
      append(to, std::exchange(between, ", "), kind->name, ':', (event.sub - 1U) * kind->bits + bit + 1,
             (value >> bit & 1) != 0 ? " on" : " off");
}

/// What is before the frame, or else the words.
void append_subject(Buffer& to, const Event& event) {
  constexpr Kinds kNumbered =
      kinds_of({Kind::kModbus, Kind::kBegun, Kind::kEnded, Kind::kFrame, Kind::kFault, Kind::kAdvice});
  if (event.transaction != 0 && (kinds_of({event.kind}) & kNumbered) != 0)
    append(to, '#', event.transaction, ' ');
  switch (event.kind) {
    case Kind::kModbus: return append(to, "Modbus unit ", event.node, ": ");
    case Kind::kState:
    case Kind::kTerminals: return append(to, "node ", event.node, ' ');
    case Kind::kBoot: return event.node == 0 ? append(to, "module: ") : append(to, "node ", event.node, ": ");
    case Kind::kCommand: return append(to, "command ");
    case Kind::kAdvice: return append(to, "advice: ");
    case Kind::kClient: return append(to, "Modbus client ", event.code, ' ');
    default: return;
  }
}

void append_words(Buffer& to, const Event& event, const Journal& journal, const FindName& find) {
  switch (event.kind) {
    case Kind::kModbus: return append_exchange(to, event, journal);
    case Kind::kFrame: return append_frame(to, event.frame, event.network, find);
    case Kind::kEmergency: return append_emergency(to, event.frame);
    case Kind::kState: return append(to, state_text(event.state));
    case Kind::kTerminals: return append_terminals(to, event);
    default: return append(to, journal.text(event));
  }
}

}  // namespace

void append_modbus(Buffer& to, std::span<const std::uint8_t> pdu, std::span<const std::uint8_t> response) {
  const unsigned function = pdu[0];
  append(to, "FC", function);
  const bool one = function == 6 || function == 22;
  const bool reads = function == 3 || function == 4 || function == 23;
  if (!one && !reads && function != 16) return;
  const std::uint32_t first = word_at(pdu, 1);
  const std::uint32_t count = one ? 1 : word_at(pdu, 3);
  append(to, " R", first);
  if (count > 1) append(to, "..R", first + count - 1);
  const Bytes words = reads ? response.subspan(std::min<std::size_t>(2, response.size()))
                      : one ? pdu.subspan(3)
                            : pdu.subspan(std::min<std::size_t>(6, pdu.size()));
  constexpr std::size_t kMostShown = 16;
  for (std::size_t at = 0; at + 1 < std::min(words.size(), kMostShown); at += 2)
    append(to, at != 0 ? " "sv : reads ? ": "sv : " = "sv, word_at(words, at));
  if (words.size() > kMostShown) append(to, " ...");
}

std::string_view nmt_text(std::uint32_t specifier) {
  for (const regmap::NmtRow& row : regmap::kNmtCommands)
    if (row.specifier == specifier) return row.name;
  return "unknown NMT command";
}

void append_value(Buffer& to, Bytes bytes, DataType type) {
  const std::uint64_t raw = bytes.size() <= 8 ? load_little_endian(bytes) : 0;
  if (descriptions::is_real(type)) return append(to, sim::from_raw(raw, type, bytes.size()));
  if (type == DataType::kBoolean) return append(to, raw != 0 ? "true" : "false");
  if (is_signed(type)) return append(to, sign_extend(raw, bytes.size()));
  if (type == DataType::kVisibleString && is_one_line(bytes))
    return append(to, '"', base::characters(bytes), '"');
  if (size_of(type) != 0) return append(to, raw);
  base::append_value(to, bytes);
}

void append_value(Buffer& to, Bytes bytes, const descriptions::Object* name) {
  const bool fits = name != nullptr && (size_of(name->type) == 0 || size_of(name->type) == bytes.size());
  if (fits) return append_value(to, bytes, name->type);
  if (!bytes.empty() && bytes.size() <= 4) return append(to, load_little_endian(bytes));
  base::append_value(to, bytes);
}

std::span<const StateName> state_names() {
  constexpr auto number = [](nmt::State state) { return static_cast<std::uint8_t>(state); };
  static constexpr std::array<StateName, 5> kNames{{{number(nmt::State::kInitialising), "initialising"},
                                                    {number(nmt::State::kPreOperational), "pre-operational"},
                                                    {number(nmt::State::kOperational), "operational"},
                                                    {number(nmt::State::kStopped), "stopped"},
                                                    {kOff, "off"}}};
  return kNames;
}

std::string_view state_text(std::uint8_t state) {
  const auto found = std::ranges::find(state_names(), state, &StateName::state);
  return found == state_names().end() ? "unknown" : found->name;
}

void append_frame(Buffer& to, const Frame& frame, std::uint8_t network, const FindName& find) {
  if ((frame.flags & Frame::kError) != 0) return append(to, "bus error");
  if ((frame.flags & Frame::kExtended) != 0) return append(to, "29-bit frame");
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if (nmt::is_command(frame)) return append_nmt(to, nmt_text(frame.data[0]), frame.data[1]);
  if (frame.id == Sync::kStandardId) return append(to, "SYNC");
  if (emergency_of(frame)) return append_emergency(to, frame);
  if (frame.id == TimeStamp::kStandardId) return append(to, "TIME");
  if (frame.id == LssSlave::kRequestId) return append(to, "LSS master");
  if (frame.id == LssSlave::kResponseId) return append(to, "LSS slave");
  switch (frame.id & ~std::uint32_t{nmt::kMaxNode}) {
    case nmt::kErrorControlId: return append_error_control(to, frame, node);
    case sdo::kRequestId:
    case sdo::kResponseId: return append_sdo(to, frame, network, node, find);
    default: break;
  }
  if (frame.id > 0x180 && frame.id < sdo::kResponseId)
    append_pdo(to, frame, node);
  else
    append(to, "a frame");
}

std::string_view append_request(Buffer& to, const Event& transaction, const Journal& journal,
                                const descriptions::Object* name) {
  const Bytes value = journal.bytes(transaction);
  switch (transaction.service) {
    case Service::kNone: append(to, "no command"); return {};
    case Service::kState: append(to, "state of node ", transaction.node); return {};
    case Service::kNmt: append_nmt_request(to, load_little_endian(value), transaction.sub); return {};
    default: break;
  }
  append(to, name_of(transaction.service), " node ", transaction.node, ' ');
  append_object(to, transaction.index, transaction.sub, name);
  if (value.empty() || transaction.result != 0) return {};
  append(to, " = ");
  const std::size_t begin = to.size();
  append_value(to, value, name);
  return base::view(to, begin);
}

void append_result(Buffer& to, const Event& ended) {
  if (ended.result == kCancelled) return append(to, "cancelled");
  if (ended.result == kNeverSent)
    return append(to, "cancelled before its first frame (is TIMEOUT too short?)");
  if (ended.result == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError))
    return append(to, descriptions::abort_text(ended.code));
  const std::string_view meaning = regmap::meaning_of(
      regmap::kResults, ended.result, regmap::meaning_of(regmap::kScannerResults, ended.result));
  if (!meaning.empty()) return append(to, meaning);
  append(to, ended.result, " in place of a result");
}

Line append_text(Buffer& to, const Event& event, const Journal& journal, const FindName& find) {
  const descriptions::Object* const name = is_transaction(event) ? name_of(event, find) : nullptr;
  const std::size_t begin = to.size();
  append_subject(to, event);
  const std::size_t frame = to.size();
  std::size_t frame_end = frame;
  if (event.kind == Kind::kFrame) {
    sim::append_frame(to, event.frame);
    frame_end = to.size();
    append(to, ' ');
  }
  const std::size_t words = to.size();
  std::size_t value = 0;
  if (is_transaction(event))
    value = append_request(to, event, journal, name).size();
  else
    append_words(to, event, journal, find);
  const std::size_t words_end = to.size();
  std::size_t outcome = words_end;
  std::size_t outcome_end = words_end;
  if (event.kind == Kind::kEnded) {
    const Bytes bytes = journal.bytes(event);
    if (event.service == Service::kState && event.result == 0 && !bytes.empty())
      append(to, " = ", state_text(bytes[0]));
    append(to, ": ");
    outcome = to.size();
    append_result(to, event);
    outcome_end = to.size();
    append(to, ", ", base::Decimal{event.took, 3}, " ms");
  } else if (event.kind == Kind::kBegun) {
    append(to, " begun");
  } else if (event.kind == Kind::kCommand && event.state == kRefused) {
    append(to, ": refused");
  } else if (event.kind == Kind::kClient) {
    append(to, event.state != 0 ? " joined" : " left");
  }
  const auto part = [&to](std::size_t from, std::size_t end) {
    return std::string_view(to.data() + from, end - from);
  };
  return {.whole = part(begin, to.size()),
          .frame = part(frame, frame_end),
          .words = part(words, words_end),
          .value = part(words_end - value, words_end),
          .outcome = part(outcome, outcome_end),
          .name = name == nullptr ? std::string_view() : name->name};
}

void append_packet_comment(Buffer& to, const Event& event, const Journal& journal, const FindName& find) {
  const bool told = event.kind == Kind::kBegun || event.kind == Kind::kEnded || event.kind == Kind::kFault;
  const bool is_packet = event.kind == Kind::kModbus || event.kind == Kind::kFrame;
  if (told)
    append_text(to, event, journal, find);
  else if (is_packet && event.transaction != 0)
    append(to, "transaction ", event.transaction);
}

}  // namespace cbcan::journal
