// SPDX-License-Identifier: MIT
#pragma once

/// Events as text, with the names of objects from EDS files.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "cbcan/canopen/dictionary/data_type.hpp"
#include "eds/object_names.hpp"
#include "journal/journal.hpp"

namespace cbcan::journal {

/// The name of an object in the node's EDS; null = none.
using FindName = std::function<const eds::ObjectName*(std::uint8_t network, std::uint8_t node,
                                                      std::uint16_t index, std::uint8_t sub)>;

/// A value as a plant file would write it.
std::string value_text(std::span<const std::uint8_t> bytes, DataType type);
/// By the type that comes with the name; without a name, 1 to 4 bytes as a number, other sizes in hexadecimal.
std::string value_text(std::span<const std::uint8_t> bytes, const eds::ObjectName* name);

struct StateName {
  std::uint8_t state;  ///< as in a heartbeat, or kOff
  std::string_view name;
};
std::span<const StateName> state_names();
/// For kTerminals, with the names of docs/reference/commands.md: "output:3 on, output:4 off",
/// "analogue-output:1 = -5".
std::string terminals_text(const Event& event);
/// "pre-operational", "off" for kOff
std::string_view state_text(std::uint8_t state);

/// "0602 0000h no such object"
std::string abort_text(std::uint32_t code);

/// "SDO node 66: read 1000h:00 Device type"
std::string frame_text(const Frame& frame, std::uint8_t network, const FindName& find);

/// "read node 66 1000h:00 Device type", "NMT Start Remote Node: node 66", "state of node 66"
std::string request_text(const Event& transaction, const Journal& journal, const FindName& find);

/// For kEnded: "done", "cancelled" or what went wrong.
std::string result_text(const Event& ended);

/// "FC16 R3700..R3705 = 51726 5055 66 4096 0 4"
std::string modbus_text(const Event& request, const Journal& journal);

/// An event as one line, without its time and without a line end.
std::string text_of(const Event& event, const Journal& journal, const FindName& find);

/// The comment of a packet in a capture: the number of the transaction, its text at begin and end, or a
/// fault's.
std::string packet_comment(const Event& event, const Journal& journal, const FindName& find);

}  // namespace cbcan::journal
