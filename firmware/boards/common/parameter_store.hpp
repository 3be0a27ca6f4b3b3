// SPDX-License-Identifier: MIT
#pragma once

/// The memory behind 1010h and 1011h in a board's flash: one record (record_log.hpp) has all that is stored,
/// the parameters of the own node and the board's own settings, words that are 2FFFh:1.. in the record and so
/// among the manufacturer's parameters. A value is its index, sub-index and length in front of its bytes;
/// those that have their power-on value are not in it, and those that a later image no longer knows count for
/// nothing.

#include <cstdint>
#include <span>

#include "boards/common/record_log.hpp"
#include "cbcan/canopen/parameter_memory.hpp"

namespace cbcan::boards {

class ParameterStore final : public ParameterMemory {
 public:
  using Words = std::span<std::uint16_t>;
  using Valid = bool (*)(std::span<const std::uint16_t>);

  /// `settings`: the board's, as the image has them; `valid` says of such words whether the board can do with
  /// them. All outlive this.
  ParameterStore(Flash& flash, Words settings, Valid valid)
      : log_(flash), settings_(settings), valid_(valid) {}

  /// Once, before the rest of the board and what RecordLog::start() says: puts what is stored into the
  /// board's settings. `leave_aside`: nothing that is stored counts until the next start.
  void start(bool leave_aside);

  // ParameterMemory. 0800 0022h: full until the next start; 0606 0000h: the flash does not work; 0609 0030h:
  // the board's settings are none.
  AbortCode save(std::uint16_t first_index, std::uint16_t last_index) override;
  AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) override;
  void load(ObjectDictionary& objects, ObjectHandler& handler, std::uint16_t first_index,
            std::uint16_t last_index) override;
  /// As R4154 and R4155, with all settings of the board; false where it has no such settings.
  bool keep_address(std::uint8_t node_id, std::uint8_t bit_rate) override;

 private:
  AbortCode keep(std::uint16_t first_index, std::uint16_t last_index, bool save);

  RecordLog log_;
  Words settings_;
  Valid valid_;
  const ObjectDictionary* objects_ = nullptr;
  bool left_aside_ = false;
};

}  // namespace cbcan::boards
