// SPDX-License-Identifier: MIT
#include "config/build_node.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "descriptions/eds_reader.hpp"
#include "devices/devices.hpp"
#include "devices/lua/lua_device.hpp"

namespace cbcan::config {

namespace {

descriptions::Result read(const std::string& text, const std::string& name, std::uint8_t node_id,
                          const devices::ObjectChanges& changes) {
  descriptions::Result result = descriptions::read(text, name, node_id, devices::standard_type);
  if (changes.eds.empty()) return result;
  std::vector<descriptions::Object>& objects = result.device.objects;
  std::vector<descriptions::Object> added = descriptions::read(changes.eds, name, node_id).device.objects;
  std::erase_if(added, [&](const descriptions::Object& each) {
    return each.index < object::kFirstManufacturer ||
           std::ranges::count(objects, each.index, &descriptions::Object::index) != 0;
  });
  std::erase_if(objects, [&](const descriptions::Object& each) {
    return std::ranges::count(changes.removed, each.index) != 0;
  });
  objects.insert(objects.end(), added.begin(), added.end());
  std::ranges::stable_sort(objects, {}, &descriptions::Object::index);
  return result;
}

}  // namespace

EdsFile::EdsFile(std::string name, std::string text, devices::ObjectChanges changes)
    : name_(std::move(name)), text_(std::move(text)), changes_(std::move(changes)) {
  descriptions::Result none = read(text_, name_, 0, changes_);
  alike_ = descriptions::only_values_differ(text_, none.device.objects);
  if (alike_) none_ = {descriptions::dictionary_image(none.device), std::move(none.diagnostics)};
  description_ = std::make_shared<const descriptions::DeviceDescription>(std::move(none.device));
}

EdsFile::ForNode EdsFile::for_node(std::uint8_t node_id) const {
  if (!alike_) {
    descriptions::Result result = read(text_, name_, node_id, changes_);
    return {descriptions::dictionary_image(result.device), std::move(result.diagnostics)};
  }
  ForNode node = none_;
  change_node_id(node.image.values, node.image.node_id_values, 0, node_id);
  return node;
}

std::string description_of(const NodeConfig& node) {
  return node.eds.empty() ? std::string(devices::script_of(node.device)) : node.eds;
}

const EdsFile* EdsFiles::find(const std::string& path, const std::string& beside) {
  const std::pair key(path, beside);
  auto file = files_.find(key);
  if (file == files_.end()) {
    std::optional<std::string> text = read_(path);
    if (text && devices::is_script(path)) text = devices::eds_of_script(path, *text);
    const std::optional<std::string> script = beside.empty() ? std::nullopt : read_(beside);
    devices::ObjectChanges changes =
        script ? devices::changes_of_script(beside, *script) : devices::ObjectChanges();
    if (text) file = files_.emplace(key, EdsFile(path, std::move(*text), std::move(changes))).first;
  }
  return file == files_.end() ? nullptr : &file->second;
}

}  // namespace cbcan::config
