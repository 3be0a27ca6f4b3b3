// SPDX-License-Identifier: MIT
#include "descriptions/network_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/text.hpp"
#include "base/toml_table.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan::descriptions {

namespace {

using base::Row;
using base::setting;
using base::Setting;

constexpr std::array<std::string_view, 2> kOutputs{"written", "at-once"};
constexpr std::array<std::string_view, 3> kPlcLost{"hold", "zero", "stop"};
constexpr std::array<std::string_view, 2> kStartedBy{"module", "plc"};
constexpr std::array<std::string_view, 2> kWords{"low-first", "high-first"};
constexpr std::array<std::string_view, 2> kPlaces{"apart", "packed"};
constexpr std::array<std::string_view, 3> kMandatoryLost{"nothing", "reset", "stop"};
constexpr std::array<std::string_view, 2> kOnLoss{"hold", "zero"};

// clang-format off
constexpr std::array kNetwork{
    setting<&PlannedNetwork::outputs>({
        .key = "network.outputs", .help = "When the module's TPDOs are sent for the first time: after the PLC has written "
        "outputs, or at the start", .choices = kOutputs}),
    setting<&PlannedNetwork::plc_lost>({
        .key = "network.plc_lost", .help = "After `plc_timeout_ms`, until the PLC writes outputs: the module's TPDOs stop, or carry "
        "zeros; or the nodes get NMT Stop, so do what their 6206h, 6207h or 6007h say", .choices = kPlcLost}),
    setting<&PlannedNetwork::own_node>({
        .key = "network.own_node", .help = "Who starts the module's own node, after the mandatory nodes", .choices = kStartedBy}),
    setting<&PlannedNetwork::nodes>({
        .key = "network.nodes", .help = "Who starts the other nodes, after the own node", .choices = kStartedBy}),
    setting<&PlannedNetwork::start_together>({
        .key = "network.start_together", .help = "One NMT command starts all nodes, when each is ready"}),
    setting<&PlannedNetwork::words>({
        .key = "network.words", .help = "Order of the two registers of a mapped object with 32 bits", .choices = kWords}),
    setting<&PlannedNetwork::place>({
        .key = "network.place", .help = "Registers of a PDO: four of its own, or those after the PDO before", .choices = kPlaces}),
    setting<&PlannedNetwork::further_first>({
        .key = "network.further_first", .help = "First of 192 registers of further inputs, followed by 192 of further outputs",
        .high = 3316, .unit = ", 0 = none"}),
    setting<&PlannedNetwork::mandatory_lost>({
        .key = "network.mandatory_lost", .help = "NMT command to all nodes when a mandatory node is lost", .choices = kMandatoryLost}),
    setting<&PlannedNetwork::boot_time_ms>({
        .key = "network.boot_time_ms", .help = "Time in which the mandatory nodes have to boot; later ones are missing",
        .high = 0x7FFF'FFFF, .unit = " ms, 0 = no limit"}),
    setting<&PlannedNetwork::sync_us>({
        .key = "network.sync_us", .help = "The module sends SYNC in this period", .high = 0x7FFF'FFFF, .unit = " us, 0 = no SYNC"}),
};
constexpr std::array kNode{
    setting<&PlannedNode::id>({.key = "node.id", .help = "Node ID", .low = 1, .high = 127, .example = "5"}),
    setting<&PlannedNode::name>({.key = "node.name", .help = "Name, for the tags of `cbcanctl map`"}),
    setting<&PlannedNode::eds>({
        .key = "node.eds", .help = "EDS file, relative to this file: identity, PDOs and types", .form = base::Form::kPath,
        .domain = "a path"}),
    setting<&PlannedNode::dcf>({
        .key = "node.dcf", .help = "DCF instead of an EDS: also node ID and objects; without `pdos` all its valid PDOs are exchanged",
        .form = base::Form::kPath, .domain = "a path"}),
    setting<&PlannedNode::mandatory>({.key = "node.mandatory", .help = "Nothing is started before this node is ready"}),
    setting<&PlannedNode::keep_alive>({
        .key = "node.keep_alive", .help = "The node is left as it is if it is Operational when the module starts"}),
    setting<&PlannedNode::lss>({
        .key = "node.lss", .help = "A module without a node ID gets this one by LSS if its identity is that of the node, and no "
        "other is like it"}),
    setting<&PlannedNode::boot>({.key = "node.boot", .help = "false: the node is checked, but neither configured nor started"}),
    setting<&PlannedNode::store>({
        .key = "node.store", .help = "The node stores its configuration (1010h:01), and is not configured again while 1020h is equal"}),
    setting<&PlannedNode::restore>({
        .key = "node.restore", .help = "Sub-index of 1011h: these defaults are restored first, and the node is reset",
        .unit = ", 0 = none"}),
    setting<&PlannedNode::sdo_timeout_ms>({
        .key = "node.sdo_timeout_ms", .help = "Time for a response to the module's boot; for a device that stores slowly",
        .unit = " ms, 0 = that of the module"}),
    setting<&PlannedNode::heartbeat_ms>({
        .key = "node.heartbeat_ms", .help = "Heartbeat period, written to 1017h; the node is lost after 1.5 times this and 100 ms",
        .high = 43'000, .unit = " ms, 0 = no supervision", .absent = "[what the device can](#supervision)"}),
    setting<&PlannedNode::on_loss>({
        .key = "node.on_loss", .help = "Its inputs after its loss", .choices = kOnLoss}),
};
constexpr std::array kPdo{
    setting<&PlannedPdo::tpdo>({.key = "pdos.tpdo", .help = "Number of a TPDO of the node, an input of the PLC", .low = 0, .high = 512}),
    setting<&PlannedPdo::rpdo>({.key = "pdos.rpdo", .help = "Or of an RPDO, an output", .low = 0, .high = 512}),
    setting<&PlannedPdo::can_id>({.key = "pdos.can_id", .help = "CAN-ID", .form = base::Form::kHexadecimal, .low = 0, .high = 0x7FF,
        .unit = ", 0 = that of the EDS"}),
    setting<&PlannedPdo::type>({.key = "pdos.type", .help = "Transmission type"}),
    setting<&PlannedPdo::event_ms>({.key = "pdos.event_ms", .help = "Event timer", .unit = " ms"}),
    setting<&PlannedPdo::inhibit_us>({.key = "pdos.inhibit_us", .help = "Inhibit time, in steps of 100 us", .high = 6'553'500, .unit = " us"}),
};
// clang-format on
constexpr std::array<std::string_view, 4> kNodeLists{"node.device_type", "node.identity", "node.objects",
                                                     "node.pdos"};
constexpr std::array<std::string_view, 1> kPdoLists{"pdos.map"};
constexpr std::string_view kOwner = "there are";  ///< before the known keys
constexpr std::array<std::string_view, 2> kTables{"network", "node"};
constexpr std::array<std::string_view, 3> kMapKeys{"index", "sub", "bits"};
constexpr std::array<std::string_view, 4> kObjectKeys{"index", "sub", "value", "type"};

const Object* known(const PlannedNode& node, std::uint16_t index) {
  return node.device ? node.device->find(index, 0) : nullptr;
}

/// What is written to the object last; null = nothing.
const Bytes* written(const PlannedNode& node, std::uint16_t index) {
  const auto is_it = [index](const PlannedObject& object) { return object.index == index; };
  const auto last = std::find_if(node.objects.rbegin(), node.objects.rend(), is_it);
  return last == node.objects.rend() ? nullptr : &last->value;
}

/// Its value after the configuration, 0 = not known.
std::uint16_t value_after(const PlannedNode& node, std::uint16_t index) {
  const Object* const object = known(node, index);
  const Bytes* const value = written(node, index);
  if (value == nullptr && object == nullptr) return 0;
  return static_cast<std::uint16_t>(load_little_endian(value != nullptr ? *value : object->value));
}

/// Decides how a node is watched whose file does not say it. True: 1017h has to be written.
bool choose_supervision(PlannedNode& node) {
  const Object* const period = known(node, object::kProducerHeartbeatTime);
  const bool can_write = period != nullptr && is_writable(*period);
  const bool is_set = written(node, object::kProducerHeartbeatTime) != nullptr;
  if (is_set || !can_write) node.heartbeat_ms = value_after(node, object::kProducerHeartbeatTime);
  if (node.heartbeat_ms != 0) return false;
  const std::uint16_t guard_ms = value_after(node, object::kGuardTime);
  const auto factor = static_cast<std::uint8_t>(value_after(node, object::kLifeTimeFactor));
  const bool guards = guard_ms != 0 && factor != 0;
  if (can_write && node.boot && !is_set && !(guards && written(node, object::kGuardTime) != nullptr)) {
    node.heartbeat_ms = 1000;
    return true;
  }
  if (guards) {
    node.guard_ms = guard_ms;
    node.retry_factor = factor;
  } else if (!is_set && known(node, object::kGuardTime) && known(node, object::kLifeTimeFactor)) {
    node.guard_ms = 1000;
    node.retry_factor = 3;
  }
  return false;
}

class Reader {
 public:
  /// `base`: other files are relative to it.
  Reader(const std::string& name, const std::string& base, const base::FileReader& read,
         std::vector<std::string>& remarks)
      : name_(name), base_(base), read_(read), remarks_(remarks) {}

  /// `files`: the names in a folder.
  PlannedNetwork read_folder(std::string_view files) {
    PlannedNetwork network;
    for (std::string_view rest = files; !rest.empty();)
      if (const std::string_view file = base::take_line(rest); base::same_text(base::leaf_of(file), "dcf"))
        add(network, toml::table{{"dcf", file}});
    node_.clear();
    if (network.all.empty())
      fail(0, "no *.dcf in this folder; name a file in TOML, or export DCF files into it");
    return completed(std::move(network));
  }

  PlannedNetwork read_table(const toml::table& root) {
    PlannedNetwork network;
    check_keys(root, kTables);
    if (const toml::node* table = root.get("network")) {
      if (!table->is_table()) fail(*table, "network: must be a table");
      read_rows(*table->as_table(), kNetworkRows, network);
    }
    for (const toml::table* table : tables_of(root, "node"))
      add(network, *table);
    return completed(std::move(network));
  }

 private:
  PlannedNetwork completed(PlannedNetwork network) {
    complete_pdos(network, [this](const PlannedNode& node, std::size_t line, const std::string& what) {
      node_ = fmt::format("node {}: ", node.id);
      fail(line, what);
    });
    return network;
  }

  /// A folder has no lines.
  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw UsageError(line == 0 ? fmt::format("{}: {}{}", name_, node_, what)
                               : fmt::format("{}:{}: {}{}", name_, line, node_, what));
  }
  [[noreturn]] void fail(const toml::node& place, const std::string& what) const {
    fail(base::line_of(place), what);
  }

  void check_keys(const toml::table& table, std::span<const std::string_view> known) const {
    base::check_keys(table, known, kOwner, complain());
  }
  /// Reads the keys with rows; `others` are read elsewhere.
  template <class Target>
  void read_rows(const toml::table& table, std::span<const Setting<Target>> rows, Target& target,
                 std::span<const std::string_view> others = {}) const {
    base::read_table(table, rows, target, kOwner, complain(), others);
  }
  base::Complain complain() const {
    return [this](std::size_t line, const std::string& mistake) { fail(line, mistake); };
  }

  std::vector<const toml::table*> tables_of(const toml::table& in, std::string_view key) const {
    std::vector<const toml::table*> tables;
    const toml::node* const found = in.get(key);
    if (found == nullptr) return tables;
    const toml::array* const list = found->as_array();
    if (list == nullptr) fail(*found, fmt::format("{}: must be a list of tables", key));
    for (const toml::node& each : *list)
      if (tables.push_back(each.as_table()); tables.back() == nullptr)
        fail(each, fmt::format("{}: must be a list of tables", key));
    return tables;
  }

  std::uint32_t number(const toml::node& value, std::string_view what, std::uint32_t most,
                       std::uint32_t least = 0) const {
    const auto found = value.value_exact<std::int64_t>();
    if (!found || *found < least || *found > most)
      fail(value, fmt::format("{}: must be {}..{}", what, least,
                              least == 0 ? fmt::format("{:#x}", most) : std::to_string(most)));
    return static_cast<std::uint32_t>(*found);
  }

  std::uint32_t number_of(const toml::table& table, std::string_view key, std::uint32_t most,
                          std::uint32_t least = 0) const {
    const toml::node* const found = table.get(key);
    if (found == nullptr) fail(table, fmt::format("{} is missing", key));
    return number(*found, key, most, least);
  }

  void add(PlannedNetwork& network, const toml::table& table) {
    node_.clear();
    PlannedNode node;
    if (const auto id = table["id"].value_exact<std::int64_t>()) {
      node_ = fmt::format("node {}: ", *id);
      if (*id < 1 || *id > 127) fail(*table.get("id"), "node IDs are 1..127");
    }
    read_rows(table, kNodeRows, node, kNodeLists);
    read_device(table, node);
    if (node.id == 0) fail(table, "id is missing");
    node_ = fmt::format("node {}: ", node.id);
    node.line = base::line_of(table);
    const auto other = std::ranges::find(network.all, node.id, &PlannedNode::id);
    if (other != network.all.end())
      fail(table, fmt::format("{}{} has this ID already", node.dcf.empty() ? "" : node.dcf + ": ",
                              node.line == 0 ? other->dcf : fmt::format("the node of line {}", other->line)));
    read_identity(table, node);
    const auto is_product = [](const PlannedObject& each) {
      return each.index == kIdentity && each.sub == 2;
    };
    if (node.lss && std::ranges::none_of(node.identity, is_product))
      fail(*table.get("lss"), "lss: needs a product code: add identity = [vendor, product], or eds");
    const auto first = static_cast<std::ptrdiff_t>(node.objects.size());  // after those of the DCF
    for (const toml::table* each : tables_of(table, "objects"))
      node.objects.push_back(object(*each, node));
    const toml::node* const asked = table.get("heartbeat_ms");
    if (asked != nullptr) check_heartbeat(*asked, node, first);
    if (asked != nullptr ? node.heartbeat_ms != 0 : choose_supervision(node))
      node.objects.insert(node.objects.begin() + first,
                          {object::kProducerHeartbeatTime, 0, to_bytes(node.heartbeat_ms, 2)});
    for (const toml::table* each : tables_of(table, "pdos"))
      node.pdos.push_back(pdo(*each, node));
    network.all.push_back(std::move(node));
  }

  void read_device(const toml::table& table, PlannedNode& node) const {
    const bool is_dcf = !node.dcf.empty();
    const std::string& path = is_dcf ? node.dcf : node.eds;
    if (path.empty()) return;
    if (is_dcf && !node.eds.empty())
      fail(*table.get("eds"), "eds: the DCF is enough; leave out one of the two");
    const auto text = read_(base::path_in(base_, path));
    const toml::node& place = *table.get(is_dcf ? "dcf" : "eds");
    if (!text) fail(place, path + ": cannot be read; the path is relative to this file");
    if (!is_dcf && node.id == 0) fail(table, "id is missing");
    auto device = std::make_shared<DeviceDescription>(
        parse_device(*text, path, is_dcf ? std::nullopt : std::optional(node.id), remarks_));
    node.device = device;
    if (!is_dcf) return;
    if (!device->node_id) fail(place, path + ": there is no NodeID in [DeviceComissioning]: is this a DCF?");
    if (node.id != 0 && node.id != *device->node_id)
      fail(place,
           fmt::format("{} is for node {}; leave out id, or export the file again", path, *device->node_id));
    configure_by(*device, path, node);
    if (!table.contains("pdos")) node.pdos = valid_pdos(*device);
    for (PlannedPdo& pdo : node.pdos)
      pdo.line = base::line_of(place);
  }

  /// Takes vendor and product of the EDS by default.
  void read_identity(const toml::table& table, PlannedNode& node) const {
    if (const toml::node* type = table.get("device_type")) {
      std::erase_if(node.identity, [](const PlannedObject& object) { return object.index == kDeviceType; });
      node.identity.insert(node.identity.begin(),
                           {kDeviceType, 0, to_bytes(number(*type, "device_type", 0xFFFF'FFFF), 4)});
    } else if (node.device && node.dcf.empty() && !table.contains("identity")) {
      for (PlannedObject& object : expected_identity(*node.device))
        if (object.index == kDeviceType || object.sub <= 2) node.identity.push_back(std::move(object));
    }
    const toml::node* const identity = table.get("identity");
    if (identity == nullptr) return;
    const toml::array* const list = identity->as_array();
    if (list == nullptr || list->size() > 4)
      fail(*identity, "identity: must be a list of up to four numbers");
    std::erase_if(node.identity, [](const PlannedObject& object) { return object.index == kIdentity; });
    std::uint8_t sub = 0;
    for (const toml::node& each : *list)
      if (const std::uint32_t part = number(each, "identity", 0xFFFF'FFFF); ++sub, part != 0)
        node.identity.push_back({kIdentity, sub, to_bytes(part, 4)});
  }

  /// `first`: of the objects in this file.
  void check_heartbeat(const toml::node& asked, const PlannedNode& node, std::ptrdiff_t first) const {
    const Object* const period = known(node, object::kProducerHeartbeatTime);
    const bool cannot = node.device && (period == nullptr || !is_writable(*period));
    if (node.heartbeat_ms != 0 && cannot)
      fail(asked, fmt::format("heartbeat_ms: 1017h is {} in the EDS: leave it out, for what the device can",
                              period == nullptr ? "not" : "read-only"));
    if (std::any_of(node.objects.begin() + first, node.objects.end(), [](const PlannedObject& object) {
          return object.index == object::kProducerHeartbeatTime;
        }))
      fail(asked, "heartbeat_ms: objects has 1017h too; leave out one of the two");
  }

  /// What `read` returns; a mistake that it throws is one of this table.
  auto read_at(const toml::table& table, auto read) const try {
    return read();
  } catch (const UsageError& error) {
    fail(table, error.what());
  }

  PlannedObject object(const toml::table& table, const PlannedNode& node) const {
    check_keys(table, kObjectKeys);
    PlannedObject object;
    object.index = static_cast<std::uint16_t>(number_of(table, "index", 0xFFFF));
    object.sub =
        table.contains("sub") ? static_cast<std::uint8_t>(number_of(table, "sub", 0xFF)) : std::uint8_t{0};
    const std::string value = text_of(table, "value");
    const Object* const known = node.device ? node.device->find(object.index, object.sub) : nullptr;
    if (known != nullptr && !is_writable(*known) && !is_command(object.index))
      fail(table,
           fmt::format("{:04X}h:{:02X} is read-only in the EDS: leave it out", object.index, object.sub));
    const ValueType& type = type_of_value(table, node, object, known);
    object.value = read_at(table, [&] { return parse_value(value, type); });
    if (object.value.empty() || object.value.size() > kMostValueToWrite)
      fail(table, fmt::format("value: must have 1..{} bytes", kMostValueToWrite));
    return object;
  }

  /// Takes that of the EDS by default.
  const ValueType& type_of_value(const toml::table& table, const PlannedNode& node,
                                 const PlannedObject& object, const Object* known) const {
    if (table.contains("type")) {
      const std::string name = text_of(table, "type");
      return *read_at(table, [&] { return &value_type(name, "type"); });
    }
    if (!node.device) fail(table, "type is missing: u8, u16, ..., string or hex");
    if (known == nullptr)
      fail(table, fmt::format("{:04X}h:{:02X} is not in the EDS: check index and sub, or add type",
                              object.index, object.sub));
    return type_of(*known);
  }

  std::string text_of(const toml::table& table, std::string_view key) const {
    const toml::node* const node = table.get(key);
    const auto value = node != nullptr ? base::value_of(*node) : std::nullopt;
    if (!value) fail(table, fmt::format("{} is missing, or no number, text or truth", key));
    return base::written({}, *value);
  }

  PlannedPdo pdo(const toml::table& table, const PlannedNode& node) const {
    PlannedPdo pdo;
    pdo.line = base::line_of(table);
    if (table.contains("tpdo") == table.contains("rpdo")) fail(table, "pdos: needs one of tpdo and rpdo");
    const std::uint16_t number =
        static_cast<std::uint16_t>(number_of(table, table.contains("tpdo") ? "tpdo" : "rpdo", 512, 1));
    (table.contains("tpdo") ? pdo.tpdo : pdo.rpdo) = number;
    if (node.device) take_from(*node.device, pdo);
    read_rows(table, kPdoRows, pdo, kPdoLists);
    for (const toml::table* each : tables_of(table, "map")) {
      if (each == tables_of(table, "map").front()) pdo.objects.clear();
      check_keys(*each, kMapKeys);
      pdo.objects.push_back(mapped(*each, node));
    }
    return pdo;
  }

  MappedObject mapped(const toml::table& table, const PlannedNode& node) const {
    MappedObject mapped;
    mapped.index = static_cast<std::uint16_t>(number_of(table, "index", 0xFFFF));
    mapped.sub =
        table.contains("sub") ? static_cast<std::uint8_t>(number_of(table, "sub", 0xFF)) : std::uint8_t{0};
    mapped.object = node.device ? node.device->find(mapped.index, mapped.sub) : nullptr;
    if (table.contains("bits"))
      mapped.bits = static_cast<std::uint8_t>(number_of(table, "bits", 64, 1));
    else if (mapped.object != nullptr)
      mapped.bits = bits_of(*mapped.object);
    else if (node.device)
      fail(table, fmt::format("map: {:04X}h:{:02X} is not in the EDS", mapped.index, mapped.sub));
    if (mapped.bits == 0) fail(table, "map: bits is missing");
    return mapped;
  }

  const std::string& name_;
  const std::string base_;
  const base::FileReader& read_;
  std::vector<std::string>& remarks_;
  std::string node_;  ///< prefix of error messages
};

}  // namespace

const std::span<const Setting<PlannedNetwork>> kNetworkRows = kNetwork;
const std::span<const Setting<PlannedNode>> kNodeRows = kNode;
const std::span<const Setting<PlannedPdo>> kPdoRows = kPdo;

PlannedNetwork read_network(const std::string& path, const base::FileReader& read,
                            std::vector<std::string>& remarks) {
  const std::string folder = path + "/";
  if (const auto files = read(folder)) return Reader(path, folder, read, remarks).read_folder(*files);
  const auto text = read(path);
  if (!text) throw UsageError(path + ": cannot be read; name a network file, or a folder of DCF files");
  if (const std::size_t line = base::first_line_not_utf8(*text); line != 0)
    throw UsageError(fmt::format(
        "{}:{}: this line is not UTF-8; write a network in TOML, or name a file *.dcf", path, line));
  if (const std::string other = base::other_kind(path, *text, base::kNetworkFile); !other.empty())
    throw UsageError(fmt::format("{}: {}", path, other));
  try {
    return Reader(path, path, read, remarks).read_table(toml::parse(*text, path));
  } catch (const toml::parse_error& error) {
    throw UsageError(
        fmt::format("{}:{}: {}", path, base::line_of(error), base::syntax_message(error.description())));
  }
}

}  // namespace cbcan::descriptions
