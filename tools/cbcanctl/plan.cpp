// SPDX-License-Identifier: MIT
#include "cbcanctl/plan.hpp"

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <span>

#include "text/numbers.hpp"
#include "text/utf8.hpp"
#include "text/words.hpp"

namespace cbcan::tools {

namespace {

constexpr std::uint8_t kStartNode = 5;

class PlanReader {
 public:
  explicit PlanReader(const std::string& name) : name_(name) {}

  std::vector<PlannedNode> read(const toml::table& root) {
    std::vector<PlannedNode> nodes;
    check_keys(root, {"node"});
    for (const toml::table* table : tables_of(root, "node"))
      nodes.push_back(node(*table));
    return nodes;
  }

 private:
  [[noreturn]] void fail(const toml::node& place, const std::string& what) const {
    throw UsageError(fmt::format("{}:{}: {}{}", name_, place.source().begin.line, node_, what));
  }

  void check_keys(const toml::table& table, std::initializer_list<std::string_view> known) const {
    for (const auto& [key, value] : table)
      if (std::find(known.begin(), known.end(), key.str()) == known.end())
        fail(value, fmt::format("{}: no such key; there are {}", key.str(),
                                text::listed(std::span(known.begin(), known.size()), " and ")));
  }

  std::vector<const toml::table*> tables_of(const toml::table& in, std::string_view key) const {
    std::vector<const toml::table*> tables;
    if (const toml::node* found = in.get(key)) {
      const toml::array* list = found->as_array();
      if (list == nullptr) fail(*found, fmt::format("{}: must be a list of tables", key));
      for (const toml::node& each : *list)
        if (tables.push_back(each.as_table()); tables.back() == nullptr)
          fail(each, fmt::format("{}: must be a list of tables", key));
    }
    return tables;
  }

  std::uint32_t number(const toml::node& value, std::string_view what, std::uint32_t most) const {
    const auto found = value.value_exact<std::int64_t>();
    if (!found || *found < 0 || *found > most) fail(value, fmt::format("{}: must be 0..{:#x}", what, most));
    return static_cast<std::uint32_t>(*found);
  }

  std::uint32_t number_of(const toml::table& table, std::string_view key, std::uint32_t most) const {
    const toml::node* found = table.get(key);
    if (found == nullptr) fail(table, fmt::format("{} is missing", key));
    return number(*found, key, most);
  }

  PlannedNode node(const toml::table& table) {
    node_.clear();
    check_keys(table, {"id", "device_type", "identity", "objects"});
    PlannedNode node;
    node.id = static_cast<std::uint8_t>(number_of(table, "id", 0xFF));
    node_ = fmt::format("node {}: ", node.id);
    if (node.id == 0 || node.id > 127) fail(*table.get("id"), "node IDs are 1..127");
    if (table.contains("device_type"))
      node.identity.push_back(
          {kDeviceType, 0, eds::to_bytes(number_of(table, "device_type", 0xFFFF'FFFF), 4)});
    std::uint8_t sub = 0;
    if (const toml::array* identity = table["identity"].as_array())
      for (const toml::node& each : *identity)
        node.identity.push_back({kIdentity, ++sub, eds::to_bytes(number(each, "identity", 0xFFFF'FFFF), 4)});
    for (const toml::table* each : tables_of(table, "objects"))
      node.objects.push_back(object(*each));
    return node;
  }

  PlannedObject object(const toml::table& table) const {
    check_keys(table, {"index", "sub", "value", "type"});
    PlannedObject object;
    object.index = static_cast<std::uint16_t>(number_of(table, "index", 0xFFFF));
    object.sub =
        table.contains("sub") ? static_cast<std::uint8_t>(number_of(table, "sub", 0xFF)) : std::uint8_t{0};
    const auto type = table["type"].value<std::string>();
    if (!type) fail(table, "type is missing: u8, u16, ..., string or hex");
    const std::string value = text_of(table);
    try {
      object.value = parse_value(value, value_type(*type));
    } catch (const UsageError& error) {
      fail(table, error.what());
    }
    if (object.value.empty() || object.value.size() > regmap::kMaxDataBytes)
      fail(table, "value: must have 1..128 bytes");
    return object;
  }

  std::string text_of(const toml::table& table) const {
    const auto value = table["value"];
    if (const auto integer = value.value_exact<std::int64_t>()) return std::to_string(*integer);
    if (const auto real = value.value_exact<double>()) return fmt::format("{}", *real);
    if (const auto boolean = value.value_exact<bool>()) return *boolean ? "true" : "false";
    if (const auto text = value.value<std::string>()) return *text;
    fail(table, "value is missing, or no number, text or truth");
  }

  const std::string& name_;
  std::string node_;  ///< prefix of error messages
};

}  // namespace

std::vector<PlannedNode> parse_plan(std::string_view text, const std::string& name) {
  if (const std::size_t line = text::first_line_not_utf8(text); line != 0)
    throw UsageError(
        fmt::format("{}:{}: this line is not UTF-8; write a plan in TOML, or name a file *.dcf", name, line));
  try {
    return PlanReader(name).read(toml::parse(text, name));
  } catch (const toml::parse_error& error) {
    throw UsageError(fmt::format("{}:{}: {}", name, error.source().begin.line, error.description()));
  }
}

NodeConfiguration::NodeConfiguration(const PlannedNode& node, bool verify) : node_(node) {
  for (const PlannedObject& object : node.identity)
    steps_.push_back({Kind::kCheck, &object});
  for (const PlannedObject& object : node.objects)
    steps_.push_back({Kind::kWrite, &object});
  // An object may be written twice, such as 1600h:00, which is 0 while its mappings change.
  for (auto object = node.objects.begin(); verify && object != node.objects.end(); ++object)
    if (std::none_of(object + 1, node.objects.end(), [&](const PlannedObject& later) {
          return later.index == object->index && later.sub == object->sub;
        }))
      steps_.push_back({Kind::kReadBack, &*object});
  steps_.push_back({Kind::kStart, nullptr});
}

std::optional<Transaction> NodeConfiguration::next() {
  if (at_ == steps_.size() || !problem_.empty()) return std::nullopt;
  const auto [kind, object] = steps_[at_];
  if (kind == Kind::kStart) return write_of(0, regmap::kNmtService, node_.id, {kStartNode});
  if (kind == Kind::kWrite) return write_of(node_.id, object->index, object->sub, object->value);
  return read_of(node_.id, object->index, object->sub);
}

void NodeConfiguration::ended(const window::Result& response) {
  const auto [kind, object] = steps_[at_++];
  const std::string place =
      object == nullptr ? fmt::format("node {}: start", node_.id)
                        : fmt::format("node {}: {:04X}h:{:02X}", node_.id, object->index, object->sub);
  if (kind == Kind::kReadBack && response.abort_code == window::abort_code::kWriteOnly) return;
  if (kind == Kind::kWrite && response.abort_code == window::abort_code::kReadOnly) {
    steps_.insert(steps_.end() - 1, {Kind::kReadBack, object});
  } else if (response.code != 0) {
    problem_ = place;
    refusal_ = response;
  } else if ((kind == Kind::kCheck || kind == Kind::kReadBack) && response.data != object->value) {
    problem_ =
        fmt::format("{} is {}, not {}", place, text::hex(response.data, " "), text::hex(object->value, " "));
  }
}

}  // namespace cbcan::tools
