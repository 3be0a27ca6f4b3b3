// SPDX-License-Identifier: MIT
#pragma once

/// The services in a build of the core, and their sizes. An image chooses them with its own header
/// "cbcan/configuration.hpp", ahead of the core's in its include path:
///
///   #include "cbcan/services.hpp"
///   namespace cbcan {
///   inline constexpr Services kServices{.time = false, .rpdos = 4, .tpdos = 4};
///   }
///
/// The core and all code that includes its headers must be compiled with the same one: the set is part of the
/// types that constructors take, so otherwise the program does not link. A service that is left out takes
/// neither flash nor RAM, and its objects are not in the own dictionary.

#include <cstddef>
#include <cstdint>

namespace cbcan {

struct Services {
  bool scanner_window = true;  ///< a second way to send requests (docs/how-to/scanner.md)
  bool channels = true;        ///< FurtherChannels may add some, each with a scanner window
  bool block_transfer = true;  ///< of the SDO client (3004h) and of SDO servers

  // The own node.
  bool sdo_server = true;   ///< other nodes can access the own objects
  bool emergencies = true;  ///< own EMCY messages (1003h, 1014h, 1015h) and received ones (3005h, 3006h)
  bool time = true;         ///< TIME messages (1012h) and the clock (3008h)
  /// With neither RPDOs nor TPDOs there are no SYNC and no process data registers. 64 of each instead of 16
  /// take 12 KB of RAM.
  std::uint8_t rpdos = 16;
  std::uint8_t tpdos = 16;
  std::uint8_t objects_of_pdo = 8;  ///< objects that each PDO may map
  std::uint8_t errors_kept = 8;     ///< entries of 1003h

  bool stored_parameters = true;  ///< 1010h, 1011h
  bool lss = true;                ///< node ID and bit rate by LSS, kept where 1010h stores
  /// CANopen manager (CiA 302): boots the other nodes; its SDO clients, 0 = no manager, otherwise 2 or more.
  std::uint8_t manager_clients = 8;
  /// Features that the coprocessor's own node does not need: errors when other nodes are lost (1016h, 100Ch),
  /// limits of values.
  bool other_devices = true;

  /// Objects that the application of an SDO server takes piece by piece, such as 1F50h: DownloadStream.
  bool streamed_downloads = false;

  bool counters =
      true;  ///< diagnostics such as SdoClient::counters(); counters of transactions are always there

  bool adapter_state = true;  ///< and counters of a serial CAN adapter; without, it always is active

  /// Size of each queue (in and out) of a serial CAN adapter, in characters; a power of two. 1024 characters
  /// are about 40 frames.
  std::size_t serial_queue = 1024;

  constexpr bool process_data() const { return rpdos + tpdos != 0; }
  constexpr bool manager() const { return manager_clients != 0; }
  /// LSS for other nodes: 300Eh, and for the manager.
  constexpr bool lss_master() const { return lss && manager(); }
};

/// SDO, NMT, node states, heartbeats; for an image that needs little more.
inline constexpr Services kMinimalServices{.scanner_window = false,
                                           .block_transfer = false,
                                           .sdo_server = false,
                                           .emergencies = false,
                                           .time = false,
                                           .rpdos = 0,
                                           .tpdos = 0,
                                           .stored_parameters = false,
                                           .lss = false,
                                           .manager_clients = 0,
                                           .other_devices = false,
                                           .counters = false,
                                           .serial_queue = 512};

}  // namespace cbcan
