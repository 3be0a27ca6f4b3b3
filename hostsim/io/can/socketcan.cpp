// SPDX-License-Identifier: MIT
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "io/can/can_frames.hpp"
#include "io/can/outside_bus.hpp"
#include "io/loop/system.hpp"
#include "io/sockets/listener.hpp"

namespace cbcan::io {

namespace {

constexpr int kReceiveBufferBytes = 8 * 1024 * 1024;
constexpr std::size_t kFramesPerRead = 32;
constexpr int kReadsPerTurn = 16;
constexpr can_err_mask_t kWantedErrors = CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;

Descriptor new_can_socket() {
  return Descriptor(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
}

bool bind_to(int socket, unsigned index) {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  return bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

void prepare(int socket) {
  const int on = 1;
  const int bytes = kReceiveBufferBytes;
  setsockopt(socket, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
  setsockopt(socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &kWantedErrors, sizeof kWantedErrors);
  if (setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0)
    setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
}

bool is_up(int any_socket, const std::string& interface) {
  ifreq request{};
  interface.copy(request.ifr_name, sizeof request.ifr_name - 1);
  return ioctl(any_socket, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0;
}

/// Buffers for one recvmmsg(), with the kernel's count of dropped frames for each frame.
class Batch {
 public:
  Batch() {
    for (std::size_t i = 0; i < kFramesPerRead; ++i) {
      parts_[i] = {&frames_[i], sizeof frames_[i]};
      msghdr& header = messages_[i].msg_hdr;
      header.msg_iov = &parts_[i];
      header.msg_iovlen = 1;
      header.msg_control = controls_[i].bytes;
      header.msg_controllen = sizeof controls_[i].bytes;
    }
  }

  int read(int socket) { return recvmmsg(socket, messages_.data(), kFramesPerRead, 0, nullptr); }

  bool whole(std::size_t i) const { return messages_[i].msg_len == CAN_MTU; }
  const can_frame& frame(std::size_t i) const { return frames_[i]; }

  /// Frames dropped since the socket was opened; `before` if the message has no count.
  std::uint32_t lost_total(std::size_t i, std::uint32_t before) {
    msghdr& header = messages_[i].msg_hdr;
    for (cmsghdr* control = CMSG_FIRSTHDR(&header); control != nullptr;
         control = CMSG_NXTHDR(&header, control))
      if (control->cmsg_level == SOL_SOCKET && control->cmsg_type == SO_RXQ_OVFL)
        std::memcpy(&before, CMSG_DATA(control), sizeof before);
    return before;
  }

 private:
  struct alignas(cmsghdr) Control {
    char bytes[CMSG_SPACE(sizeof(std::uint32_t))];
  };

  std::array<can_frame, kFramesPerRead> frames_;
  std::array<iovec, kFramesPerRead> parts_;
  std::array<Control, kFramesPerRead> controls_;
  std::array<mmsghdr, kFramesPerRead> messages_{};
};

bool interface_deleted(int error) {
  return error == ENODEV || error == ENXIO || error == EBADF;
}

std::string none_such(const std::string& interface) {
  return "no such interface; `ip link` lists them; for a virtual one: ip link add dev " + interface +
         " type vcan && ip link set " + interface + " up";
}

std::string is_down(const std::string& interface) {
  return "the interface is down; `ip link set " + interface + " up` brings it up";
}

class SocketCan final : public OutsideBus {
 public:
  SocketCan(Reactor& reactor, sim::Bus& bus, const std::string& interface, Warn warn)
      : OutsideBus(reactor, bus, "socketcan:" + interface, std::move(warn)), interface_(interface) {
    if (!new_can_socket())
      throw EnvironmentError(
          where_ + "this kernel has no CAN (" + reason(errno) +
          "); `tools/dev/in-vcan-vm COMMAND` runs a command where there is vcan0, and the virtual "
          "bus needs no kernel");
    const unsigned index = if_nametoindex(interface_.c_str());
    if (index == 0) throw EnvironmentError(where_ + none_such(interface_));
    open_socket(index);
    if (!socket_)
      throw EnvironmentError(where_ + "not a CAN interface (" + reason(errno) +
                             "); `ip link show type can` and `ip link show type vcan` list those");
    watch_links();
    const bool up = is_up(socket_.get(), interface_);
    seen_ = up ? Interface::kUp : Interface::kDown;
    if (!up) warn_(where_ + is_down(interface_));
    bus_.set_link(up);
  }

  ~SocketCan() override {
    close_socket();
    reactor_.forget(links_.get());
  }

  /// False = no room now; next_deadline() is when to advance the bus again.
  bool transmit(const Frame& frame) override {
    const can_frame kernel = to_kernel(frame);
    if (::write(socket_.get(), &kernel, sizeof kernel) == sizeof kernel) return true;
    if (is_temporary(errno) || errno == ENOBUFS || errno == ENOMEM) {  // the kernel's queues are full
      retry_at_ = reactor_.time() + kFrameRetry;
      return false;
    }
    if (errno != ENETDOWN && !interface_deleted(errno))
      return true;  // rejected by the kernel: the frame is lost
    if (errno != ENETDOWN) index_ = 0;
    check_interface_ = true;  // in poll(): the bus must not be called back from here
    return false;
  }

  void poll(Time now) override {
    if (check_interface_) {
      note(away(), now);  // transmit() failed, even if the interface is up again
      check_interface(now);
    }
    if (retry_at_ <= now) {
      retry_at_ = kNever;
      bus_.resume();
    }
    if (overflow_until_ > now) return;
    overflow_until_ = kNever;
    tell_state(now);
  }

  Time next_deadline() const override { return check_interface_ ? 0 : earlier(retry_at_, overflow_until_); }

 private:
  enum class Interface { kUp, kDown, kGone };

  void open_socket(unsigned index) {
    Descriptor socket = new_can_socket();
    if (!socket) return;
    prepare(socket.get());
    if (!bind_to(socket.get(), index)) return;
    socket_ = std::move(socket);
    index_ = index;
    lost_total_ = 0;
    reactor_.watch(socket_.get(), Reactor::kReadable, [this](std::uint32_t) { receive(); });
  }

  void close_socket() {
    reactor_.forget(socket_.get());
    socket_.reset();
    index_ = 0;
  }

  void watch_links() {
    links_ = Descriptor(socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE));
    sockaddr_nl address{};
    address.nl_family = AF_NETLINK;
    address.nl_groups = RTMGRP_LINK;
    if (!links_ || bind(links_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw EnvironmentError(where_ + "cannot watch the interface: " + reason(errno));
    reactor_.watch(links_.get(), Reactor::kReadable, [this](std::uint32_t) { on_link_change(); });
  }

  /// The messages only wake the loop: some may be lost, so the interface's present state is read.
  void on_link_change() {
    std::array<char, 8192> ignored;
    while (::recv(links_.get(), ignored.data(), ignored.size(), 0) > 0 || errno == ENOBUFS) {
    }
    check_interface(reactor_.time());
  }

  void check_interface(Time now) {
    check_interface_ = false;
    // After a short interruption the socket has an error, which the next frame would report otherwise.
    const int error = socket_ ? take_error(socket_.get()) : 0;
    if (error != 0) note(away(), now);
    if (interface_deleted(error)) index_ = 0;
    const unsigned index = if_nametoindex(interface_.c_str());
    if (index != index_) {
      close_socket();
      if (index != 0) open_socket(index);
    }
    note(socket_ && is_up(socket_.get(), interface_) ? Interface::kUp : away(), now);
  }

  Interface away() const {
    return if_nametoindex(interface_.c_str()) == 0 ? Interface::kGone : Interface::kDown;
  }

  void note(Interface seen, Time now) {
    if (seen == seen_) return;
    seen_ = seen;
    state_ = BusState::kActive;  // a restarted controller has no errors
    tell_state(now);
    bus_.set_link(seen == Interface::kUp);
    switch (seen) {
      case Interface::kUp: return warn_(where_ + "the interface is up again");
      case Interface::kDown: return warn_(where_ + is_down(interface_));
      case Interface::kGone: return warn_(where_ + none_such(interface_));
    }
  }

  /// Bounded, so that a burst of frames does not delay the rest of the loop.
  void receive() {
    const Time now = reactor_.time();
    for (int i = 0; i < kReadsPerTurn; ++i)
      if (receive_batch(now) < kFramesPerRead) return;
  }

  std::size_t receive_batch(Time now) {
    Batch batch;
    const int count = batch.read(socket_.get());
    if (count < 0) {
      const bool deleted = interface_deleted(errno);
      if (!deleted && errno != ENETDOWN) return 0;
      if (deleted) index_ = 0;
      note(away(), now);  // the interface may be up again, but its interruption is reported here only
      check_interface(now);
      return 0;
    }
    const auto frames = static_cast<std::size_t>(count);
    for (std::size_t i = 0; i < frames; ++i) {
      note_lost(batch.lost_total(i, lost_total_), now);
      if (batch.whole(i)) take(from_kernel(batch.frame(i)), now);
    }
    return frames;
  }

  void take(const Frame& frame, Time now) {
    if ((frame.flags & Frame::kError) != 0) {
      const ControllerReport report = read_error_frame(frame);
      if (report.state) state_ = *report.state;
      if (report.overflow) overflow_until_ = now + kOverflowShown;
      tell_state(now);
    }
    bus_.receive(frame, now);
  }

  void note_lost(std::uint32_t total, Time now) {
    if (total == lost_total_) return;
    lost_total_ = total;
    overflow_until_ = now + kOverflowShown;
    tell_state(now);
  }

  void tell_state(Time now) {
    const BusState overflow = overflow_until_ == kNever ? BusState::kActive : BusState::kOverflow;
    bus_.set_state(std::max(state_, overflow), now);
  }

  std::string interface_;
  Descriptor links_;  ///< netlink: readable when any interface has changed
  Descriptor socket_;
  unsigned index_ = 0;  ///< of the interface that the socket is bound to; 0 = none
  Interface seen_ = Interface::kUp;
  bool check_interface_ = false;
  BusState state_ = BusState::kActive;  ///< without overflow
  std::uint32_t lost_total_ = 0;        ///< the socket's count
  Time overflow_until_ = kNever;        ///< kNever = no overflow is shown
  Time retry_at_ = kNever;
};

}  // namespace

std::unique_ptr<OutsideBus> socketcan_bus(Reactor& reactor, sim::Bus& bus, const std::string& interface,
                                          Warn warn) {
  return std::make_unique<SocketCan>(reactor, bus, interface, std::move(warn));
}

}  // namespace cbcan::io
