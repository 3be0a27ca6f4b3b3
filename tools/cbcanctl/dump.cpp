// SPDX-License-Identifier: MIT
// dump: the objects of a node as a plan, either those of a file or those found on the node. configure: the
// other way round.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <deque>
#include <map>

#include "base/setting.hpp"
#include "base/text.hpp"
#include "cbcanctl/commands.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::ctl {

namespace {

using tools::Bytes;
using tools::Transaction;

constexpr std::uint16_t kManufacturer = 0x2000;  ///< communication parameters are below

/// Communication parameters that are read-only in every device (CiA 301, 7.5.2).
constexpr std::array<std::uint16_t, 8> kReadOnly{0x1000, 0x1001, 0x1002, 0x1008,
                                                 0x1009, 0x100A, 0x1018, 0x1200};

struct Dumped {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  const tools::ValueType* type = nullptr;
  bool writable = true;
  std::string name{};
  window::Result response{};
};

/// Throws if the response is not about the object but about the node or the module.
void check(std::uint8_t node, const window::Result& response) {
  if (response.code != 0 && (response.code != 4 || response.abort_code == window::abort_code::kTimedOut))
    throw Refused(response, fmt::format("node {}", node));
}

/// Tries a range of indices: sub-index 0; if that may be the number of sub-indices, also the others, unless
/// the first is missing.
class ProbeJob final : public tools::Job {
 public:
  ProbeJob(std::uint8_t node, unsigned first, unsigned count)
      : node_(node), index_(first), end_(first + count) {}

  std::optional<Transaction> next() override {
    if (index_ == end_) return std::nullopt;
    return tools::sdo_read(node_, index_, sub_);
  }
  void ended(const window::Result& response) override {
    check(node_, response);
    const bool there = response.abort_code != window::abort_code::kNoObject &&
                       response.abort_code != window::abort_code::kNoSubIndex &&
                       index_ != regmap::kNodeStateService;  // answered by the module itself
    if (sub_ == 0) last_ = response.data.size() == 1 ? response.data[0] : 0;
    if (sub_ == 1 && !there) last_ = 1;
    if (there) keep(response);
    if (++sub_ <= last_) return;
    sub_ = 0;
    ++index_;
  }
  const std::vector<Dumped>& found() const { return found_; }

 private:
  void keep(const window::Result& response) {
    const auto index = static_cast<std::uint16_t>(index_);
    const bool is_count = sub_ == 1 && !tools::is_mapping(index);
    if (is_count && !found_.empty()) found_.back().writable = false;
    const bool writable =
        !tools::is_command(index) && std::find(kReadOnly.begin(), kReadOnly.end(), index) == kReadOnly.end();
    found_.push_back({index, static_cast<std::uint8_t>(sub_), nullptr, writable, {}, response});
  }

  std::uint8_t node_;
  unsigned index_;
  unsigned end_;
  unsigned sub_ = 0;
  unsigned last_ = 0;  ///< sub-index
  std::vector<Dumped> found_;
};

std::vector<Dumped> objects_of(window::Client& client, std::uint8_t node, const Options& options,
                               const descriptions::DeviceDescription& device) {
  std::vector<Dumped> found;
  std::deque<tools::ReadJob> jobs;
  std::vector<tools::Job*> list;
  for (const descriptions::Object& object : device.objects)
    for (unsigned sub = object.first_sub; object.index >= tools::kDeviceType && sub <= object.last_sub;
         ++sub) {
      const tools::ObjectPlace place{object.index, static_cast<std::uint8_t>(sub)};
      found.push_back({place.index, place.sub, &tools::type_of(object), tools::is_writable(object),
                       descriptions::shortened(object.name)});
      list.push_back(&jobs.emplace_back(node, std::vector{place}));
    }
  run(client, list, "object", options.timeout_ms);
  for (std::size_t i = 0; i < found.size(); ++i)
    check(node, found[i].response = jobs[i].results().front());
  return found;
}

std::vector<Dumped> objects_found(window::Client& client, std::uint8_t node, const Options& options) {
  constexpr unsigned kEnd = 0xA000;
  constexpr unsigned kAtOnce = 64;
  std::deque<ProbeJob> jobs;
  std::vector<tools::Job*> list;
  for (unsigned first = tools::kDeviceType; first < kEnd; first += kAtOnce)
    list.push_back(&jobs.emplace_back(node, first, kAtOnce));
  run(client, list, "part", options.timeout_ms);
  std::vector<Dumped> found;
  for (const ProbeJob& job : jobs)
    found.insert(found.end(), job.found().begin(), job.found().end());
  return found;
}

/// Printable, and not mistaken for bytes when read again.
bool is_text(const Bytes& value) {
  return !value.empty() && !base::is_hex(std::string(value.begin(), value.end())) &&
         std::all_of(value.begin(), value.end(),
                     [](std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; });
}

/// The file's type if it fits the value, else one that fits the size.
const tools::ValueType& fitting_type(const Bytes& value, const tools::ValueType* type) {
  if (type == nullptr)
    return tools::value_type(value.size() >= 1 && value.size() <= 8 ? fmt::format("u{}", 8 * value.size())
                             : is_text(value)                       ? "string"
                                                                    : "hex");
  const bool fits = type->is_text() ? is_text(value) : type->size() == 0 || type->size() == value.size();
  return fits ? *type : tools::value_type("hex");
}

/// A line of the plan: communication parameters in hexadecimal, numbers too large for TOML as text.
std::string plan_line(std::uint16_t index, std::uint8_t sub, const Bytes& value,
                      const tools::ValueType* known) {
  const tools::ValueType& type = fitting_type(value, known);
  std::string text = tools::json_value(value, &type);
  if (type.name == "u64") text = '"' + text + '"';
  if (type.name == "u32" && index < kManufacturer) text = fmt::format("{:#x}", std::stoul(text));
  return fmt::format("{{ index = 0x{:04X}, sub = {}, value = {}, type = \"{}\" }},", index, sub, text,
                     type.name);
}

void print_heading(std::uint8_t node, const std::vector<Dumped>& objects) {
  const tools::ValueType& u32 = tools::value_type("u32");
  std::string identity;
  fmt::print("[[node]]\nid = {}\n", node);
  for (const auto& [index, sub, type, writable, name, response] : objects) {
    if (response.data.size() != u32.size()) continue;
    if (index == tools::kDeviceType) fmt::print("device_type = {}\n", tools::print_value(response.data, u32));
    if (index == tools::kIdentity && sub > 0)
      identity += (identity.empty() ? "" : ", ") + tools::print_value(response.data, u32);
  }
  if (!identity.empty()) fmt::print("identity = [{}]\n", identity);
}

std::string comment(const Dumped& object) {
  return object.name.empty() ? "" : "  # " + object.name;
}

void print_plan(std::uint8_t node, const std::vector<Dumped>& objects) {
  std::map<std::pair<std::uint16_t, std::uint8_t>, const Dumped*> places;
  std::vector<tools::PlannedObject> to_write;
  print_heading(node, objects);
  fmt::print("objects = [\n");
  for (const Dumped& object : objects) {
    const Bytes& value = object.response.data;
    places[{object.index, object.sub}] = &object;
    if (object.response.code != 0)
      fmt::print("  # {:04X}h:{:02X} {}{}\n", object.index, object.sub, Refused(object.response).what(),
                 comment(object));
    else if (value.empty() || !object.writable)
      fmt::print("  # {}{}\n", plan_line(object.index, object.sub, value, object.type), comment(object));
    else
      to_write.push_back({object.index, object.sub, value});
  }
  for (const tools::PlannedObject& each : tools::in_writing_order(to_write)) {
    const Dumped& object = *places.at({each.index, each.sub});
    fmt::print("  {}{}\n", plan_line(each.index, each.sub, each.value, object.type), comment(object));
  }
  fmt::print("]\n");
}

void print_json(std::uint8_t node, const Dumped& object) {
  const Bytes& value = object.response.data;
  fmt::print(R"({{"node": {}, "index": {}, "sub": {}, )", node, object.index, object.sub);
  if (object.response.code != 0)
    fmt::print("\"abort_code\": {}}}\n", object.response.abort_code);
  else
    fmt::print("\"data\": {}, \"value\": {}}}\n", base::json_text(base::hex(value, " ")),
               tools::json_value(value, &fitting_type(value, object.type)));
}

std::vector<descriptions::PlannedNode> read_plan(const std::string& path) {
  const std::string_view ending = base::leaf_of(path);
  if (!base::same_text(ending, "dcf") && !base::same_text(ending, "eds")) return read_network(path).all;
  std::vector<std::string> remarks;
  std::vector nodes{descriptions::parse_dcf(read_file(path), path, remarks)};
  std::ranges::for_each(remarks, say);
  return nodes;
}

/// The nodes of all plans; each node may appear once.
std::vector<descriptions::PlannedNode> read_plans(const std::vector<std::string>& paths) {
  std::vector<descriptions::PlannedNode> nodes;
  std::array<std::string, kMaxNode + 1> planned_by;
  for (const std::string& path : paths)
    for (descriptions::PlannedNode& node : read_plan(path)) {
      if (!planned_by[node.id].empty())
        throw tools::UsageError(
            fmt::format("{}: node {} is in {} already", path, node.id, planned_by[node.id]));
      planned_by[node.id] = path;
      nodes.push_back(std::move(node));
    }
  return nodes;
}

}  // namespace

void dump(const Options& options) {
  const auto node = static_cast<std::uint8_t>(tools::parse_number(options.node, kMaxNode, "NODE"));
  if (node == 0) throw tools::UsageError("NODE 0: write 1..127");
  std::vector<std::string> remarks;
  descriptions::DeviceDescription device;
  if (!options.eds.empty()) device = tools::parse_device(read_file(options.eds), options.eds, node, remarks);
  std::for_each(remarks.begin(), remarks.end(), say);
  window::Client client = connect(options);
  check(node, client.execute(tools::sdo_read(node, tools::kDeviceType, 0)));
  const std::vector<Dumped> objects =
      options.eds.empty() ? objects_found(client, node, options) : objects_of(client, node, options, device);
  if (!options.json) return print_plan(node, objects);
  for (const Dumped& object : objects)
    print_json(node, object);
}

void configure(const Options& options) {
  const std::vector<descriptions::PlannedNode> plan = read_plans(options.plans);
  window::Client client = connect(options);
  std::deque<tools::NodeConfiguration> nodes;
  std::vector<tools::Job*> jobs;
  for (const descriptions::PlannedNode& node : plan)
    jobs.push_back(&nodes.emplace_back(node, !options.no_verify));
  run(client, jobs, "node");
  std::size_t failed = 0;
  for (const tools::NodeConfiguration& node : nodes) {
    const std::string problem =
        node.refusal() ? Refused(*node.refusal(), node.problem()).what() : node.problem();
    if (!problem.empty()) say(problem);
    failed += problem.empty() ? 0u : 1u;
    if (options.json)
      fmt::print("{{\"node\": {}, \"started\": {}, \"error\": {}}}\n", node.node().id, problem.empty(),
                 base::json_text(problem));
    else if (problem.empty())
      fmt::print("{} started\n", node.node().id);
  }
  if (failed == 0) return;
  say(fmt::format("{} of {} nodes {} not been started", failed, nodes.size(), failed == 1 ? "has" : "have"));
  throw Ended{ExitCode::kRefused};
}

}  // namespace cbcan::ctl
