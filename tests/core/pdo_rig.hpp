// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

using Flags = ObjectFlags;

inline constexpr std::uint8_t kParameter = Flags::kReadWrite | Flags::kChecked;
inline constexpr std::uint16_t kMapped = Flags::kReadWrite | Flags::kMapRpdo | Flags::kMapTpdo;
inline constexpr std::uint16_t kNumbers[] = {0, 1, 2, 4, 511};  // PDO 4 is missing

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

inline std::vector<ObjectEntry> table() {
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

inline std::size_t bytes_of(const std::vector<ObjectEntry>& entries) {
  const ObjectEntry& last = entries.back();
  return last.offset + std::size_t{last.stride()} * (last.last_sub - last.first_sub + 1u);
}

/// Process data over a small dictionary, in virtual time. Calls of the application are in the wire's log too, in
/// order.
///
/// RPDOs 1, 2, 3, 5, 512 and TPDOs 1, 2, 3, 5, 512, all invalid with an empty mapping. 2000h:1..8 BOOLEAN,
/// 2001h:1..8 U8, 2002h:1..4 U16, 2003h U32, 2004h U64, 2005h I24, mappable both ways; 2010h U8 not at all;
/// 2011h a string; 2012h computed; 2013h RPDO only, 2014h TPDO only; 6000h:1 U8, 6401h:1 I16 TPDO only.
struct PdoRig final : Wire, PdoApplication, private ObjectHandler {
  explicit PdoRig(std::size_t rpdo_room = 5, std::size_t tpdo_room = 5)
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
    reset();
  }

  void reset() {
    pdo.reset({}, now);
    for (std::size_t k = 0; pdo.load_one(k, now);)
      ++k;
  }

  // As an SDO client.
  AbortCode write(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    ObjectEntry entry{};
    REQUIRE(dictionary.find(index, sub, entry) == AbortCode::kNone);
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t i = 0; i < entry.capacity; ++i)
      bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
    return dictionary.write(index, sub, bytes, now);
  }
  void configure(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    INFO("object " << std::hex << index << " sub " << int{sub});
    CHECK(write(index, sub, value) == AbortCode::kNone);
  }
  struct Object {
    unsigned index;
    std::uint8_t sub;
    std::uint64_t value;
  };
  void configure(std::initializer_list<Object> objects) {
    for (const Object& each : objects)
      configure(static_cast<std::uint16_t>(each.index), each.sub, each.value);
  }
  void refuse(std::uint16_t index, std::uint8_t sub, std::uint64_t value, std::uint32_t abort_code) {
    INFO("object " << std::hex << index << " sub " << int{sub} << " value " << value);
    const std::uint64_t before = get(index, sub);
    CHECK(static_cast<std::uint32_t>(write(index, sub, value)) == abort_code);
    CHECK(get(index, sub) == before);
  }
  /// With the procedure of CiA 301. `first` is 1400h or 1800h, `number` from 1.
  void map(std::uint16_t first, std::uint16_t number, std::initializer_list<std::uint32_t> objects) {
    const auto index = static_cast<std::uint16_t>(first + 0x200 + number - 1);
    configure(index, 0, 0);
    std::uint8_t sub = 0;
    for (const std::uint32_t object : objects)
      configure(index, ++sub, object);
    configure(index, 0, sub);
  }
  void set_up(std::uint16_t first, std::uint16_t number, std::uint32_t cob_id, std::uint8_t type,
              std::initializer_list<std::uint32_t> objects) {
    const auto index = static_cast<std::uint16_t>(first + number - 1);
    configure(index, 1, 0x80000000);
    configure(index, 2, type);
    map(first, number, objects);
    configure(index, 1, cob_id);
  }

  // The bus and the master.
  Wire& operational(bool on = true) {
    pdo.on_state(on ? nmt::State::kOperational : nmt::State::kPreOperational, now);
    return *this;
  }
  template <class... Frames>
  Wire& arrive(const Frames&... frames) {
    (pdo.on_frame(frame_from(frames), now), ...);
    return *this;
  }
  Wire& sync(std::uint8_t counter = 0, Time window = 0) {
    const Time due = pdo.deadline();
    const bool moved = pdo.on_sync(counter, window, now);
    CHECK(moved == (pdo.deadline() != due));
    return *this;
  }
  Wire& pass(Time duration) {
    const Time end = now + duration;
    while (pdo.deadline() <= end) {
      now = std::max(now, pdo.deadline());
      pdo.poll(now);
      REQUIRE(pdo.deadline() > now);
    }
    now = end;
    return *this;
  }

  // The device.
  Wire& set(unsigned index, std::uint8_t sub, std::uint64_t value) {
    REQUIRE(dictionary.set(static_cast<std::uint16_t>(index), sub, value));
    return *this;
  }
  void set(std::initializer_list<Object> objects) {
    for (const Object& each : objects)
      set(each.index, each.sub, each.value);
  }
  std::uint64_t get(std::uint16_t index, std::uint8_t sub) { return dictionary.get(index, sub); }
  void shows(std::initializer_list<Object> objects) {
    for (const Object& each : objects) {
      INFO("object " << std::hex << each.index << " sub " << int{each.sub});
      CHECK(get(static_cast<std::uint16_t>(each.index), each.sub) == each.value);
    }
  }
  Wire& change(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    set(index, sub, value);
    pdo.changed(index, sub, now);
    return *this;
  }
  std::vector<std::uint32_t> ids() const {
    std::vector<std::uint32_t> ids;
    pdo.visit_ids([&](std::uint32_t id) { ids.push_back(id); });
    return ids;
  }

  Time now = 1000;
  bool log_sampling = false;
  bool log_recovery = false;
  /// Called by refresh(), and by on_written() and on_sync().
  std::function<void()> in_sampling = [] {};
  std::function<void()> in_reception = [] {};

  std::vector<ObjectEntry> entries;
  std::vector<std::uint8_t> values;
  ObjectDictionary dictionary;
  std::vector<Pdo::Rpdo> rpdos;
  std::vector<Pdo::Tpdo> tpdos;
  std::vector<PdoMapping::Piece> pieces;
  Pdo pdo;

 private:
  void refresh(Time at) override {
    CHECK(at == now);
    if (log_sampling) port.sent.push_back("sampling");
    in_sampling();
  }
  void on_written(Time at) override {
    CHECK(at == now);
    port.sent.push_back("received");
    in_reception();
  }
  void on_sync(Time at) override {
    CHECK(at == now);
    if (log_sampling) port.sent.push_back("synchronised");
    in_reception();
  }
  void on_pdo_error(std::uint16_t code, std::uint16_t number, Time at) override {
    CHECK(at == now);
    char text[32];
    std::snprintf(text, sizeof text, "error %04X of %u", unsigned{code}, unsigned{number});
    port.sent.push_back(text);
  }
  void on_pdo_error_over(std::uint16_t code, Time at) override {
    CHECK(at == now);
    char text[32];
    std::snprintf(text, sizeof text, "recovered %04X", unsigned{code});
    if (log_recovery) port.sent.push_back(text);
  }
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time) override {
    CHECK(Pdo::owns(entry.index));
    return pdo.check(entry.index, sub, static_cast<std::uint32_t>(load_little_endian(value)));
  }
  void on_stored(const ObjectEntry& entry, std::uint8_t, Time at) override { pdo.configure(entry.index, at); }
};

}  // namespace cbcan::test
