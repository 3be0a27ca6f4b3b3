// SPDX-License-Identifier: MIT
#pragma once

/// What a Station needs from its board in addition to the CanPorts. All calls come from the loop. `network`
/// counts the CAN networks from 0; a board with one network ignores it.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/frame.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards {

struct CanCounters {
  std::uint32_t received = 0;  ///< frames
  std::uint32_t sent = 0;      ///< frames that the controller accepted
  std::uint32_t refused = 0;   ///< times the controller had no room
  std::uint32_t lost = 0;      ///< frames, or bytes of a serial adapter, lost because a buffer was full
  std::uint32_t errors = 0;    ///< bus errors, failed starts, or invalid lines from a serial adapter
};

/// Values of the diagnostics registers.
struct Health {
  regmap::ResetCause reset_cause = regmap::ResetCause::kUnknown;
  regmap::ClockSource clock_source = regmap::ClockSource::kOnly;
  std::uint16_t stack_size = 0;   ///< bytes
  std::uint16_t stack_used = 0;   ///< bytes, maximum so far
  std::uint32_t modbus_lost = 0;  ///< bytes that the UART received and lost
  CanCounters can;
};

class Hardware {
 public:
  /// Never goes backwards.
  virtual Time now() = 0;
  /// The next frame that has arrived; false = none.
  virtual bool receive(std::size_t network, Frame& frame) = 0;
  virtual BusState bus_state(std::size_t network) = 0;
  /// Starts sending a Modbus response; the bytes stay valid until the board calls RtuServer::on_sent().
  virtual void respond(std::span<const std::uint8_t> response) = 0;
  virtual Health health(std::size_t network) = 0;

 protected:
  ~Hardware() = default;
};

/// Two sectors of flash for data that survives a power cycle, as RecordLog uses them. Flash with an ECC has
/// units of more than one word.
class Flash {
 public:
  static constexpr std::uint32_t kErased = 0xFFFFFFFF;  ///< a word that has not been written
  static constexpr std::size_t kMostUnitWords = 8;
  static bool is_erased(std::span<const std::uint32_t> words) {
    return std::ranges::all_of(words, [](std::uint32_t word) { return word == kErased; });
  }

  /// Words that are written together and once: 1, 2, 4 or 8.
  virtual std::size_t unit_words() const { return 1; }
  /// The sector's content. Both sectors have the same size, in whole units. A unit whose ECC is wrong, which
  /// an interrupted write leaves, reads as any value: the board ends the exception that it causes.
  virtual std::span<const std::uint32_t> sector(std::size_t number) const = 0;
  /// Writes an erased unit, the first word of which is `word`; takes some microseconds. False: it does not
  /// hold these values.
  virtual bool write(std::size_t sector, std::size_t word, std::span<const std::uint32_t> unit) = 0;
  /// Blocks, and may stop the core for a second. False: not completely erased.
  virtual bool erase(std::size_t sector) = 0;

 protected:
  ~Flash() = default;
};

}  // namespace cbcan::boards
