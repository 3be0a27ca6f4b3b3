// SPDX-License-Identifier: MIT
#include "config/build_node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/pdo/mapping.hpp"
#include "descriptions/failures.hpp"
#include "descriptions/modules.hpp"
#include "descriptions/network_file.hpp"
#include "descriptions/values.hpp"
#include "devices/devices.hpp"
#include "devices/drive/drive.hpp"
#include "devices/lua/lua_device.hpp"
#include "sim/random.hpp"
#include "sim/world.hpp"

namespace cbcan::config {

namespace {

std::optional<Bytes> encode_integer(std::int64_t number, DataType type) {
  const auto raw = static_cast<std::uint64_t>(number);
  return descriptions::to_bytes({.magnitude = number < 0 ? 0 - raw : raw, .negative = number < 0}, type);
}

std::optional<Bytes> encode_real(double number, DataType type) {
  if (type == DataType::kReal64) return descriptions::to_bytes(std::bit_cast<std::uint64_t>(number), 8);
  const bool fits =
      !std::isfinite(number) || std::abs(number) <= static_cast<double>(std::numeric_limits<float>::max());
  if (type != DataType::kReal32 || !fits) return std::nullopt;
  return descriptions::to_bytes(std::bit_cast<std::uint32_t>(static_cast<float>(number)), 4);
}

/// Stores the value, which then no longer depends on the node ID; returns what is wrong with it, or nothing.
std::string put(const InitialValue& initial, ObjectDictionary& dictionary,
                descriptions::DictionaryImage& image) {
  ObjectEntry entry{};
  const std::string name = object_name(initial.index, initial.sub);
  if (dictionary.find(initial.index, initial.sub, entry) != AbortCode::kNone)
    return fmt::format("object {}: the node's EDS file has no such object{}", name,
                       meant_index(initial.index, initial.sub, dictionary));
  const std::optional<Bytes> bytes = encode(initial.value, entry.type);
  const bool variable = entry.has(ObjectFlags::kVariable);
  if (!bytes || bytes->size() > entry.capacity || (!variable && bytes->size() != entry.capacity))
    return fmt::format("object {}: {} does not fit its data type {} of {} bytes", name,
                       base::value_text(initial.value), descriptions::name_of(entry.type), entry.capacity);
  dictionary.store(entry, initial.sub, *bytes);
  for (ObjectEntry& own : image.entries)
    if (own.index == initial.index && own.first_sub <= initial.sub && initial.sub <= own.last_sub)
      own.flags &= static_cast<std::uint16_t>(~ObjectFlags::kUnset);
  const std::uint8_t* const place = dictionary.value(entry, initial.sub).data();
  std::erase_if(image.node_id_values,
                [&](const NodeIdValue& relative) { return image.values.data() + relative.offset == place; });
  return {};
}

constexpr std::string_view kDrive = "cia402";

class Builder {
 public:
  Builder(const NodeConfig& node, std::uint64_t seed, NodeTiming timing, const base::FileReader& read)
      : node_(node), file_(description_of(node)), seed_(seed), timing_(timing), read_(read) {}

  /// `file`: null if it cannot be read.
  NodeBuild build(const EdsFile* file) {
    if (file == nullptr) {
      complain(node_.place, cannot_read(file_, node_.place));
    } else {
      read_eds(*file);
      if (build_.problems.empty()) add_parts();
      if (build_.problems.empty()) try_out();
    }
    if (!build_.problems.empty()) build_.node.reset();
    return std::move(build_);
  }

 private:
  void complain(const Place& place, const std::string& message) {
    build_.problems.push_back(fmt::format("{}: {}: {}", to_string(place), node_name(node_), message));
  }

  static std::string cannot_read(const std::string& path, const Place& place) {
    return fmt::format(
        "cannot read {}; {}", path,
        place.line != 0 ? "paths are relative to the plant file" : "check the path and its permissions");
  }

  void read_eds(const EdsFile& file) {
    auto [image, diagnostics] = file.for_node(node_.id);
    for (const descriptions::Diagnostic& diagnostic : diagnostics)
      build_.warnings.push_back(descriptions::to_string(diagnostic));
    if (image.entries.empty()) {
      build_ = {};  // messages for each of its lines would not help
      const bool is_refused =
          !diagnostics.empty() && diagnostics.front().severity == descriptions::Severity::kError;
      build_.problems.push_back(
          is_refused ? descriptions::to_string(diagnostics.front())
                     : file_ + ": not one object in it that a node could have; write an EDS or DCF file");
    }
    ObjectDictionary dictionary(image.entries, image.values, nullptr);
    for (const InitialValue& initial : node_.objects)
      if (const std::string wrong = put(initial, dictionary, image); !wrong.empty())
        complain(initial.place, wrong);
    if (!devices::is_script(node_.device)) {
      choose_device(dictionary);
      check_modes(dictionary, *file.description());
    }
    for (const ObjectEntry& entry : image.entries)
      if (descriptions::is_mapping(entry.index) && entry.first_sub == 0)
        check_mapping(dictionary, entry.index);
    build_.node.emplace().image = std::move(image);
    build_.node->description = file.description();
  }

  /// Warns of devices that the file describes incompletely.
  void choose_device(ObjectDictionary& dictionary) {
    ObjectEntry type{};
    const bool has_type = dictionary.find(object::kDeviceType, 0, type) == AbortCode::kNone;
    kind_ = devices::find_device(node_.device);
    if (kind_ == nullptr) {
      kind_ = &devices::device_for(dictionary);
      check_profile(dictionary, has_type && type.has(ObjectFlags::kUnset));
    }
    if (const auto left_out = devices::left_out(*kind_, dictionary); !left_out.empty())
      build_.warnings.push_back(fmt::format("{}: not simulated: {}", file_, fmt::join(left_out, "; ")));
    for (const std::string& missing : devices::missing_objects(*kind_, dictionary))
      build_.warnings.push_back(
          fmt::format("{}: the device {} needs {}, and the file has none of CiA's data type", file_,
                      kind_->name, missing));
  }

  /// Warns of a 6502h that the file has as 0.
  void check_modes(const ObjectDictionary& dictionary, const descriptions::DeviceDescription& description) {
    constexpr std::uint16_t kModes = 0x6502;
    const descriptions::Object* const modes = description.find(kModes, 0);
    if (kind_->name != kDrive || modes == nullptr || !modes->has_value || dictionary.get(kModes, 0) != 0)
      return;
    build_.warnings.push_back(fmt::format(
        "{}:{}: 6502h is 0, and so a master reads it; `objects` of the node can say which modes the "
        "drive has",
        file_, modes->line));
  }

  /// Warns of a PDO that its default mapping makes unusable.
  void check_mapping(const ObjectDictionary& dictionary, std::uint16_t index) {
    const std::uint64_t count = std::min<std::uint64_t>(dictionary.get(index, 0), PdoMapping::kMostObjects);
    for (std::uint8_t sub = 1; sub <= count; ++sub) {
      const auto mapped = static_cast<std::uint32_t>(dictionary.get(index, sub));
      const AbortCode wrong = PdoMapping::check(dictionary, index, mapped);
      if (wrong == AbortCode::kNone) continue;
      build_.warnings.push_back(
          fmt::format("{}: {:04X}h:{:02X}: {:08X}h {}, so this PDO is not used", file_, index, sub, mapped,
                      wrong == AbortCode::kNotMappable ? "cannot be mapped, or has another length"
                                                       : "maps no object of the file"));
      return;
    }
  }

  /// Empty: no device is expected.
  static std::string why_no_device(const ObjectDictionary& dictionary, std::uint64_t profile, bool unset) {
    if (unset) return "1000h has no value";
    if (profile != 0) return fmt::format("1000h names profile {}, which is not simulated", profile);
    const bool has_profile = std::ranges::any_of(
        dictionary.entries(), [](const ObjectEntry& entry) { return entry.index >= object::kFirstProfile; });
    return has_profile ? "1000h names no profile" : "";
  }

  static std::string suggestion(const ObjectDictionary& dictionary) {
    const devices::DeviceKind* const kind = devices::device_by_objects(dictionary);
    return kind != nullptr ? fmt::format("device = \"{}\", whose objects it has", kind->name)
                           : "a Lua script, or device = \"none\"";
  }

  void check_profile(ObjectDictionary& dictionary, bool unset) {
    const std::uint64_t number = dictionary.get(object::kDeviceType, 0);
    if (kind_->profile == 0) {
      if (const std::string why = why_no_device(dictionary, number & 0xFFFF, unset); !why.empty())
        build_.warnings.push_back(
            fmt::format("{}: {}, so the node has no device: name one in the plant file, {}", file_, why,
                        suggestion(dictionary)));
    } else if (unset && (number & 0xFFFF) != kind_->profile) {
      dictionary.set(object::kDeviceType, 0, kind_->profile);
    }
  }

  void add_parts() {
    sim::NodeParts& parts = *build_.node;
    parts.node_id = node_.id != 0 ? node_.id : sim::Node::kNoNodeId;
    parts.name = node_.name;
    if (const auto* name = parts.description->find(object::kDeviceName, 0);
        name != nullptr && parts.name.empty())
      parts.name.assign(name->value.begin(), std::ranges::find(name->value, 0));
    parts.device = kind_ != nullptr ? kind_->name : devices::kScript;
    if (!node_.axes.empty())
      add_axes();
    else if (kind_ == nullptr || !kind_->script.empty())
      parts.behaviour = script(kind_ == nullptr ? node_.device : std::string(kind_->script));
    else if (kind_->make != nullptr)
      parts.behaviour = kind_->make;
    if (!node_.script.empty()) parts.behaviour = script(node_.script, std::move(parts.behaviour));
    parts.seed = seed_;
    parts.lss = node_.lss;
    parts.block_timeout_ms = node_.block_timeout_ms;
    parts.takes_time = node_.timing.value_or(timing_) == NodeTiming::kTypical;
  }

  void add_axes() {
    sim::NodeParts& parts = *build_.node;
    if (parts.device != kDrive)
      return complain(node_.place,
                      fmt::format("axis: the device {} has none; a {} has one", parts.device, kDrive));
    const std::size_t count =
        devices::axis_count(ObjectDictionary(parts.image.entries, parts.image.values, nullptr));
    if (node_.axes.size() > count)
      return complain(node_.place, fmt::format("axis.{}: {} has objects of {} ax{}", node_.axes.size(), file_,
                                               count, count == 1 ? "is" : "es"));
    parts.behaviour = [axes = node_.axes](sim::DeviceNode& node, std::uint64_t /*seed*/) {
      return devices::make_drive(node, axes);
    };
  }

  /// Reads the file each time, so that `reload` works. `below`: the device that it is beside; none = it is
  /// one.
  sim::BehaviourMaker script(std::string path, std::optional<sim::BehaviourMaker> below = {}) const {
    return [read = read_, path = std::move(path), place = node_.place, below = std::move(below)](
               sim::DeviceNode& node, std::uint64_t seed) -> std::unique_ptr<sim::Behaviour> {
      const std::optional<std::string> text = read(path);
      if (!text) throw sim::BehaviourProblem(cannot_read(path, place));
      if (below) return devices::make_beside(node, seed, path, *text, *below);
      return devices::make_lua_device(node, seed, path, *text);
    };
  }

  /// Only a running node shows which inputs it has and whether its script works.
  void try_out() try {
    if (node_.signals.empty() && kind_ != nullptr && kind_->script.empty() && node_.script.empty()) return;
    sim::World world;
    sim::Node& trial = world.add_node(*build_.node);
    world.start(0);
    for (const SignalConfig& signal : node_.signals) {
      if (trial.set_input(signal.signal.index, signal.signal.sub, 0, 0)) {
        add_signal(signal);
      } else {
        complain(
            signal.place,
            fmt::format("signal at {}: neither {} has such a number nor the device {} such an input{}",
                        object_name(signal.signal.index, signal.signal.sub), file_, build_.node->device,
                        meant_index(signal.signal.index, signal.signal.sub, trial.device().dictionary())));
      }
    }
  } catch (const sim::BehaviourProblem& problem) {
    complain(node_.place, problem.what());
  }

  void add_signal(const SignalConfig& config) {
    sim::Signal signal = config.signal;
    if (auto* noise = std::get_if<sim::Noise>(&signal.shape)) {
      // Depends on node and object only: other signals do not change it.
      const std::uint64_t object = std::uint64_t{signal.index} << 8 | signal.sub;
      noise->seed = config.seed ? *config.seed : sim::Random(seed_ ^ object).next();
    }
    if (auto* replay = std::get_if<sim::Replay>(&signal.shape)) {
      const std::optional<std::string> text = read_(config.file);
      if (!text) return complain(config.place, cannot_read(config.file, config.place));
      sim::CsvPoints csv = sim::parse_csv_points(*text);
      if (!csv.problem.empty())
        return build_.problems.push_back(fmt::format("{}:{}: {}", config.file, csv.line, csv.problem));
      replay->points = std::move(csv.points);
    }
    build_.node->signals.push_back(std::move(signal));
  }

  const NodeConfig& node_;
  const std::string file_;  ///< that describes its objects
  std::uint64_t seed_;
  NodeTiming timing_;
  const base::FileReader& read_;
  NodeBuild build_;
  const devices::DeviceKind* kind_ = nullptr;
};

using descriptions::BootFailure;
using descriptions::PlannedNode;
using descriptions::PlannedObject;
using descriptions::PlannedPdo;

/// What a boot writes, but the defaults last, so that they are not restored.
std::vector<PlannedObject> written_to(const PlannedNode& planned) {
  const descriptions::Bytes kSave{'s', 'a', 'v', 'e'}, kLoad{'l', 'o', 'a', 'd'};
  std::vector<PlannedObject> all = planned.objects;
  if (planned.store)
    all.insert(all.end(), {{object::kConfigurationDate, 1, kSave}, {object::kStore, 1, kSave}});
  if (planned.restore != 0) all.push_back({object::kRestore, planned.restore, kLoad});
  return all;
}

/// What would end the boot of a node with these objects, which get their values; without a letter: nothing.
BootFailure boot(const PlannedNode& planned, ObjectDictionary& objects) {
  constexpr std::string_view kLetters = "CDMNO";  // of 1000h:00 and 1018h:01..04
  for (const auto& [index, sub, value] : planned.identity) {
    const auto wanted = static_cast<std::uint32_t>(load_little_endian(value));
    const auto seen = static_cast<std::uint32_t>(objects.get(index, sub));
    if (wanted != 0 && seen != wanted) return {.letter = kLetters[sub], .seen = seen, .wanted = wanted};
  }
  if (!planned.boot) return {};
  for (const auto& [index, sub, value] : written_to(planned))
    if (const auto code = static_cast<std::uint32_t>(objects.write(index, sub, value, 0)); code != 0)
      return {.letter = 'J', .index = index, .sub = sub, .code = code};
  return {};
}

/// 1400h and so on; of its mapping with `more`.
std::uint16_t index_of(const PlannedPdo& pdo, std::uint16_t more = 0) {
  const unsigned first = pdo.input() ? object::kTpdoParameter : object::kRpdoParameter;
  return static_cast<std::uint16_t>(first + pdo.number() - 1u + more);
}

bool has(const ObjectDictionary& objects, const PlannedPdo& pdo) {
  const std::uint16_t mapping = index_of(pdo, descriptions::kToMapping);
  std::uint8_t sub = 0;
  const auto is_mapped = [&](const auto& object) { return objects.get(mapping, ++sub) == entry_of(object); };
  constexpr std::uint32_t kBits = cob::kInvalid | cob::kIdMask;
  return (objects.get(index_of(pdo), descriptions::kCobId) & kBits) == pdo.can_id &&
         objects.get(mapping, 0) == pdo.objects.size() && std::ranges::all_of(pdo.objects, is_mapped);
}

constexpr std::string_view kNotWatched =
    "not watched, so its loss is not noticed; set heartbeat_ms if the device has 1017h, else let the PLC "
    "read an "
    "object of it";

/// The first difference, and its line in the network file; empty = none.
Diagnostic difference(const PlannedNode& planned, sim::Node& node) {
  const ObjectDictionary& objects = node.device().dictionary();
  BootFailure failure = boot(planned, node.device().dictionary());
  if (const auto* const known = node.description().find(failure.index, failure.sub))
    failure.name = known->name;
  for (const PlannedPdo& pdo : planned.pdos) {
    const bool fails =
        failure.index == index_of(pdo) || failure.index == index_of(pdo, descriptions::kToMapping);
    if (fails) return {{"", pdo.line}, failure_text(failure)};
    if (failure.letter == 0 && !has(objects, pdo))
      return {{"", pdo.line},
              fmt::format("{} {} of the plant's node has another CAN-ID, or maps other objects",
                          pdo.input() ? "TPDO" : "RPDO", pdo.number())};
  }
  return {{"", planned.line}, failure.letter == 0 ? "" : failure_text(failure)};
}

}  // namespace

std::string meant_index(std::uint16_t index, std::uint8_t sub, const ObjectDictionary& dictionary) {
  const auto meant = base::parse<std::uint16_t>(std::to_string(index), 16);
  ObjectEntry entry{};
  const bool is_there = meant && dictionary.find(*meant, sub, entry) == AbortCode::kNone;
  return is_there ? fmt::format("; did you mean 0x{}?", index) : "";
}

std::optional<Bytes> encode(const Value& value, DataType type) {
  if (const auto* bytes = std::get_if<Bytes>(&value)) return *bytes;
  if (const auto* number = std::get_if<double>(&value)) return encode_real(*number, type);
  if (const auto* flag = std::get_if<bool>(&value)) return encode_integer(*flag ? 1 : 0, type);
  if (const auto* number = std::get_if<std::int64_t>(&value))
    return descriptions::is_real(type) ? encode_real(static_cast<double>(*number), type)
                                       : encode_integer(*number, type);
  if (size_of(type) != 0) return std::nullopt;
  const auto& text = std::get<std::string>(value);
  return Bytes(text.begin(), text.end());
}

static NodeBuild without_node(const NodeConfig& node, std::size_t line, const char* why) {
  NodeBuild build;
  build.problems = {
      fmt::format("{}: {}: {}", to_string(Place{node.place.source, line}), node_name(node), why)};
  return build;
}

NodeBuild build_node(const NodeConfig& node, std::uint64_t seed, EdsFiles& files, NodeTiming timing) try {
  const EdsFile* const file = files.find(description_of(node), node.script, node.modules);
  return Builder(node, seed, timing, files.reader()).build(file);
} catch (const sim::BehaviourProblem& problem) {
  return without_node(node, node.place.line, problem.what());
} catch (const descriptions::ModuleError& problem) {
  return without_node(node, node.modules.front().number, problem.what());
}

/// The frames of a log, the first one at 0; returns what is wrong, or nothing.
std::string read_replay(const std::string& path, const base::FileReader& read,
                        std::vector<sim::TimedFrame>& frames) {
  const auto text = read(path);
  if (!text) return path + ": cannot be read";
  std::string_view rest = *text;
  for (std::size_t line = 1; !rest.empty(); ++line) {
    const std::string_view written = base::take_line(rest);
    if (base::trim(written).empty()) continue;
    const auto frame = sim::parse_candump_line(written);
    if (!frame || (!frames.empty() && frame->at < frames.back().at))
      return fmt::format("{}:{}: not a line of candump -L, or earlier than the one before", path, line);
    frames.push_back(*frame);
  }
  const Time first = frames.empty() ? 0 : frames.front().at;
  for (sim::TimedFrame& frame : frames)
    frame.at -= first;
  return {};
}

/// Image of the network that the module boots.
NetworkImage image_of(const NetworkConfig& network, const base::FileReader& read, PlantBuild& plant) {
  const std::string& path = network.module.network;
  if (path.empty()) return {};
  try {
    const descriptions::PlannedNetwork planned = descriptions::read_network(path, read, plant.lines);
    if (const std::string problem = problem_of_further(network, planned.further_first); !problem.empty())
      throw base::UsageError(path + ": " + problem);
    return {descriptions::image_of(planned, network.module.node_id, path), planned.further_first};
  } catch (const base::UsageError& error) {
    plant.lines.push_back(fmt::format("{}module.network: {}", in_network(network.number), error.what()));
    plant.good = false;
    return {};
  }
}

PlantBuild build_nodes(const Config& config, const base::FileReader& read) {
  EdsFiles files(read);
  return build_nodes(config, files);
}

PlantBuild build_nodes(const Config& config, EdsFiles& files) {
  PlantBuild plant;
  plant.read = files.reader();
  std::set<std::string> said;  // nodes with the same file have the same lines
  for (const NetworkConfig& network : config.networks) {
    auto& nodes = plant.networks.emplace_back();
    for (const NodeConfig& node : network.nodes) {
      NodeBuild build =
          build_node(node, node_seed(config, node), files, config.timing.value_or(NodeTiming::kAtOnce));
      for (auto* lines : {&build.warnings, &build.problems})
        for (std::string& line : *lines)
          if (said.insert(line).second) plant.lines.push_back(std::move(line));
      plant.good = plant.good && build.node;
      if (build.node) nodes.push_back(std::move(*build.node));
    }
    if (nodes.size() == network.nodes.size()) check_can_ids(network, nodes, plant.lines);
    plant.images.push_back(image_of(network, files.reader(), plant));
    auto& replay = plant.replays.emplace_back();
    if (network.can.replay.empty()) continue;
    if (const std::string problem = read_replay(network.can.replay, files.reader(), replay);
        !problem.empty()) {
      plant.lines.push_back("can.replay: " + problem);
      plant.good = false;
    }
  }
  if (!plant.good) return plant;
  plant.wires = config.wires;
  const std::vector<std::string> wrong = connect(config, plant.networks, plant.wires);
  plant.lines.insert(plant.lines.end(), wrong.begin(), wrong.end());
  plant.good = wrong.empty();
  return plant;
}

void compare_networks(const Config& config, PlantBuild& plant) {
  for (const NetworkConfig& network : config.networks) {
    const std::string& path = network.module.network;
    if (path.empty()) continue;
    sim::World world;
    for (const sim::NodeParts& parts : plant.networks[network.number - 1])
      world.add_node(parts);
    world.start(0);
    std::vector<std::string> remarks;  // already reported
    for (const PlannedNode& planned : descriptions::read_network(path, plant.read, remarks).all) {
      Diagnostic found{{"", planned.line}, network.can.outside.empty() ? "the plant has no such node" : ""};
      if (sim::Node* const node = world.node(planned.id)) found = difference(planned, *node);
      const std::string unwatched(planned.is_watched() ? "" : kNotWatched);
      for (Diagnostic each : {found, Diagnostic{{"", planned.line}, unwatched}}) {
        if (each.message.empty()) continue;
        each.place.source = path;
        each.message = fmt::format("{}node {}: {}", in_network(network.number), planned.id, each.message);
        plant.lines.push_back(to_string(each));
      }
    }
  }
}

}  // namespace cbcan::config
