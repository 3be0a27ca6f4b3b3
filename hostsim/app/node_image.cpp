// SPDX-License-Identifier: MIT
#include "app/node_image.hpp"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <utility>

#include "devices/devices.hpp"
#include "eds/dictionary_image.hpp"
#include "eds/eds_reader.hpp"
#include "eds/values.hpp"

namespace cbcan::app {

namespace {

std::optional<Bytes> encode_integer(std::int64_t number, DataType type) {
  const std::size_t size = size_of(type);
  if (size == 0 || (type == DataType::kBoolean && (number < 0 || number > 1))) return std::nullopt;
  const auto raw = static_cast<std::uint64_t>(number);
  const eds::Number written{.magnitude = number < 0 ? 0 - raw : raw, .negative = number < 0};
  const std::optional<std::uint64_t> bits = eds::to_bits(written, type);
  return bits ? std::optional(eds::to_bytes(*bits, size)) : std::nullopt;
}

std::optional<Bytes> encode_real(double number, DataType type) {
  if (type == DataType::kReal64) return eds::to_bytes(std::bit_cast<std::uint64_t>(number), 8);
  if (type != DataType::kReal32) return std::nullopt;
  return eds::to_bytes(std::bit_cast<std::uint32_t>(static_cast<float>(number)), 4);
}

std::string object_name(const InitialValue& initial) {
  char text[32];
  std::snprintf(text, sizeof text, "object %04Xh:%02X", initial.index, initial.sub);
  return text;
}

/// Puts the value in, which then no longer follows the node ID; returns what is wrong with it, or nothing.
std::string put(const InitialValue& initial, ObjectDictionary& dictionary, eds::DictionaryImage& image) {
  const ObjectEntry* entry = nullptr;
  if (dictionary.find(initial.index, initial.sub, entry) != AbortCode::kNone)
    return object_name(initial) + ": the node's EDS file has no such object";
  const std::optional<Bytes> bytes = encode(initial.value, entry->type);
  const bool variable = entry->has(ObjectFlags::kVariable);
  if (!bytes || bytes->size() > entry->capacity || (!variable && bytes->size() != entry->capacity))
    return object_name(initial) + ": " + value_text(initial.value) + " does not fit its data type " +
           std::string(eds::name_of(entry->type)) + " of " + std::to_string(entry->capacity) + " bytes";
  dictionary.store(*entry, initial.sub, *bytes);
  const std::uint8_t* const place = dictionary.value(*entry, initial.sub).data();
  std::erase_if(image.node_id_values,
                [&](const NodeIdValue& relative) { return image.values.data() + relative.offset == place; });
  return {};
}

}  // namespace

std::optional<Bytes> encode(const Value& value, DataType type) {
  if (const auto* bytes = std::get_if<Bytes>(&value)) return *bytes;
  if (const auto* number = std::get_if<double>(&value)) return encode_real(*number, type);
  if (const auto* flag = std::get_if<bool>(&value)) return encode_integer(*flag ? 1 : 0, type);
  if (const auto* number = std::get_if<std::int64_t>(&value))
    return eds::is_real(type) ? encode_real(static_cast<double>(*number), type)
                              : encode_integer(*number, type);
  if (size_of(type) != 0) return std::nullopt;
  const auto& text = std::get<std::string>(value);
  return Bytes(text.begin(), text.end());
}

NodeBuild build_node(const NodeConfig& node, const FileReader& read) {
  NodeBuild build;
  const std::optional<std::string> text = read(node.eds);
  if (!text) {
    build.problems.push_back(to_string(node.place) + ": node " + std::to_string(node.id) + ": cannot read " +
                             node.eds + "; paths are relative to the plant file");
    return build;
  }
  const eds::Result result = eds::read(*text, node.eds, node.id);
  for (const eds::Diagnostic& diagnostic : result.diagnostics)
    (diagnostic.severity == eds::Severity::kNote ? build.notes : build.warnings)
        .push_back(eds::to_string(diagnostic));
  eds::DictionaryImage image = eds::dictionary_image(result.device);
  if (image.entries.empty())
    build.problems.push_back(node.eds + ": not one object in it that a node could have");
  ObjectDictionary dictionary(image.entries, image.values, nullptr);
  for (const InitialValue& initial : node.objects)
    if (std::string wrong = put(initial, dictionary, image); !wrong.empty())
      build.problems.push_back(to_string(initial.place) + ": node " + std::to_string(node.id) + ": " +
                               std::move(wrong));
  if (!build.problems.empty()) return build;
  constexpr std::uint16_t kDeviceType = 0x1000;
  const auto profile = static_cast<std::uint16_t>(dictionary.get(kDeviceType, 0));
  const devices::DeviceKind& device = devices::device_for_profile(profile);
  build.node.emplace();
  build.node->image = {std::move(image.entries), std::move(image.limits), std::move(image.values),
                       std::move(image.node_id_values)};
  build.node->parts.behaviour = device.make;
  build.node->device = device.name;
  return build;
}

}  // namespace cbcan::app
