// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <array>
#include <iostream>

#include "base/text.hpp"
#include "base/value.hpp"
#include "cbcanctl/commands.hpp"
#include "descriptions/failures.hpp"

namespace cbcan::ctl {

namespace {

using base::json_text;
using descriptions::EmergencyMessage;

/// `quoted`: as elements of a JSON array.
std::string bits_text(std::uint8_t error_register, bool quoted) {
  std::string text;
  descriptions::for_each_error(error_register, [&](std::string_view bit) {
    text += (text.empty() ? "" : ", ") + (quoted ? json_text(bit) : std::string(bit));
  });
  return text;
}

/// `nothing`: the meaning of a message of zeros.
void print(int node, const EmergencyMessage& message, std::string_view nothing, const Options& options) {
  const bool is_nothing = message == EmergencyMessage{};
  const std::string_view meaning = is_nothing ? nothing : descriptions::emergency_meaning(message.code);
  const std::string bits = bits_text(message.error_register, options.json);
  const std::string info = base::hex(message.info, " ");
  if (options.json)
    fmt::print(
        R"({{"node": {}, "error_code": {}, "meaning": {}, "error_register": {}, "bits": [{}], "data": {}}})"
        "\n",
        node, message.code, json_text(meaning), message.error_register, bits, json_text(info));
  else if (is_nothing)
    fmt::print("{} {}\n", node, nothing);
  else
    fmt::print("{} {:04X}h {}; error register {:02X}h{}{}; data {}\n", node, message.code, meaning,
               message.error_register, bits.empty() ? "" : ": ", bits, info);
}

/// A repeated node means a full round: the scan always stops at a node that has an error.
void list_all(window::Client& client, const Options& options) {
  std::array<std::optional<EmergencyMessage>, 256> told{};
  bool any = false;
  while (true) {
    const tools::Bytes found = own::read(client, own::kEmergencyScan, 0, 1 + EmergencyMessage::kSize);
    const auto message = descriptions::emergency_from(std::span(found).subspan<1, EmergencyMessage::kSize>());
    if (found[0] == 0) break;  // nothing found in a full round
    any = true;
    std::optional<EmergencyMessage>& before = told[found[0]];
    if (before != message) print(found[0], message, "no error any more", options);
    if (before) return;
    before = message;
  }
  if (!any && !options.json) std::cout << "no error\n";
}

bool is_detected(window::Client& client, std::uint8_t node) {
  return execute(client, tools::sdo_read(node, regmap::kNodeStateService, 0, 1)).front() != kNotDetected;
}

}  // namespace

void emcy(const Options& options) {
  const bool all = options.node == "all";
  auto node = static_cast<std::uint8_t>(all ? 0 : tools::parse_number(options.node, kMaxNode, "NODE"));
  window::Client client = connect(options);
  if (all) return list_all(client, options);
  const bool is_own = node == 0;
  if (is_own) node = own::read(client, own::kOwnNodeId, 0, 1)[0];
  const tools::Bytes bytes = own::read(client, own::kLastEmergency, node, EmergencyMessage::kSize);
  const auto message = descriptions::emergency_from(std::span(bytes).first<EmergencyMessage::kSize>());
  const bool is_absent = !is_own && message == EmergencyMessage{} && !is_detected(client, node);
  print(node, message, is_absent ? "not detected" : "no error", options);
  if (is_absent) throw Ended{ExitCode::kAbsent};
}

}  // namespace cbcan::ctl
