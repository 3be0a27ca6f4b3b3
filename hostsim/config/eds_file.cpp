// SPDX-License-Identifier: MIT
#include "config/build_node.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "devices/devices.hpp"
#include "devices/lua/lua_device.hpp"

namespace cbcan::config {

EdsFile::EdsFile(std::string name, std::string text, devices::ObjectChanges changes,
                 std::vector<std::string> modules)
    : name_(std::move(name)),
      text_(std::move(text)),
      changes_(std::move(changes)),
      modules_(std::move(modules)) {
  descriptions::Result none = read(0);
  flat_ = std::move(none.flat);
  alike_ = descriptions::only_values_differ(this->text(), none.device.objects);
  if (alike_) none_ = {descriptions::dictionary_image(none.device), std::move(none.diagnostics)};
  description_ = std::make_shared<const descriptions::DeviceDescription>(std::move(none.device));
}

EdsFile::ForNode EdsFile::for_node(std::uint8_t node_id) const {
  if (!alike_) {
    descriptions::Result result = read(node_id);
    return {descriptions::dictionary_image(result.device), std::move(result.diagnostics)};
  }
  ForNode node = none_;
  change_node_id(node.image.values, node.image.node_id_values, 0, node_id);
  return node;
}

descriptions::Result EdsFile::read(std::uint8_t node_id) const {
  descriptions::Result result = descriptions::read(text_, name_, node_id, devices::standard_type, modules_);
  if (changes_.eds.empty()) return result;
  std::vector<descriptions::Object>& objects = result.device.objects;
  std::vector<descriptions::Object> added = descriptions::read(changes_.eds, name_, node_id).device.objects;
  std::erase_if(added, [&](const descriptions::Object& each) {
    return each.index < object::kFirstManufacturer ||
           std::ranges::count(objects, each.index, &descriptions::Object::index) != 0;
  });
  std::erase_if(objects, [&](const descriptions::Object& each) {
    return std::ranges::count(changes_.removed, each.index) != 0;
  });
  objects.insert(objects.end(), added.begin(), added.end());
  std::ranges::stable_sort(objects, {}, &descriptions::Object::index);
  return result;
}

std::string description_of(const NodeConfig& node) {
  return node.eds.empty() ? std::string(devices::script_of(node.device)) : node.eds;
}

const EdsFile* EdsFiles::find(const std::string& path, const std::string& beside,
                              const std::vector<base::Line>& modules) {
  // The text of the script: one that could not be read, or has changed, counts as another.
  const std::string script = beside.empty() ? std::string() : read_(beside).value_or(std::string());
  const Key key(path, script, base::column(modules, &base::Line::text));
  auto file = files_.find(key);
  if (file == files_.end()) {
    std::optional<std::string> text = read_(path);
    if (text && devices::is_script(path)) text = devices::eds_of_script(path, *text);
    devices::ObjectChanges changes =
        script.empty() ? devices::ObjectChanges() : devices::changes_of_script(beside, script);
    if (text)
      file = files_.emplace(key, EdsFile(path, std::move(*text), std::move(changes), std::get<2>(key))).first;
  }
  return file == files_.end() ? nullptr : &file->second;
}

}  // namespace cbcan::config
