// SPDX-License-Identifier: MIT
#pragma once

/// The further SDO servers of a node (CiA 301, 7.5.2.33): one for each of 1201h..127Fh that the dictionary
/// has, on the CAN-IDs of sub-indices 1 (requests) and 2 (responses). A server exists when both are valid,
/// and uses new ones as soon as they are written. CAN-IDs that CiA 301 restricts are accepted, since files
/// contain them.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "cbcan/canopen/sdo/server.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

class MoreSdoServers {
 public:
  /// `dictionary` and `port` outlive this; `room` is the size of the largest object in bytes. `timeout_ms`:
  /// see SdoServer::set_block_timeout().
  MoreSdoServers(ObjectDictionary& dictionary, CanPort& port, std::size_t room, std::uint16_t timeout_ms);

  static constexpr bool owns(std::uint16_t index) { return index >= kFirst && index <= kLast; }
  /// Applies the CAN-IDs in the dictionary.
  void configure();
  /// Forgets transfers in progress.
  void reset();
  bool serves(std::uint32_t id) const {
    return id != 0 && std::ranges::find(servers_, id, &Served::request_id) != servers_.end();
  }
  /// Call it only for a frame whose identifier serves() accepts.
  void on_frame(const Frame& frame, Time now);
  void poll(Time now);
  Time deadline() const {
    return earliest(servers_, [](const Served& served) { return served.server.deadline(); });
  }
  template <class Visitor>
  void visit_ids(Visitor visit) const {
    for (const Served& served : servers_)
      if (served.request_id != 0) visit(served.request_id);
  }

 private:
  static constexpr std::uint16_t kFirst = 0x1201;
  static constexpr std::uint16_t kLast = 0x127F;

  struct Served {
    std::uint16_t index;
    std::vector<std::uint8_t> buffer;
    SdoServer server;
    std::uint32_t request_id = 0;  ///< 0 = the server does not exist
    std::uint32_t response_id = 0;
  };

  ObjectDictionary& dictionary_;
  std::vector<Served> servers_;
};

}  // namespace cbcan::sim
