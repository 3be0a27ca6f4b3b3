// SPDX-License-Identifier: MIT
#include "app/control.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <utility>

#include "app/clock.hpp"
#include "app/config.hpp"
#include "app/suggest.hpp"
#include "app/value.hpp"
#include "canopen/dictionary/little_endian.hpp"
#include "canopen/dictionary/objects.hpp"

namespace cbcan::app {

namespace {

using Words = std::vector<std::string_view>;

/// What the response's last line complains about.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

constexpr std::string_view kBlanks = " \t";

Words words_of(std::string_view line) {
  Words words;
  while (true) {
    const auto first = line.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return words;
    line.remove_prefix(first);
    words.push_back(line.substr(0, line.find_first_of(kBlanks)));
    line.remove_prefix(words.back().size());
  }
}

std::string quoted(std::string_view word) {
  return "\"" + std::string(word) + "\"";
}

std::uint32_t number_of(std::string_view text, std::uint32_t low, std::uint32_t high,
                        const std::string& what) {
  const auto number = parse_integer(text);
  if (!number || *number < low || *number > high)
    throw Refused(what + " " + quoted(text) + ": must be " + std::to_string(low) + ".." +
                  std::to_string(high));
  return static_cast<std::uint32_t>(*number);
}

struct Address {
  std::uint16_t index;
  std::uint8_t sub;
};

/// "0x6041", "0x6401:2"
Address address_of(std::string_view text) {
  constexpr std::uint32_t kMostIndex = 0xFFFF;
  const auto colon = text.find(':');
  Address address{};
  address.index = static_cast<std::uint16_t>(number_of(text.substr(0, colon), 1, kMostIndex, "index"));
  if (colon != std::string_view::npos)
    address.sub = static_cast<std::uint8_t>(number_of(text.substr(colon + 1), 0, 0xFF, "sub-index"));
  return address;
}

std::string_view name_of(nmt::State state) {
  switch (state) {
    case nmt::State::kInitialising: return "initialising";
    case nmt::State::kStopped: return "stopped";
    case nmt::State::kOperational: return "operational";
    case nmt::State::kPreOperational: return "pre-operational";
  }
  return "";
}

constexpr std::string_view kBus = "bus";
constexpr char kSlash = '/';

/// "2/", in front of what is in network 2; nothing for network 1.
std::string prefix_of(std::size_t network) {
  return network == 1 ? "" : std::to_string(network) + kSlash;
}

/// `place`: from 0.
std::string place_name(std::size_t network, std::size_t place) {
  return prefix_of(network) + "#" + std::to_string(place + 1);
}

std::string id_text(const sim::Node& node, std::size_t network) {
  const std::uint8_t id = node.device().node_id();
  return id == sim::Node::kNoNodeId ? "-" : prefix_of(network) + std::to_string(id);
}

bool is_one_line(std::span<const std::uint8_t> text) {
  return std::ranges::none_of(text, [](std::uint8_t byte) { return byte < ' '; });
}

/// As a plant file would write it.
std::string text_of_value(std::span<const std::uint8_t> bytes, DataType type) {
  const std::uint64_t raw = bytes.size() <= 8 ? load_little_endian(bytes) : 0;
  if (type == DataType::kReal32)
    return value_text(static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw))));
  if (type == DataType::kReal64) return value_text(std::bit_cast<double>(raw));
  if (type == DataType::kBoolean) return value_text(raw != 0);
  if (is_signed(type)) return value_text(sign_extend(raw, bytes.size()));
  if (type == DataType::kVisibleString && is_one_line(bytes))
    return value_text(std::string(bytes.begin(), bytes.end()));
  if (size_of(type) != 0) return std::to_string(raw);
  return value_text(Bytes(bytes.begin(), bytes.end()));
}

/// A line for each.
std::string list_of(std::string_view place, const sim::FaultSet& faults) {
  std::string text;
  for (const sim::SetFault& set : faults.list())
    text += std::string(place) + " " + std::to_string(set.number) + " " + set.text +
            " occasions=" + std::to_string(set.occasions) + " fired=" + std::to_string(set.fired) + "\n";
  return text;
}

/// One line's execution.
class Execution {
 public:
  Execution(const std::vector<PlantNetwork*>& networks, Words words, Time started, Time now)
      : networks_(networks), words_(std::move(words)), started_(started), now_(now) {}

  std::string run();

 private:
  struct Command {
    std::string_view name;
    std::size_t least;  ///< words behind the name
    std::size_t most;
    std::string_view usage;
    std::string_view meaning;
    std::string (Execution::*run)();
  };
  static std::span<const Command> commands();

  std::string list_nodes();
  std::string get();
  std::string set();
  std::string incident();
  std::string fault();
  std::string list_faults();
  std::string clear();
  std::string tell_time() { return "ok " + seconds_text(now_ - started_) + "\n"; }
  std::string help();

  /// "2/5" and "2/bus" are node 5 and the bus of network 2; without a number it is network 1.
  struct Where {
    std::size_t network;  ///< from 1
    std::string_view name;
  };
  Where where(std::string_view word) const;
  sim::Node& node(std::string_view word) const;
  /// Of the bus or the node that the word means.
  sim::FaultSet& faults(std::string_view word) const;
  /// Calls `visit(place, faults)` for every bus and every node.
  template <class Visitor>
  void for_all_faults(Visitor visit) const;
  std::string nodes_of(std::size_t network) const;

  const std::vector<PlantNetwork*>& networks_;
  Words words_;
  Time started_;
  Time now_;
};

std::span<const Execution::Command> Execution::commands() {
  constexpr std::size_t kAny = ~std::size_t{0};
  static constexpr std::array kCommands = std::to_array<Command>({
      {"nodes", 0, 0, "nodes", "the nodes, a line each", &Execution::list_nodes},
      {"get", 2, 2, "get NODE INDEX[:SUB]", "a value of its dictionary", &Execution::get},
      {"set", 3, 3, "set NODE INDEX[:SUB] NUMBER", "an input gets this value from outside", &Execution::set},
      {"incident", 3, 3, "incident NODE NAME on|off", "something happens to the device, or is over",
       &Execution::incident},
      {"fault", 2, kAny, "fault NODE|bus KIND [KEY=VALUE ...]", "inject a fault; the response is its number",
       &Execution::fault},
      {"faults", 0, 1, "faults [NODE|bus]", "the faults that are set, a line each", &Execution::list_faults},
      {"clear", 0, 2, "clear [NODE|bus [NUMBER]]", "no more faults: all, one place's, or one of them",
       &Execution::clear},
      {"time", 0, 0, "time", "seconds since the start", &Execution::tell_time},
      {"help", 0, 0, "help", "these lines", &Execution::help},
  });
  return kCommands;
}

std::string Execution::run() {
  const auto known = commands();
  const auto command = std::ranges::find(known, words_.front(), &Command::name);
  if (command == known.end()) {
    std::vector<std::string_view> names;
    for (const Command& other : known)
      names.push_back(other.name);
    const std::string suggestion = did_you_mean(words_.front(), names);
    throw Refused(quoted(words_.front()) + ": no such command" +
                  (suggestion.empty() ? "; help lists them" : suggestion));
  }
  const std::size_t given = words_.size() - 1;
  if (given < command->least || given > command->most) throw Refused("write " + std::string(command->usage));
  return (this->*command->run)();
}

Execution::Where Execution::where(std::string_view word) const {
  const auto slash = word.find(kSlash);
  if (slash == std::string_view::npos) return {1, word};
  const auto most = static_cast<std::uint32_t>(networks_.size());
  return {number_of(word.substr(0, slash), 1, most, "network"), word.substr(slash + 1)};
}

sim::Node& Execution::node(std::string_view word) const {
  const auto [network, name] = where(word);
  const std::vector<PlantNode>& nodes = networks_[network - 1]->nodes;
  const std::string what = in_network(network) + "node";
  if (name.starts_with('#')) {
    const std::uint32_t place = number_of(name.substr(1), 1, static_cast<std::uint32_t>(nodes.size()), what);
    return *nodes[place - 1].node;
  }
  const std::uint32_t id = number_of(name, 1, nmt::kMaxNode, what);
  const auto found = std::ranges::find_if(
      nodes, [id](const PlantNode& plant) { return plant.node->device().node_id() == id; });
  if (found == nodes.end())
    throw Refused("node " + std::string(word) + ": not in this plant; nodes lists them");
  return *found->node;
}

sim::FaultSet& Execution::faults(std::string_view word) const {
  const Where of = where(word);
  return of.name == kBus ? networks_[of.network - 1]->world.faults() : node(word).faults();
}

template <class Visitor>
void Execution::for_all_faults(Visitor visit) const {
  for (std::size_t network = 1; network <= networks_.size(); ++network) {
    PlantNetwork& plant = *networks_[network - 1];
    visit(prefix_of(network) + std::string(kBus), plant.world.faults());
    for (std::size_t place = 0; place < plant.nodes.size(); ++place)
      visit(place_name(network, place), plant.nodes[place].node->faults());
  }
}

std::string Execution::list_nodes() {
  std::string text;
  for (std::size_t network = 1; network <= networks_.size(); ++network)
    text += nodes_of(network);
  return text + "ok\n";
}

std::string Execution::nodes_of(std::size_t network) const {
  const std::vector<PlantNode>& nodes = networks_[network - 1]->nodes;
  std::string text;
  for (std::size_t place = 0; place < nodes.size(); ++place) {
    const PlantNode& plant = nodes[place];
    text += place_name(network, place) + " " + id_text(*plant.node, network) + " " +
            std::string(name_of(plant.node->device().state())) + " " + plant.device;
    if (!plant.name.empty()) text += " " + quoted(plant.name);
    text += "\n";
  }
  return text;
}

std::string Execution::get() {
  sim::Node& of = node(words_[1]);
  const Address address = address_of(words_[2]);
  ObjectEntry entry{};
  if (of.device().dictionary().find(address.index, address.sub, entry) != AbortCode::kNone)
    throw Refused(object_name(address.index, address.sub) + ": node " + std::string(words_[1]) +
                  " has no such object");
  return "ok " + text_of_value(of.value(entry, address.sub, now_), entry.type) + "\n";
}

std::string Execution::set() {
  sim::Node& of = node(words_[1]);
  const Address address = address_of(words_[2]);
  const Value value = parse_value(words_[3]);
  double number = 0;
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    number = static_cast<double>(*integer);
  } else if (const auto* real = std::get_if<double>(&value)) {
    number = *real;
  } else if (const auto* flag = std::get_if<bool>(&value)) {
    number = *flag ? 1 : 0;
  } else {
    throw Refused(quoted(words_[3]) + ": must be a number, true or false");
  }
  if (address.index <= object::kLastCommunication)
    throw Refused(object_name(address.index, address.sub) + ": objects below 2000h are for SDO, not for set");
  if (!of.set_input(address.index, address.sub, number, now_))
    throw Refused(object_name(address.index, address.sub) + ": node " + std::string(words_[1]) +
                  " has no such number");
  return "ok\n";
}

std::string Execution::incident() {
  sim::Node& of = node(words_[1]);
  if (words_[3] != "on" && words_[3] != "off") throw Refused(quoted(words_[3]) + ": must be on or off");
  if (of.set_incident(words_[2], words_[3] == "on", now_)) return "ok\n";
  std::string known;
  for (const std::string_view name : of.behaviour().incidents())
    known += (known.empty() ? "; it has " : ", ") + std::string(name);
  throw Refused(quoted(words_[2]) + ": node " + std::string(words_[1]) + " has no such incident" + known);
}

std::string Execution::fault() {
  const char* const kind = words_[2].data();
  const std::string_view text(kind,
                              static_cast<std::size_t>(words_.back().data() + words_.back().size() - kind));
  sim::FaultSet& of = faults(words_[1]);
  const sim::FaultOrProblem parsed = sim::parse_fault(text, of.place());
  if (!parsed.problem.empty()) throw Refused(parsed.problem);
  return "ok " + std::to_string(of.add(parsed.fault, now_)) + "\n";
}

std::string Execution::list_faults() {
  if (words_.size() == 2) return list_of(words_[1], faults(words_[1])) + "ok\n";
  std::string text;
  for_all_faults([&](const std::string& place, sim::FaultSet& of) { text += list_of(place, of); });
  return text + "ok\n";
}

std::string Execution::clear() {
  constexpr std::uint32_t kMostNumber = 1'000'000'000;
  if (words_.size() == 1) {
    for_all_faults([this](const std::string& /*place*/, sim::FaultSet& of) { of.clear(now_); });
    return "ok\n";
  }
  sim::FaultSet& of = faults(words_[1]);
  if (words_.size() == 2) {
    of.clear(now_);
    return "ok\n";
  }
  const std::uint32_t number = number_of(words_[2], 1, kMostNumber, "fault");
  if (!of.remove(number, now_))
    throw Refused("fault " + std::string(words_[2]) + ": " + std::string(words_[1]) +
                  " has none with this number");
  return "ok\n";
}

std::string Execution::help() {
  std::string text;
  for (const Command& command : commands()) {
    std::array<char, 100> line{};
    std::snprintf(line.data(), line.size(), "%-37s %s\n", command.usage.data(), command.meaning.data());
    text += line.data();
  }
  return text + "ok\n";
}

}  // namespace

std::string Control::execute(std::string_view line, Time now) {
  Words words = words_of(line);
  if (words.empty()) return {};
  try {
    return Execution(networks_, std::move(words), started_, now).run();
  } catch (const Refused& refused) {
    return "error: " + std::string(refused.what()) + "\n";
  }
}

}  // namespace cbcan::app
