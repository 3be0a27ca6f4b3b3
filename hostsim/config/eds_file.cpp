// SPDX-License-Identifier: MIT
#include "config/eds_file.hpp"

#include <utility>

#include "cbcan/canopen/nmt/nmt.hpp"
#include "devices/devices.hpp"
#include "eds/eds_reader.hpp"
#include "eds/values.hpp"

namespace cbcan::config {

namespace {

eds::Result read(const std::string& text, const std::string& name, std::uint8_t node_id) {
  return eds::read(text, name, node_id, devices::standard_type);
}

/// The same as dictionary_image() and change_node_id() for the highest node ID.
void move_to_last_node(std::vector<eds::Object>& objects) {
  for (eds::Object& object : objects) {
    const NodeIdValue all{0, object.node_ids, static_cast<std::uint8_t>(object.value.size())};
    if (object.node_ids != 0) change_node_id(object.value, {&all, 1}, 0, nmt::kMaxNode);
  }
}

}  // namespace

EdsFile::EdsFile(std::string name, std::string text) : name_(std::move(name)), text_(std::move(text)) {
  eds::Result none = read(text_, name_, 0);
  const eds::Result last = read(text_, name_, nmt::kMaxNode);
  none_.image = eds::dictionary_image(none.device);
  names_ = std::make_shared<const eds::ObjectNames>(eds::object_names(none.device));
  move_to_last_node(none.device.objects);
  alike_ = none.device.objects == last.device.objects && none.diagnostics == last.diagnostics;
  none_.diagnostics = std::move(none.diagnostics);
}

EdsFile::ForNode EdsFile::for_node(std::uint8_t node_id) {
  if (!alike_) {
    eds::Result result = read(text_, name_, node_id);
    return {eds::dictionary_image(result.device), std::move(result.diagnostics)};
  }
  ForNode node{none_.image, std::exchange(none_.diagnostics, {})};
  change_node_id(node.image.values, node.image.node_id_values, 0, node_id);
  return node;
}

}  // namespace cbcan::config
