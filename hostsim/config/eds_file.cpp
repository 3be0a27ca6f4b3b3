// SPDX-License-Identifier: MIT
#include "config/build_node.hpp"

#include "descriptions/eds_reader.hpp"
#include "devices/devices.hpp"
#include "devices/lua/lua_device.hpp"

namespace cbcan::config {

namespace {

descriptions::Result read(const std::string& text, const std::string& name, std::uint8_t node_id) {
  return descriptions::read(text, name, node_id, devices::standard_type);
}

}  // namespace

EdsFile::EdsFile(std::string name, std::string text) : name_(std::move(name)), text_(std::move(text)) {
  descriptions::Result none = read(text_, name_, 0);
  alike_ = descriptions::only_values_differ(text_, none.device.objects);
  if (alike_) none_ = {descriptions::dictionary_image(none.device), std::move(none.diagnostics)};
  description_ = std::make_shared<const descriptions::DeviceDescription>(std::move(none.device));
}

EdsFile::ForNode EdsFile::for_node(std::uint8_t node_id) const {
  if (!alike_) {
    descriptions::Result result = read(text_, name_, node_id);
    return {descriptions::dictionary_image(result.device), std::move(result.diagnostics)};
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
