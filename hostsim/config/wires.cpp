// SPDX-License-Identifier: MIT
#include "config/build_node.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <span>
#include <tuple>

#include "base/text.hpp"
#include "sim/world.hpp"

namespace cbcan::config {
namespace {

/// nullopt unless it is in 0..most.
std::optional<unsigned> number(std::string_view text, std::int64_t most) {
  const auto parsed = base::parse_integer(text);
  if (!parsed || *parsed < 0 || *parsed > most) return std::nullopt;
  return static_cast<unsigned>(*parsed);
}

std::optional<sim::Terminal> numbered_terminal(const sim::Terminals& row, std::string_view text) {
  constexpr unsigned kMostSubs = 0xFE;
  const auto n = number(text, std::int64_t{kMostSubs} * std::max(row.bits, 1u));
  if (!n || *n == 0) return std::nullopt;
  if (row.bits == 0)
    return sim::Terminal{row.index, static_cast<std::uint8_t>(*n), std::nullopt, row.is_output};
  return sim::Terminal{row.index, static_cast<std::uint8_t>((*n - 1) / row.bits + 1),
                       static_cast<std::uint8_t>((*n - 1) % row.bits), row.is_output};
}

bool is_point_name(std::string_view text) {
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0 &&
         text.find(':') == std::string_view::npos;
}

std::string complaint(const WireConfig& wire, std::string_view what) {
  return fmt::format("wire {} to {}: {}", wire.from.text, wire.to.text, what);
}

bool overlap(const sim::Terminal& one, const sim::Terminal& other) {
  return !one.bit || !other.bit || *one.bit == *other.bit;
}

bool delays(const WireConfig& wire) {
  const sim::TransferFunction& transfer = wire.transfer;
  const bool has_slow_block =
      !transfer.block.empty() && !sim::Block::parse(transfer.block).block.is_immediate();
  return transfer.delay != 0 || transfer.lag != 0 || has_slow_block;
}

class Check {
 public:
  Check(const Config& config, std::span<const WireConfig> wires, Diagnostics& found)
      : config_(config), all_(wires), found_(found) {
    for (const WireConfig& wire : all_)
      if (const auto to = object_at(wire.to)) wires_[*to].push_back(&wire);
    for (const WireConfig& wire : all_)
      find_rounds(wire);
  }

  void check() {
    for (const WireConfig& wire : all_) {
      if (wire.from.text.empty() || wire.to.text.empty()) continue;  // has been reported
      check_nodes(wire);
      if (wire.transfer.low > wire.transfer.high && wire.transfer.low && wire.transfer.high)
        complain(wire, "low is above high; exchange them");
      if (wire.transfer.lag != 0 && !wire.transfer.block.empty())
        complain(wire, "has lag_ms and block; remove one of the two");
      check_single(wire);
      if (rounds_[number_of(wire)])
        complain(wire, "goes round in a loop without delay; give one of its wires delay_ms or lag_ms");
    }
  }

 private:
  /// Network, index of the node in it, index and sub-index of the object.
  using Object = std::tuple<std::size_t, std::size_t, std::uint16_t, std::uint8_t>;

  void complain(const WireConfig& wire, std::string_view what) {
    found_.push_back({wire.place, complaint(wire, what)});
  }

  /// nullopt: no such node, or not known yet.
  std::optional<Object> object_at(const WireEnd& end) const {
    const auto place = place_of(config_, end);
    if (!place || !end.name.empty()) return std::nullopt;
    return Object(end.network, *place, end.terminal.index, end.terminal.sub);
  }

  void check_nodes(const WireConfig& wire) {
    for (const WireEnd* end : {&wire.from, &wire.to})
      if (!place_of(config_, *end))
        complain(wire, fmt::format("{}: there is no such node in the plant", end->text));
    const auto place = place_of(config_, wire.to);
    if (!place || !wire.to.name.empty()) return;
    const std::pair object(wire.to.terminal.index, wire.to.terminal.sub);
    for (const SignalConfig& signal : config_.networks[wire.to.network - 1].nodes[*place].signals)
      if (object_of(signal) == object)
        return complain(wire, fmt::format("{} already has a signal at {}; remove one of the two",
                                          wire.to.text, to_string(signal.place)));
  }

  /// Those to the object of an input, also to other bits of it.
  std::span<const WireConfig* const> wires_to(const WireEnd& end) const {
    const auto object = end.terminal.is_output ? std::nullopt : object_at(end);
    const auto wires = object ? wires_.find(*object) : wires_.end();
    if (wires == wires_.end()) return {};
    return wires->second;
  }

  void check_single(const WireConfig& wire) {
    for (const WireConfig* first : wires_to(wire.to)) {
      if (first == &wire) return;
      if (!overlap(wire.to.terminal, first->to.terminal)) continue;
      const bool adds = wire.transfer.sum && first->transfer.sum && wire.to.terminal == first->to.terminal;
      if (adds) continue;
      return complain(wire, fmt::format("{} already has a wire at {}; remove one of the two, or write sum = "
                                        "true in both",
                                        wire.to.text, to_string(first->place)));
    }
  }

  std::size_t number_of(const WireConfig& wire) const {
    return static_cast<std::size_t>(&wire - all_.data());
  }

  /// Follows wires without delay backwards, depth first: one that is met on its own way is part of a loop.
  void find_rounds(const WireConfig& start) {
    std::vector<std::pair<const WireConfig*, std::size_t>> way;  // and the next wire to follow from there
    const auto go_to = [&](const WireConfig& wire) {
      states_[number_of(wire)] = State::kOnWay;
      way.emplace_back(&wire, 0);
    };
    if (states_[number_of(start)] == State::kNew) go_to(start);
    while (!way.empty()) {
      auto& [wire, next] = way.back();
      const auto before = delays(*wire) ? std::span<const WireConfig* const>() : wires_to(wire->from);
      if (next == before.size()) {
        states_[number_of(*wire)] = State::kDone;
        way.pop_back();
        continue;
      }
      const WireConfig& other = *before[next++];
      if (!overlap(wire->from.terminal, other.to.terminal)) continue;
      if (states_[number_of(other)] == State::kOnWay) mark(way, other);
      if (states_[number_of(other)] == State::kNew) go_to(other);
    }
  }

  /// Marks the wires from `first` to the end of the way.
  void mark(std::span<const std::pair<const WireConfig*, std::size_t>> way, const WireConfig& first) {
    for (std::size_t i = way.size(); i-- > 0;) {
      rounds_[number_of(*way[i].first)] = true;
      if (way[i].first == &first) return;
    }
  }

  const Config& config_;
  std::span<const WireConfig> all_;
  Diagnostics& found_;
  std::map<Object, std::vector<const WireConfig*>> wires_;  ///< by their target
  enum class State : std::uint8_t { kNew, kOnWay, kDone };
  std::vector<State> states_ = std::vector<State>(all_.size());  ///< by wire, in find_rounds()
  std::vector<bool> rounds_ = std::vector<bool>(all_.size());    ///< by wire: it is part of a loop
};

/// Replaces a name by its terminal. Returns what is wrong with the end.
std::string find_terminal(sim::Node& node, WireEnd& end, bool is_source) {
  if (!end.name.empty()) {
    std::string problem;
    const auto point = find_point(node, end.name, is_source, problem);
    if (!point) return problem;
    end.terminal = {point->index, point->sub, std::nullopt, false};
    end.terminal.is_output = is_source && point->kind != sim::Point::Kind::kCurve;
    if (!node.number(end.terminal)) end.terminal.is_output = false;
    end.name.clear();
  }
  const sim::Terminal& terminal = end.terminal;
  if (is_source ? node.number(terminal).has_value() : node.set_input(terminal.index, terminal.sub, 0, 0))
    return {};
  return fmt::format("the node, whose device is {}, has no such {} as {}; cbcan-sim eds prints its objects",
                     node.device_name(), is_source ? "output or number" : "input", end.text);
}

}  // namespace

std::optional<sim::Terminal> parse_terminal(std::string_view text) {
  const auto [name, rest] = base::split(text, ':').value_or(std::pair(text, std::string_view("0")));
  const auto row = std::ranges::find(sim::kTerminals, name, &sim::Terminals::name);
  if (row != sim::kTerminals.end()) return numbered_terminal(*row, rest);
  constexpr std::int64_t kMostBit = 63;
  const auto [object, bit] = base::split(text, '.').value_or(std::pair(text, std::string_view()));
  const auto [index, sub] = base::split(object, ':').value_or(std::pair(object, std::string_view("0")));
  const auto index_number = number(index, 0xFFFF);
  const auto sub_number = number(sub, 0xFF);
  const auto bit_number = number(bit, kMostBit);
  if (!index_number || !sub_number || (object != text && !bit_number)) return std::nullopt;
  sim::Terminal terminal{static_cast<std::uint16_t>(*index_number), static_cast<std::uint8_t>(*sub_number),
                         std::nullopt, false};
  if (bit_number) terminal.bit = static_cast<std::uint8_t>(*bit_number);
  return terminal;
}

std::optional<WireEnd> parse_wire_end(std::string_view text) {
  WireEnd end;
  end.text = text;
  const auto parts = base::split(text, ':');
  if (!parts) return std::nullopt;
  auto [node, rest] = *parts;
  if (const auto sides = base::split(node, '/')) {
    const auto network = number(sides->first, kMostNetworks);
    if (!network || *network == 0) return std::nullopt;
    end.network = *network;
    node = sides->second;
  }
  const bool by_place = node.starts_with('#');
  const auto node_number = number(node.substr(by_place ? 1 : 0), by_place ? 0xFFFF : 127);
  const auto terminal = parse_terminal(rest);
  if (!node_number || *node_number == 0) return std::nullopt;
  (by_place ? end.place : end.id) = *node_number;
  if (terminal)
    end.terminal = *terminal;
  else if (is_point_name(rest))
    end.name = rest;
  else
    return std::nullopt;
  return end;
}

std::optional<sim::Point> find_point(sim::Node& node, std::string_view name, bool is_read,
                                     std::string& problem) {
  std::vector<sim::Point> points = node.points();
  if (is_read)
    std::stable_partition(points.begin(), points.end(),
                          [](const auto& each) { return each.kind != sim::Point::Kind::kInput; });
  std::vector<std::string> names;
  for (sim::Point& point : points) {
    std::ranges::replace(point.name, ' ', '-');
    if (point.name == name) return std::move(point);
    if (std::ranges::find(names, point.name) == names.end()) names.push_back(std::move(point.name));
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string hint = base::did_you_mean(name, known);
  const std::string list = known.empty() ? "" : "; its names are " + base::listed(known, ", ");
  problem = fmt::format("\"{}\": the node has no such object{}", name, hint.empty() ? list : hint);
  return std::nullopt;
}

std::optional<std::size_t> place_of(const Config& config, const WireEnd& end) {
  if (end.network > config.networks.size()) return std::nullopt;
  const auto& nodes = config.networks[end.network - 1].nodes;
  if (end.place != 0) return end.place <= nodes.size() ? std::optional(end.place - 1) : std::nullopt;
  const auto found = std::ranges::find(nodes, end.id, &NodeConfig::id);
  if (found == nodes.end()) return std::nullopt;
  return static_cast<std::size_t>(found - nodes.begin());
}

void check_wires(const Config& config, std::span<const WireConfig> wires, Diagnostics& found) {
  Check(config, wires, found).check();
}

std::vector<std::string> connect(const Config& config, const std::vector<std::vector<sim::NodeParts>>& nodes,
                                 std::vector<WireConfig>& wires) {
  sim::World world;
  std::map<std::pair<std::size_t, std::size_t>, sim::Node*> trials;
  const auto trial_of = [&](const WireEnd& end) -> sim::Node& {
    const std::size_t place = *place_of(config, end);
    sim::Node*& trial = trials[{end.network, place}];
    if (trial == nullptr) trial = &world.add_node(nodes[end.network - 1][place]);
    return *trial;
  };
  for (const WireConfig& wire : wires)
    for (const WireEnd* end : {&wire.from, &wire.to})
      trial_of(*end);
  world.start(0);
  Diagnostics found;
  bool has_names = false;
  for (WireConfig& wire : wires) {
    for (WireEnd* end : {&wire.from, &wire.to}) {
      const bool is_source = end == &wire.from;
      has_names |= !end->name.empty();
      const std::string problem = find_terminal(trial_of(*end), *end, is_source);
      if (!problem.empty()) found.push_back({wire.place, complaint(wire, problem)});
    }
  }
  if (has_names && found.empty()) check_wires(config, wires, found);
  std::vector<std::string> lines;
  std::ranges::transform(found, std::back_inserter(lines),
                         [](const Diagnostic& each) { return to_string(each); });
  return lines;
}

}  // namespace cbcan::config
