// SPDX-License-Identifier: MIT
#include "plant/eds_file.hpp"

#include <utility>

#include "cbcan/canopen/nmt/nmt.hpp"
#include "devices/devices.hpp"
#include "eds/eds_reader.hpp"
#include "eds/values.hpp"

namespace cbcan::plant {

namespace {

eds::Result read(const std::string& text, const std::string& name, std::uint8_t node_id) {
  return eds::read(text, name, node_id, devices::standard_type);
}

/// What dictionary_image() and change_node_id() would come to for the highest node ID.
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
  image_ = eds::dictionary_image(none.device);
  names_ = std::make_shared<const eds::ObjectNames>(eds::object_names(none.device));
  move_to_last_node(none.device.objects);
  alike_ = none.device.objects == last.device.objects && none.diagnostics == last.diagnostics;
  if (alike_) diagnostics_ = std::move(none.diagnostics);
}

eds::DictionaryImage EdsFile::image(std::uint8_t node_id) const {
  if (!alike_) return eds::dictionary_image(read(text_, name_, node_id).device);
  eds::DictionaryImage image = image_;
  change_node_id(image.values, image.node_id_values, 0, node_id);
  return image;
}

std::vector<eds::Diagnostic> EdsFile::take_diagnostics(std::uint8_t node_id) {
  return alike_ ? std::exchange(diagnostics_, {}) : read(text_, name_, node_id).diagnostics;
}

}  // namespace cbcan::plant
