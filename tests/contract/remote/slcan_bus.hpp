// SPDX-License-Identifier: MIT
#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <deque>
#include <stdexcept>
#include <string>

#include "contract/remote/child.hpp"
#include "contract/remote/slcan_text.hpp"

namespace cbcan::contract {

inline io::Descriptor connect_to(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  io::Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("no SLCAN adapter at 127.0.0.1:" + std::to_string(port));
  const int on = 1;
  setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return socket;
}

/// The other nodes on a CAN bus: a connection to one of cbcan-sim's SLCAN adapters. Frames are text in candump's
/// format. Throws std::runtime_error if the adapter rejects something or sends nothing for a minute.
struct SlcanBus {
  /// Connects to 127.0.0.1 and opens the channel.
  explicit SlcanBus(std::uint16_t port) : socket_(connect_to(port)) {
    write("O");
    if (!read_line().empty()) throw std::runtime_error("the SLCAN adapter does not open");
  }

  /// Returns when the adapter has sent the frame, and all nodes on cbcan-sim's bus have handled it.
  void send(const std::string& frame) {
    const std::string line = slcan_line(frame);
    write(line);
    read_until(frame.find('#') == 8 ? 'Z' : 'z');
  }

  /// Waits for the adapter's response to a command: all earlier frames of the bus are in the inbox then.
  void settle() {
    write("V");
    read_until('V');
  }

  /// Takes the first frame of the inbox; "" = it is empty.
  std::string take() {
    if (inbox_.empty()) return {};
    std::string frame = inbox_.front();
    inbox_.pop_front();
    return frame;
  }

 private:
  void write(const std::string& line) {
    const std::string text = line + "\r";
    if (::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(text.size()))
      throw std::runtime_error("the SLCAN adapter has gone");
  }
  std::string read_line() {
    std::size_t end = 0;
    while ((end = characters_.find_first_of("\r\a")) == std::string::npos) {
      std::array<char, 4096> part;
      wait_readable(socket_.get(), "the SLCAN adapter");
      const ssize_t count = recv(socket_.get(), part.data(), part.size(), 0);
      if (count <= 0) throw std::runtime_error("the SLCAN adapter has gone");
      characters_.append(part.data(), static_cast<std::size_t>(count));
    }
    if (characters_[end] == '\a') throw std::runtime_error("the SLCAN adapter refuses");
    std::string line = characters_.substr(0, end);
    characters_.erase(0, end + 1);
    return line;
  }
  /// Frames that arrive before it go to the inbox.
  void read_until(char response) {
    for (std::string line = read_line(); !line.starts_with(response); line = read_line())
      if (is_slcan_frame(line)) inbox_.push_back(candump_text(line));
  }

  io::Descriptor socket_;
  std::string characters_;
  std::deque<std::string> inbox_;
};

}  // namespace cbcan::contract
