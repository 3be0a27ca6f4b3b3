// SPDX-License-Identifier: MIT
#include "config/eds_file.hpp"

#include <algorithm>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "devices/devices.hpp"
#include "devices/lua/lua_device.hpp"
#include "eds/eds_reader.hpp"
#include "eds/values.hpp"

namespace cbcan::config {

namespace {

eds::Result read(const std::string& text, const std::string& name, std::uint8_t node_id) {
  return eds::read(text, name, node_id, devices::standard_type);
}

/// The value fits its type with every node ID, and nothing but the value depends on it.
bool follows_node_id(const eds::Object& object) {
  if (object.node_ids == 0) return true;
  const std::int64_t value = eds::from_bits(load_little_endian(object.value), object.type);
  const std::uint64_t highest = eds::highest_pattern(object.value.size()) >> (is_signed(object.type) ? 1 : 0);
  const std::uint64_t most = std::uint64_t{object.node_ids} * nmt::kMaxNode;
  const bool may_be_count = object.last_sub == 0 && object.value.size() == 1;
  const bool is_checked = object.low || object.high || may_be_count;
  return !is_checked && value >= 0 && most <= highest && static_cast<std::uint64_t>(value) <= highest - most;
}

/// The results for all node IDs differ by values only. `objects`: for node ID 0.
bool only_values_differ(const std::string& text, const std::vector<eds::Object>& objects) {
  std::size_t found = 0;
  for (const eds::Object& object : objects)
    found += object.node_ids;
  return found == static_cast<std::size_t>(std::ranges::count(text, '$')) &&
         std::ranges::all_of(objects, follows_node_id);
}

}  // namespace

EdsFile::EdsFile(std::string name, std::string text) : name_(std::move(name)), text_(std::move(text)) {
  eds::Result none = read(text_, name_, 0);
  names_ = std::make_shared<const eds::ObjectNames>(eds::object_names(none.device));
  alike_ = only_values_differ(text_, none.device.objects);
  if (alike_) none_ = {eds::dictionary_image(none.device), std::move(none.diagnostics)};
}

EdsFile::ForNode EdsFile::for_node(std::uint8_t node_id) const {
  if (!alike_) {
    eds::Result result = read(text_, name_, node_id);
    return {eds::dictionary_image(result.device), std::move(result.diagnostics)};
  }
  ForNode node = none_;
  change_node_id(node.image.values, node.image.node_id_values, 0, node_id);
  return node;
}

std::string description_of(const NodeConfig& node) {
  return node.eds.empty() ? std::string(devices::script_of(node.device)) : node.eds;
}

const EdsFile* EdsFiles::find(const std::string& path) {
  auto file = files_.find(path);
  if (file == files_.end()) {
    std::optional<std::string> text = read_(path);
    if (text && devices::is_script(path)) text = devices::eds_of_script(path, *text);
    if (text) file = files_.emplace(path, EdsFile(path, std::move(*text))).first;
  }
  return file == files_.end() ? nullptr : &file->second;
}

}  // namespace cbcan::config
