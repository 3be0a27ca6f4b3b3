// SPDX-License-Identifier: MIT
#pragma once

#include "support/bench.hpp"
#include "support/rows.hpp"

namespace cbcan::test {

using Flags = ObjectFlags;

inline constexpr std::uint8_t kParameter = Flags::kReadWrite | Flags::kChecked;
inline constexpr std::uint16_t kMapped = Flags::kReadWrite | Flags::kMapRpdo | Flags::kMapTpdo;
inline constexpr std::uint16_t kNumbers[] = {0, 1, 2, 4, 511};  // PDO 4 is missing

inline std::vector<ObjectRow> pdo_rows() {
  using enum DataType;
  std::vector<ObjectRow> rows;
  const auto add_pdos = [&rows](unsigned first, std::vector<ObjectRow> objects) {
    for (const std::uint16_t number : kNumbers) {
      for (ObjectRow& row : objects)
        row.index = static_cast<std::uint16_t>(first + number);
      rows.insert(rows.end(), objects.begin(), objects.end());
    }
  };
  const std::vector<ObjectRow> mapping{{0, 0, 0, kUnsigned8, 0, kParameter},
                                       {0, 1, 64, kUnsigned32, 0, kParameter}};
  std::vector<ObjectRow> parameters{{0, 0, 0, kUnsigned8, 0, Flags::kRead},
                                    {0, 1, 1, kUnsigned32, 0x80000000, kParameter},
                                    {0, 2, 2, kUnsigned8, 0, kParameter},
                                    {0, 3, 3, kUnsigned16, 0, kParameter},
                                    {0, 5, 5, kUnsigned16, 0, kParameter}};
  add_pdos(0x1400, parameters);
  add_pdos(0x1600, mapping);
  parameters.push_back({0, 6, 6, kUnsigned8, 0, kParameter});
  add_pdos(0x1800, parameters);
  add_pdos(0x1A00, mapping);
  rows.insert(rows.end(), {{0x2000, 1, 8, kBoolean, 0, kMapped},
                           {0x2001, 1, 8, kUnsigned8, 0, kMapped},
                           {0x2002, 1, 4, kUnsigned16, 0, kMapped},
                           {0x2003, 0, 0, kUnsigned32, 0, kMapped},
                           {0x2004, 0, 0, kUnsigned64, 0, kMapped},
                           {0x2005, 0, 0, kInteger24, 0, kMapped},
                           {0x2010, 0, 0, kUnsigned8},
                           {0x2011, 0, 0, kVisibleString, 0, kMapped | Flags::kVariable, false, 4},
                           {0x2012, 0, 0, kUnsigned16, 0, kMapped | Flags::kComputed},
                           {0x2013, 0, 0, kUnsigned8, 0, Flags::kReadWrite | Flags::kMapRpdo},
                           {0x2014, 0, 0, kUnsigned8, 0, Flags::kReadWrite | Flags::kMapTpdo},
                           {0x6000, 1, 1, kUnsigned8, 0, Flags::kRead | Flags::kMapTpdo},
                           {0x6401, 1, 1, kInteger16, 0, Flags::kRead | Flags::kMapTpdo}});
  return rows;
}

/// Process data over a small dictionary, in virtual time. Calls of the application are in the wire's log too, in
/// order.
///
/// RPDOs 1, 2, 3, 5, 512 and TPDOs 1, 2, 3, 5, 512, all invalid with an empty mapping. 2000h:1..8 BOOLEAN,
/// 2001h:1..8 U8, 2002h:1..4 U16, 2003h U32, 2004h U64, 2005h I24, mappable both ways; 2010h U8 not at all;
/// 2011h a string; 2012h computed; 2013h RPDO only, 2014h TPDO only; 6000h:1 U8, 6401h:1 I16 TPDO only.
struct PdoRig final : StackRig<Pdo>, PdoApplication, private ObjectHandler {
  explicit PdoRig(std::size_t rpdo_room = 5, std::size_t tpdo_room = 5)
      : StackRig(pdo, true),
        entries(entries_of(pdo_rows())),
        values(values_of(pdo_rows())),
        dictionary(entries, values, this),
        rpdos(rpdo_room),
        tpdos(tpdo_room),
        pieces((rpdo_room + tpdo_room) * PdoMapping::kMostObjects),
        pdo(dictionary, port, {rpdos, tpdos, pieces}, *this) {
    now = 1000;
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
  Wire& sync(std::uint8_t counter = 0, Time window = 0) {
    const Time due = pdo.deadline();
    const bool moved = pdo.on_sync(counter, window, now);
    CHECK(moved == (pdo.deadline() != due));
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
    pdo.changed(index, sub);
    pdo.poll(now);
    return *this;
  }
  std::vector<std::uint32_t> ids() const {
    std::vector<std::uint32_t> ids;
    pdo.visit_ids([&](std::uint32_t id) { ids.push_back(id); });
    return ids;
  }

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
