// SPDX-License-Identifier: MIT
#pragma once

/// Events as text, with the names of objects from EDS files, appended to a buffer.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "base/buffer.hpp"
#include "cbcan/canopen/dictionary/data_type.hpp"
#include "descriptions/device_description.hpp"
#include "journal/journal.hpp"

namespace cbcan::journal {

using base::Buffer;

/// An object in the node's EDS, for its name and type; null = none.
using FindName = std::function<const descriptions::Object*(std::uint8_t network, std::uint8_t node,
                                                           std::uint16_t index, std::uint8_t sub)>;

/// Name of the object that a transaction reads or writes.
inline const descriptions::Object* name_of(const Event& transaction, const FindName& find) {
  const bool has_object = transaction.service == Service::kRead || transaction.service == Service::kWrite;
  return has_object ? find(transaction.network, transaction.node, transaction.index, transaction.sub)
                    : nullptr;
}

/// A value as a plant file would write it.
void append_value(Buffer& to, std::span<const std::uint8_t> bytes, DataType type);
/// Appends a value by the type that comes with the name; without a name, 1 to 4 bytes as a number, other
/// sizes in hexadecimal.
void append_value(Buffer& to, std::span<const std::uint8_t> bytes, const descriptions::Object* name);

struct StateName {
  std::uint8_t state;  ///< as in a heartbeat, or kOff
  std::string_view name;
};
std::span<const StateName> state_names();
/// "pre-operational", "off" for kOff
std::string_view state_text(std::uint8_t state);

/// "Start Remote Node"
std::string_view nmt_text(std::uint32_t specifier);

/// "SDO node 66: read 1000h:00 Device type"
void append_frame(Buffer& to, const Frame& frame, std::uint8_t network, const FindName& find);

/// "read node 66 1000h:00 Device type", "NMT Start Remote Node: node 66", "state of node 66"; `name` of the
/// object: null = none. Returns the value that it ends with, valid until `to` is changed; empty = none.
std::string_view append_request(Buffer& to, const Event& transaction, const Journal& journal,
                                const descriptions::Object* name);

/// Appends the result of a kEnded event: "done", "cancelled" or what went wrong.
void append_result(Buffer& to, const Event& ended);

/// Appends a valid Modbus request, "FC16 R3700..R3701 = 51726 5055", and what it read: "FC3 R3700: 0".
void append_modbus(Buffer& to, std::span<const std::uint8_t> pdu, std::span<const std::uint8_t> response);

/// Parts of an event's line, valid until its buffer is changed; empty = it has none.
struct Line {
  std::string_view whole;
  std::string_view frame;
  std::string_view words;    ///< of a request, a frame, terminals and so on
  std::string_view value;    ///< that a request ends with
  std::string_view outcome;  ///< of kEnded
  std::string_view name;     ///< of a transaction's object, UTF-8
};
/// An event as one line, without its time and without a line end; its parts are in `to`, until that changes.
Line append_text(Buffer& to, const Event& event, const Journal& journal, const FindName& find);

/// The comment of a packet in a capture: the number of the transaction, its text at begin and end, or a
/// fault's.
void append_packet_comment(Buffer& to, const Event& event, const Journal& journal, const FindName& find);

// The same as strings.

template <class Type>
std::string value_text(std::span<const std::uint8_t> bytes, Type type) {
  return base::made([&](Buffer& to) { append_value(to, bytes, type); });
}
inline std::string request_text(const Event& transaction, const Journal& journal, const FindName& find) {
  return base::made(
      [&](Buffer& to) { append_request(to, transaction, journal, name_of(transaction, find)); });
}
inline std::string result_text(const Event& ended) {
  return base::made([&](Buffer& to) { append_result(to, ended); });
}
inline std::string text_of(const Event& event, const Journal& journal, const FindName& find) {
  return base::made([&](Buffer& to) { append_text(to, event, journal, find); });
}

}  // namespace cbcan::journal
