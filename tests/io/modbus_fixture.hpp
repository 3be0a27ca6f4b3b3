// SPDX-License-Identifier: MIT
#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>

#include "bytes.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "stream_client.hpp"
#include "support/catch.hpp"
#include "support/register_unit.hpp"
#include "turns.hpp"

namespace cbcan::io::test {

/// 4168 registers, and a record of the calls.
struct Unit final : cbcan::test::RegisterUnit {
  using Tell = std::function<void(bool valid, const modbus::Range& written)>;
  explicit Unit(Tell tell, std::size_t registers = 4168)
      : RegisterUnit(std::vector<std::uint16_t>(registers)), told(std::move(tell)) {}
  void on_request(bool valid, const modbus::Range& written) override { told(valid, written); }
  Tell told;
};

/// A server on a free port, with two networks of 4168 registers each, and a record of its calls.
struct Server {
  /// libmodbus's server delays other clients by 450 ms and more.
  static constexpr Time kDelayed = 300 * kMillisecond;

  Reactor reactor;
  std::vector<bool> requests;          ///< on_request's arguments: did it write something
  std::vector<modbus::Range> written;  ///< what
  std::vector<bool> valid;
  std::function<void()> on_request;
  Unit::Tell told = [this](bool good, const modbus::Range& range) {
    requests.push_back(range.count != 0);
    written.push_back(range);
    valid.push_back(good);
    if (on_request) on_request();
  };
  Unit first, second{told};
  std::vector<std::uint16_t>& registers = first.words;
  std::vector<std::uint16_t>& of_second = second.words;
  std::vector<std::string> warnings;
  protocols::ModbusServer protocol{std::array<protocols::ModbusUnit*, 2>{&first, &second},
                                   {"cb", "can", "1.0"}};
  const protocols::ModbusServer::Counters& counters = protocol.counters();
  ModbusTcp modbus{
      reactor, {"127.0.0.1", 0}, protocol, [this](const std::string& line) { warnings.push_back(line); }};

  explicit Server(std::size_t registers_of_first = 4168) : first(told, registers_of_first) {}

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
struct Client : StreamClient {
  static constexpr int kSystemBuffer = 0;

  explicit Client(const Server& server, int receive_buffer = kSystemBuffer) : Client(receive_buffer) {
    connect_to(server);
  }
  /// Not connected yet.
  explicit Client(int receive_buffer) : StreamClient(receive_buffer) {}

  void connect_to(const Server& server) {
    set(IPPROTO_TCP, TCP_NODELAY, 1);
    StreamClient::connect_to(looked_up("", server.modbus.address()));
    set(IPPROTO_TCP, TCP_QUICKACK, 0);  // acknowledges late, like a distant client
  }
  void send(const Bytes& bytes) {
    StreamClient::send({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  void send(std::string_view text) { send(hex(text)); }
  Bytes take() {
    const std::string bytes = StreamClient::take();
    return {bytes.begin(), bytes.end()};
  }
  /// True: at least this many bytes have arrived.
  bool has(std::size_t bytes) { return heard().size() >= bytes; }
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
