// SPDX-License-Identifier: MIT
#include "sim/node.hpp"

#include <algorithm>
#include <utility>

namespace cbcan::sim {

namespace {

std::size_t largest_object(const std::vector<ObjectEntry>& entries) {
  std::size_t largest = 0;
  for (const ObjectEntry& entry : entries)
    largest = std::max<std::size_t>(largest, entry.capacity);
  return largest;
}

/// The slave has to hear of every write, to take over what it acts on.
NodeImage all_checked(NodeImage image) {
  for (ObjectEntry& entry : image.entries)
    entry.flags |= ObjectFlags::kChecked;
  return image;
}

}  // namespace

Node::Node(Bus& bus, Schedule& schedule, std::uint8_t node_id, NodeImage image)
    : Participant(schedule),
      image_(all_checked(std::move(image))),
      values_(image_.values),
      buffer_(largest_object(image_.entries)),
      port_(bus.attach(*this)),
      slave_(node_id, {image_.entries, values_, image_.limits}, buffer_, *this, port_) {
  port_.accept(nmt::kCommandId, nmt::kCommandId);
  port_.accept(sdo::kRequestId + node_id, sdo::kRequestId + node_id);
  port_.accept(nmt::kErrorControlId + node_id, nmt::kErrorControlId + node_id);
}

void Node::start(Time now) {
  slave_.start(now);
  wants(slave_.deadline());
}

void Node::poll(Time now) {
  wants(slave_.poll(now));
}

void Node::on_frame(const Frame& frame, Time now) {
  slave_.on_frame(frame, now);
  wants(slave_.deadline());
}

void Node::on_bus_state(BusState /*state*/, Time now) {
  poll(now);
}

AbortCode Node::on_read(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/, std::span<std::uint8_t> /*out*/,
                        std::size_t& /*size*/, Time /*now*/) {
  return AbortCode::kGeneral;  // every value is stored
}

AbortCode Node::on_write(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/,
                         std::span<const std::uint8_t> /*value*/, Time /*now*/) {
  return AbortCode::kNone;
}

void Node::restore(std::uint16_t first_index, std::uint16_t last_index, Time /*now*/) {
  restore_values(image_.entries, image_.values, values_, first_index, last_index);
}

}  // namespace cbcan::sim
