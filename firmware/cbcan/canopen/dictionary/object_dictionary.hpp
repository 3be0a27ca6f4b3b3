// SPDX-License-Identifier: MIT
#pragma once

/// An object dictionary (CiA 301, 7.4): a sorted table of entries, which may be constant and in flash, over a
/// block of values in RAM. It owns neither; nothing here allocates. One access is a binary search, O(log n);
/// none where it is in the same entry as the one before.
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

/// What may be done with an entry.
struct ObjectFlags {
  static constexpr std::uint16_t kRead = 0x01;
  static constexpr std::uint16_t kWrite = 0x02;
  static constexpr std::uint16_t kReadWrite = kRead | kWrite;
  /// The length may be anything up to the capacity. The current one is kept in the four bytes in front of the
  /// value.
  static constexpr std::uint16_t kVariable = 0x04;
  /// The value is not stored; the handler makes it when it is read and takes it when it is written.
  static constexpr std::uint16_t kComputed = 0x08;
  /// The handler is asked before a written value is stored.
  static constexpr std::uint16_t kChecked = 0x10;
  /// A row of the limits table holds for it.
  static constexpr std::uint16_t kLimited = 0x20;
  /// May be mapped into an RPDO or a TPDO.
  static constexpr std::uint16_t kMapRpdo = 0x40;
  static constexpr std::uint16_t kMapTpdo = 0x80;
  /// The value lies in the process image, not among the values.
  static constexpr std::uint16_t kProcess = 0x100;
  /// BOOLEANs, eight to a byte: the offset counts bits.
  static constexpr std::uint16_t kPacked = 0x200;
  /// Whoever wrote the table left the value to the device, which may have a default of its own.
  static constexpr std::uint16_t kUnset = 0x400;
  /// A command or a set point, not a parameter that 1010h stores.
  static constexpr std::uint16_t kSetPoint = 0x800;
  /// Sub-index 0 is there too, an UNSIGNED8 that says what the last one is: an entry less for each array.
  static constexpr std::uint16_t kCounted = 0x1000;
};

/// Places and lengths of values; the coprocessor's own fit 16 bits.
using ObjectSize = std::conditional_t<kServices.other_devices, std::uint32_t, std::uint16_t>;

/// One entry, or a run of sub-indices that are alike (an array's elements, CompactSubObj), or such a run in
/// each of several indices that follow each other (PDO parameters). Element k of a run, counted through all
/// its indices, has its value at offset + k * stride(). Numbers are stored little-endian, as on the bus.
struct ObjectEntry {
  std::uint16_t index;
  std::uint8_t first_sub;
  std::uint8_t last_sub;
  DataType type;
  std::uint8_t more_indices;  ///< behind the first
  std::uint16_t flags;
  ObjectSize offset;    ///< into the values or the process image; behind the length, for a variable one
  ObjectSize capacity;  ///< bytes of one element

  static constexpr std::uint32_t kLengthBytes = 4;
  constexpr bool has(std::uint16_t flag) const { return (flags & flag) != 0; }
  constexpr std::uint16_t last_index() const { return static_cast<std::uint16_t>(index + more_indices); }
  constexpr bool has_index(std::uint16_t i) const { return index <= i && i <= last_index(); }
  constexpr bool holds(std::uint16_t i, std::uint8_t sub) const {
    return has_index(i) && first_sub <= sub && sub <= last_sub;
  }
  /// Elements in each index, and in all.
  constexpr std::uint32_t subs() const { return last_sub - first_sub + 1u; }
  constexpr std::uint32_t count() const { return subs() * (more_indices + 1u); }
  /// Bytes in front of each value.
  constexpr std::uint32_t front() const { return has(ObjectFlags::kVariable) ? kLengthBytes : 0; }
  /// Bytes, for packed ones bits, from one element to the next.
  constexpr std::uint32_t stride() const { return has(ObjectFlags::kPacked) ? 1 : front() + capacity; }
};

/// Lowest and highest value of a number, both allowed. Unsigned values are compared as their bit pattern.
struct ObjectLimits {
  std::uint16_t index;
  std::uint8_t sub;
  std::int64_t low;
  std::int64_t high;
};

/// Behaviour behind entries: computed values, a say before a value is stored, and word of it afterwards.
class ObjectHandler {
 public:
  /// Writes the value of a kComputed entry to `out` and its length to `size`.
  virtual AbortCode on_read(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/,
                            std::span<std::uint8_t> /*out*/, std::size_t& /*size*/, Time /*now*/) {
    return AbortCode::kGeneral;
  }

  /// `value` has passed access, length and limits. A code other than kNone refuses it and nothing is stored.
  virtual AbortCode on_write(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/,
                             std::span<const std::uint8_t> /*value*/, Time /*now*/) {
    return AbortCode::kNone;
  }

  /// A value that on_write() let pass stands in the dictionary now.
  virtual void on_stored(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/, Time /*now*/) {}

 protected:
  ~ObjectHandler() = default;
};

/// Copies the power-on values of the stored entries first_index..last_index over the values; both blocks are
/// laid out alike. Entries that lie behind the end of `power_on` become zeros.
void restore_values(std::span<const ObjectEntry> entries, std::span<const std::uint8_t> power_on,
                    std::span<std::uint8_t> values, std::uint16_t first_index, std::uint16_t last_index);

class ObjectDictionary {
 public:
  /// `entries` sorted by index, then first_sub, without overlap; entries of several indices share them with
  /// entries of the very same indices only. `limits` sorted by index, then sub. `process` is the memory of
  /// kProcess entries. All of it is the caller's and outlives the dictionary. `handler` may be null if no
  /// entry is kComputed or kChecked.
  ObjectDictionary(std::span<const ObjectEntry> entries, std::span<std::uint8_t> values,
                   ObjectHandler* handler, std::span<const ObjectLimits> limits = {},
                   std::span<std::uint8_t> process = {});

  /// kNone and the entry, as one of this index alone; or kNoObject, kNoSubIndex and an `entry` left alone.
  AbortCode find(std::uint16_t index, std::uint8_t sub, ObjectEntry& entry) const;

  /// As an SDO upload sees it: access rights count. At most out.size() bytes; a larger object is kReadLength.
  AbortCode read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> out, std::size_t& size,
                 Time now) const;

  /// As an SDO download sees it: access rights, length (too long kParameterLength, too short kObjectLength),
  /// limits and handler count; the value is stored whole or not at all.
  AbortCode write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value, Time now);

  /// The device's own side: a stored number of up to 8 bytes, whatever its access rights. 0 where there is
  /// none.
  std::uint64_t get(std::uint16_t index, std::uint8_t sub) const;
  /// The same of an entry that find() has found.
  std::uint64_t number(const ObjectEntry& entry, std::uint8_t sub) const;

  /// Likewise; false where there is no such stored number. The handler is not asked. Not for packed ones.
  bool set(std::uint16_t index, std::uint8_t sub, std::uint64_t value);

  /// Likewise for a value of any kind. `bytes` has the capacity's length, or less for a variable one.
  void store(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> bytes);

  /// The bytes of a stored element, current length; empty for a computed one. Of a packed one the byte that
  /// it is in.
  std::span<std::uint8_t> value(const ObjectEntry& entry, std::uint8_t sub) const;
  /// Where an element begins in its block(): bits from the first one.
  static std::size_t first_bit(const ObjectEntry& entry, std::uint8_t sub) {
    return entry.has(ObjectFlags::kPacked) ? offset_of(entry, sub) : 8 * offset_of(entry, sub);
  }
  /// The process image, or the values.
  std::uint8_t* block(bool process) const { return process ? process_.data() : values_.data(); }

  std::span<const ObjectEntry> entries() const { return entries_; }

 private:
  static std::size_t offset_of(const ObjectEntry& entry, std::uint8_t sub) {
    return entry.offset + std::size_t{entry.stride()} * (sub - entry.first_sub);
  }
  std::size_t search(std::uint16_t index, std::uint8_t sub) const;
  AbortCode find_count(std::uint16_t index, std::uint8_t sub, ObjectEntry& entry) const;
  AbortCode check_limits(const ObjectEntry& entry, std::uint8_t sub,
                         std::span<const std::uint8_t> value) const;

  std::span<const ObjectEntry> entries_;
  std::span<std::uint8_t> values_;
  std::span<std::uint8_t> process_;
  std::span<const ObjectLimits> limits_;
  ObjectHandler* handler_;
  mutable std::size_t found_ =
      0;  ///< the entry found last: objects that belong together are asked for together
};

}  // namespace cbcan
