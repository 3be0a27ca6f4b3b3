// SPDX-License-Identifier: MIT
#pragma once

/// What a CANopen manager knows of its network (CiA 302-2 and -3): its own objects 1F80h to 1F8Ah, 1F22h and
/// so on, and the parameters of its own node: an image, one concise DCF and its crc16(), low byte first. The
/// bytes come from flash, are compiled in (cbcan-network), or are in RAM, where SDO clients can change them.
///
/// Objects with a sub-index for each node (is_of_node()) are in groups: those of one node follow each other,
/// and all others precede the first group. So an object is found among the few of its node.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/manager/concise_dcf.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"

namespace cbcan {

/// Bits of 1F80h, by number.
struct StartupBit {
  static constexpr std::uint8_t kIsManager = 0;
  static constexpr std::uint8_t kStartsAll = 1;
  static constexpr std::uint8_t kOwnNotStarted = 2;
  static constexpr std::uint8_t kSlavesNotStarted = 3;
  static constexpr std::uint8_t kResetsAll = 4;
  static constexpr std::uint8_t kStopsAll = 6;
};

/// Bits of 1F81h, by number; of its numbers the first.
struct SlaveBit {
  static constexpr std::uint8_t kListed = 0;
  static constexpr std::uint8_t kBoots = 2;
  static constexpr std::uint8_t kMandatory = 3;
  static constexpr std::uint8_t kKeepAlive = 4;
  static constexpr std::uint8_t kRetryFactor = 8;  ///< 8 bits
  static constexpr std::uint8_t kGuardTime = 16;   ///< 16 bits, ms
};

/// 300Ah: node, flags, then entries as in 1A00h, low byte first.
struct RpdoSource {
  static constexpr std::size_t kFlags = 1;
  static constexpr std::size_t kHead = 2;
  static constexpr std::size_t kEntryBytes = 4;
  static constexpr std::size_t kMostEntries = 64;
  // Bits of the flags, by number.
  static constexpr std::uint8_t kZeroWhenLost = 0;
  static constexpr std::uint8_t kReadAtStart = 1;

  /// Bits of the PDO with this mapping, 64 at most: NetworkObjects refuses more.
  static std::size_t bits(std::span<const std::uint8_t> source);
};

/// 300Bh: kAtOnce, or 0 = own TPDOs wait for the PLC's first write of outputs; and what happens while it is
/// silent: 0 = they are not sent, kZero = they carry zeros, kStop = also the nodes get NMT Stop.
struct OutputsMode {
  static constexpr std::uint8_t kAtOnce = 1;
  static constexpr std::uint8_t kZero = 2;
  static constexpr std::uint8_t kStop = 4;
  static constexpr bool is_valid(std::uint8_t mode) { return mode <= (kAtOnce | kStop); }
};

class NetworkObjects {
 public:
  using Bytes = std::span<const std::uint8_t>;
  static constexpr std::size_t kMostBytes = 0xFFFF;
  static constexpr std::size_t kCheckBytes = 2;

  /// Uses an image in flash, or compiled in; more may follow it. False: check sum, lengths or groups are
  /// wrong; the objects are as without one.
  bool use(Bytes image) { return take(image, {}); }
  /// Memory in RAM: the first `used` bytes are the image, 0 = none yet; write() may use all of them.
  bool use(std::span<std::uint8_t> memory, std::size_t used);

  /// Empty = not set, which is 0 for a number.
  Bytes find(std::uint16_t index, std::uint8_t sub) const;
  std::uint32_t number(std::uint16_t index, std::uint8_t sub) const {
    return static_cast<std::uint32_t>(load_little_endian(find(index, sub)));
  }
  /// Zeros remove an object: kNone, kStore = no more room, kReadOnly = not in RAM.
  AbortCode write(std::uint16_t index, std::uint8_t sub, Bytes value);

  /// Calls `visit(entry)` for each parameter of the own node, in order.
  void visit_own(auto visit) const {
    for (std::size_t at = ConciseDcf::kFirst; at < first_group_; at = dcf_.after(at))
      if (const ConciseDcf::Entry entry = dcf_.at(at); !is_network(entry.index)) visit(entry);
  }

  /// Its sub-index is a node ID.
  static constexpr bool is_of_node(std::uint16_t index) {
    return index == object::kConciseDcf || index == object::kExpectedDate || index == object::kExpectedTime ||
           index == object::kSlaveAssignment || index == object::kRestoreConfiguration ||
           index == object::kSlaveSdoTimeout || index == object::kSlaveLss ||
           (index >= object::kExpectedDeviceType && index <= object::kExpectedSerial);
  }
  /// An object of the manager, not a parameter of its own node.
  static constexpr bool is_network(std::uint16_t index) {
    return is_of_node(index) || index == object::kNmtStartup || index == object::kBootTime ||
           index == object::kRpdoSource || index == object::kOutputsMode;
  }

 private:
  static constexpr std::uint8_t group_of(const ConciseDcf::Entry& entry) {
    return is_of_node(entry.index) && entry.sub <= nmt::kMaxNode ? entry.sub : 0;
  }
  bool take(Bytes image, std::span<std::uint8_t> memory);
  bool find_groups();
  std::size_t offset_of(std::uint16_t index, std::uint8_t sub) const;
  std::size_t end_of(std::uint8_t group) const;
  void replace(std::size_t at, std::size_t removed, std::size_t added);

  static constexpr std::array<std::uint8_t, ConciseDcf::kFirst> kEmpty{};

  ConciseDcf dcf_{kEmpty};
  std::span<std::uint8_t> memory_;  ///< empty: the image is constant
  std::size_t first_group_ = ConciseDcf::kFirst;
  std::array<std::uint16_t, nmt::kMaxNode + 1> group_{};  ///< offset of the first object; 0 = none
};

}  // namespace cbcan
