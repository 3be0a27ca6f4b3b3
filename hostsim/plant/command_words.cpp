// SPDX-License-Identifier: MIT
#include "plant/command_words.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "cbcan/regmap.hpp"
#include "config/build_node.hpp"
#include "config/config.hpp"
#include "journal/event_text.hpp"

namespace cbcan::plant {

namespace {

std::string object_text(const sim::Point& point) {
  return fmt::format("0x{:04X}:{}", point.index, point.sub);
}

ObjectEntry entry_of(const sim::Node& of, std::string_view node, const Address& address) {
  ObjectEntry entry{};
  const ObjectDictionary& dictionary = of.device().dictionary();
  if (dictionary.find(address.index, address.sub, entry) != AbortCode::kNone)
    refuse("{}: node {} has no such object{}", config::object_name(address.index, address.sub), node,
           config::meant_index(address.index, address.sub, dictionary));
  return entry;
}

double number_at(sim::Node& of, std::string_view node, std::string_view word, const sim::Terminal& terminal) {
  if (const auto number = of.number(terminal)) return *number;
  refuse("{}: node {} has no such terminal", word, node);
}

}  // namespace

std::optional<double> number_in(const base::Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? 1 : 0;
  if (const auto* number = std::get_if<double>(&value)) return *number;
  return std::nullopt;
}

std::uint32_t number_of(std::string_view text, std::uint32_t low, std::uint32_t high, std::string_view what) {
  const auto number = base::parse_integer(text);
  if (!number || *number < low || *number > high) refuse("{} \"{}\": must be {}..{}", what, text, low, high);
  return static_cast<std::uint32_t>(*number);
}

Time duration_of(std::string_view text) {
  const auto duration = base::parse_duration(text);
  if (!duration)
    refuse("\"{}\": write a whole number of us, ms or s, such as 100ms; an hour is 3600s, 31536000s the most",
           text);
  return *duration;
}

std::string_view rest_of(const Words& words, std::size_t first) {
  if (first >= words.size()) return {};
  const char* const begin = words[first].data();
  return {begin, static_cast<std::size_t>(words.back().data() + words.back().size() - begin)};
}

Address address_of(std::string_view text) {
  constexpr std::uint32_t kMostIndex = 0xFFFF;
  const auto [index, sub] = base::split(text, ':').value_or(std::pair(text, std::string_view("0")));
  return {static_cast<std::uint16_t>(number_of(index, 1, kMostIndex, "index")),
          static_cast<std::uint8_t>(number_of(sub, 0, 0xFF, "sub-index"))};
}

Where where(std::string_view word, std::size_t networks) {
  const auto sides = base::split(word, '/');
  if (!sides) return {1, word};
  return {number_of(sides->first, 1, static_cast<std::uint32_t>(networks), "network"), sides->second};
}

std::string prefix_of(std::size_t network) {
  return network == 1 ? "" : fmt::format("{}/", network);
}

sim::Node& node_of(View& view, std::string_view word) {
  const auto [network, name] = where(word, view.networks());
  const auto nodes = view.world(network).nodes();
  const std::string what = config::in_network(network) + "node";
  if (name.starts_with('#')) {
    const std::uint32_t place = number_of(name.substr(1), 1, static_cast<std::uint32_t>(nodes.size()), what);
    return *nodes[place - 1];
  }
  const std::uint32_t id = number_of(name, 1, nmt::kMaxNode, what);
  sim::Node* const node = view.world(network).node(static_cast<std::uint8_t>(id));
  if (node == nullptr) refuse("node {}: not in this plant; nodes lists them", word);
  return *node;
}

sim::Node& running_node_of(View& view, std::string_view word) {
  sim::Node& node = node_of(view, word);
  if (!node.has_power()) refuse("node {} has no power; switch it on by power {} on", word, word);
  return node;
}

std::string_view state_of(const sim::Node& node) {
  return journal::state_text(node.has_power() ? static_cast<std::uint8_t>(node.device().state())
                                              : journal::kOff);
}

std::string text_of_number(double number) {
  const bool is_whole = number == std::trunc(number) && std::abs(number) < 1e15;
  return is_whole ? std::to_string(static_cast<std::int64_t>(number)) : base::value_text(number);
}

std::optional<sim::Terminal> terminal_of(std::string_view word) {
  const bool is_object =
      !word.empty() && word[0] >= '0' && word[0] <= '9' && word.find('.') == std::string_view::npos;
  return is_object ? std::nullopt : config::parse_terminal(word);
}

DataType check_value(View& view, std::string_view node, std::string_view word) {
  sim::Node& of = node_of(view, node);
  const std::string object = object_of(of, word);
  const auto terminal = terminal_of(object);
  if (!terminal) return entry_of(of, node, address_of(object)).type;
  number_at(of, node, word, *terminal);
  return DataType::kReal64;
}

std::string value_of(View& view, std::string_view node, std::string_view word) {
  check_value(view, node, word);
  sim::Node& of = running_node_of(view, node);
  const Time now = view.started() + view.now();
  const std::string object = object_of(of, word);
  if (object != word)
    if (const auto level = level_of(of, word)) return text_of_number(*level);
  if (const auto terminal = terminal_of(object)) {
    of.bring_up_to_date(now);
    return text_of_number(number_at(of, node, word, *terminal));
  }
  const Address address = address_of(object);
  const ObjectEntry entry = entry_of(of, node, address);
  return journal::value_text(of.value(entry, address.sub, now), entry.type);
}

Reading read_of(const Words& words, std::size_t networks) {
  constexpr std::uint32_t kMost = 125;  // of one FC 3 request
  const auto [network, name] = where(words[1], networks);
  return {network, number_of(name, 0, 0xFFFF, "register"),
          words.size() == 3 ? number_of(words[2], 1, kMost, "count") : 1};
}

Writing writing_of(const Words& words, std::size_t networks) {
  const auto [network, name] = where(words[1], networks);
  const auto number = [](std::string_view word, std::string_view what) {
    return static_cast<std::uint16_t>(number_of(word, 0, 0xFFFF, what));
  };
  Writing writing{network, regmap::kWindowFirst, {}};
  constexpr std::array<std::string_view, 2> kCommands{"read", "write"};
  const bool is_named = std::ranges::find(kCommands, name) != kCommands.end();
  const std::size_t least = name == "read" ? 6 : 7;
  if (words[0] == "trigger" && is_named && words.size() < least)
    refuse("{}: write {}", rest_of(words, 0),
           name == "read" ? "trigger read NODE INDEX SUB SIZE" : "trigger write NODE INDEX SUB SIZE WORD...");
  if (words[0] == "trigger" && !is_named && !base::parse_integer(name))
    refuse("\"{}\": must be read, write or a number{}", name, base::did_you_mean(name, kCommands));
  if (words[0] == "write")
    writing.first = number(name, "register");
  else
    writing.words = {regmap::kExecute, name == "read"    ? regmap::kSdoRead
                                       : name == "write" ? regmap::kSdoWrite
                                                         : number(name, "command")};
  for (std::size_t i = 2; i < words.size(); ++i)
    writing.words.push_back(number(words[i], "word"));
  return writing;
}

std::vector<ShownPoint> points_of(View& view, std::string_view node) {
  sim::Node& of = node_of(view, node);
  std::vector<ShownPoint> shown;
  if (!of.has_power()) return shown;
  of.bring_up_to_date(view.started() + view.now());
  for (sim::Point& point : of.points()) {
    const double value = *of.number({point.index, point.sub, std::nullopt, false});
    const bool is_curve = point.kind == sim::Point::Kind::kCurve;
    const auto terminals = is_curve ? std::nullopt : of.number({point.index, point.sub, std::nullopt, true});
    const auto target =
        point.target == 0 ? std::nullopt : of.number({point.target, point.sub, std::nullopt, false});
    std::string object = object_text(point);
    shown.push_back({std::move(point), std::move(object), terminals.value_or(value), target});
  }
  return shown;
}

std::string object_of(sim::Node& node, std::string_view word) {
  const bool is_name = !word.empty() && std::isalpha(static_cast<unsigned char>(word[0])) != 0;
  if (!is_name || terminal_of(word)) return std::string(word);
  std::string problem;
  const auto point = config::find_point(node, word, false, problem);
  if (!point) refuse("{}", problem);
  return object_text(*point);
}

std::optional<double> level_of(sim::Node& node, std::string_view name) {
  std::string problem;
  const auto point = config::find_point(node, name, true, problem);
  if (!point || point->kind != sim::Point::Kind::kInput) return std::nullopt;
  return node.number({point->index, point->sub, std::nullopt, true});
}

}  // namespace cbcan::plant
