// SPDX-License-Identifier: MIT
#include "journal/words.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/regmap.hpp"
#include "eds/emergency.hpp"
#include "journal/watch.hpp"
#include "sim/frame_text.hpp"
#include "sim/wire.hpp"
#include "text/numbers.hpp"
#include "text/value.hpp"

namespace cbcan::journal {

namespace {

using Bytes = std::span<const std::uint8_t>;

bool is_one_line(Bytes text) {
  return std::ranges::none_of(text, [](std::uint8_t byte) { return byte < ' ' || byte == 0x7F; });
}

/// "1000h:00 Device type"
std::string object_text(std::uint16_t index, std::uint8_t sub, const eds::ObjectName* name) {
  return fmt::format("{:04X}h:{:02X}{}{}", index, sub, name == nullptr ? "" : " ",
                     name == nullptr ? "" : name->name);
}

std::string_view nmt_text(std::uint32_t specifier) {
  for (const regmap::NmtRow& row : regmap::kNmtCommands)
    if (row.specifier == specifier) return row.name;
  return "unknown NMT command";
}

std::string node_text(std::uint8_t node) {
  return node == 0 ? "all nodes" : fmt::format("node {}", node);
}

// ---- SDO

/// " = 983441" for an expedited transfer.
std::string expedited_text(const Frame& frame, const eds::ObjectName* name) {
  const std::uint8_t command = frame.data[0];
  if ((command & sdo::kExpedited) == 0) return "";
  const bool sized = (command & sdo::kSizeIndicated) != 0;
  const std::size_t size = sized ? sdo::expedited_size(command) : sdo::kExpeditedBytes;
  return " = " + value_text(std::span(frame.data).subspan(4, size), name);
}

/// By command specifier. Segments of blocks have none: they are shown as what their first byte means in other
/// frames.
std::string sdo_text(const Frame& frame, bool from_client, const eds::ObjectName* name) {
  static constexpr std::array<std::string_view, 8> kRequests{"write segment",     "write",     "read",
                                                             "read next segment", "abort",     "block read",
                                                             "block write",       "no command"};
  static constexpr std::array<std::string_view, 8> kResponses{
      "segment", "segment written",       "value of",   "written",
      "abort",   "block write confirmed", "block read", "no command"};
  const std::uint8_t specifier = sdo::specifier_of(frame.data[0]);
  const std::string what((from_client ? kRequests : kResponses)[specifier]);
  const bool is_abort = specifier == static_cast<std::uint8_t>(sdo::Request::kAbort);
  if (!is_abort && specifier != (from_client ? 1 : 3) && specifier != 2) return what;
  const sdo::Multiplexer mux = sdo::multiplexer_of(frame);
  return fmt::format("{} {}{}", what, object_text(sdo::index_of(mux), sdo::sub_of(mux), name),
                     is_abort ? ": " + abort_text(sdo::tail_of(frame)) : expedited_text(frame, name));
}

std::string error_control_text(const Frame& frame, std::uint8_t node) {
  if ((frame.flags & Frame::kRemote) != 0) return fmt::format("node {}: node guarding request", node);
  if (frame.data[0] == 0) return fmt::format("node {}: boot-up", node);
  return fmt::format("node {}: heartbeat or guarding: {}", node, state_text(frame.data[0] & nmt::kStateMask));
}

std::string emergency_text(const Frame& frame) {
  const auto message = eds::emergency_from(frame.data);
  const auto bits = eds::error_register_bits(message.error_register);
  return fmt::format("EMCY node {}: {:04X}h {}{}{}", frame.id & nmt::kMaxNode, message.code,
                     eds::emergency_meaning(message.code), bits.empty() ? "" : "; ", fmt::join(bits, ", "));
}

/// By the default identifiers of CiA 301.
std::string pdo_text(const Frame& frame, std::uint8_t node) {
  const std::uint32_t number = (frame.id - 0x180) / 0x100 + 1;
  const bool transmit = (frame.id & 0x80) != 0;
  return fmt::format("{}PDO{} node {}", transmit ? "T" : "R", number, node);
}

}  // namespace

std::string value_text(Bytes bytes, DataType type) {
  const std::uint64_t raw = bytes.size() <= 8 ? load_little_endian(bytes) : 0;
  if (type == DataType::kReal32)
    return text::value_text(static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw))));
  if (type == DataType::kReal64) return text::value_text(std::bit_cast<double>(raw));
  if (type == DataType::kBoolean) return text::value_text(raw != 0);
  if (is_signed(type)) return text::value_text(sign_extend(raw, bytes.size()));
  if (type == DataType::kVisibleString && is_one_line(bytes))
    return text::value_text(std::string(bytes.begin(), bytes.end()));
  if (size_of(type) != 0) return std::to_string(raw);
  return text::value_text(text::Bytes(bytes.begin(), bytes.end()));
}

std::string value_text(Bytes bytes, const eds::ObjectName* name) {
  const bool fits = name != nullptr && (size_of(name->type) == 0 || size_of(name->type) == bytes.size());
  if (fits) return value_text(bytes, name->type);
  if (!bytes.empty() && bytes.size() <= 4) return std::to_string(load_little_endian(bytes));
  return value_text(bytes, DataType::kOctetString);
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

std::string abort_text(std::uint32_t code) {
  const regmap::AbortRow* const row = regmap::find_abort(code);
  return fmt::format("{:04X} {:04X}h {}", code >> 16, code & 0xFFFF,
                     row == nullptr ? "an abort code of the node's own" : row->meaning);
}

std::string frame_text(const Frame& frame, std::uint8_t network, const FindName& find) {
  if ((frame.flags & Frame::kError) != 0) return "bus error";
  if ((frame.flags & Frame::kExtended) != 0) return "29-bit frame";
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if (nmt::is_command(frame))
    return fmt::format("NMT {}: {}", nmt_text(frame.data[0]), node_text(frame.data[1]));
  if (frame.id == 0x80) return "SYNC";
  if (emergency_of(frame)) return emergency_text(frame);
  if (frame.id == 0x100) return "TIME";
  if (frame.id == 0x7E4 || frame.id == 0x7E5) return frame.id == 0x7E5 ? "LSS master" : "LSS slave";
  switch (frame.id & ~std::uint32_t{nmt::kMaxNode}) {
    case nmt::kErrorControlId: return error_control_text(frame, node);
    case sdo::kRequestId:
    case sdo::kResponseId: {
      const sdo::Multiplexer mux = sdo::multiplexer_of(frame);
      const eds::ObjectName* name = find(network, node, sdo::index_of(mux), sdo::sub_of(mux));
      return fmt::format("SDO node {}: {}", node, sdo_text(frame, (frame.id & 0x80) == 0, name));
    }
    default: return frame.id > 0x180 && frame.id < sdo::kResponseId ? pdo_text(frame, node) : "a frame";
  }
}

std::string request_text(const Event& transaction, const Journal& journal, const FindName& find) {
  const Bytes value = journal.bytes(transaction);
  const eds::ObjectName* name =
      find(transaction.network, transaction.node, transaction.index, transaction.sub);
  switch (transaction.service) {
    case Service::kNone: return "no command";
    case Service::kState: return fmt::format("state of node {}", transaction.node);
    case Service::kNmt: {
      const std::uint64_t code = load_little_endian(value);
      for (const regmap::NmtRow& row : regmap::kNmtCommands)
        if (code == row.state_code || code == row.command_code)
          return fmt::format("NMT {}: {}", row.name, node_text(transaction.node));
      return fmt::format("NMT {}: {}", code, node_text(transaction.node));
    }
    default: break;
  }
  const bool shows = !value.empty() && transaction.result == 0;
  return fmt::format("{} node {} {}{}{}", name_of(transaction.service), transaction.node,
                     object_text(transaction.index, transaction.sub, name), shows ? " = " : "",
                     shows ? value_text(value, name) : "");
}

std::string result_text(const Event& ended) {
  if (ended.result == kCancelled) return "cancelled";
  if (ended.result == kNeverSent) return "cancelled before its first frame (is TIMEOUT too short?)";
  if (ended.result == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError))
    return abort_text(ended.code);
  for (const auto& rows : {std::span<const regmap::NamedNumber>(regmap::kResults),
                           std::span<const regmap::NamedNumber>(regmap::kScannerResults)})
    for (const regmap::NamedNumber& row : rows)
      if (row.value == ended.result) return std::string(row.meaning);
  return fmt::format("{} in place of a result", ended.result);
}

std::string modbus_text(const Event& request, const Journal& journal) {
  const Bytes all = journal.bytes(request);
  if (all.empty()) return "no longer kept";
  const Bytes pdu = all.first(request.index);
  const unsigned function = pdu[0];
  if (request.state != 0) return fmt::format("FC{} exception {:02X}h", function, request.state);
  const bool one = function == 6 || function == 22;
  const bool reads = function == 3 || function == 4 || function == 23;
  if (!one && !reads && function != 16) return fmt::format("FC{}", function);
  const std::uint32_t first = word_at(pdu, 1);
  const std::uint32_t count = one ? 1 : word_at(pdu, 3);
  std::string text = fmt::format("FC{} R{}", function, first);
  if (count > 1) text += fmt::format("..R{}", first + count - 1);
  const Bytes words = reads ? all.subspan(std::min<std::size_t>(request.index + 2, all.size()))
                      : one ? pdu.subspan(3)
                            : pdu.subspan(std::min<std::size_t>(6, pdu.size()));
  constexpr std::size_t kMostShown = 16;
  for (std::size_t at = 0; at + 1 < std::min(words.size(), kMostShown); at += 2)
    text += fmt::format("{}{}", at == 0 ? (reads ? ": " : " = ") : " ", word_at(words, at));
  return text + (words.size() > kMostShown ? " ..." : "");
}

std::string terminals_text(const Event& event) {
  const auto value = static_cast<std::int32_t>(event.code);
  const auto kind = std::ranges::find(sim::kTerminals, event.index, &sim::Terminals::index);
  if (kind == sim::kTerminals.end())
    return fmt::format("{} = {}", object_text(event.index, event.sub, nullptr), value);
  if (kind->bits == 0) return fmt::format("{}:{} = {}", kind->name, event.sub, value);
  std::string text;
  for (unsigned bit = 0; bit < kind->bits; ++bit)
    if ((event.state >> bit & 1) != 0)
      text += fmt::format("{}{}:{} {}", text.empty() ? "" : ", ", kind->name,
                          (event.sub - 1U) * kind->bits + bit + 1, (value >> bit & 1) != 0 ? "on" : "off");
  return text;
}

std::string text_of(const Event& event, const Journal& journal, const FindName& find) {
  const std::string number = event.transaction == 0 ? "" : fmt::format("#{} ", event.transaction);
  switch (event.kind) {
    case Kind::kModbus:
      return fmt::format("{}Modbus unit {}: {}", number, event.node, modbus_text(event, journal));
    case Kind::kBegun: return number + request_text(event, journal, find) + " begun";
    case Kind::kEnded: {
      const Bytes value = journal.bytes(event);
      const bool told = event.service == Service::kState && event.result == 0 && !value.empty();
      return fmt::format("{}{}{}{}: {}, {} ms", number, request_text(event, journal, find), told ? " = " : "",
                         told ? state_text(value[0]) : "", result_text(event),
                         static_cast<double>(event.took) / kMillisecond);
    }
    case Kind::kFrame:
      return fmt::format("{}{} {}", number, sim::frame_text(event.frame),
                         frame_text(event.frame, event.network, find));
    case Kind::kEmergency: return emergency_text(event.frame);
    case Kind::kState: return fmt::format("node {} {}", event.node, state_text(event.state));
    case Kind::kTerminals: return fmt::format("node {} {}", event.node, terminals_text(event));
    case Kind::kFault: return number + std::string(journal.text(event));
    case Kind::kCommand:
      return fmt::format("command {}{}", journal.text(event), event.state == kRefused ? ": refused" : "");
    case Kind::kClient:
      return fmt::format("Modbus client {} {} {}", event.code, journal.text(event),
                         event.state != 0 ? "joined" : "left");
  }
  return {};
}

std::string packet_comment(const Event& event, const Journal& journal, const FindName& find) {
  const bool told = event.kind == Kind::kBegun || event.kind == Kind::kEnded || event.kind == Kind::kFault;
  if (told) return text_of(event, journal, find);
  const bool is_packet = event.kind == Kind::kModbus || event.kind == Kind::kFrame;
  return is_packet && event.transaction != 0 ? fmt::format("transaction {}", event.transaction) : "";
}

}  // namespace cbcan::journal
