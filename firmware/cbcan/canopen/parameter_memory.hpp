// SPDX-License-Identifier: MIT
#pragma once

/// Non-volatile memory for 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14). A device without one rejects both
/// (0800 0020h).

#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan {

class ParameterMemory {
 public:
  /// 1010h: stores the values of the parameters first_index..last_index for later resets. kNone; kLater: call
  /// it again for the next part; or the reason why not: then the values stored before are unchanged.
  virtual AbortCode save(std::uint16_t first_index, std::uint16_t last_index) = 0;
  /// 1011h: from the next reset on those parameters have their power-on values. Returns the same.
  virtual AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) = 0;
  /// A reset has restored the power-on values of first_index..last_index: replaces them by the stored ones,
  /// computed ones with handler.on_write(). True: call it again, with the next `step` from 0, for the next
  /// part. For devices whose own restore() does not do that.
  virtual bool load(ObjectDictionary& /*objects*/, ObjectHandler& /*handler*/, std::uint16_t /*first_index*/,
                    std::uint16_t /*last_index*/, std::uint32_t /*step*/) {
    return false;
  }
  /// LSS: stores both for the next power-on. `node_id` 1..127, 255 = none; `bit_rate` as in LssApplication,
  /// kReservedLssBitRate = unchanged. False: could not. For devices with their own LSS slave.
  virtual bool keep_address(std::uint8_t /*node_id*/, std::uint8_t /*bit_rate*/) { return false; }

 protected:
  ~ParameterMemory() = default;
};

/// What a memory that stores only changed parameters must know of the device.
class PowerOnValues {
 public:
  /// `bytes` is the value that this parameter has without stored parameters.
  virtual bool is_power_on(const ObjectDictionary& objects, const ObjectEntry& entry, std::uint8_t sub,
                           std::span<const std::uint8_t> bytes) const = 0;

 protected:
  ~PowerOnValues() = default;
};

}  // namespace cbcan
