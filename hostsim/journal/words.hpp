// SPDX-License-Identifier: MIT
#pragma once

/// Events in words, with the names that EDS files have for objects.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "cbcan/canopen/dictionary/data_type.hpp"
#include "eds/object_names.hpp"
#include "journal/journal.hpp"

namespace cbcan::journal {

/// What this node's EDS says of the object; null = nothing.
using FindName = std::function<const eds::ObjectName*(std::uint8_t network, std::uint8_t node,
                                                      std::uint16_t index, std::uint8_t sub)>;

/// A value as a plant file would write it.
std::string value_text(std::span<const std::uint8_t> bytes, DataType type);
/// The bytes as a number where they may be one, else in hexadecimal; as its type says where there is a name.
std::string value_text(std::span<const std::uint8_t> bytes, const eds::ObjectName* name);

struct StateName {
  std::uint8_t state;  ///< as in a heartbeat, or kOff
  std::string_view name;
};
std::span<const StateName> state_names();
/// Of kTerminals, as docs/reference/commands.md names them: "output:3 on, output:4 off", "analogue-output:1 = -5".
std::string terminals_text(const Event& event);
/// "pre-operational", "off" for kOff
std::string_view state_text(std::uint8_t state);

/// "0602 0000h no such object"
std::string abort_text(std::uint32_t code);

/// "SDO node 66: read 1000h:00 Device type"
std::string frame_text(const Frame& frame, std::uint8_t network, const FindName& find);

/// "read 66 1000h:00 Device type", "NMT Start Remote Node 66", "state of 66"
std::string request_text(const Event& transaction, const Journal& journal, const FindName& find);

/// Of kEnded: "done", "cancelled" or what has gone wrong.
std::string result_text(const Event& ended);

/// "FC16 R3700..R3705 = 51726 5055 66 4096 0 4"
std::string modbus_text(const Event& request, const Journal& journal);

/// All of an event but its time: one line, without its end.
std::string text_of(const Event& event, const Journal& journal, const FindName& find);

}  // namespace cbcan::journal
