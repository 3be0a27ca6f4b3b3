// SPDX-License-Identifier: MIT
#pragma once

/// The memory for 1010h and 1011h in a board's flash: one record (record_log.hpp) holds all stored parameters
/// of a device and the board's own settings, which count as manufacturer parameters. An entry is index,
/// sub-index and length, then the value's bytes; a setting has an index that no object has. Values
/// equal to their power-on value, or longer than 255 bytes, are not stored; entries that a later image does
/// not know, or whose value is outside its limits, are ignored.

#include <array>
#include <cstdint>
#include <span>

#include "boards/common/record_log.hpp"
#include "cbcan/canopen/parameter_memory.hpp"

namespace cbcan::boards {

class ParameterStore final : public ParameterMemory, private RecordLog::Source {
 public:
  static constexpr std::size_t kMostSettings = 16;
  struct Words : std::span<std::uint16_t> {
    template <std::size_t kWords>
    Words(std::array<std::uint16_t, kWords>& words) : span(words) {
      static_assert(kWords <= kMostSettings, "a ParameterStore has up to 16 words of settings");
    }
  };
  using Valid = bool (*)(std::span<const std::uint16_t>);

  /// Makes the store of a coprocessor. `settings`: the board's settings with the image's values; `valid`
  /// checks such words. All outlive this.
  ParameterStore(Flash& flash, Words settings, Valid valid);
  /// Makes that of another device. The settings begin with the bit rate in kbit/s and the node ID.
  ParameterStore(Flash& flash, Words settings, Valid valid, const PowerOnValues& power_on)
      : log_(flash),
        settings_(settings),
        valid_(valid),
        address_(settings.first(kAddressWords)),
        power_on_(power_on) {}

  /// Call once, before the rest of the board starts (see RecordLog::start()): loads the stored board
  /// settings. `leave_aside`: ignores everything stored until the next start.
  void start(bool leave_aside);

  /// Saving may erase a sector from now on: see RecordLog.
  void allow_erase(bool allowed) { log_.allow_erase(allowed); }

  // ParameterMemory. 0800 0022h: full until the next start; 0504 0005h: more than a sector holds; 0606 0000h:
  // the flash does not work; 0609 0030h: the board's settings are invalid.
  AbortCode save(std::uint16_t first_index, std::uint16_t last_index) override;
  AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) override;
  bool load(ObjectDictionary& objects, ObjectHandler& handler, std::uint16_t first_index,
            std::uint16_t last_index, std::uint32_t step) override;
  /// Stores them with all settings of the board, those of a coprocessor as R4154 and R4155; false if it has
  /// no such settings.
  bool keep_address(std::uint8_t node_id, std::uint8_t bit_rate) override;

 private:
  static constexpr std::size_t kAddressWords = 2;

  struct Value;
  static bool take(std::span<const std::uint8_t>& rest, Value& value);
  AbortCode keep(std::uint16_t first_index, std::uint16_t last_index, bool save);
  bool put_some(RecordLog& log, bool begins) override;
  bool put_next();
  void put_entry(const ObjectEntry& entry);
  void put_value(const ObjectEntry& entry, std::uint8_t sub);
  void put_settings();
  void put(const Value& value);
  void load_value(const Value& value, ObjectDictionary& objects, ObjectHandler& handler) const;

  RecordLog log_;
  Words settings_;
  Valid valid_;
  std::span<std::uint16_t> address_;  ///< bit rate and node ID; empty = they cannot be set
  const PowerOnValues& power_on_;
  const ObjectDictionary* objects_ = nullptr;
  bool left_aside_ = false;
  std::span<const std::uint8_t> to_load_;  ///< rest of a record, which a later one may replace meanwhile
  // State of keep(): what it stores, and how far it is.
  bool saves_ = false;
  std::uint16_t first_index_ = 0;
  std::uint16_t last_index_ = 0;
  std::span<const std::uint8_t> before_;  ///< rest of the latest record
  std::size_t entry_ = 0;
  std::uint32_t element_ = 0;  ///< of that entry
};

}  // namespace cbcan::boards
