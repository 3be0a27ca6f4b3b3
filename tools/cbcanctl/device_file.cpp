// SPDX-License-Identifier: MIT
#include "cbcanctl/device_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "text/words.hpp"

namespace cbcan::tools {

namespace {

constexpr std::uint16_t kToMapping = 0x200;  ///< from communication to mapping parameters
constexpr std::uint8_t kInvalid = 0x80;      ///< of the highest byte of a PDO's COB-ID
constexpr std::uint8_t kCobId = 1;

/// The communication parameters of the PDO that the object belongs to; 0 = of none.
std::uint16_t pdo_of(std::uint16_t index) {
  if (index < 0x1400 || index > 0x1BFF) return 0;
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

std::uint32_t number(const Bytes& value) {
  std::uint32_t number = 0;
  for (std::size_t i = std::min<std::size_t>(value.size(), 4); i-- > 0;)
    number = number << 8 | value[i];
  return number;
}

class DcfReader {
 public:
  DcfReader(const eds::DeviceDescription& device, const std::string& name) : device_(device), name_(name) {}

  PlannedNode read() {
    const auto& commissioning = device_.commissioning;
    if (!commissioning || !commissioning->node_id)
      throw UsageError(name_ + ":1: there is no NodeID in [DeviceComissioning]: is this a DCF?");
    PlannedNode node;
    node.id = *commissioning->node_id;
    std::vector<PlannedObject> objects;
    for (const eds::Object& object : device_.objects) {
      check_identity(object, node);
      if (object.configured && is_writable(object)) add(object, objects);
    }
    complete_pdos(objects);
    node.objects = in_writing_order(objects);
    return node;
  }

 private:
  /// In 1018h a 0 says nothing, as in CiA 302's 1F85h to 1F88h.
  static void check_identity(const eds::Object& object, PlannedNode& node) {
    const bool is_type = object.index == kDeviceType && object.has_value;
    const bool is_identity = object.index == kIdentity && object.first_sub > 0 && number(object.value) != 0;
    if (is_type || is_identity) node.identity.push_back({object.index, object.first_sub, object.value});
  }

  void add(const eds::Object& object, std::vector<PlannedObject>& objects) const {
    if (object.value.empty() || object.value.size() > regmap::kMaxDataBytes)
      throw UsageError(fmt::format("{}:{}: {:04X}h:{:02X} has {} bytes: must be 1..{}", name_, object.line,
                                   object.index, object.first_sub, object.value.size(),
                                   regmap::kMaxDataBytes));
    for (unsigned sub = object.first_sub; sub <= object.last_sub; ++sub)
      objects.push_back({object.index, static_cast<std::uint8_t>(sub), object.value});
  }

  /// A PDO needs its COB-ID and the number of its mappings, also where the file leaves them as they are.
  void complete_pdos(std::vector<PlannedObject>& objects) const {
    for (const eds::Object& object : device_.objects) {
      const std::uint16_t pdo = pdo_of(object.index);
      const bool mapping = is_mapping(object.index);
      if (pdo == 0 || object.first_sub != (mapping ? 0 : kCobId) || object.configured || !is_writable(object))
        continue;
      if (std::any_of(objects.begin(), objects.end(), [&](const PlannedObject& each) {
            return mapping ? each.index == object.index : pdo_of(each.index) == pdo;
          }))
        add(object, objects);
    }
  }

  const eds::DeviceDescription& device_;
  const std::string& name_;
};

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
  return index == 0x1003 || index == 0x1010 || index == 0x1011;
}

bool is_mapping(std::uint16_t index) {
  return pdo_of(index) != index && pdo_of(index) != 0;
}

bool is_writable(const eds::Object& object) {
  return object.access != eds::Access::kReadOnly && object.access != eds::Access::kConstant &&
         object.index >= 0x1000 && !is_command(object.index);
}

const ValueType& type_of(const eds::Object& object) {
  using enum DataType;
  const std::string bits = std::to_string(8 * size_of(object.type));
  const auto number = static_cast<unsigned>(object.type);
  if (object.type == kBoolean) return value_type("bool");
  if (object.type == kVisibleString) return value_type("string");
  if (object.type == kReal32 || object.type == kReal64) return value_type("f" + bits);
  if (is_signed(object.type)) return value_type("i" + bits);
  const bool is_unsigned = (number >= static_cast<unsigned>(kUnsigned8) && object.type <= kUnsigned32) ||
                           (object.type >= kUnsigned24 && object.type <= kUnsigned64);
  return value_type(is_unsigned ? "u" + bits : "hex");
}

eds::DeviceDescription parse_device(std::string_view text, const std::string& name,
                                    std::optional<std::uint8_t> node_id, std::vector<std::string>& remarks) {
  eds::Result result = eds::read(text, name, node_id);
  for (const eds::Diagnostic& found : result.diagnostics) {
    const bool is_value = text::same_text(found.message.substr(0, 14), "ParameterValue");
    if (found.severity == eds::Severity::kError || is_value) throw UsageError(to_string(found));
    if (found.severity == eds::Severity::kWarning) remarks.push_back(to_string(found));
  }
  return std::move(result.device);
}

PlannedNode parse_dcf(std::string_view text, const std::string& name, std::vector<std::string>& remarks) {
  return DcfReader(parse_device(text, name, std::nullopt, remarks), name).read();
}

}  // namespace cbcan::tools
