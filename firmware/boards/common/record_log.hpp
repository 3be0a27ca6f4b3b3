// SPDX-License-Identifier: MIT
#pragma once

/// Records in flash, appended one after another; only the latest counts. Whenever the power is cut, the
/// latest complete record is found again.
///
/// A sector begins with a mark, written after an erasure. A record is a word with its length, one with its
/// number, its bytes, and a word with the CRC of these; without the CRC it is invalid. Mark, head, bytes and
/// CRC each begin a unit of the flash, and zeros fill it. The record with the highest number counts, wherever
/// it is: an unreadable one hides no other. The sector with the latest record is never erased.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/common/hardware.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"

namespace cbcan::boards {

class RecordLog {
  static_assert(std::endian::native == std::endian::little, "RecordLog needs a little-endian processor");

 public:
  /// Produces a record's bytes, all of them twice: they are measured, then written.
  class Source {
   public:
    /// Puts the next bytes with put(); the first ones if it `begins`. False: they were the last.
    virtual bool put_some(RecordLog& log, bool begins) = 0;

   protected:
    ~Source() = default;
  };

  /// The flash outlives this. Empty until start().
  explicit RecordLog(Flash& flash) : flash_(flash) {}

  /// Call once, while nothing is urgent: may erase the sector without the latest record.
  void start();

  /// append() may erase the older sector when the other is full, as often as needed: the application can bear
  /// that Flash::erase() blocks. Otherwise there is room for a sector's records until the next start().
  void allow_erase(bool allowed) { may_erase_ = allowed; }

  /// The bytes of the latest record, in flash; empty = there is none.
  std::span<const std::uint8_t> latest() const { return latest_; }

  /// Appends a record, unless it equals the latest one. kLater: a part of it; call it again with the same
  /// source, or begin another record with restart(). kDeviceState: no room without an erasure.
  /// kReadLength: the record is longer than a sector. kHardware: the flash does not hold what was written.
  /// After an error the latest record is unchanged.
  AbortCode append(Source& source);
  void restart() { phase_ = Phase::kIdle; }
  /// Only for Source::put_some().
  void put(std::uint8_t byte);

 private:
  enum class Phase : std::uint8_t { kIdle, kMeasure, kWrite };
  struct Scan {
    std::size_t latest = 0;  ///< first word of the latest record; 0 = none
    std::uint32_t number = 0;
    std::size_t end = 0;  ///< the first word after all records
    bool clean = false;   ///< has a mark, and all words from `end` on are erased
  };
  Scan scan(std::size_t sector) const;
  std::size_t record_end(std::span<const std::uint32_t> words, std::size_t at) const;
  bool make_blank(std::size_t sector);
  bool change_sector();
  void begin(Phase phase);
  AbortCode begin_record();
  AbortCode end_record();
  void put_word(std::uint32_t value);
  void end_unit();
  std::span<const std::uint8_t> bytes_at(std::size_t begin) const;
  std::size_t sector_words() const { return flash_.sector(0).size(); }
  bool has_record() const { return latest_.data() != nullptr; }
  std::size_t unit() const { return flash_.unit_words(); }
  /// The words of all units that hold so many words.
  std::size_t whole(std::size_t words) const { return (words + unit() - 1) & ~(unit() - 1); }

  Flash& flash_;
  std::span<const std::uint8_t> latest_;
  std::uint32_t number_ = 0;       ///< of the latest record, or of one that did not become it
  std::size_t latest_sector_ = 0;  ///< where it is
  std::size_t sector_ = 0;         ///< where the next one goes
  std::size_t end_ = 0;            ///< and its first word
  bool other_is_blank_ = false;    ///< the other sector
  bool may_erase_ = false;
  bool failed_ = false;  ///< the flash, since start()
  // State of append().
  Phase phase_ = Phase::kIdle;
  bool begins_ = false;
  bool same_ = false;   ///< equal to the latest record so far
  bool sound_ = false;  ///< all words of the record hold their values
  unsigned tries_ = 0;
  std::uint16_t crc_ = 0;
  std::uint32_t word_ = 0;
  std::size_t size_ = 0;    ///< bytes put so far
  std::size_t length_ = 0;  ///< all bytes of the record, as measured
  std::size_t begin_ = 0;   ///< its first word
  std::size_t filled_ = 0;  ///< words in unit_
  std::array<std::uint32_t, Flash::kMostUnitWords> unit_{};
};

}  // namespace cbcan::boards
