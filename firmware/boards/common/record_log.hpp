// SPDX-License-Identifier: MIT
#pragma once

/// Records in flash, appended one behind the other, of which only the latest counts. Whatever moment the
/// power is cut at, the latest one that was whole is found again.
///
/// A sector begins with a mark, which is written when an erasure has ended. A record is a word with its
/// length, one with its number, its bytes, and a word with the CRC of all of these: one that lacks it is
/// none. The record with the highest number counts, wherever it is: one that has become unreadable hides no
/// other. Nothing is erased but in start(), and there never the sector with the latest record; what it has
/// been copied from stays until the next time.

#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/common/flash.hpp"

namespace cbcan::boards {

class RecordLog {
 public:
  enum class Result : std::uint8_t {
    kKept,
    kFull,    ///< until the next start(); the latest record is what it was
    kFailed,  ///< the flash does not hold what is written; likewise
  };

  /// Takes the bytes of a record.
  class Writer {
   public:
    void put(std::uint8_t byte);
    std::size_t size() const { return size_; }

   private:
    friend class RecordLog;
    /// Measures, where there is no `log`.
    explicit Writer(std::span<const std::uint8_t> latest, RecordLog* log = nullptr)
        : latest_(latest), log_(log) {}
    void end_word();

    std::span<const std::uint8_t> latest_;
    RecordLog* log_;
    std::size_t size_ = 0;
    std::uint32_t word_ = 0;
    bool same_ = true;  ///< as the latest record, so far
  };

  /// What a record is made of.
  class Source {
   public:
    /// Puts all bytes, the same ones each time.
    virtual void write_to(Writer& writer) const = 0;

   protected:
    ~Source() = default;
  };

  /// The flash outlives this. Empty until start().
  explicit RecordLog(Flash& flash) : flash_(flash) {}

  /// Once, while nothing is urgent: makes room, which may erase a sector.
  void start();

  /// The bytes of the latest record, in flash; empty = there is none.
  std::span<const std::uint8_t> latest() const { return latest_; }

  /// Appends a record, which is the latest one then. One like it is not written again. Takes some
  /// microseconds for each word.
  Result append(const Source& source);

 private:
  struct Scan {
    std::size_t latest = 0;  ///< word where the latest record begins; 0 = none
    std::uint32_t number = 0;
    std::size_t end = 1;  ///< the first word after all records
    bool clean = false;   ///< from there on all is erased
  };
  Scan scan(std::size_t sector) const;
  std::size_t record_end(std::span<const std::uint32_t> words, std::size_t at) const;
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
