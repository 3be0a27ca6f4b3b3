// SPDX-License-Identifier: MIT
// The PDOs of a network: checks, the configuration of the nodes' PDOs, and the numbers of the own ones.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "cbcan/canopen/sync.hpp"
#include "cbcan/canopen/time_stamp.hpp"
#include "cbcan/regmap.hpp"
#include "descriptions/device_file.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::descriptions {

namespace {

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
  const bool writes = access == Access::kReadWrite || access == Access::kWriteOnly ||
                      access == Access::kReadWriteOutput;
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
  if (has(kEventTimer, pdo.event_ms))
    objects.push_back({parameters, kEventTimer, to_bytes(pdo.event_ms, 2)});
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
