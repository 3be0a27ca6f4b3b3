// SPDX-License-Identifier: MIT
#include "cbcanctl/plan.hpp"

#include <fmt/core.h>
#include <algorithm>

#include "base/text.hpp"

namespace cbcan::tools {

NodeConfiguration::NodeConfiguration(const PlannedNode& node, bool verify) : node_(node) {
  for (const PlannedObject& object : node.identity)
    steps_.push_back({Kind::kCheck, &object});
  for (const PlannedObject& object : node.objects) {
    steps_.push_back({Kind::kWrite, &object});
    if (object.value.size() > regmap::kMaxDataBytes)
      throw UsageError(fmt::format("node {}: {:04X}h:{:02X}: over 128 bytes, configure cannot write it",
                                   node.id, object.index, object.sub));
  }
  // An object may be written twice, such as 1600h:00, which is 0 while its mappings change.
  for (auto object = node.objects.begin(); verify && object != node.objects.end(); ++object)
    if (std::none_of(object + 1, node.objects.end(), [&](const PlannedObject& later) {
          return later.index == object->index && later.sub == object->sub;
        }))
      steps_.push_back({Kind::kReadBack, &*object});
  steps_.push_back({Kind::kStart, nullptr});
}

std::optional<Transaction> NodeConfiguration::next() {
  if (at_ == steps_.size() || !problem_.empty()) return std::nullopt;
  const auto [kind, object] = steps_[at_];
  constexpr std::uint8_t kStartNode = 5;
  if (kind == Kind::kStart) return sdo_write(0, regmap::kNmtService, node_.id, {kStartNode});
  if (kind == Kind::kWrite) return sdo_write(node_.id, object->index, object->sub, object->value);
  return sdo_read(node_.id, object->index, object->sub);
}

void NodeConfiguration::ended(const window::Result& response) {
  const auto [kind, object] = steps_[at_++];
  const std::string place =
      object == nullptr ? fmt::format("node {}: start", node_.id)
                        : fmt::format("node {}: {:04X}h:{:02X}", node_.id, object->index, object->sub);
  if (kind == Kind::kReadBack && response.abort_code == window::abort_code::kWriteOnly) return;
  if (kind == Kind::kWrite && response.abort_code == window::abort_code::kReadOnly) {
    steps_.insert(steps_.end() - 1, {Kind::kReadBack, object});
  } else if (response.code != 0) {
    problem_ = place;
    refusal_ = response;
  } else if ((kind == Kind::kCheck || kind == Kind::kReadBack) && response.data != object->value) {
    problem_ =
        fmt::format("{} is {}, not {}", place, base::hex(response.data, " "), base::hex(object->value, " "));
  }
}

}  // namespace cbcan::tools
