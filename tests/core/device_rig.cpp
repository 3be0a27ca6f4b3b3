// SPDX-License-Identifier: MIT
#include "core/device_rig.hpp"

namespace cbcan::test {

namespace {

std::string hex(std::uint64_t number, int digits) {
  char text[24];
  std::snprintf(text, sizeof text, "%0*llX", digits, static_cast<unsigned long long>(number));
  return text;
}

/// Low byte first.
std::string bytes_of(std::uint64_t number, std::size_t bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes; ++i)
    text += hex(number >> 8 * i & 0xFF, 2);
  return text;
}

std::vector<ObjectEntry> entries_of(const std::vector<Row>& rows) {
  std::vector<ObjectEntry> entries;
  std::uint32_t offset = 0;
  for (const Row& row : rows) {
    const auto size = static_cast<std::uint32_t>(size_of(row.type));
    entries.push_back({row.index, row.first_sub, row.last_sub, row.type, 0,
                       static_cast<std::uint16_t>(row.flags | ObjectFlags::kChecked), offset, size});
    offset += size * (row.last_sub - row.first_sub + 1u);
  }
  return entries;
}

std::vector<std::uint8_t> values_of(const std::vector<Row>& rows) {
  std::vector<std::uint8_t> values;
  for (const Row& row : rows)
    for (unsigned sub = row.first_sub; sub <= row.last_sub; ++sub)
      for (std::size_t byte = 0; byte < size_of(row.type); ++byte)
        values.push_back(static_cast<std::uint8_t>(row.value >> 8 * byte));
  return values;
}

}  // namespace

std::vector<Row> everything() {
  using enum DataType;
  return {
      {0x1001, 0, 0, kUnsigned8},         {0x1003, 0, 0, kUnsigned8},
      {0x1003, 1, 3, kUnsigned32},        {0x1005, 0, 0, kUnsigned32, 0x80},
      {0x1006, 0, 0, kUnsigned32},        {0x1007, 0, 0, kUnsigned32},
      {0x100C, 0, 0, kUnsigned16},        {0x100D, 0, 0, kUnsigned8},
      {0x1010, 1, 4, kUnsigned32, 1},     {0x1011, 1, 4, kUnsigned32, 1},
      {0x1012, 0, 0, kUnsigned32, 0x100}, {0x1014, 0, 0, kUnsigned32, 0xC2},
      {0x1015, 0, 0, kUnsigned16},        {0x1016, 1, 3, kUnsigned32},
      {0x1017, 0, 0, kUnsigned16},        {0x1019, 0, 0, kUnsigned8},
      {0x1029, 1, 1, kUnsigned8},         {0x2001, 0, 0, kUnsigned8},
  };
}

DeviceRig::DeviceRig(const std::vector<Row>& rows)
    : entries(entries_of(rows)),
      power_on(values_of(rows)),
      values(power_on),
      device(0x42, {entries, values, {}}, {buffer_, {rpdos_, tpdos_, pieces_}, watched_}, *this, port) {}

Wire& DeviceRig::arrive(const std::string& frame) {
  device.on_frame(frame_from(frame), now);
  pass(0);
  return *this;
}

void DeviceRig::write(std::uint16_t index, std::uint8_t sub, std::size_t size, std::uint32_t value,
                      const std::string& outcome) {
  const char* const commands[] = {"", "2F", "2B", "27", "23"};
  const std::string object = bytes_of(index, 2) + bytes_of(sub, 1);
  arrive("642#" + (commands[size] + object) + bytes_of(value, 4));
  if (outcome == "done") return expect("5C2#60" + object + "00000000");
  expect("5C2#80" + object + bytes_of(std::stoul(outcome, nullptr, 16), 4));
}

std::uint32_t DeviceRig::read(std::uint16_t index, std::uint8_t sub) {
  arrive("642#40" + bytes_of(index, 2) + bytes_of(sub, 1) + "00000000");
  if (port.sent.empty()) {
    FAIL_CHECK("no response");
    return 0;
  }
  const Frame frame = frame_from(port.sent.front());
  port.sent.pop_front();
  CHECK((frame.data[0] & 0xE3) == 0x43);
  return frame.data[4] | std::uint32_t{frame.data[5]} << 8 | std::uint32_t{frame.data[6]} << 16 |
         std::uint32_t{frame.data[7]} << 24;
}

Wire& DeviceRig::pass(Time duration) {
  const Time end = now + duration;
  while (device.deadline() <= end) {
    now = std::max(now, device.deadline());
    device.poll(now);
  }
  now = end;
  return *this;
}

Wire& DeviceRig::start(bool operational) {
  device.start(now);
  pass(0);
  expect("742#00");
  if (operational) arrive("000#0142");
  events.clear();
  return *this;
}

std::vector<std::uint32_t> DeviceRig::received_ids() const {
  std::vector<std::uint32_t> ids;
  device.visit_ids([&ids](std::uint32_t id) { ids.push_back(id); });
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

AbortCode DeviceRig::on_read(const ObjectEntry&, std::uint8_t, std::span<std::uint8_t>, std::size_t&, Time) {
  return AbortCode::kGeneral;
}

AbortCode DeviceRig::on_write(const ObjectEntry& entry, std::uint8_t, std::span<const std::uint8_t> value,
                              Time) {
  return entry.index == 0x2001 && value[0] == 0xEE ? AbortCode::kValue : AbortCode::kNone;
}

void DeviceRig::restore(std::uint16_t first_index, std::uint16_t last_index, Time) {
  restore_values(entries, power_on, values, first_index, last_index);
}

void DeviceRig::on_state(nmt::State state, Time) {
  events.push_back("state " + std::to_string(static_cast<int>(state)));
}

void DeviceRig::refresh(Time) {
  events.push_back("refresh");
}

void DeviceRig::on_written(Time) {
  events.push_back("written");
}

void DeviceRig::on_sync(Time) {
  events.push_back("sync");
}

void DeviceRig::on_network_failure(NetworkFailure failure, Time) {
  const char* const names[] = {"heartbeat", "guarding", "bus-off"};
  events.push_back(std::string("lost ") + names[static_cast<int>(failure)]);
}

AbortCode DeviceRig::save(std::uint16_t first_index, std::uint16_t last_index) {
  events.push_back("save " + hex(first_index, 4) + ".." + hex(last_index, 4));
  return keeps;
}

AbortCode DeviceRig::forget(std::uint16_t first_index, std::uint16_t last_index) {
  events.push_back("forget " + hex(first_index, 4) + ".." + hex(last_index, 4));
  return keeps;
}

}  // namespace cbcan::test
