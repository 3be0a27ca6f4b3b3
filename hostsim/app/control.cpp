// SPDX-License-Identifier: MIT
#include "app/control.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <stdexcept>
#include <utility>

#include "app/clock.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "plant/config.hpp"
#include "text/numbers.hpp"
#include "text/suggestion.hpp"
#include "text/utf8.hpp"
#include "text/value.hpp"
#include "text/words.hpp"

namespace cbcan::app {

namespace {

using Words = std::vector<std::string_view>;

/// What the response's last line complains about.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> text, Args&&... args) {
  throw Refused(fmt::format(text, std::forward<Args>(args)...));
}

std::uint32_t number_of(std::string_view text, std::uint32_t low, std::uint32_t high, std::string_view what) {
  const auto number = text::parse_integer(text);
  if (!number || *number < low || *number > high) refuse("{} \"{}\": must be {}..{}", what, text, low, high);
  return static_cast<std::uint32_t>(*number);
}

struct Address {
  std::uint16_t index;
  std::uint8_t sub;
};

/// "0x6041", "0x6401:2"
Address address_of(std::string_view text) {
  constexpr std::uint32_t kMostIndex = 0xFFFF;
  const auto [index, sub] = text::split(text, ':').value_or(std::pair(text, std::string_view("0")));
  return {static_cast<std::uint16_t>(number_of(index, 1, kMostIndex, "index")),
          static_cast<std::uint8_t>(number_of(sub, 0, 0xFF, "sub-index"))};
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
  return network == 1 ? "" : fmt::format("{}{}", network, kSlash);
}

/// `place`: from 0.
std::string place_name(std::size_t network, std::size_t place) {
  return fmt::format("{}#{}", prefix_of(network), place + 1);
}

std::string id_text(const sim::Node& node, std::size_t network) {
  const std::uint8_t id = node.device().node_id();
  return id == sim::Node::kNoNodeId ? "-" : prefix_of(network) + std::to_string(id);
}

bool is_one_line(std::span<const std::uint8_t> text) {
  return std::ranges::none_of(text, [](std::uint8_t byte) { return byte < ' ' || byte == 0x7F; });
}

/// As a plant file would write it.
std::string text_of_value(std::span<const std::uint8_t> bytes, DataType type) {
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

/// A line for each fault, and when there have been many how many more there are.
class FaultList {
 public:
  void add(std::string_view place, const sim::FaultSet& faults) {
    for (const sim::SetFault& set : faults.list())
      if (++count_ <= kMost)
        text_ += fmt::format("{} {} {} occasions={} fired={}\n", place, set.number, set.text, set.occasions,
                             set.fired);
  }
  std::string text() const {
    return text_ + (count_ > kMost ? fmt::format("and {} more\nok\n", count_ - kMost) : "ok\n");
  }

 private:
  static constexpr std::size_t kMost = 1000;
  std::string text_;
  std::size_t count_ = 0;
};

/// One line's execution.
class Execution {
 public:
  Execution(const std::vector<sim::World*>& networks, Words words, Time started, Time now)
      : networks_(networks), words_(std::move(words)), started_(started), now_(now) {}

  std::string run();

  struct Command {
    std::size_t least;  ///< words behind the name
    std::size_t most;
    std::string (Execution::*run)();
    CommandText text;

    std::string_view name() const { return text.usage.substr(0, text.usage.find(' ')); }
  };
  static std::span<const Command> commands();

 private:
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

  const std::vector<sim::World*>& networks_;
  Words words_;
  Time started_;
  Time now_;
};

std::span<const Execution::Command> Execution::commands() {
  constexpr std::size_t kAny = ~std::size_t{0};
  // clang-format off
  static constexpr auto kCommands = std::to_array<Command>({
      {0, 0, &Execution::list_nodes, {"nodes", "Lists the nodes of all networks",
       "A line each: place in the network, node ID (`-` without one), NMT state, device, name."}},
      {2, 2, &Execution::get, {"get NODE INDEX[:SUB]", "A value as an SDO read would give it now",
       "Whatever its access rights are."}},
      {3, 3, &Execution::set, {"set NODE INDEX[:SUB] NUMBER", "An input gets this value from outside",
       "It is rounded, and limited to what the object can hold, as one from a signal of the plant file. Objects that "
       "are no input of the device are set as they are, from 2000h on."}},
      {3, 3, &Execution::incident, {"incident NODE NAME on|off", "Something happens to the device, or is over",
       "[devices.md](devices.md) lists the names of each device."}},
      {2, kAny, &Execution::fault, {"fault NODE|bus KIND [KEY=VALUE ...]", "Injects a fault; the response is its number",
       "[faults.md](faults.md) lists kinds and keys."}},
      {0, 1, &Execution::list_faults, {"faults [NODE|bus]", "Lists the faults that are set",
       "A line each, with how often it has happened; 1,000 at most, and then how many more there are."}},
      {0, 2, &Execution::clear, {"clear [NODE|bus [NUMBER]]",
       "Takes away all faults, those of one node or of the bus, or one of them", ""}},
      {0, 0, &Execution::tell_time, {"time", "Seconds since the start", ""}},
      {0, 0, &Execution::help, {"help", "Lists the commands", ""}},
  });
  // clang-format on
  return kCommands;
}

std::string Execution::run() {
  std::vector<std::string_view> names;
  for (const Command& command : commands()) {
    names.push_back(command.name());
    if (names.back() != words_.front()) continue;
    const std::size_t given = words_.size() - 1;
    if (given < command.least || given > command.most) refuse("write {}", command.text.usage);
    return (this->*command.run)();
  }
  const std::string suggestion = text::did_you_mean(words_.front(), names);
  refuse("\"{}\": no such command{}", words_.front(), suggestion.empty() ? "; help lists them" : suggestion);
}

Execution::Where Execution::where(std::string_view word) const {
  const auto sides = text::split(word, kSlash);
  if (!sides) return {1, word};
  const auto most = static_cast<std::uint32_t>(networks_.size());
  return {number_of(sides->first, 1, most, "network"), sides->second};
}

sim::Node& Execution::node(std::string_view word) const {
  const auto [network, name] = where(word);
  const auto nodes = networks_[network - 1]->nodes();
  const std::string what = plant::in_network(network) + "node";
  if (name.starts_with('#')) {
    const std::uint32_t place = number_of(name.substr(1), 1, static_cast<std::uint32_t>(nodes.size()), what);
    return *nodes[place - 1];
  }
  const std::uint32_t id = number_of(name, 1, nmt::kMaxNode, what);
  const auto found =
      std::ranges::find_if(nodes, [id](const auto& node) { return node->device().node_id() == id; });
  if (found == nodes.end()) refuse("node {}: not in this plant; nodes lists them", word);
  return **found;
}

sim::FaultSet& Execution::faults(std::string_view word) const {
  const Where of = where(word);
  return of.name == kBus ? networks_[of.network - 1]->faults() : node(word).faults();
}

template <class Visitor>
void Execution::for_all_faults(Visitor visit) const {
  for (std::size_t network = 1; network <= networks_.size(); ++network) {
    sim::World& world = *networks_[network - 1];
    visit(fmt::format("{}{}", prefix_of(network), kBus), world.faults());
    for (std::size_t place = 0; place < world.nodes().size(); ++place)
      visit(place_name(network, place), world.nodes()[place]->faults());
  }
}

std::string Execution::list_nodes() {
  std::string text;
  for (std::size_t network = 1; network <= networks_.size(); ++network)
    text += nodes_of(network);
  return text + "ok\n";
}

std::string Execution::nodes_of(std::size_t network) const {
  const auto nodes = networks_[network - 1]->nodes();
  std::string text;
  for (std::size_t place = 0; place < nodes.size(); ++place) {
    const sim::Node& node = *nodes[place];
    text += fmt::format("{} {} {} {}", place_name(network, place), id_text(node, network),
                        name_of(node.device().state()), node.device_name());
    text += node.name().empty() ? "\n" : fmt::format(" \"{}\"\n", text::to_utf8(node.name()));
  }
  return text;
}

std::string Execution::get() {
  sim::Node& of = node(words_[1]);
  const Address address = address_of(words_[2]);
  ObjectEntry entry{};
  if (of.device().dictionary().find(address.index, address.sub, entry) != AbortCode::kNone)
    refuse("{}: node {} has no such object", plant::object_name(address.index, address.sub), words_[1]);
  return "ok " + text_of_value(of.value(entry, address.sub, now_), entry.type) + "\n";
}

std::string Execution::set() {
  sim::Node& of = node(words_[1]);
  const Address address = address_of(words_[2]);
  const text::Value value = text::parse_value(words_[3]);
  double number = 0;
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    number = static_cast<double>(*integer);
  } else if (const auto* real = std::get_if<double>(&value)) {
    number = *real;
  } else if (const auto* flag = std::get_if<bool>(&value)) {
    number = *flag ? 1 : 0;
  } else {
    refuse("\"{}\": must be a number, true or false", words_[3]);
  }
  const std::string name = plant::object_name(address.index, address.sub);
  if (address.index <= object::kLastCommunication)
    refuse("{}: objects below 2000h are for SDO, not for set", name);
  if (!of.set_input(address.index, address.sub, number, now_))
    refuse("{}: node {} has no such number", name, words_[1]);
  return "ok\n";
}

std::string Execution::incident() {
  sim::Node& of = node(words_[1]);
  if (words_[3] != "on" && words_[3] != "off") refuse("\"{}\": must be on or off", words_[3]);
  if (of.set_incident(words_[2], words_[3] == "on", now_)) return "ok\n";
  const auto known = of.behaviour().incidents();
  refuse("\"{}\": node {} has no such incident{}{}", words_[2], words_[1], known.empty() ? "" : "; it has ",
         fmt::join(known, ", "));
}

std::string Execution::fault() {
  const char* const kind = words_[2].data();
  const std::string_view text(kind,
                              static_cast<std::size_t>(words_.back().data() + words_.back().size() - kind));
  sim::FaultSet& of = faults(words_[1]);
  const sim::FaultOrProblem parsed = sim::parse_fault(text, of.place());
  if (!parsed.problem.empty()) throw Refused(parsed.problem);
  return fmt::format("ok {}\n", of.add(parsed.fault, now_));
}

std::string Execution::list_faults() {
  FaultList list;
  if (words_.size() == 2)
    list.add(words_[1], faults(words_[1]));
  else
    for_all_faults([&](const std::string& place, sim::FaultSet& of) { list.add(place, of); });
  return list.text();
}

std::string Execution::clear() {
  constexpr std::uint32_t kMostNumber = 1'000'000'000;
  if (words_.size() == 1) {
    for_all_faults([this](const std::string& /*place*/, sim::FaultSet& of) { of.clear(now_); });
    return "ok\n";
  }
  sim::FaultSet& of = faults(words_[1]);
  if (words_.size() == 2) return of.clear(now_), "ok\n";
  const std::uint32_t number = number_of(words_[2], 1, kMostNumber, "fault");
  if (!of.remove(number, now_)) refuse("fault {}: {} has none with this number", words_[2], words_[1]);
  return "ok\n";
}

std::string Execution::help() {
  std::string text;
  for (const CommandText& command : command_texts())
    text += fmt::format("{:37} {}\n", command.usage, command.meaning);
  return text + "ok\n";
}

}  // namespace

std::vector<CommandText> command_texts() {
  std::vector<CommandText> texts;
  for (const auto& command : Execution::commands())
    texts.push_back(command.text);
  return texts;
}

std::string Control::execute(std::string_view line, Time now) {
  Words words = text::words_of(line);
  if (words.empty()) return {};
  try {
    return Execution(networks_, std::move(words), started_, now).run();
  } catch (const Refused& refused) {
    return fmt::format("error: {}\n", text::to_utf8(refused.what()));
  }
}

}  // namespace cbcan::app
