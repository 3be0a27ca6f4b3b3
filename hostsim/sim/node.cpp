// SPDX-License-Identifier: MIT
#include "sim/node.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace cbcan::sim {

namespace {

std::size_t largest_object(const std::vector<ObjectEntry>& entries) {
  std::size_t largest = 0;
  for (const ObjectEntry& entry : entries)
    largest = std::max<std::size_t>(largest, entry.capacity);
  return largest;
}

std::size_t highest_sub(const std::vector<ObjectEntry>& entries, std::uint16_t index) {
  std::size_t highest = 0;
  for (const ObjectEntry& entry : entries)
    if (entry.index == index) highest = entry.last_sub;
  return highest;
}

/// The device has to hear of every write; what 1010h and 1011h are sent is a command and not kept.
NodeImage prepared(NodeImage image) {
  for (ObjectEntry& entry : image.entries) {
    entry.flags |= ObjectFlags::kChecked;
    const bool is_command = entry.index == Device::kStore || entry.index == Device::kRestore;
    if (is_command && entry.first_sub != 0) entry.flags |= ObjectFlags::kComputed;
  }
  return image;
}

/// The nearest number that the type can hold, as the dictionary stores it.
std::uint64_t to_raw(double value, DataType type, std::size_t bytes) {
  if (type == DataType::kReal32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  if (type == DataType::kReal64) return std::bit_cast<std::uint64_t>(value);
  const auto bits = static_cast<int>(8 * bytes);
  const double whole = std::isnan(value) ? 0 : std::round(value);
  if (is_signed(type)) {
    const double limit = std::ldexp(1.0, bits - 1);
    if (whole >= limit) return (std::uint64_t{1} << (bits - 1)) - 1;
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::max(whole, -limit)));
  }
  if (whole >= std::ldexp(1.0, bits)) return ~std::uint64_t{0};
  return whole <= 0 ? 0 : static_cast<std::uint64_t>(whole);
}

}  // namespace

Node::Node(Bus& bus, Schedule& schedule, std::uint8_t node_id, NodeImage image, const NodeParts& parts)
    : Participant(schedule),
      image_(prepared(std::move(image))),
      values_(image_.values),
      saved_(image_.values),
      buffer_(largest_object(image_.entries)),
      rpdos_(Pdo::rpdo_count(image_.entries)),
      tpdos_(Pdo::tpdo_count(image_.entries)),
      watched_(highest_sub(image_.entries, HeartbeatConsumer::kTimes)),
      parameters_(parts.parameters),
      port_(bus.attach(*this)),
      device_(node_id, {image_.entries, values_, image_.limits}, {buffer_, rpdos_, tpdos_, watched_}, *this,
              port_) {
  if (parts.behaviour != nullptr) behaviour_ = parts.behaviour(*this, parts.seed);
  if (parameters_ == nullptr) return;
  ObjectDictionary saved(image_.entries, saved_, nullptr);
  put_parameters(parameters_->load(), saved);
}

void Node::start(Time now) {
  device_.start(now);
  update(now);
  settle();
}

void Node::poll(Time now) {
  if (now >= behaviour_due_) update(now);
  device_.poll(now);
  settle();
}

void Node::on_frame(const Frame& frame, Time now) {
  device_.on_frame(frame, now);
  settle();
}

void Node::on_bus_state(BusState state, Time now) {
  device_.on_bus_state(state, now);
  poll(now);
}

/// After anything that has happened: what is heard, and when to be called next.
void Node::settle() {
  if (ids_changed_) follow_ids();
  wants(earlier(device_.deadline(), behaviour_due_));
}

/// The port's filter may be what is delivering right now: identifiers that stay are left alone.
void Node::follow_ids() {
  ids_changed_ = false;
  std::vector<std::uint32_t> wanted;
  device_.visit_ids([&wanted](std::uint32_t id) { wanted.push_back(id); });
  std::ranges::sort(wanted);
  wanted.erase(std::ranges::unique(wanted).begin(), wanted.end());
  for (const std::uint32_t id : received_ids_)
    if (!std::ranges::binary_search(wanted, id)) port_.refuse(id, id);
  for (const std::uint32_t id : wanted)
    if (!std::ranges::binary_search(received_ids_, id)) port_.accept(id, id);
  received_ids_ = std::move(wanted);
}

// ---- Behaviour
// -----------------------------------------------------------------------------------------------

void Node::update(Time now) {
  if (!behaviour_) return;
  behaviour_due_ = behaviour_->update(now);
  updated_at_ = now;
}

void Node::refresh(Time now) {
  if (updated_at_ != now) update(now);
}

void Node::on_written(Time now) {
  update(now);
}

void Node::on_sync(Time now) {
  if (!behaviour_) return;
  behaviour_->on_sync(now);
  update(now);
}

void Node::on_nmt_state(nmt::State state, Time now) {
  if (!behaviour_) return;
  behaviour_->on_nmt_state(state, now);
  update(now);
}

void Node::on_network_failure(NetworkFailure failure, Time now) {
  if (!behaviour_) return;
  behaviour_->on_network_failure(failure, now);
  update(now);
}

bool Node::set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) {
  if (behaviour_ && behaviour_->set_input(index, sub, value, now)) {
    update(now);
    settle();
    return true;
  }
  const ObjectEntry* entry = nullptr;
  if (dictionary().find(index, sub, entry) != AbortCode::kNone) return false;
  const std::size_t bytes = size_of(entry->type);
  if (bytes == 0 || bytes != entry->capacity || entry->has(ObjectFlags::kComputed)) return false;
  const std::uint64_t before = dictionary().get(index, sub);
  dictionary().set(index, sub, to_raw(value, entry->type, bytes));
  if (dictionary().get(index, sub) != before) device_.changed(index, sub, now);
  update(now);
  settle();
  return true;
}

bool Node::set_incident(std::string_view incident, bool present, Time now) {
  if (!behaviour_) return false;
  const auto known = behaviour_->incidents();
  if (std::ranges::find(known, incident) == known.end()) return false;
  behaviour_->set_incident(incident, present, now);
  update(now);
  settle();
  return true;
}

void Node::error(std::uint16_t code, std::uint8_t register_bits, const EmergencyInfo& info, Time now) {
  device_.emergency().error(code, register_bits, info, now);
}

void Node::error_over(std::uint16_t code, Time now) {
  device_.emergency().error_over(code, now);
}

void Node::changed(std::uint16_t index, std::uint8_t sub, Time now) {
  device_.changed(index, sub, now);
}

// ---- The dictionary
// ------------------------------------------------------------------------------------------

/// 1010h and 1011h: what the device can do, as its EDS file says.
AbortCode Node::on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                        std::size_t& size, Time /*now*/) {
  const std::size_t offset = entry.offset + std::size_t{entry.stride()} * (sub - entry.first_sub);
  size = entry.capacity;
  std::copy_n(image_.values.begin() + static_cast<std::ptrdiff_t>(offset), size, out.begin());
  return AbortCode::kNone;
}

AbortCode Node::on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                         Time now) {
  return behaviour_ ? behaviour_->check(entry, sub, value, now) : AbortCode::kNone;
}

void Node::on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) {
  device_.changed(entry.index, sub, now);
}

void Node::restore(std::uint16_t first_index, std::uint16_t last_index, Time now) {
  constexpr std::uint16_t kFirstApplicationIndex = 0x2000;
  restore_values(image_.entries, saved_, values_, first_index, last_index);
  if (behaviour_) behaviour_->reset(last_index >= kFirstApplicationIndex, now);
}

AbortCode Node::save(std::uint16_t first_index, std::uint16_t last_index) {
  copy_parameters(image_.entries, values_, saved_, first_index, last_index);
  return keep_saved();
}

AbortCode Node::forget(std::uint16_t first_index, std::uint16_t last_index) {
  copy_parameters(image_.entries, image_.values, saved_, first_index, last_index);
  return keep_saved();
}

/// 0606 0000h: access failed due to a hardware error.
AbortCode Node::keep_saved() {
  if (parameters_ == nullptr) return AbortCode::kNone;
  const bool kept = parameters_->save(changed_parameters(image_.entries, image_.values, saved_));
  return kept ? AbortCode::kNone : AbortCode::kHardware;
}

}  // namespace cbcan::sim
