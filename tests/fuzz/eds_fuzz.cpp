// SPDX-License-Identifier: MIT
// Any bytes as an EDS or DCF: reading ends, has the same result twice, and the result is within its limits.

#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

namespace {

/// Larger images take milliseconds without testing more.
constexpr std::uint64_t kMostImageBytes = 1U << 18;

void check_diagnostics(const descriptions::Result& result, std::string_view text) {
  const auto lines =
      static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return c == '\n' || c == '\r'; })) +
      1;
  require(result.diagnostics.size() <= descriptions::Findings::kMost + 1, "not more diagnostics than people read");
  std::size_t previous = 1;
  for (const descriptions::Diagnostic& diagnostic : result.diagnostics) {
    require(diagnostic.line >= previous && diagnostic.line <= lines, "every diagnostic has a line, in order");
    require(!diagnostic.message.empty() && diagnostic.file == "fuzz.eds", "a diagnostic says what and where");
    previous = diagnostic.line;
  }
}

void check_object(const descriptions::Object& object) {
  const std::size_t fixed = size_of(object.type);
  require(object.first_sub <= object.last_sub, "a run of sub-indices has a beginning and an end");
  require(object.value.size() <= object.capacity, "a value fits into its object");
  require(object.capacity <= descriptions::kMostCapacity, "no object is larger than the most");
  require(fixed == 0 || (object.value.size() == fixed && object.capacity == fixed),
          "a number has its type's size");
  require(object.value.size() < 8 || fixed == 0 || !object.low || object.capacity == 8,
          "limits are for integers");
}

std::uint64_t check_device(const descriptions::DeviceDescription& device) {
  std::uint64_t bytes = 0;
  std::uint32_t next = 0;
  for (const descriptions::Object& object : device.objects) {
    check_object(object);
    const std::uint32_t first = std::uint32_t{object.index} << 8 | object.first_sub;
    require(first >= next, "objects are sorted, no sub-index twice");
    next = (std::uint32_t{object.index} << 8 | object.last_sub) + 1;
    bytes += std::uint64_t{object.capacity} * (object.last_sub - object.first_sub + 1u);
    require(device.find(object.index, object.last_sub) == &object, "every object is found");
  }
  require(bytes <= descriptions::kMostValueBytes, "all values of a device are limited");
  require(!device.node_id || (*device.node_id >= 1 && *device.node_id <= 127), "a node ID is 1..127");
  return bytes;
}

/// Reads every value of the dictionary and writes it back, as the device itself would.
void check_image(const descriptions::DeviceDescription& device) {
  descriptions::DictionaryImage image = descriptions::dictionary_image(device);
  ObjectDictionary dictionary(image.entries, image.values, nullptr, image.limits);
  std::size_t end = 0;
  for (const ObjectEntry& entry : image.entries) {
    require(entry.offset >= end, "values do not overlap");
    end = entry.offset + std::size_t{entry.stride()} * (entry.last_sub - entry.first_sub) + entry.capacity;
    for (unsigned sub = entry.first_sub; sub <= entry.last_sub; ++sub) {
      const auto value = dictionary.value(entry, static_cast<std::uint8_t>(sub));
      require(value.size() <= entry.capacity, "a stored value fits");
      require(entry.has(ObjectFlags::kVariable) || value.size() == size_of(entry.type),
              "a stored number is whole");
    }
  }
  require(end == image.values.size(), "the values are as long as the entries say");
  std::size_t next = 0;
  for (const NodeIdValue& relative : image.node_id_values) {
    require(relative.offset >= next && relative.size >= 1 && relative.size <= 8,
            "values follow the node ID once");
    next = relative.offset + std::size_t{relative.size};
  }
  require(next <= image.values.size(), "values that follow the node ID are values");
  require(std::ranges::is_sorted(image.limits, {},
                                 [](const auto& limit) { return std::pair(limit.index, limit.sub); }),
          "limits are sorted");
}

/// The input is only the file, so its size determines the caller's node ID; 0 = none.
std::optional<std::uint8_t> node_id_for(std::size_t size) {
  const auto id = static_cast<std::uint8_t>(size & 0x7F);
  return id == 0 ? std::nullopt : std::optional(id);
}

}  // namespace

void run(Input input) {
  const std::string_view text = text_of(input.rest());
  const auto node_id = node_id_for(text.size());
  const descriptions::Result result = descriptions::read(text, "fuzz.eds", node_id);
  if (is_read_twice(text.size()))
    require(result == descriptions::read(text, "fuzz.eds", node_id), "the same text gives the same result");
  check_diagnostics(result, text);
  if (check_device(result.device) <= kMostImageBytes) check_image(result.device);
}

}  // namespace cbcan::fuzz
