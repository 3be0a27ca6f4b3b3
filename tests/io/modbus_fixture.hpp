// SPDX-License-Identifier: MIT
#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>

#include "bytes.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "support/catch.hpp"
#include "turns.hpp"

namespace cbcan::io::test {

/// 4168 registers, and a record of the calls.
struct Unit final : protocols::ModbusUnit {
  using Tell = std::function<void(bool valid, const modbus::Range& written)>;
  explicit Unit(Tell tell) : told(std::move(tell)) {}
  std::span<std::uint16_t> registers() override { return words; }
  void advance_due() override { at_catch_up.push_back(words[9]); }
  void on_writer(std::uint32_t client, const modbus::Range& written) override {
    writers.emplace_back(client, written.first);
  }
  void on_request(bool valid, const modbus::Range& written) override { told(valid, written); }
  std::vector<std::uint16_t> words = std::vector<std::uint16_t>(4168);
  std::vector<std::uint16_t> at_catch_up;                      ///< R9
  std::vector<std::pair<std::uint32_t, std::size_t>> writers;  ///< client, first register
  Tell told;
};

/// A server on a free port, with two networks of 4168 registers each, and a record of its calls.
struct Server {
  /// libmodbus's server delays other clients by 450 ms and more.
  static constexpr Time kDelayed = 300 * kMillisecond;

  Reactor reactor;
  std::vector<bool> requests;                  ///< on_request's arguments: did it write something
  std::vector<modbus::Range> written;  ///< what
  std::vector<bool> valid;
  std::vector<std::size_t> networks;  ///< to which
  std::function<void()> on_request;
  Unit first{[this](bool good, const modbus::Range& range) { told(0, good, range); }};
  Unit second{[this](bool good, const modbus::Range& range) { told(1, good, range); }};
  std::vector<std::uint16_t>& registers = first.words;
  std::vector<std::uint16_t>& of_second = second.words;
  std::vector<std::string> warnings;
  ModbusTcp modbus{
      reactor, {&first, &second}, settings(), [this](const std::string& line) { warnings.push_back(line); }};

  void told(std::size_t network, bool good, const modbus::Range& range) {
    networks.push_back(network);
    requests.push_back(range.count != 0);
    written.push_back(range);
    valid.push_back(good);
    if (on_request) on_request();
  }

  static ModbusTcpSettings settings() {
    ModbusTcpSettings settings;
    settings.listen = {"127.0.0.1", 0};
    settings.identity = {"cb", "can", "1.0"};
    return settings;
  }

  /// One turn of the owner's loop, but without waiting: on loopback everything sent has arrived.
  std::size_t turn() {
    modbus.poll(Reactor::now());
    return reactor.poll(0);
  }

  /// Turns until `done`.
  template <typename Done>
  void run_until(Done done) {
    test::turn_until([this] { turn(); }, done);
  }

  void run_until_quiet() {
    while (turn() != 0) {
    }
  }
};

/// A Modbus client that sends exactly the given bytes.
struct Client {
  static constexpr int kSystemBuffer = 0;

  explicit Client(const Server& server, int receive_buffer = kSystemBuffer) : Client(receive_buffer) {
    connect_to(server);
  }

  /// Not connected yet.
  explicit Client(int receive_buffer) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    REQUIRE(socket_);
    if (receive_buffer != kSystemBuffer) set(SOL_SOCKET, SO_RCVBUF, receive_buffer);
    set(IPPROTO_TCP, TCP_NODELAY, 1);
  }

  void connect_to(const Server& server) {
    const SocketAddress address = looked_up("", server.modbus.address());
    REQUIRE(connect(socket_.get(), address.get(), address.size) == 0);
    set(IPPROTO_TCP, TCP_QUICKACK, 0);  // acknowledges late, like a distant client
  }

  void send(const Bytes& bytes) {
    REQUIRE(::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(bytes.size()));
  }
  void send(std::string_view text) { send(hex(text)); }

  /// Everything that has arrived since the last call.
  Bytes take() {
    read();
    return std::exchange(inbox_, {});
  }

  /// True: at least this many bytes have arrived.
  bool has(std::size_t bytes) {
    read();
    return inbox_.size() >= bytes;
  }

  /// The server has closed the connection.
  bool closed() {
    read();
    return closed_;
  }

  void end_sending() { REQUIRE(shutdown(socket_.get(), SHUT_WR) == 0); }
  void leave() { socket_.reset(); }

  /// Aborts the connection: the server gets a reset.
  void slam() {
    const linger at_once{1, 0};
    setsockopt(socket_.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    leave();
  }

 private:
  void set(int level, int option, int value) {
    setsockopt(socket_.get(), level, option, &value, sizeof value);
  }

  void read() {
    std::array<std::uint8_t, 4096> chunk;
    ssize_t count = 0;
    while ((count = recv(socket_.get(), chunk.data(), chunk.size(), MSG_DONTWAIT)) > 0)
      inbox_.insert(inbox_.end(), chunk.begin(), chunk.begin() + count);
    if (count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) closed_ = true;
  }

  Descriptor socket_;
  Bytes inbox_;
  bool closed_ = false;
};

/// Sends one request and returns its response, which is `response_bytes` long.
inline Bytes ask(Server& server, Client& client, std::string_view request, std::size_t response_bytes) {
  client.send(request);
  server.run_until([&] { return client.has(response_bytes) || client.closed(); });
  return client.take();
}

/// Checks that a valid request of `client` is answered without the delay that libmodbus's server would have.
inline void check_served_at_once(Server& server, Client& client) {
  server.registers[100] = 0x1234;
  const Time begin = Reactor::now();
  CHECK(ask(server, client, "BE EF 00 00 00 06 01 03 00 64 00 01", 11) ==
        hex("BE EF 00 00 00 05 01 03 02 12 34"));
  CHECK(Reactor::now() - begin < Server::kDelayed);
}

}  // namespace cbcan::io::test
