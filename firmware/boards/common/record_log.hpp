// SPDX-License-Identifier: MIT
#pragma once

/// Records in flash, appended one after another; only the latest counts. Whenever the power is cut, the
/// latest complete record is found again.
///
/// A sector begins with a mark, written after an erasure. A record is a word with its length, one with its
/// number, its bytes, and a word with the CRC of these; without the CRC it is invalid. The record with the
/// highest number counts, wherever it is: an unreadable one hides no other. Only start() erases, and never
/// the sector with the latest record; the source of a copy stays until the next start.

#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/common/hardware.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"

namespace cbcan::boards {

class RecordLog {
 public:
  /// Takes the bytes of a record.
  class Writer {
   public:
    void put(std::uint8_t byte);
    std::size_t size() const { return size_; }

   private:
    friend class RecordLog;
    /// Measures only, if there is no `log`.
    explicit Writer(std::span<const std::uint8_t> latest, RecordLog* log = nullptr)
        : latest_(latest), log_(log) {}
    void end_word();

    std::span<const std::uint8_t> latest_;
    RecordLog* log_;
    std::size_t size_ = 0;
    std::uint32_t word_ = 0;
    bool same_ = true;  ///< equal to the latest record so far
  };

  /// Produces a record's bytes.
  class Source {
   public:
    /// Puts all bytes; the same ones in each call.
    virtual void write_to(Writer& writer) const = 0;

   protected:
    ~Source() = default;
  };

  /// The flash outlives this. Empty until start().
  explicit RecordLog(Flash& flash) : flash_(flash) {}

  /// Call once, while nothing is urgent: makes room, which may erase a sector.
  void start();

  /// The bytes of the latest record, in flash; empty = there is none.
  std::span<const std::uint8_t> latest() const { return latest_; }

  /// Appends a record, unless it equals the latest one. Takes some microseconds for each word. kDeviceState:
  /// it is full until the next start(), and the latest record is unchanged; kHardware: the flash does not
  /// hold what was written, until the next start().
  AbortCode append(const Source& source);

 private:
  struct Scan {
    std::size_t latest = 0;  ///< first word of the latest record; 0 = none
    std::uint32_t number = 0;
    std::size_t end = 1;  ///< the first word after all records
    bool clean = false;   ///< all words from `end` on are erased
  };
  Scan scan(std::size_t sector) const;
  bool make_blank(std::size_t sector);
  bool move_to(std::size_t sector, const Scan& from);
  bool write(std::uint32_t value);
  bool seal(std::size_t begin);
  std::span<const std::uint8_t> bytes_at(std::size_t begin) const;

  Flash& flash_;
  std::span<const std::uint8_t> latest_;
  std::uint32_t number_ = 0;  ///< of the latest record
  std::size_t sector_ = 0;
  std::size_t end_ = 0;  ///< where the next record goes
  bool works_ = false;
};

}  // namespace cbcan::boards
