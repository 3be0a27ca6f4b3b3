// SPDX-License-Identifier: MIT
#include "sim/node.hpp"

#include "cbcan/canopen/dictionary/cob_id.hpp"

namespace cbcan::sim {

namespace {

constexpr std::uint8_t kRequests = 1;
constexpr std::uint8_t kResponses = 2;

/// 0 = none is valid.
std::uint32_t can_id(const ObjectDictionary& dictionary, std::uint16_t index, std::uint8_t sub) {
  const auto cob_id = static_cast<std::uint32_t>(dictionary.get(index, sub));
  return (cob_id & (cob::kInvalid | cob::kReserved)) == 0 ? cob::id_of(cob_id) : 0;
}

}  // namespace

MoreSdoServers::MoreSdoServers(ObjectDictionary& dictionary, CanPort& port, std::size_t room,
                               std::uint16_t timeout_ms)
    : dictionary_(dictionary) {
  for (const ObjectEntry& entry : dictionary.entries()) {
    if (!owns(entry.index) || (!servers_.empty() && servers_.back().index == entry.index)) continue;
    std::vector<std::uint8_t> buffer(room);
    SdoServer server(dictionary, port, buffer);
    server.set_block_timeout(timeout_ms);
    servers_.push_back({entry.index, std::move(buffer), server});
  }
}

void MoreSdoServers::configure() {
  for (Served& served : servers_) {
    const std::uint32_t response = can_id(dictionary_, served.index, kResponses);
    served.request_id = response == 0 ? 0 : can_id(dictionary_, served.index, kRequests);
    if (std::exchange(served.response_id, response) != response) served.server.reset(response);
  }
}

void MoreSdoServers::reset() {
  for (Served& served : servers_)
    served.server.reset(served.response_id);
}

void MoreSdoServers::on_frame(const Frame& frame, Time now) {
  std::ranges::find(servers_, frame.id, &Served::request_id)->server.on_frame(frame, now);
}

void MoreSdoServers::poll(Time now) {
  for (Served& served : servers_)
    served.server.poll(now);
}

}  // namespace cbcan::sim
