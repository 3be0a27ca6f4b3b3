// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/canopen/pdo/pdo.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

/// Process data over a small dictionary, in virtual time. What the application is told stands in the
/// wire's log too, in order.
///
/// RPDOs 1, 2, 3, 5, 512 and TPDOs 1, 2, 3, 5, 512, all invalid with an empty mapping. 2000h:1..8 BOOLEAN,
/// 2001h:1..8 U8, 2002h:1..4 U16, 2003h U32, 2004h U64, 2005h I24, mappable both ways; 2010h U8 not at all;
/// 2011h a string; 2012h computed; 2013h RPDO only, 2014h TPDO only; 6000h:1 U8, 6401h:1 I16 TPDO only.
struct PdoRig final : Wire, PdoApplication, private ObjectHandler {
  explicit PdoRig(std::size_t rpdos = 5, std::size_t tpdos = 5);

  // As an SDO client.
  AbortCode write(std::uint16_t index, std::uint8_t sub, std::uint64_t value);
  void configure(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    INFO("object " << std::hex << index << " sub " << int{sub});
    CHECK(write(index, sub, value) == AbortCode::kNone);
  }
  void refuse(std::uint16_t index, std::uint8_t sub, std::uint64_t value, std::uint32_t abort_code) {
    INFO("object " << std::hex << index << " sub " << int{sub} << " value " << value);
    const std::uint64_t before = get(index, sub);
    CHECK(static_cast<std::uint32_t>(write(index, sub, value)) == abort_code);
    CHECK(get(index, sub) == before);
  }
  /// By the procedure of CiA 301. `first` is 1400h or 1800h, `number` from 1.
  void map(std::uint16_t first, std::uint16_t number, std::initializer_list<std::uint32_t> objects);
  void set_up(std::uint16_t first, std::uint16_t number, std::uint32_t cob_id, std::uint8_t type,
              std::initializer_list<std::uint32_t> objects);

  // The bus and the master.
  Wire& operational(bool on = true) {
    pdo.on_state(on ? nmt::State::kOperational : nmt::State::kPreOperational, now);
    return *this;
  }
  Wire& arrive(const std::string& frame) {
    pdo.on_frame(frame_from(frame), now);
    return *this;
  }
  Wire& sync(std::uint8_t counter = 0, Time window = 0) {
    pdo.on_sync(counter, window, now);
    return *this;
  }
  Wire& pass(Time duration);

  // The device.
  Wire& set(unsigned index, std::uint8_t sub, std::uint64_t value) {
    REQUIRE(dictionary.set(static_cast<std::uint16_t>(index), sub, value));
    return *this;
  }
  std::uint64_t get(std::uint16_t index, std::uint8_t sub) { return dictionary.get(index, sub); }
  Wire& change(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    set(index, sub, value);
    pdo.changed(index, sub, now);
    return *this;
  }
  std::vector<std::uint32_t> ids() const;

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
  void refresh(Time at) override;
  void on_written(Time at) override;
  void on_sync(Time at) override;
  void on_pdo_error(std::uint16_t code, std::uint16_t number, Time at) override;
  void on_pdo_error_over(std::uint16_t code, Time at) override;
  AbortCode on_read(const ObjectEntry&, std::uint8_t, std::span<std::uint8_t>, std::size_t&, Time) override {
    return AbortCode::kGeneral;
  }
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time) override {
    CHECK(Pdo::owns(entry.index));
    return pdo.check(entry, sub, value);
  }
  void on_stored(const ObjectEntry& entry, std::uint8_t, Time at) override { pdo.configure(entry.index, at); }
};

}  // namespace cbcan::test
