// SPDX-License-Identifier: MIT
#pragma once

/// The SDO servers of a node behind its first one (CiA 301, 7.5.2.33): one for each of 1201h..127Fh that the
/// dictionary has, on the CAN-IDs of its sub-indices 1 (requests) and 2 (responses). It is there when both
/// are valid, and follows them when they are written. CAN-IDs that CiA 301 restricts are taken: files have
/// them.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "cbcan/canopen/sdo/server.hpp"

namespace cbcan::sim {

class MoreSdoServers {
 public:
  /// Both outlive it; `room` bytes are those of the largest object.
  MoreSdoServers(ObjectDictionary& dictionary, CanPort& port, std::size_t room);

  static constexpr bool owns(std::uint16_t index) { return index >= kFirst && index <= kLast; }
  /// Takes over what the dictionary says.
  void configure();
  /// What was under way is forgotten.
  void reset();
  bool serves(std::uint32_t id) const {
    return id != 0 && std::ranges::find(servers_, id, &Served::request_id) != servers_.end();
  }
  /// A frame that one of them serves.
  void on_frame(const Frame& frame, Time now);
  void poll(Time now);
  Time deadline() const {
    Time first = kNever;
    for (const Served& served : servers_)
      first = earlier(first, served.server.deadline());
    return first;
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
    std::uint32_t request_id = 0;  ///< 0 = it is not there
    std::uint32_t response_id = 0;
  };

  ObjectDictionary& dictionary_;
  std::vector<Served> servers_;
};

}  // namespace cbcan::sim
