// SPDX-License-Identifier: MIT
// What the module gets of a network: its PDOs (checks, the configuration of the nodes' PDOs, and the numbers
// of the own ones) and the bytes of its objects.

#include <fmt/core.h>

#include <array>
#include <bit>
#include <map>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"
#include "cbcan/canopen/manager/network_objects.hpp"
#include "cbcan/canopen/pdo/mapping.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "cbcan/canopen/sdo/crc16.hpp"
#include "cbcan/canopen/sync.hpp"
#include "cbcan/canopen/time_stamp.hpp"
#include "cbcan/regmap.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::descriptions {

namespace {

// CiA 405, network variables: the first input; outputs are further on.
constexpr std::uint16_t kUnsigned8 = 0xA040;
constexpr std::uint16_t kUnsigned16 = 0xA100;
constexpr std::uint16_t kUnsigned64 = 0xA440;
constexpr std::uint16_t kToOutputs = 0x480;
constexpr std::uint16_t kToFurther = 8;
constexpr std::size_t kMostElements = 254;

/// A number with this bit, or 0.
constexpr std::uint32_t bit(std::uint8_t number, bool set = true) {
  return std::uint32_t{set} << number;
}

class Image {
 public:
  void add(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value) {
    number(index, 2);
    number(sub, 1);
    number(value.size(), 4);
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    ++count_;
  }
  void add(std::uint16_t index, std::uint8_t sub, std::uint32_t value, std::size_t size) {
    add(index, sub, to_bytes(value, size));
  }
  void add(const std::vector<PlannedObject>& objects) {
    for (const PlannedObject& object : objects)
      add(object.index, object.sub, object.value);
  }
  Bytes bytes() const {
    Bytes all = to_bytes(count_, ConciseDcf::kFirst);
    all.insert(all.end(), bytes_.begin(), bytes_.end());
    return all;
  }

 private:
  void number(std::uint64_t value, std::size_t size) {
    const Bytes little = to_bytes(value, size);
    bytes_.insert(bytes_.end(), little.begin(), little.end());
  }

  Bytes bytes_;
  std::uint32_t count_ = 0;
};

/// `element`: from 0, among the usual registers or the further ones.
std::uint32_t entry(std::uint16_t index, std::size_t element, std::uint8_t bits, const PlannedPdo& pdo) {
  const std::size_t object = index + (pdo.input() ? 0u : kToOutputs) +
                             (pdo.at < kFurtherAt ? 0u : kToFurther) + element / kMostElements;
  return static_cast<std::uint32_t>(object << 16 | (element % kMostElements + 1) << 8 | bits);
}

/// The mapping of the own PDO: bytes, or one element of all eight; words of 32-bit objects in the order asked
/// for.
std::vector<std::uint32_t> own_mapping(const PlannedPdo& pdo, Words words) {
  constexpr std::size_t kAll = PdoMapping::kMostBytes;
  const std::size_t first = pdo.at < kFurtherAt ? pdo.at : pdo.at - kFurtherAt;
  const bool high_first = words == Words::kHighFirst;
  const auto is_double = [](const MappedObject& mapped) { return mapped.bits == 32; };
  if (pdo.bytes() == kAll && first % kAll == 0 &&
      !(high_first && std::ranges::any_of(pdo.objects, is_double)))
    return {entry(kUnsigned64, first / kAll, 64, pdo)};
  std::vector<std::uint32_t> entries;
  std::size_t bits = 0;
  std::size_t mapped_bytes = 0;
  for (const MappedObject& mapped : pdo.objects) {
    bits += mapped.bits;
    if (high_first && is_double(mapped)) {
      for (const std::size_t word : {mapped_bytes / 2 + 1, mapped_bytes / 2})
        entries.push_back(entry(kUnsigned16, first / 2 + word, 16, pdo));
      mapped_bytes += 4;
    }
    for (; mapped_bytes < (&mapped == &pdo.objects.back() ? (bits + 7) / 8 : bits / 8); ++mapped_bytes)
      entries.push_back(entry(kUnsigned8, first + mapped_bytes, 8, pdo));
  }
  return entries;
}

std::vector<PlannedObject> own_pdo(const PlannedPdo& pdo, Words words) {
  const auto parameters = static_cast<std::uint16_t>(
      (pdo.input() ? object::kRpdoParameter : object::kTpdoParameter) + pdo.own - 1);
  const auto mapping = static_cast<std::uint16_t>(parameters + kToMapping);
  const std::vector<std::uint32_t> entries = own_mapping(pdo, words);
  constexpr std::uint8_t kEventDriven = 255;
  const std::uint8_t type = pdo.input() ? kEventDriven : pdo.type;
  std::vector<PlannedObject> objects{{parameters, kCobId, to_bytes(pdo.can_id, 4)},
                                     {parameters, kType, to_bytes(type, 1)},
                                     {mapping, 0, to_bytes(entries.size(), 1)}};
  if (!pdo.input()) {
    objects.push_back({parameters, kInhibitTime, to_bytes(pdo.inhibit_us / object::kInhibitUnit, 2)});
    objects.push_back({parameters, kEventTimer, to_bytes(pdo.event_ms, 2)});
  }
  std::uint8_t sub = 0;
  for (const std::uint32_t each : entries)
    objects.push_back({mapping, ++sub, to_bytes(each, 4)});
  return in_writing_order(objects);
}

/// 300Ah. An event-driven TPDO without a timer may not be sent again: its objects are read at the start.
Bytes source_of(const PlannedNode& node, const PlannedPdo& pdo) {
  constexpr std::uint8_t kFirstEvent = 254;
  const bool sent_once = pdo.type >= kFirstEvent && pdo.event_ms == 0;
  Bytes source{node.id,
               static_cast<std::uint8_t>(bit(RpdoSource::kZeroWhenLost, node.on_loss == OnLoss::kZero) |
                                         bit(RpdoSource::kReadAtStart, sent_once))};
  for (const MappedObject& mapped : pdo.objects) {
    const Bytes bytes = to_bytes(entry_of(mapped), 4);
    source.insert(source.end(), bytes.begin(), bytes.end());
  }
  return source;
}

void add_own(Image& image, const PlannedNetwork& network) {
  std::uint8_t consumer = 0;
  for (const PlannedNode& node : network.all)
    if (node.heartbeat_ms != 0)
      image.add(object::kConsumerHeartbeatTime, ++consumer,
                std::uint32_t{node.id} << 16 | std::min(node.heartbeat_ms * 3u / 2 + 100, 0xFFFFu), 4);
  for (const PlannedNode& node : network.all)
    for (const PlannedPdo& pdo : node.pdos) {
      image.add(own_pdo(pdo, network.words));
      if (pdo.input()) image.add(object::kRpdoSource, pdo.own, source_of(node, pdo));
    }
  if (network.sync_us != 0) {
    constexpr std::uint32_t kSyncId = 0x80;
    image.add(object::kSyncPeriod, 0, network.sync_us, 4);
    image.add(object::kSyncCobId, 0, kSyncId | cob::kProduces, 4);
  }
  image.add(object::kNmtStartup, 0,
            bit(StartupBit::kIsManager) | bit(StartupBit::kStartsAll, network.start_together) |
                bit(StartupBit::kOwnNotStarted, network.own_node == StartedBy::kPlc) |
                bit(StartupBit::kSlavesNotStarted, network.nodes == StartedBy::kPlc) |
                bit(StartupBit::kResetsAll, network.mandatory_lost == MandatoryLost::kReset) |
                bit(StartupBit::kStopsAll, network.mandatory_lost == MandatoryLost::kStop),
            4);
  if (network.boot_time_ms != 0) image.add(object::kBootTime, 0, network.boot_time_ms, 4);
  constexpr std::array<std::uint8_t, 3> kModes{0, OutputsMode::kZero, OutputsMode::kStop};
  const unsigned mode = (network.outputs == Outputs::kAtOnce ? OutputsMode::kAtOnce : 0u) |
                        kModes[static_cast<std::size_t>(network.plc_lost)];
  if (mode != 0) image.add(object::kOutputsMode, 0, mode, 1);
}

/// A number for the configuration, never 0 (FNV-1a).
std::uint32_t number_of(const Bytes& bytes) {
  std::uint32_t hash = 0x811C9DC5;
  for (const std::uint8_t byte : bytes)
    hash = (hash ^ byte) * 0x01000193;
  return hash | 1;
}

void add_node(Image& image, const PlannedNode& node) {
  image.add(object::kSlaveAssignment, node.id,
            bit(SlaveBit::kListed) | bit(SlaveBit::kBoots, node.boot) |
                bit(SlaveBit::kMandatory, node.mandatory) | bit(SlaveBit::kKeepAlive, node.keep_alive) |
                std::uint32_t{node.retry_factor} << SlaveBit::kRetryFactor |
                std::uint32_t{node.guard_ms} << SlaveBit::kGuardTime,
            4);
  for (const PlannedObject& expected : node.identity) {
    const std::size_t object = expected.index == kDeviceType ? object::kExpectedDeviceType
                                                             : object::kExpectedVendor + expected.sub - 1u;
    image.add(static_cast<std::uint16_t>(object), node.id, expected.value);
  }
  if (node.restore != 0) image.add(object::kRestoreConfiguration, node.id, node.restore, 1);
  if (node.sdo_timeout_ms != 0) image.add(object::kSlaveSdoTimeout, node.id, node.sdo_timeout_ms, 2);
  if (node.lss) image.add(object::kSlaveLss, node.id, 1, 1);
  Image writes;
  writes.add(node.objects);
  if (node.store) {
    const Bytes kSave{'s', 'a', 'v', 'e'};
    const std::uint32_t number = number_of(writes.bytes());
    const auto size = static_cast<std::uint32_t>(writes.bytes().size());
    writes.add(object::kConfigurationDate, 1, number, 4);
    writes.add(object::kConfigurationDate, 2, size, 4);
    writes.add(object::kStore, 1, kSave);
    image.add(object::kExpectedDate, node.id, number, 4);
    image.add(object::kExpectedTime, node.id, size, 4);
  }
  if (!node.objects.empty() || node.store) image.add(object::kConciseDcf, node.id, writes.bytes());
}

constexpr std::size_t kMostBits = 64;
constexpr std::size_t kWordBits = 32;

std::string name_of(const PlannedPdo& pdo) {
  return fmt::format("{} {}", pdo.input() ? "TPDO" : "RPDO", pdo.number());
}

/// What is wrong with it; empty = nothing.
std::string problem_of(const MappedObject& mapped, const PlannedNode& node, bool input) {
  const std::string place = fmt::format("{:04X}h:{:02X}", mapped.index, mapped.sub);
  if (!node.device) return {};
  if (mapped.object == nullptr) return place + " is not in the EDS";
  if (!mapped.object->pdo_mapping) return place + " cannot be mapped: PDOMapping in the EDS";
  const Access access = mapped.object->access;
  const bool reads = access != Access::kWriteOnly && access != Access::kReadWriteOutput;
  const bool writes =
      access == Access::kReadWrite || access == Access::kWriteOnly || access == Access::kReadWriteOutput;
  if (input && !reads) return place + " is an output of the node, map it into an RPDO";
  if (!input && !writes) return place + " is an input of the node, map it into a TPDO";
  if (mapped.bits != bits_of(*mapped.object))
    return fmt::format("{} has {} bits, not {}", place, bits_of(*mapped.object), mapped.bits);
  return {};
}

/// Objects of 32 bits must begin with a register if their words are to be exchanged.
std::string problem_of_words(const PlannedPdo& pdo) {
  std::size_t bits = 0;
  for (const MappedObject& mapped : pdo.objects) {
    if (mapped.bits == kWordBits && bits % 16 != 0)
      return fmt::format(
          "{:04X}h:{:02X} has 32 bits and does not begin at a register: words = \"high-first\" needs that",
          mapped.index, mapped.sub);
    bits += mapped.bits;
  }
  return {};
}

std::string problem_of(const PlannedPdo& pdo, const PlannedNode& node, Words words) {
  if (pdo.objects.empty()) return "maps nothing: add map = [...]";
  for (const MappedObject& mapped : pdo.objects)
    if (std::string problem = problem_of(mapped, node, pdo.input()); !problem.empty()) return problem;
  if (8 * pdo.bytes() > kMostBits) return "maps more than 64 bits";
  if (pdo.can_id == 0) return "has no CAN-ID in the EDS: add can_id";
  if (cob::is_restricted(pdo.can_id))
    return fmt::format("can_id {:#x} is restricted (CiA 301, 7.3.5)", pdo.can_id);
  if (!Pdo::is_type(pdo.input() ? object::kTpdoParameter : object::kRpdoParameter, pdo.type))
    return fmt::format("type {} is reserved: must be 0..240 or {}..255", pdo.type, pdo.input() ? 252 : 254);
  if (pdo.inhibit_us % object::kInhibitUnit != 0)
    return fmt::format("inhibit_us {}: must be a multiple of {}", pdo.inhibit_us, object::kInhibitUnit);
  return words == Words::kHighFirst ? problem_of_words(pdo) : std::string();
}

bool same(const PlannedPdo& one, const PlannedPdo& other) {
  return one.can_id == other.can_id && one.type == other.type && one.event_ms == other.event_ms &&
         one.inhibit_us == other.inhibit_us &&
         std::ranges::equal(one.objects, other.objects, [](const MappedObject& a, const MappedObject& b) {
           return a.index == b.index && a.sub == b.sub && a.bits == b.bits;
         });
}

/// What is wrong with writing this for a PDO; empty = nothing. A file may describe no PDOs, or too few
/// mappings.
std::string problem_of(const PlannedObject& written, const PlannedNode& node) {
  constexpr std::array<std::string_view, kEventTimer + 1> kKeys{"",           "can_id", "type",
                                                                "inhibit_us", "",       "event_ms"};
  const bool mapping = is_mapping(written.index);
  const Object* const known = node.device ? node.device->find(written.index, written.sub) : nullptr;
  const bool may_be_there = mapping || !node.device || node.device->find(written.index, kCobId) == nullptr;
  if (known == nullptr ? may_be_there : is_writable(*known)) return {};
  return fmt::format("{:04X}h:{:02X} is {} in the EDS: leave out {}", written.index, written.sub,
                     known == nullptr ? "not" : "read-only", mapping ? "map" : kKeys[written.sub]);
}

/// What must be written to the node; nothing if its file has the PDO like this.
std::vector<PlannedObject> configuration_of(const PlannedPdo& pdo, const PlannedNode& node) {
  PlannedPdo standard;
  (pdo.input() ? standard.tpdo : standard.rpdo) = pdo.number();
  if (node.device && take_from(*node.device, standard) && same(standard, pdo)) return {};
  const auto parameters = static_cast<std::uint16_t>(
      (pdo.input() ? object::kTpdoParameter : object::kRpdoParameter) + pdo.number() - 1);
  const auto mapping = static_cast<std::uint16_t>(parameters + kToMapping);
  const auto has = [&](std::uint8_t sub, std::uint32_t value) {
    return value != 0 || (node.device && node.device->find(parameters, sub) != nullptr);
  };
  const std::uint32_t cob_id = pdo.can_id | (pdo.no_rtr ? cob::kNoRemote : 0);
  std::vector<PlannedObject> objects{{parameters, kCobId, to_bytes(cob_id, 4)},
                                     {parameters, kType, to_bytes(pdo.type, 1)}};
  const std::uint32_t inhibit = pdo.inhibit_us / object::kInhibitUnit;
  if (pdo.input() && has(kInhibitTime, inhibit))
    objects.push_back({parameters, kInhibitTime, to_bytes(inhibit, 2)});
  if (has(kEventTimer, pdo.event_ms)) objects.push_back({parameters, kEventTimer, to_bytes(pdo.event_ms, 2)});
  objects.push_back({mapping, 0, to_bytes(pdo.objects.size(), 1)});
  std::uint8_t sub = 0;
  for (const MappedObject& mapped : pdo.objects)
    objects.push_back({mapping, ++sub, to_bytes(entry_of(mapped), 4)});
  std::erase_if(objects, [&](const PlannedObject& object) {
    const Object* const known = node.device ? node.device->find(object.index, object.sub) : nullptr;
    return known != nullptr && !is_writable(*known) && known->value == object.value;
  });
  return in_writing_order(objects);
}

/// Gives it the first bytes after `end` in which its longest value is aligned and it is not divided.
void place_after(std::size_t& end, PlannedPdo& pdo, Placing place) {
  const std::size_t longest = std::ranges::max(pdo.objects, {}, &MappedObject::bits).bits;
  const bool packed = place == Placing::kPacked;
  const std::size_t unit = packed ? std::bit_ceil((longest + 7) / 8) : PdoMapping::kMostBytes;
  const std::size_t size = packed ? pdo.bytes() : PdoMapping::kMostBytes;
  std::size_t begin = (end + unit - 1) / unit * unit;
  if (begin < kFurtherAt && begin + size > kFurtherAt) begin = kFurtherAt;
  pdo.at = static_cast<std::uint16_t>(begin);
  end = begin + size;
}

}  // namespace

Bytes image_of(const PlannedNetwork& network, std::uint8_t own_id, const std::string& name) {
  constexpr std::size_t kMost = NetworkObjects::kMostBytes;
  Image image;
  add_own(image, network);
  for (const PlannedNode& node : network.all) {
    if (node.id == own_id)
      throw UsageError(fmt::format(
          "{}: node {} is the module's own node: another module.node_id, or leave it out", name, node.id));
    for (const PlannedPdo& pdo : node.pdos)
      if (pdo.can_id == EmergencyConsumer::kFirstId + own_id)
        throw UsageError(
            fmt::format("{}{}: node {}: CAN-ID {:#x} is that of the module's EMCY: set another can_id, or "
                        "another module.node_id",
                        name, pdo.line == 0 ? "" : fmt::format(":{}", pdo.line), node.id, pdo.can_id));
    add_node(image, node);
    if (const std::size_t size = image.bytes().size() + NetworkObjects::kCheckBytes; size > kMost)
      throw UsageError(fmt::format(
          "{}{}: node {}: writes up to here take {} bytes, the module has {}: leave default values out", name,
          node.line == 0 ? "" : fmt::format(":{}", node.line), node.id, size, kMost));
  }
  Bytes bytes = image.bytes();
  for (const std::uint8_t byte : to_bytes(crc16(bytes), NetworkObjects::kCheckBytes))
    bytes.push_back(byte);
  return bytes;
}

std::string made_by(std::string_view program, std::string_view file) {
  return fmt::format("// Made by {} from {}: do not edit.\n", program, base::to_utf8(file));
}

std::string array_of(std::string_view array, const Bytes& bytes) {
  std::string text = fmt::format("inline constexpr std::array<std::uint8_t, {}> {}{{", bytes.size(), array);
  constexpr std::size_t kBytesOfLine = 16;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    text += fmt::format("{}0x{:02X},", i % kBytesOfLine == 0 ? "\n    " : " ", bytes[i]);
  return text + "\n};\n";
}

std::string header_of(const Bytes& image, const std::string& name) {
  return made_by("cbcan-network", name) + "#pragma once\n\n#include <array>\n#include <cstdint>\n\n" +
         array_of("kNetwork", image);
}

std::uint16_t register_of(const PlannedNetwork& network, const PlannedPdo& pdo) {
  const bool further = pdo.at >= kFurtherAt;
  const std::size_t inputs = further ? network.further_first - kFurtherAt / 2u : regmap::kProcessFirst;
  const std::size_t to_outputs = further ? regmap::kFurtherWords : regmap::kInputWords;
  return static_cast<std::uint16_t>(inputs + (pdo.input() ? 0 : to_outputs) + pdo.at / 2u);
}

std::size_t PlannedPdo::bytes() const {
  std::size_t bits = 0;
  for (const MappedObject& mapped : objects)
    bits += mapped.bits;
  return (bits + 7) / 8;
}

std::uint32_t entry_of(const MappedObject& mapped) {
  return std::uint32_t{mapped.index} << 16 | std::uint32_t{mapped.sub} << 8 | mapped.bits;
}

void complete_pdos(PlannedNetwork& network, const Fail& fail) {
  std::map<std::uint16_t, std::string> used{{Sync::kStandardId, "SYNC"},
                                            {TimeStamp::kStandardId, "TIME"}};  // by CAN-ID
  for (const PlannedNode& node : network.all)
    if (!node.device || node.device->find(object::kEmergencyCobId, 0) != nullptr)
      used.insert({static_cast<std::uint16_t>(EmergencyConsumer::kFirstId + node.id),
                   fmt::format("node {}, EMCY", node.id)});
  std::array<std::size_t, 2> count{};
  std::array<std::size_t, 2> end{};  // in bytes
  for (PlannedNode& node : network.all)
    for (PlannedPdo& pdo : node.pdos) {
      const auto& first = *std::ranges::find_if(node.pdos, [&](const PlannedPdo& other) {
        return other.input() == pdo.input() && other.number() == pdo.number();
      });
      if (&first != &pdo)
        fail(node, pdo.line, fmt::format("{}: line {} has it already", name_of(pdo), first.line));
      if (const std::string problem = problem_of(pdo, node, network.words); !problem.empty())
        fail(node, pdo.line, name_of(pdo) + ": " + problem);
      const auto [other, is_new] =
          used.insert({pdo.can_id, fmt::format("node {}, {}", node.id, name_of(pdo))});
      if (!is_new)
        fail(node, pdo.line,
             fmt::format("{}: {} has CAN-ID {:#x} already: set another can_id", name_of(pdo), other->second,
                         pdo.can_id));
      if (++count[pdo.input()] > kMostPdos)
        fail(node, pdo.line,
             fmt::format("{}: the module has {} {}s; map more objects into one, or leave this one out",
                         name_of(pdo), kMostPdos, pdo.input() ? "RPDO" : "TPDO"));
      pdo.own = static_cast<std::uint8_t>(count[pdo.input()]);
      place_after(end[pdo.input()], pdo, network.place);
      if (pdo.at >= kFurtherAt && network.further_first == 0)
        fail(node, pdo.line,
             fmt::format("{}: {} have no room: set network.further_first, or network.place = \"packed\"",
                         name_of(pdo), pdo.input() ? "R3800..R3863" : "R3864..R3927"));
      const std::vector<PlannedObject> written = configuration_of(pdo, node);
      for (const PlannedObject& each : written)
        if (const std::string problem = problem_of(each, node); !problem.empty())
          fail(node, pdo.line, name_of(pdo) + ": " + problem);
      node.objects.insert(node.objects.end(), written.begin(), written.end());
    }
}

}  // namespace cbcan::descriptions
