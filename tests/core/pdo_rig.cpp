// SPDX-License-Identifier: MIT
#include "core/pdo_rig.hpp"

namespace cbcan::test {

namespace {

using Flags = ObjectFlags;

constexpr std::uint8_t kParameter = Flags::kReadWrite | Flags::kChecked;
constexpr std::uint16_t kMapped = Flags::kReadWrite | Flags::kMapRpdo | Flags::kMapTpdo;
constexpr std::uint16_t kNumbers[] = {0, 1, 2, 4, 511};  // PDO 4 is missing

struct Table {
  void add(std::uint16_t index, std::uint8_t first_sub, std::uint8_t last_sub, DataType type,
           std::uint16_t flags, std::uint32_t capacity = 0) {
    if (capacity == 0) capacity = static_cast<std::uint32_t>(size_of(type));
    const std::uint32_t front = (flags & Flags::kVariable) != 0 ? ObjectEntry::kLengthBytes : 0;
    entries.push_back({index, first_sub, last_sub, type, 0, flags, end + front, capacity});
    end += (front + capacity) * (last_sub - first_sub + 1u);
  }
  void add_parameters(std::uint16_t first, bool transmit) {
    for (const std::uint16_t number : kNumbers) {
      const auto index = static_cast<std::uint16_t>(first + number);
      add(index, 0, 0, DataType::kUnsigned8, Flags::kRead);
      add(index, 1, 1, DataType::kUnsigned32, kParameter);
      add(index, 2, 2, DataType::kUnsigned8, kParameter);
      add(index, 3, 3, DataType::kUnsigned16, kParameter);
      add(index, 5, 5, DataType::kUnsigned16, kParameter);
      if (transmit) add(index, 6, 6, DataType::kUnsigned8, kParameter);
    }
  }
  void add_mappings(std::uint16_t first) {
    for (const std::uint16_t number : kNumbers) {
      const auto index = static_cast<std::uint16_t>(first + number);
      add(index, 0, 0, DataType::kUnsigned8, kParameter);
      add(index, 1, 64, DataType::kUnsigned32, kParameter);
    }
  }

  std::vector<ObjectEntry> entries;
  std::uint32_t end = 0;
};

std::vector<ObjectEntry> table() {
  Table table;
  table.add_parameters(0x1400, false);
  table.add_mappings(0x1600);
  table.add_parameters(0x1800, true);
  table.add_mappings(0x1A00);
  table.add(0x2000, 1, 8, DataType::kBoolean, kMapped);
  table.add(0x2001, 1, 8, DataType::kUnsigned8, kMapped);
  table.add(0x2002, 1, 4, DataType::kUnsigned16, kMapped);
  table.add(0x2003, 0, 0, DataType::kUnsigned32, kMapped);
  table.add(0x2004, 0, 0, DataType::kUnsigned64, kMapped);
  table.add(0x2005, 0, 0, DataType::kInteger24, kMapped);
  table.add(0x2010, 0, 0, DataType::kUnsigned8, Flags::kReadWrite);
  table.add(0x2011, 0, 0, DataType::kVisibleString, kMapped | Flags::kVariable, 4);
  table.add(0x2012, 0, 0, DataType::kUnsigned16, kMapped | Flags::kComputed);
  table.add(0x2013, 0, 0, DataType::kUnsigned8, Flags::kReadWrite | Flags::kMapRpdo);
  table.add(0x2014, 0, 0, DataType::kUnsigned8, Flags::kReadWrite | Flags::kMapTpdo);
  table.add(0x6000, 1, 1, DataType::kUnsigned8, Flags::kRead | Flags::kMapTpdo);
  table.add(0x6401, 1, 1, DataType::kInteger16, Flags::kRead | Flags::kMapTpdo);
  return table.entries;
}

std::size_t bytes_of(const std::vector<ObjectEntry>& entries) {
  const ObjectEntry& last = entries.back();
  return last.offset + std::size_t{last.stride()} * (last.last_sub - last.first_sub + 1u);
}

}  // namespace

PdoRig::PdoRig(std::size_t rpdo_room, std::size_t tpdo_room)
    : entries(table()),
      values(bytes_of(entries)),
      dictionary(entries, values, this),
      rpdos(rpdo_room),
      tpdos(tpdo_room),
      pieces((rpdo_room + tpdo_room) * PdoMapping::kMostObjects),
      pdo(dictionary, port, {rpdos, tpdos, pieces}, *this) {
  for (const std::uint16_t number : kNumbers) {
    set(static_cast<std::uint16_t>(0x1400 + number), 1, 0x80000000);
    set(static_cast<std::uint16_t>(0x1800 + number), 1, 0x80000000);
  }
  pdo.reset({}, now);
}

AbortCode PdoRig::write(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
  ObjectEntry entry{};
  REQUIRE(dictionary.find(index, sub, entry) == AbortCode::kNone);
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t i = 0; i < entry.capacity; ++i)
    bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  return dictionary.write(index, sub, bytes, now);
}

void PdoRig::map(std::uint16_t first, std::uint16_t number, std::initializer_list<std::uint32_t> objects) {
  const auto index = static_cast<std::uint16_t>(first + 0x200 + number - 1);
  configure(index, 0, 0);
  std::uint8_t sub = 0;
  for (const std::uint32_t object : objects)
    configure(index, ++sub, object);
  configure(index, 0, sub);
}

void PdoRig::set_up(std::uint16_t first, std::uint16_t number, std::uint32_t cob_id, std::uint8_t type,
                    std::initializer_list<std::uint32_t> objects) {
  const auto index = static_cast<std::uint16_t>(first + number - 1);
  configure(index, 1, 0x80000000);
  configure(index, 2, type);
  map(first, number, objects);
  configure(index, 1, cob_id);
}

Wire& PdoRig::pass(Time duration) {
  const Time end = now + duration;
  while (pdo.deadline() <= end) {
    now = std::max(now, pdo.deadline());
    pdo.poll(now);
    REQUIRE(pdo.deadline() > now);
  }
  now = end;
  return *this;
}

std::vector<std::uint32_t> PdoRig::ids() const {
  std::vector<std::uint32_t> ids;
  pdo.visit_ids([&](std::uint32_t id) { ids.push_back(id); });
  return ids;
}

void PdoRig::refresh(Time at) {
  CHECK(at == now);
  if (log_sampling) port.sent.push_back("sampling");
  in_sampling();
}

void PdoRig::on_written(Time at) {
  CHECK(at == now);
  port.sent.push_back("received");
  in_reception();
}

void PdoRig::on_sync(Time at) {
  CHECK(at == now);
  if (log_sampling) port.sent.push_back("synchronised");
  in_reception();
}

void PdoRig::on_pdo_error_over(std::uint16_t code, Time at) {
  CHECK(at == now);
  char text[32];
  std::snprintf(text, sizeof text, "recovered %04X", unsigned{code});
  if (log_recovery) port.sent.push_back(text);
}

void PdoRig::on_pdo_error(std::uint16_t code, std::uint16_t number, Time at) {
  CHECK(at == now);
  char text[32];
  std::snprintf(text, sizeof text, "error %04X of %u", unsigned{code}, unsigned{number});
  port.sent.push_back(text);
}

}  // namespace cbcan::test
