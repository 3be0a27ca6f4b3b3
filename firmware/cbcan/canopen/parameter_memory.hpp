// SPDX-License-Identifier: MIT
#pragma once

/// What 1010h and 1011h ask for (CiA 301, 7.5.2.13 and 7.5.2.14): a memory that survives power. A device
/// without one refuses both (0800 0020h).

#include <cstdint>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan {

class ParameterMemory {
 public:
  /// 1010h: keeps the values of the parameters first_index..last_index for the resets to come. kNone, or why
  /// not: then what was kept before still is.
  virtual AbortCode save(std::uint16_t first_index, std::uint16_t last_index) = 0;
  /// 1011h: from the next reset on those parameters have their power-on values. Likewise.
  virtual AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) = 0;
  /// A reset has put power-on values into first_index..last_index: puts those that are kept over them,
  /// computed ones by handler.on_write(). For devices whose own restore() does not do that.
  virtual void load(ObjectDictionary& /*objects*/, ObjectHandler& /*handler*/, std::uint16_t /*first_index*/,
                    std::uint16_t /*last_index*/) {}
  /// LSS: keeps both for the next power-on. `node_id` 1..127; `bit_rate` as LssApplication has it,
  /// kReservedLssBitRate = as it is. False: could not. For devices with an LSS slave of their own.
  virtual bool keep_address(std::uint8_t /*node_id*/, std::uint8_t /*bit_rate*/) { return false; }

 protected:
  ~ParameterMemory() = default;
};

}  // namespace cbcan
