// SPDX-License-Identifier: MIT
#include "web/state.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/coprocessor/local_objects.hpp"
#include "cbcan/version.hpp"
#include "descriptions/failures.hpp"
#include "sim/faults/fault.hpp"

namespace cbcan::web {

namespace {

constexpr std::uint16_t kPdos = 512;
constexpr std::uint16_t kToMapping = object::kRpdoMapping - object::kRpdoParameter;

/// One object of a PDO by its mapping parameter, and the bit where it begins in the frame.
struct Mapped {
  std::uint16_t index;
  std::uint8_t sub;
  unsigned bits;
  unsigned at;
};

std::vector<Mapped> mapping_of(const ObjectDictionary& dictionary, std::uint16_t pdo) {
  std::vector<Mapped> list;
  unsigned at = 0;
  const auto parameter = static_cast<std::uint16_t>(pdo + kToMapping);
  const auto count = std::min<std::uint64_t>(dictionary.get(parameter, 0), 64);
  for (std::uint8_t sub = 1; sub <= count; ++sub) {
    const auto entry = static_cast<std::uint32_t>(dictionary.get(parameter, sub));
    list.push_back(
        {static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8), entry & 0xFF, at});
    at += entry & 0xFF;
  }
  return list;
}

/// The register in which a network variable begins, if those of its direction begin at `first` and `further`.
std::size_t place_of(const Mapped& variable, std::size_t first, std::size_t further) {
  using namespace local::table;
  const unsigned index = unsigned{variable.index} % kIndicesOfType;
  const unsigned element = (index < kFurther ? index : index - kFurther) * kMostSubs + variable.sub - 1u;
  return (index < kFurther ? first : further) + element * variable.bits / 16;
}

struct FarPdo {
  const Device* device;
  std::uint16_t parameter;
};
using FarPdos = std::multimap<std::uint32_t, FarPdo>;

/// The simulated nodes' valid PDOs of one direction by their identifiers.
FarPdos far_pdos(plant::Network& network, std::uint16_t first) {
  FarPdos found;
  for (const auto& node : network.world().nodes()) {
    const Device& device = node->device();
    for (const ObjectEntry& entry : device.dictionary().entries()) {
      if (!entry.holds(entry.index, 1) || entry.last_index() < first || entry.index >= first + kPdos)
        continue;
      for (unsigned pdo = entry.index; pdo <= entry.last_index(); ++pdo) {
        const auto parameter = static_cast<std::uint16_t>(pdo);
        const std::uint64_t cob_id = device.dictionary().get(parameter, 1);
        if ((cob_id & cob::kInvalid) == 0)
          found.emplace(cob::id_of(static_cast<std::uint32_t>(cob_id)), FarPdo{&device, parameter});
      }
    }
  }
  return found;
}

/// What is at this bit of the frame, by the PDO of a simulated node with the same identifier.
std::string far_side(std::uint8_t number, const FarPdos& pdos, std::uint32_t can_id, unsigned at,
                     const journal::FindName& find) {
  const auto [begin, end] = pdos.equal_range(can_id);
  for (auto pdo = begin; pdo != end; ++pdo) {
    for (const Mapped& object : mapping_of(pdo->second.device->dictionary(), pdo->second.parameter)) {
      if (at < object.at || at >= object.at + object.bits) continue;
      const std::uint8_t id = pdo->second.device->node_id();
      const descriptions::Object* const name = find(number, id, object.index, object.sub);
      return fmt::format("node {} {:04X}h:{:02X} {}", id, object.index, object.sub,
                         name == nullptr ? "" : name->name);
    }
  }
  return fmt::format("PDO {:03X}h", can_id);
}

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

MappedRegisters mapped_registers(std::uint8_t number, plant::Network& network,
                                 const journal::FindName& find) {
  MappedRegisters found;
  if (network.module() == nullptr) return found;
  const ObjectDictionary& own = network.module()->coprocessor().own_objects();
  const std::size_t first_register = network.module_config().process_first;
  const std::size_t further_first = network.module()->further_first();
  const auto add = [&](std::uint16_t own_first, std::uint16_t far_first, std::uint16_t variables,
                       std::size_t first, std::size_t further) {
    std::optional<FarPdos> pdos;
    ObjectEntry entry{};
    for (std::uint16_t pdo = own_first; own.find(pdo, 1, entry) == AbortCode::kNone; ++pdo) {
      const auto cob_id = static_cast<std::uint32_t>(own.get(pdo, 1));
      if ((cob_id & cob::kInvalid) != 0) continue;
      if (!pdos) pdos = far_pdos(network, far_first);
      for (const Mapped& variable : mapping_of(own, pdo)) {
        if (variable.index < variables || variable.sub == 0) continue;
        std::string& text = found[place_of(variable, first, further)];
        const std::string far = far_side(number, *pdos, cob::id_of(cob_id), variable.at, find);
        if (!text.ends_with(far))
          text += (text.empty() ? "" : ", ") + far;  // one object may be two variables
      }
    }
  };
  add(object::kRpdoParameter, object::kTpdoParameter, local::kInputs, first_register, further_first);
  add(object::kTpdoParameter, object::kRpdoParameter, local::kOutputs, first_register + regmap::kInputWords,
      further_first + regmap::kFurtherWords);
  return found;
}

Json boots_of(plant::Network& network) {
  const std::size_t first = network.module_config().status_first + regmap::kStatusNodes;
  Json list = Json::array();
  for (std::uint8_t node = 1; network.module() != nullptr && node <= nmt::kMaxNode; ++node) {
    const unsigned step = network.registers()[first + node] >> 8;
    const std::string& failure = network.watch()->boot_failure(node);
    const bool failed = step >= 'A';
    const std::string words = failed && !failure.empty()
                                  ? failure
                                  : descriptions::boot_step_text(network.registers()[first + node]);
    if (step != 0) list.push_back({{"node", node}, {"failed", failed}, {"words", base::to_utf8(words)}});
  }
  return list;
}

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
