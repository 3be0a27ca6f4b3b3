// SPDX-License-Identifier: MIT
#pragma once

/// An object dictionary (CiA 301, 7.4): a sorted table of entries, which may be constant and in flash, over a
/// block of values in RAM. It owns neither; nothing here allocates. An access takes a binary search, O(log
/// n), or none when it is in the same entry as the access before.
///
/// Not re-entrant: call it from the place that also calls the rest of the core.

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "cbcan/canopen/dictionary/data_type.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// Access rights and properties of an entry.
struct ObjectFlags {
  static constexpr std::uint16_t kRead = 0x01;
  static constexpr std::uint16_t kWrite = 0x02;
  static constexpr std::uint16_t kReadWrite = kRead | kWrite;
  /// Any length up to the capacity. The current length is in the four bytes before the value.
  static constexpr std::uint16_t kVariable = 0x04;
  /// The value is not stored: the handler provides it when it is read and takes it when it is written. With
  /// kVariable the handler checks the length of what is read.
  static constexpr std::uint16_t kComputed = 0x08;
  /// The handler is asked before a written value is stored.
  static constexpr std::uint16_t kChecked = 0x10;
  /// The limits table has a row for it.
  static constexpr std::uint16_t kLimited = 0x20;
  /// May be mapped into an RPDO or a TPDO.
  static constexpr std::uint16_t kMapRpdo = 0x40;
  static constexpr std::uint16_t kMapTpdo = 0x80;
  /// The value is in the process image, not in the block of values.
  static constexpr std::uint16_t kProcess = 0x100;
  /// BOOLEANs, eight to a byte: the offset counts bits.
  static constexpr std::uint16_t kPacked = 0x200;
  /// The table gives no value: the device may have its own default.
  static constexpr std::uint16_t kUnset = 0x400;
  /// A command or a set point, not a parameter that 1010h stores.
  static constexpr std::uint16_t kSetPoint = 0x800;
  /// Sub-index 0 also exists, an UNSIGNED8 with the highest sub-index: saves an entry for each array.
  static constexpr std::uint16_t kCounted = 0x1000;
  /// The handler is asked after the stored value and its length are in `out` and `size`. A value that clients
  /// cannot write is the application's: a reset does not restore it.
  static constexpr std::uint16_t kAsked = 0x2000;
  /// 1010h of a simulated node stores it although clients cannot write it: derived from a command.
  static constexpr std::uint16_t kKept = 0x4000;
  /// The value is not stored and has any length: the SDO server hands a download over piece by piece
  /// (DownloadStream). With kComputed and a capacity of 0, of clients that only write.
  static constexpr std::uint16_t kStreamed = 0x8000;
};

/// Offsets and lengths of values; those of the coprocessor's own objects fit in 16 bits.
using ObjectSize = std::conditional_t<kServices.other_devices, std::uint32_t, std::uint16_t>;

/// One object, or a run of identical sub-indices (an array's elements, CompactSubObj), or such a run in each
/// of several consecutive indices (PDO parameters). The value of element k of a run, counted through all its
/// indices, is at offset + k * stride(). Numbers are stored little-endian, as on the bus.
struct ObjectEntry {
  std::uint16_t index;
  std::uint8_t first_sub;
  std::uint8_t last_sub;
  DataType type;
  std::uint8_t more_indices;  ///< after the first
  std::uint16_t flags;
  ObjectSize offset;    ///< into the values or the process image; with kVariable, after the length
  ObjectSize capacity;  ///< bytes of one element

  static constexpr std::uint32_t kLengthBytes = 4;
  constexpr bool has(std::uint16_t flag) const { return (flags & flag) != 0; }
  constexpr bool is_streamed() const { return kServices.streamed_downloads && has(ObjectFlags::kStreamed); }
  constexpr std::uint16_t last_index() const { return static_cast<std::uint16_t>(index + more_indices); }
  constexpr bool has_index(std::uint16_t i) const { return index <= i && i <= last_index(); }
  constexpr bool holds(std::uint16_t i, std::uint8_t sub) const {
    return has_index(i) && first_sub <= sub && sub <= last_sub;
  }
  /// Elements in each index, and in all of them.
  constexpr std::uint32_t subs() const { return last_sub - first_sub + 1u; }
  constexpr std::uint32_t count() const { return subs() * (more_indices + 1u); }
  /// Bytes before each value.
  constexpr std::uint32_t front() const { return has(ObjectFlags::kVariable) ? kLengthBytes : 0; }
  /// Distance from one element to the next, in bytes; in bits with kPacked.
  constexpr std::uint32_t stride() const { return has(ObjectFlags::kPacked) ? 1 : front() + capacity; }
};

/// Lowest and highest allowed value of a number. For unsigned types these are bit patterns.
struct ObjectLimits {
  std::uint16_t index;
  std::uint8_t sub;
  std::int64_t low;
  std::int64_t high;
};

/// The device's part in an access: provides computed values, checks values before they are stored, and is
/// notified afterwards.
class ObjectHandler {
 public:
  /// Writes the value of a kComputed or kAsked entry to `out` and its length to `size`. With kVariable the
  /// value may be longer than `out`: then it returns kReadLength.
  virtual AbortCode on_read(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/,
                            std::span<std::uint8_t> /*out*/, std::size_t& /*size*/, Time /*now*/) {
    return AbortCode::kGeneral;
  }

  /// `value` has passed the checks of access, length and limits. A code other than kNone rejects it: nothing
  /// is stored. kLater, only with Services::stored_parameters: ask again with the same value, at once if need
  /// be; each call does a part, and does not wait for time.
  virtual AbortCode on_write(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/,
                             std::span<const std::uint8_t> /*value*/, Time /*now*/) {
    return AbortCode::kNone;
  }

  /// A value that on_write() accepted is now in the dictionary.
  virtual void on_stored(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/, Time /*now*/) {}

 protected:
  ~ObjectHandler() = default;
};

/// Copies the power-on values of the stored entries first_index..last_index to `values`; both blocks have the
/// same layout. Entries after the end of `power_on` become zeros.
void restore_values(std::span<const ObjectEntry> entries, std::span<const std::uint8_t> power_on,
                    std::span<std::uint8_t> values, std::uint16_t first_index, std::uint16_t last_index);

class ObjectDictionary {
 public:
  /// `entries`: sorted by index, then first_sub, without overlap; an entry of several indices may share them
  /// only with entries of exactly the same indices. `limits`: sorted by index, then sub. `process`: the
  /// memory of kProcess entries. The caller owns all of it, and it outlives the dictionary.
  template <Services>
  struct TablesOf {
    std::span<const ObjectEntry> entries;
    std::span<std::uint8_t> values;
    std::span<const ObjectLimits> limits = {};
    std::span<std::uint8_t> process = {};
  };
  /// Tables of this build: a program with other services does not link.
  using Tables = TablesOf<kServices>;

  /// `handler` may be null if no entry is kComputed, kAsked or kChecked.
  ObjectDictionary(const Tables& tables, ObjectHandler* handler);
  ObjectDictionary(std::span<const ObjectEntry> entries, std::span<std::uint8_t> values,
                   ObjectHandler* handler, std::span<const ObjectLimits> limits = {},
                   std::span<std::uint8_t> process = {})
      : ObjectDictionary({entries, values, limits, process}, handler) {}

  /// kNone: `entry` is the entry, reduced to this index. kNoObject, kNoSubIndex: `entry` is unchanged.
  AbortCode find(std::uint16_t index, std::uint8_t sub, ObjectEntry& entry) const;

  /// Reads with the access rights of an SDO upload. An object larger than out.size() is kReadLength.
  AbortCode read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> out, std::size_t& size,
                 Time now) const;

  /// Writes as an SDO download does: checks access rights, length (too long kParameterLength, too short
  /// kObjectLength) and limits, and asks the handler; kStreamed is kIncompatible. The value is stored
  /// completely or not at all. kLater: the handler has not finished; write the same again.
  AbortCode write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value, Time now);
  /// The same for those that cannot wait: it never returns kLater.
  AbortCode write_whole(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value,
                        Time now) {
    AbortCode answer = write(index, sub, value, now);
    while (kServices.stored_parameters && answer == AbortCode::kLater)
      answer = write(index, sub, value, now);
    return answer;
  }

  /// Returns, for the device itself, a stored number of up to 8 bytes, whatever its access rights; 0 if there
  /// is none.
  std::uint64_t get(std::uint16_t index, std::uint8_t sub) const;
  /// The same for an entry returned by find().
  std::uint64_t number(const ObjectEntry& entry, std::uint8_t sub) const;

  /// Sets such a number without asking the handler. False: there is no such stored number. Not for kPacked.
  bool set(std::uint16_t index, std::uint8_t sub, std::uint64_t value);

  /// Sets a value of any type without asking the handler. `bytes` has the length of the capacity, or less
  /// with kVariable.
  void store(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> bytes);

  /// kNone, or why an element cannot have this value: its length, or a limit of it.
  AbortCode check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value) const {
    if (value.size() > entry.capacity) return AbortCode::kParameterLength;
    if (value.size() < entry.capacity && !entry.has(ObjectFlags::kVariable)) return AbortCode::kObjectLength;
    return check_limits(entry, sub, value);
  }

  /// The bytes of a stored element, in its current length; empty for kComputed. With kPacked, the byte that
  /// contains it.
  std::span<std::uint8_t> value(const ObjectEntry& entry, std::uint8_t sub) const;
  /// The offset of an element in its block(), in bits.
  static std::size_t first_bit(const ObjectEntry& entry, std::uint8_t sub) {
    return entry.has(ObjectFlags::kPacked) ? offset_of(entry, sub) : 8 * offset_of(entry, sub);
  }
  /// The process image, or the values.
  std::uint8_t* block(bool process) const { return process ? tables_.process.data() : tables_.values.data(); }

  std::span<const ObjectEntry> entries() const { return tables_.entries; }

 private:
  static std::size_t offset_of(const ObjectEntry& entry, std::uint8_t sub) {
    return entry.offset + std::size_t{entry.stride()} * (sub - entry.first_sub);
  }
  std::size_t search(std::uint16_t index, std::uint8_t sub) const;
  AbortCode find_count(std::uint16_t index, std::uint8_t sub, ObjectEntry& entry) const;
  AbortCode check_limits(const ObjectEntry& entry, std::uint8_t sub,
                         std::span<const std::uint8_t> value) const;

  Tables tables_;
  ObjectHandler* handler_;
  mutable std::size_t found_ = 0;  ///< the entry found last: related objects are accessed in succession
};

}  // namespace cbcan
