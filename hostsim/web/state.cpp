// SPDX-License-Identifier: MIT
#include "web/state.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "base/text.hpp"
#include "cbcan/version.hpp"
#include "descriptions/boot_failure.hpp"
#include "descriptions/emergency.hpp"
#include "sim/faults/fault.hpp"

namespace cbcan::web {

namespace {

constexpr std::size_t kMost = 4096;  ///< characters of a list, and one item
constexpr std::uint16_t kStatusword = 0x6041;
constexpr std::uint16_t kModeDisplay = 0x6061;  // a drive has it; a valve has a 6041h of its own

/// The bits that are set.
std::string status_text(std::uint16_t word) {
  std::string text;
  for (const regmap::NamedNumber& bit : regmap::kStatusBits)
    if ((word >> bit.value & 1) != 0) text += (text.empty() ? "" : "; ") + std::string(bit.meaning);
  return text;
}

/// NMT state in the low byte, step of the boot in the high byte; a letter is a failure.
std::string node_status_text(std::uint16_t word) {
  const std::string_view state = regmap::meaning_of(regmap::kNodeStates, word & 0xFF, "no state");
  return word == 0 ? "" : fmt::format("{}, {}", state, descriptions::boot_step_text(word));
}

/// The meaning of a value in one of the named registers; empty = it is a number.
std::string meaning_of(const regmap::RegisterRow* row, std::uint16_t word) {
  if (row == nullptr) return {};
  if (row->name == "EXECUTE_FLAG")
    return std::string(word == regmap::kExecute ? "execute" : regmap::meaning_of(regmap::kResults, word));
  if (row->name == "IN_RESULT")
    return std::string(word < 5 ? regmap::meaning_of(regmap::kResults, word)
                                : regmap::meaning_of(regmap::kScannerResults, word));
  if (row->name == "STATUS") return status_text(word);
  if (row->name == "NODE_STATUS") return node_status_text(word);
  return std::string(row->name.ends_with("COMMAND") ? regmap::meaning_of(regmap::kCommands, word) : "");
}

/// nullopt: not a drive.
std::optional<std::uint16_t> statusword_of(plant::Control& control, sim::Node& node) {
  const auto has = [&node](std::uint16_t index) {
    ObjectEntry entry{};
    return node.device().dictionary().find(index, 0, entry) == AbortCode::kNone;
  };
  if (!has(kStatusword) || !has(kModeDisplay)) return std::nullopt;
  node.bring_up_to_date(control.started() + control.now());
  return static_cast<std::uint16_t>(node.device().dictionary().get(kStatusword, 0));
}

}  // namespace

std::vector<NamedRegister> names_in(const config::ModuleConfig& module) {
  std::vector<NamedRegister> names(regmap::kRegisterFileWords);
  const auto name = [&](const auto& rows, std::size_t first, std::size_t words, std::size_t standard,
                        unsigned channel = 1) {
    for (const regmap::RegisterRow& row : rows)
      for (std::size_t at = std::max<std::size_t>(row.first, standard);
           at <= row.last && at < standard + words; ++at)
        if (NamedRegister& named = names[first + at - standard]; named.row == nullptr)
          named = {&row, channel};
  };
  name(regmap::kWindow, regmap::kWindowFirst, regmap::kWindowWords, regmap::kWindowFirst);
  name(regmap::kProcessData, module.process_first, regmap::kProcessWords, regmap::kProcessFirst);
  name(regmap::kStatus, module.status_first, regmap::kStatusWords, regmap::kStatusFirst);
  name(regmap::kStatus, regmap::kNodeRequest, 2, regmap::kNodeRequest);
  for (unsigned channel = 1; channel <= module.channels; ++channel) {
    name(regmap::kScanner, regmap::of_channel(module.scanner_out_first, channel), regmap::kScannerOutWords,
         regmap::kScannerOutFirst, channel);
    name(regmap::kScanner, regmap::of_channel(module.scanner_in_first, channel), regmap::kScannerInWords,
         regmap::kScannerInFirst, channel);
  }
  return names;
}

void append_register(base::Buffer& to, std::size_t address, const NamedRegister& named, std::uint16_t value,
                     const MappedRegisters& mapped) {
  base::append(to, "{\"register\":", address, ",\"name\":\"", named.row == nullptr ? "" : named.row->name,
               "\",\"value\":", value);
  if (named.channel != 1) base::append(to, ",\"channel\":", named.channel);
  if (const std::string meaning = meaning_of(named.row, value); !meaning.empty())
    base::append(to, ",\"words\":\"", meaning, '"');
  if (const auto found = mapped.find(address); found != mapped.end())
    base::append(to, ",\"mapped\":", json_string(found->second));
  base::append(to, '}');
}

void append_node(base::Buffer& to, plant::Control& control, std::size_t network, std::size_t place) {
  sim::Node& node = *control.world(network).nodes()[place];
  const journal::NetworkWatch& watch = *control.network(network).watch();
  const std::uint8_t id = node.device().node_id();
  const bool has_id = id != sim::Node::kNoNodeId;
  base::append(to, "{\"place\":", place + 1, ",\"node\":", has_id ? id : 0,
               ",\"name\":", json_string(base::to_utf8(node.name())),
               ",\"device\":", json_string(node.device_name()), ",\"state\":\"", plant::state_of(node),
               "\",\"incidents\":", line_of(node.behaviour().incidents()),
               ",\"alarms\":", line_of(node.behaviour().alarms()), ",\"faults\":[");
  std::string_view between;
  for (const sim::SetFault& fault : node.faults().list())
    base::append(to, std::exchange(between, ","),
                 line_of({{"number", fault.number},
                          {"fault", fault.text},
                          {"occasions", fault.occasions},
                          {"fired", fault.fired}}));
  base::append(to, ']');
  if (const Time heard = has_id ? watch.heard_at(id) : kNever; heard != kNever)
    base::append(to, ",\"heard\":", seconds_of(heard));
  if (const auto message = journal::emergency_of(has_id ? watch.last_emergency(id) : Frame{}))
    base::append(to, ",\"emergency\":{\"code\":", message->code,
                 ",\"words\":", json_string(descriptions::emergency_meaning(message->code)),
                 ",\"error_register\":", message->error_register, '}');
  if (has_id)
    base::append(to, ",\"heartbeat_ms\":", node.device().dictionary().get(object::kProducerHeartbeatTime, 0));
  if (const auto statusword = has_id ? statusword_of(control, node) : std::nullopt)
    base::append(to, ",\"statusword\":", *statusword);
  base::append(to, '}');
}

void append_about(base::Buffer& to, const ApiParts& parts) {
  plant::Control& control = parts.control;
  const std::string program = line_of(parts.about());
  base::append(to, std::string_view(program).substr(1, program.size() - 2),
               ",\"time\":", seconds_of(control.now()), ",\"version\":\"", kVersion,
               "\",\"first_event\":", control.journal().first(), ",\"next_event\":", control.journal().end(),
               ",\"networks\":[");
  for (std::size_t number = 1; number <= control.networks(); ++number) {
    plant::Network& network = control.network(number);
    base::append(to, number == 1 ? "" : ",", "{\"network\":", number,
                 ",\"bit_rate\":", network.world().bus().bit_rate(),
                 ",\"frames\":", network.watch()->frames(), ",\"bits\":", network.watch()->bits(),
                 ",\"second_writers\":", network.second_writers(), '}');
  }
  base::append(to, ']');
}

// ---- Changes

StateChanges::StateChanges(const ApiParts& parts, std::size_t network)
    : parts_(parts),
      number_(network),
      network_(parts.control.network(network)),
      names_(names_in(network_.module_config())),
      nodes_(network_.world().nodes().size()) {}

void StateChanges::append(base::Buffer& to) {
  constexpr unsigned kLookEvery = 2;
  constexpr unsigned kSayEvery = 20;
  const bool is_due = calls_ % kSayEvery == 0;
  if (calls_++ % kLookEvery != 0) return;
  if (is_due) look_at_mapping();
  base::Buffer nodes;
  base::Buffer registers;
  append_nodes(nodes);
  append_registers(registers);
  if (!is_due && nodes.size() == 0 && registers.size() == 0) return;
  base::append(to, "data: {\"kind\":\"now\",\"network\":", number_, ',');
  append_about(to, parts_);
  base::append(to, ",\"nodes\":[", base::view(nodes, nodes.size() != 0 ? 1 : 0), "],\"registers\":[",
               base::view(registers, registers.size() != 0 ? 1 : 0), "]}\n\n");
}

/// Goes on where it has stopped: the first nodes may change at each look.
void StateChanges::append_nodes(base::Buffer& to) {
  base::Buffer node;
  for (std::size_t left = std::min<std::size_t>(nodes_.size(), 64); left != 0 && to.size() < kMost; --left) {
    node.clear();
    append_node(node, parts_.control, number_, next_node_);
    std::string& sent = nodes_[std::exchange(next_node_, (next_node_ + 1) % nodes_.size())];
    if (sent != base::view(node)) base::append(to, ',', sent = base::view(node));
  }
}

void StateChanges::append_registers(base::Buffer& to) {
  const auto words = network_.registers();
  for (std::size_t at = 0; at < std::min(words.size(), names_.size()) && to.size() < kMost; ++at) {
    NamedRegister& named = names_[at];
    if (named.row == nullptr || named.channel != 1 || named.said == words[at]) continue;
    named.said = words[at];
    base::append(to, ',');
    append_register(to, at, named, words[at], mapped_);
  }
}

void StateChanges::look_at_mapping() {
  MappedRegisters mapped = mapped_registers(static_cast<std::uint8_t>(number_), network_, parts_.find);
  if (mapped == mapped_) return;
  mapped_ = std::move(mapped);
  for (NamedRegister& named : names_)
    named.said = -1;
}

}  // namespace cbcan::web
