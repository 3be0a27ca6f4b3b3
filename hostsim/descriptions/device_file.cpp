// SPDX-License-Identifier: MIT
#include "descriptions/network_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan::descriptions {

namespace {

using object::kRpdoParameter;
using object::kTpdoParameter;

constexpr std::uint8_t kInvalid = 0x80;  ///< in the highest byte of a PDO's COB-ID
constexpr std::uint64_t kMostMapped = 64;

/// The communication parameters of the PDO that the object belongs to; 0 = none.
std::uint16_t pdo_of(std::uint16_t index) {
  if (index < kRpdoParameter || index > object::kLastPdo) return 0;
  return static_cast<std::uint16_t>(index & kToMapping ? index - kToMapping : index);
}

const PlannedObject* find(const std::vector<PlannedObject>& objects, std::uint16_t index, std::uint8_t sub) {
  const auto found = std::find_if(objects.begin(), objects.end(), [&](const PlannedObject& object) {
    return object.index == index && object.sub == sub;
  });
  return found == objects.end() ? nullptr : &*found;
}

/// `objects` are those of one PDO, in the order of index and sub-index.
void append_pdo(std::vector<PlannedObject>& order, const std::vector<PlannedObject>& objects) {
  const std::uint16_t pdo = pdo_of(objects.front().index);
  const auto mapping = static_cast<std::uint16_t>(pdo + kToMapping);
  const PlannedObject* const cob_id = find(objects, pdo, kCobId);
  const PlannedObject* const count = find(objects, mapping, 0);
  if (cob_id != nullptr) order.push_back(*cob_id), order.back().value.back() |= kInvalid;
  for (const PlannedObject& object : objects)
    if (object.index == pdo && object.sub > kCobId) order.push_back(object);
  if (count != nullptr) order.push_back({mapping, 0, {0}});
  for (const PlannedObject& object : objects)
    if (object.index == mapping && object.sub > 0 && (count == nullptr || object.sub <= count->value[0]))
      order.push_back(object);
  if (count != nullptr && count->value[0] != 0) order.push_back(*count);
  if (cob_id != nullptr && (cob_id->value.back() & kInvalid) == 0) order.push_back(*cob_id);
}

/// A 0 in 1018h is not checked, as in CiA 302's 1F85h to 1F88h.
bool is_checked(const Object& object) {
  const bool says_something =
      std::any_of(object.value.begin(), object.value.end(), [](std::uint8_t byte) { return byte != 0; });
  return (object.index == kIdentity && object.first_sub > 0 && says_something) ||
         (object.index == kDeviceType && object.has_value);
}

/// What the file sets; of a PDO that it changes also COB-ID and number of mappings, which must be written
/// again.
bool is_set(const Object& object, const std::set<std::uint16_t>& touched) {
  const bool frames_others = object.first_sub == (is_mapping(object.index) ? 0 : kCobId);
  return is_writable(object) && (object.configured || (pdo_of(object.index) != 0 && frames_others &&
                                                       touched.contains(object.index)));
}

/// The ParameterValues of all writable objects, in the order of writing. Throws UsageError.
std::vector<PlannedObject> configured_objects(const DeviceDescription& device, const std::string& name) {
  std::set<std::uint16_t> touched;
  for (const Object& object : device.objects)
    if (object.configured) touched.insert({object.index, pdo_of(object.index)});
  std::vector<PlannedObject> objects;
  for (const Object& object : device.objects) {
    if (!is_set(object, touched)) continue;
    if (object.value.empty() || object.value.size() > kMostValueToWrite)
      throw UsageError(fmt::format("{}:{}: {:04X}h:{:02X} has {} bytes: must be 1..{}", name, object.line,
                                   object.index, object.first_sub, object.value.size(),
                                   kMostValueToWrite));
    for (unsigned sub = object.first_sub; sub <= object.last_sub; ++sub)
      objects.push_back({object.index, static_cast<std::uint8_t>(sub), object.value});
  }
  return in_writing_order(objects);
}

}  // namespace

std::vector<PlannedObject> in_writing_order(const std::vector<PlannedObject>& objects) {
  std::vector<PlannedObject> order;
  std::map<std::uint16_t, std::vector<PlannedObject>> pdos;
  for (const PlannedObject& object : objects)
    (pdo_of(object.index) == 0 ? order : pdos[pdo_of(object.index)]).push_back(object);
  for (const auto& [pdo, parts] : pdos)
    append_pdo(order, parts);
  return order;
}

bool is_command(std::uint16_t index) {
  return index == object::kErrorHistory || index == object::kStore || index == object::kRestore;
}

bool is_writable(const Object& object) {
  return object.access != Access::kReadOnly && object.access != Access::kConstant &&
         object.index >= object::kFirstCommunication && !is_command(object.index);
}

const ValueType& type_of(const Object& object) {
  const auto found = std::ranges::find(kValueTypes, object.type, &ValueType::type);
  return found == kValueTypes.end() ? value_type("hex") : *found;
}

DeviceDescription parse_device(std::string_view text, const std::string& name,
                                    std::optional<std::uint8_t> node_id, std::vector<std::string>& remarks) {
  Result result = read(text, name, node_id);
  const auto refusal = [](const Diagnostic& found) {
    std::string message = to_string(found);
    for (const std::string_view part : {": left out", ": ignored"})  // nothing of the file is used
      if (const std::size_t at = message.rfind(part); at != std::string::npos) message.erase(at, part.size());
    return message;
  };
  const auto is_about_all = [](const Diagnostic& found) {
    return found.line == 1 && found.severity == Severity::kError;
  };
  if (result.device.objects.empty() && std::ranges::none_of(result.diagnostics, is_about_all))
    throw UsageError(name + ": not one object in it; name an EDS or DCF file");
  for (const Diagnostic& found : result.diagnostics) {
    const bool is_value = base::same_text(found.message.substr(0, 14), "ParameterValue");
    if (found.severity == Severity::kError || is_value) throw UsageError(refusal(found));
    if (found.severity == Severity::kWarning) remarks.push_back(to_string(found));
  }
  return std::move(result.device);
}

std::vector<PlannedObject> expected_identity(const DeviceDescription& device) {
  std::vector<PlannedObject> identity;
  for (const Object& object : device.objects)
    if (is_checked(object)) identity.push_back({object.index, object.first_sub, object.value});
  return identity;
}

std::uint8_t bits_of(const Object& object) {
  if (object.type == DataType::kBoolean) return 1;
  const std::size_t size = size_of(object.type);
  return static_cast<std::uint8_t>(8 * (size != 0 ? size : std::min<std::size_t>(object.value.size(), 8)));
}

bool take_from(const DeviceDescription& device, PlannedPdo& pdo) {
  const auto parameters =
      static_cast<std::uint16_t>((pdo.input() ? kTpdoParameter : kRpdoParameter) + pdo.number() - 1);
  const auto number = [&device](std::uint16_t index, std::uint8_t sub) {
    const Object* const object = device.find(index, sub);
    return object == nullptr ? std::uint64_t{0} : load_little_endian(object->value);
  };
  const auto cob_id = static_cast<std::uint32_t>(number(parameters, kCobId));
  const auto mapping = static_cast<std::uint16_t>(parameters + kToMapping);
  pdo.can_id = static_cast<std::uint16_t>(cob::id_of(cob_id));
  pdo.no_rtr = pdo.input() && (cob_id & cob::kNoRemote) != 0;
  if (device.find(parameters, kType) != nullptr)
    pdo.type = static_cast<std::uint8_t>(number(parameters, kType));
  pdo.event_ms = static_cast<std::uint16_t>(number(parameters, kEventTimer));
  pdo.inhibit_us = static_cast<std::uint32_t>(number(parameters, kInhibitTime) * object::kInhibitUnit);
  for (std::uint64_t sub = 1; sub <= std::min<std::uint64_t>(number(mapping, 0), kMostMapped); ++sub) {
    const auto entry = static_cast<std::uint32_t>(number(mapping, static_cast<std::uint8_t>(sub)));
    const auto index = static_cast<std::uint16_t>(entry >> 16);
    const auto of_object = static_cast<std::uint8_t>(entry >> 8);
    pdo.objects.push_back(
        {index, of_object, static_cast<std::uint8_t>(entry), device.find(index, of_object)});
  }
  return cob_id != 0 && (cob_id & cob::kInvalid) == 0 && !pdo.objects.empty();
}

std::vector<PlannedPdo> valid_pdos(const DeviceDescription& device) {
  std::vector<PlannedPdo> pdos;
  std::uint16_t last = 0;
  for (const Object& object : device.objects) {
    const bool tpdo = object.index >= kTpdoParameter && object.index < kTpdoParameter + kToMapping;
    const bool rpdo = object.index >= kRpdoParameter && object.index < kRpdoParameter + kToMapping;
    if (object.index == last || (!tpdo && !rpdo)) continue;
    last = object.index;
    PlannedPdo pdo;
    (tpdo ? pdo.tpdo : pdo.rpdo) =
        static_cast<std::uint16_t>(object.index - (tpdo ? kTpdoParameter : kRpdoParameter) + 1);
    if (take_from(device, pdo)) pdos.push_back(std::move(pdo));
  }
  return pdos;
}

void configure_by(const DeviceDescription& device, const std::string& name, PlannedNode& node) {
  node.id = *device.node_id;
  node.identity = expected_identity(device);
  node.objects = configured_objects(device, name);
}

PlannedNode parse_dcf(std::string_view text, const std::string& name, std::vector<std::string>& remarks) {
  const DeviceDescription device = parse_device(text, name, std::nullopt, remarks);
  if (!device.node_id)
    throw UsageError(name + ":1: there is no NodeID in [DeviceComissioning]: is this a DCF?");
  PlannedNode node;
  configure_by(device, name, node);
  return node;
}

}  // namespace cbcan::descriptions
