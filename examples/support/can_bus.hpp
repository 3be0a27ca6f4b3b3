// SPDX-License-Identifier: MIT
#pragma once

/// A CAN bus for the examples on a PC: an interface of Linux (SocketCAN), whose bit rate and recovery from
/// bus-off `ip link` sets, or an SLCAN adapter at a TCP port, such as that of `cbcan-sim --slcan`.

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "boards/common/slcan_port.hpp"
#include "io/can/can_frames.hpp"

class CanBus final : private cbcan::CanPort {
 public:
  /// The program's arguments are INTERFACE, or HOST and PORT. Ends the program if nothing is there.
  CanBus(int count, char** words) : is_interface_(count == 2) {
    if (count != 2 && count != 3) end(2, std::string("usage: ") + words[0] + " INTERFACE | HOST PORT");
    is_interface_ ? open(words[1]) : connect(words[1], words[2]);
  }
  ~CanBus() { ::close(socket_); }
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;

  cbcan::CanPort& port() { return is_interface_ ? *this : static_cast<cbcan::CanPort&>(adapter_); }
  cbcan::BusState state() const { return is_interface_ ? state_ : adapter_.state(); }
  bool receive(cbcan::Frame& frame) {
    if (!is_interface_) return adapter_.receive(frame);
    can_frame kernel;
    if (::read(socket_, &kernel, sizeof kernel) != sizeof kernel) return false;
    frame = cbcan::io::from_kernel(kernel);
    state_ = cbcan::io::read_error_frame(frame).state.value_or(state_);
    return true;
  }

  static cbcan::Time now() {
    const auto time = std::chrono::steady_clock::now().time_since_epoch();
    return static_cast<cbcan::Time>(time / std::chrono::microseconds(1));
  }

  /// Sends what is queued, and waits for frames or until `due`. Ends the program when the adapter is closed.
  void wait_until(cbcan::Time due) {
    constexpr std::uint32_t kLongestMs = 10;  // then a full interface may have room
    const cbcan::Time at = now();
    if (!is_interface_) due = cbcan::earlier(due, adapter_.poll(at));
    std::string out;
    for (char c; adapter_.next_char(c);)
      out += c;
    if (!out.empty() && ::send(socket_, out.data(), out.size(), MSG_NOSIGNAL) < 0) std::exit(0);
    pollfd readable{socket_, POLLIN, 0};
    if (::poll(&readable, 1, static_cast<int>(cbcan::milliseconds_until(due, at, kLongestMs))) <= 0 ||
        is_interface_)
      return;
    char in[256];
    const ssize_t count = ::recv(socket_, in, sizeof in, 0);
    if (count <= 0) std::exit(0);
    for (ssize_t i = 0; i < count; ++i)
      adapter_.on_char(in[i]);
  }

 private:
  [[noreturn]] static void end(int code, const std::string& why) {
    std::fprintf(stderr, "%s\n", why.c_str());
    std::exit(code);
  }

  void open(const char* interface) {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface));
    socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW);
    const can_err_mask_t errors = CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;
    ::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
    if (address.can_ifindex == 0 ||
        ::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
      end(1, std::string(interface) + ": no such CAN interface; `ip link` lists them");
  }

  void connect(const std::string& host, const std::string& port) {
    addrinfo* found = nullptr;
    if (getaddrinfo(host.c_str(), port.c_str(), nullptr, &found) == 0)
      socket_ = ::socket(found->ai_family, SOCK_STREAM, 0);
    if (socket_ < 0 || ::connect(socket_, found->ai_addr, found->ai_addrlen) != 0)
      end(1, host + " " + port + ": nothing listens there; start cbcan-sim --slcan " + host + ":" + port);
    freeaddrinfo(found);
    adapter_.poll(now());  // opens the adapter before the first frame
  }

  /// The interface's.
  bool try_send(const cbcan::Frame& frame) override {
    const can_frame kernel = cbcan::io::to_kernel(frame);
    return ::write(socket_, &kernel, sizeof kernel) == sizeof kernel;
  }

  const bool is_interface_;
  int socket_ = -1;
  cbcan::BusState state_ = cbcan::BusState::kActive;
  cbcan::boards::SlcanPort adapter_{500};
};
