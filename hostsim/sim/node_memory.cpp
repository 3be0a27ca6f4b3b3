// SPDX-License-Identifier: MIT
// What a node keeps without power: its program, parameters, node ID and bit rate.

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "sim/node.hpp"

namespace cbcan::sim {

/// The file's 1F56h is the CRC of the program that the node has at first.
void Node::add_program() {
  if (std::ranges::none_of(image_.entries, &ObjectEntry::is_streamed)) return;
  ObjectEntry entry{};
  dictionary().find(object::kProgramIdentification, 1, entry);
  const auto crc = load_little_endian(std::span(image_.values).subspan(entry.offset, entry.capacity));
  program_.emplace(crc == 0 ? 1 : static_cast<std::uint32_t>(crc));
  device_.slave().sdo_server().set_stream(program_->download);
}

void Node::load_parameters() {
  const StoredParameters stored = parameters_->load();
  if (lss_ && stored.lss.node_id != 0) {
    stored_lss_ = stored.lss;
    start_node_id_ = stored.lss.node_id;
    take_node_id(start_node_id_);
  }
  ObjectDictionary saved(image_.entries, saved_, nullptr);
  const std::vector<StoredValue> left_out = put_parameters(stored.values, saved);
  if (!left_out.empty()) parameters_->tell_left_out(left_out);
}

AbortCode Node::save_from(std::span<const std::uint8_t> values, std::uint16_t first_index,
                          std::uint16_t last_index) {
  const AbortCode refused = writes_itself_ ? AbortCode::kNone : faulty_.refusal();
  if (refused != AbortCode::kNone) return refused;
  std::vector<std::uint8_t> before = saved_;
  copy_parameters(image_.entries, values, saved_, first_index, last_index);
  if (keep_saved()) return AbortCode::kNone;
  saved_ = std::move(before);
  return AbortCode::kHardware;
}

bool Node::keep_saved() {
  if (parameters_ == nullptr) return true;
  return parameters_->save({changed_parameters(image_.entries, image_.values, saved_), stored_lss_});
}

}  // namespace cbcan::sim
