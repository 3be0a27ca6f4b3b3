// SPDX-License-Identifier: MIT
#include "cbcan/canopen/eds_device.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

void EdsDevice::start(std::uint8_t node_id, Time now) {
  if constexpr (kServices.lss) lss_->start(node_id, now);
  device_.set_node_id(node_id);
  device_.start(now);
}

void EdsDevice::on_frame(const Frame& frame, Time now) {
  if (frame.id == LssSlave::kRequestId) return void(lss_.on_frame(frame, now));
  device_.on_frame(frame, now);
}

Time EdsDevice::poll(Time now) {
  lss_.poll(now);
  const Time due = device_.poll(now);
  return earlier(due, lss_.deadline());
}

void EdsDevice::set(ObjectAddress object, std::uint64_t value) {
  const std::uint64_t before = get(object);
  device_.dictionary().set(object.index, object.sub, value);
  if (get(object) != before) device_.changed(object.index, object.sub);
}

/// Computed are 1010h and 1011h: what the device supports, as its EDS file says.
AbortCode EdsDevice::on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                             std::size_t& size, Time /*now*/) {
  if (!entry.has(ObjectFlags::kComputed)) return AbortCode::kNone;
  size = entry.capacity;
  const std::size_t offset = ObjectDictionary::first_bit(entry, sub) / 8;
  for (std::size_t i = 0; i < size; ++i)
    out[i] = offset + i < dictionary_.power_on.size() ? dictionary_.power_on[offset + i] : 0;
  return AbortCode::kNone;
}

void EdsDevice::on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) {
  device_.changed(entry.index, sub, now);
}

/// Only a reset makes the node ID active that LSS has set.
void EdsDevice::on_state(nmt::State state, Time now) {
  if (kServices.lss && state == nmt::State::kInitialising)
    device_.set_node_id(lss_->reset_communication(now));
}

void EdsDevice::restore(std::uint16_t first_index, std::uint16_t last_index, Time /*now*/) {
  restore_values(dictionary_.entries, dictionary_.power_on, values_, first_index, last_index);
  const bool all = last_index > object::kLastCommunication;
  if (device_.node_id() <= nmt::kMaxNode)
    change_node_id(values_,
                   all ? dictionary_.node_id_values
                       : dictionary_.node_id_values.first(dictionary_.communication_node_id_values),
                   0, device_.node_id());
}

bool EdsDevice::restore_more(std::uint32_t step, Time /*now*/) {
  if (!kServices.stored_parameters || memory_ == nullptr) return false;
  const bool all = device_.slave().resets_application();
  return memory_->load(device_.dictionary(), *this, all ? 0 : object::kFirstCommunication,
                       all ? object::kLast : object::kLastCommunication, step);
}

bool EdsDevice::is_power_on(const ObjectDictionary& /*objects*/, const ObjectEntry& entry, std::uint8_t sub,
                            std::span<const std::uint8_t> bytes) const {
  const std::size_t offset = ObjectDictionary::first_bit(entry, sub) / 8;
  const std::span<const std::uint8_t> power_on = dictionary_.power_on;
  if (offset >= power_on.size())
    return (!entry.has(ObjectFlags::kVariable) || bytes.empty()) &&
           std::ranges::all_of(bytes, [](std::uint8_t byte) { return byte == 0; });
  if (entry.has(ObjectFlags::kVariable) &&
      load_word(&power_on[offset - ObjectEntry::kLengthBytes]) != bytes.size())
    return false;
  const auto relative = std::ranges::find(dictionary_.node_id_values, offset, &NodeIdValue::offset);
  const auto standard = power_on.subspan(offset, bytes.size());
  if (relative == dictionary_.node_id_values.end()) return std::ranges::equal(standard, bytes);
  return load_little_endian(bytes) == load_little_endian(standard) + relative->factor * device_.node_id();
}

}  // namespace cbcan
