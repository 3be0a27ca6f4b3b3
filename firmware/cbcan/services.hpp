// SPDX-License-Identifier: MIT
#pragma once

/// What a build of the core has, and how much of it. Each image may have a header "cbcan/configuration.hpp"
/// of its own, ahead of the core's in its include path, which says so:
///
///   #include "cbcan/services.hpp"
///   namespace cbcan {
///   inline constexpr Services kServices{.time = false, .rpdos = 4, .tpdos = 4};
///   }
///
/// The core and all that includes its headers have to be compiled with the same one. What is left out takes
/// neither flash nor RAM, and the objects that belong to it are not in the own dictionary.

#include <cstddef>
#include <cstdint>

namespace cbcan {

struct Services {
  bool scanner_window = true;  ///< a second way in (docs/how-to/scanner.md)
  bool block_transfer = true;  ///< of the SDO client (3004h) and of SDO servers

  // The own node.
  bool sdo_server = true;   ///< other nodes reach the own objects
  bool emergencies = true;  ///< the own EMCY messages (1003h, 1014h, 1015h), those of others (3005h, 3006h)
  bool time = true;         ///< TIME messages (1012h) and the clock (3008h)
  std::uint8_t rpdos = 16;  ///< neither RPDOs nor TPDOs: no SYNC, no process data registers either
  std::uint8_t tpdos = 16;
  std::uint8_t objects_of_pdo = 8;  ///< that each may map
  std::uint8_t errors_kept = 8;     ///< in 1003h

  bool stored_parameters = true;  ///< 1010h, 1011h
  bool lss = true;                ///< node ID and bit rate by LSS, kept where 1010h stores
  /// What Devices have that the coprocessor's own node has no use for: the loss of other nodes as an error
  /// (1016h, 100Ch), limits of values.
  bool other_devices = true;

  bool counters = true;  ///< for people, as SdoClient::counters(); those of transactions are always there

  /// Characters each way of a serial CAN adapter, a power of two: 1024 are some 40 frames.
  std::size_t serial_queue = 1024;

  constexpr bool process_data() const { return rpdos + tpdos != 0; }
};

}  // namespace cbcan
