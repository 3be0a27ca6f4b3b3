// SPDX-License-Identifier: MIT
#include "io/can/udp_bus.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "io/can/msgpack_frames.hpp"

namespace cbcan::io {

namespace {

constexpr std::size_t kMostBytes = 512;  ///< of a datagram; python-can's are below 200
constexpr int kDatagramsPerTurn = 256;

bool is_multicast(const SocketAddress& address) {
  if (address.get()->sa_family == AF_INET6)
    return IN6_IS_ADDR_MULTICAST(&reinterpret_cast<const sockaddr_in6*>(address.get())->sin6_addr);
  return IN_MULTICAST(ntohl(reinterpret_cast<const sockaddr_in*>(address.get())->sin_addr.s_addr));
}

}  // namespace

UdpBus::UdpBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, const text::ListenAddress& group,
               Warn warn)
    : RemoteBus(reactor, bus, spec, std::move(warn)), group_(looked_up(where_, group)) {
  if (!is_multicast(group_))
    throw EnvironmentError(where_ + "not a multicast address; python-can's own is 239.74.163.2");
  attempt();
}

/// Others on this machine may have the same port. What is sent comes from a port of its own, to be known by.
bool UdpBus::join() {
  const int on = 1;
  group_req request{};
  std::memcpy(&request.gr_group, &group_.storage, sizeof request.gr_group);
  const int level = group_.get()->sa_family == AF_INET6 ? IPPROTO_IPV6 : IPPROTO_IP;
  return receiver_ && sender_ && setsockopt(receiver_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
         bind(receiver_.get(), group_.get(), group_.size) == 0 &&
         setsockopt(receiver_.get(), level, MCAST_JOIN_GROUP, &request, sizeof request) == 0 &&
         connect(sender_.get(), group_.get(), group_.size) == 0;
}

void UdpBus::open() {
  receiver_ = datagram_socket(group_);
  sender_ = datagram_socket(group_);
  if (!join()) return broken(reason(errno));
  own_ = own_address(sender_.get());
  reactor_.watch(receiver_.get(), Reactor::kReadable, [this](std::uint32_t) { receive(); });
  opened();
}

void UdpBus::close() {
  reactor_.forget(receiver_.get());
  receiver_.reset();
  sender_.reset();
  retry_at_ = kNever;
}

bool UdpBus::send(const Frame& frame) {
  const auto bytes = pack_frame(frame, reactor_.time() + Reactor::wall_offset());
  if (::send(sender_.get(), bytes.data(), bytes.size(), 0) >= 0) return true;
  has_no_room(errno) ? void(retry_at_ = reactor_.time() + kRetry) : broken(reason(errno));
  return false;
}

Time UdpBus::keep(Time now) {
  if (retry_at_ <= now) {
    retry_at_ = kNever;
    has_room();
  }
  return retry_at_;
}

/// Bounded, so that a storm of frames leaves the others their turn.
void UdpBus::receive() {
  std::array<std::uint8_t, kMostBytes> bytes;
  for (int i = 0; i < kDatagramsPerTurn; ++i) {
    SocketAddress from;
    from.size = sizeof from.storage;
    const ssize_t count = recvfrom(receiver_.get(), bytes.data(), bytes.size(), 0,
                                   reinterpret_cast<sockaddr*>(&from.storage), &from.size);
    if (count < 0) return has_no_room(errno) ? void() : broken(reason(errno));
    if (address_of(from) == own_) continue;
    if (const auto frame = unpack_frame(std::span(bytes).first(static_cast<std::size_t>(count))))
      take(*frame);
  }
}

}  // namespace cbcan::io
