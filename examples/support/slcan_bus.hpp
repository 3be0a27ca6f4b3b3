// SPDX-License-Identifier: MIT
#pragma once

/// A CAN bus for the examples on a PC: an SLCAN adapter at a TCP port, such as that of `cbcan-sim --slcan`.

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

class SlcanBus {
 public:
  /// The program's arguments are HOST and PORT. Ends the program if nothing is there.
  SlcanBus(int count, char** words) {
    if (count != 3) {
      std::fprintf(stderr, "usage: %s HOST PORT\n", words[0]);
      std::exit(2);
    }
    addrinfo* found = nullptr;
    if (getaddrinfo(words[1], words[2], nullptr, &found) == 0)
      socket_ = ::socket(found->ai_family, SOCK_STREAM, 0);
    if (socket_ < 0 || ::connect(socket_, found->ai_addr, found->ai_addrlen) != 0) {
      std::fprintf(stderr, "%s %s: nothing listens there; start cbcan-sim --slcan %s:%s\n", words[1],
                   words[2], words[1], words[2]);
      std::exit(1);
    }
    freeaddrinfo(found);
    port_.poll(now());  // opens the adapter before the first frame
  }
  ~SlcanBus() { ::close(socket_); }
  SlcanBus(const SlcanBus&) = delete;
  SlcanBus& operator=(const SlcanBus&) = delete;

  cbcan::CanPort& port() { return port_; }
  cbcan::BusState state() const { return port_.state(); }
  bool receive(cbcan::Frame& frame) { return port_.receive(frame); }

  static cbcan::Time now() {
    const auto time = std::chrono::steady_clock::now().time_since_epoch();
    return static_cast<cbcan::Time>(time / std::chrono::microseconds(1));
  }

  /// Sends what is queued, and waits for characters or until `due`. Ends the program when the adapter is
  /// closed.
  void wait_until(cbcan::Time due) {
    const cbcan::Time at = now();
    due = std::min(due, port_.poll(at));
    std::string out;
    for (char c; port_.next_char(c);)
      out += c;
    if (!out.empty() && ::send(socket_, out.data(), out.size(), MSG_NOSIGNAL) < 0) std::exit(0);
    pollfd readable{socket_, POLLIN, 0};
    if (::poll(&readable, 1, static_cast<int>(cbcan::milliseconds_until(due, at, 1000))) <= 0) return;
    char in[256];
    const ssize_t count = ::recv(socket_, in, sizeof in, 0);
    if (count <= 0) std::exit(0);
    for (ssize_t i = 0; i < count; ++i)
      port_.on_char(in[i]);
  }

 private:
  int socket_ = -1;
  cbcan::boards::SlcanPort port_{500};
};
