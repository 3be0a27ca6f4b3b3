// SPDX-License-Identifier: MIT
// Any bytes, in any pieces, to the Modbus TCP server: its responses and registers are those of the model,
// byte for byte, and it closes the connection if and only if the model does.
//
// The input is a list of pieces, each after two bytes: flags with the number of repetitions, and length.
#include <sys/socket.h>

#include <cerrno>

#include "fuzz/fuzz.hpp"
#include "fuzz/modbus_model.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "support/register_unit.hpp"

namespace cbcan::fuzz {

namespace {

using Bytes = ModbusModel::Bytes;
using View = ModbusModel::View;

constexpr std::uint8_t kIsPdu = 1;    ///< the piece is sent as one request with a good header
constexpr std::uint8_t kKeepOut = 2;  ///< the client does not read the responses yet
constexpr std::uint8_t kGather = 4;   ///< the server receives this piece together with the next
constexpr std::array<std::uint8_t, 3> kUnits{1, 0, 255};
constexpr unsigned kRepeatShift = 3;
constexpr unsigned kMostPieces = 400;  ///< of one input

/// Exists as long as the program: a listener for each input would cost more than everything else.
struct Server final : test::RegisterUnit {
  Server() : RegisterUnit(std::vector<std::uint16_t>(ModbusModel::kRegisters)) {}
  void on_request(bool, const modbus::Range&) override { ++requests; }

  io::Reactor reactor;
  std::size_t requests = 0;
  protocols::ModbusServer protocol{std::array<protocols::ModbusUnit*, 1>{this}, {"cb", "can", "1.0"}};
  io::ModbusTcp modbus{reactor, {"127.0.0.1", 0}, protocol, [](const std::string&) {}};
};

Server& server() {
  static Server the_server;
  return the_server;
}

struct Run {
  Run() {
    std::ranges::copy(kAtStart, server().words.begin());
    server().requests = 0;
    int pair[2];
    require(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) == 0,
            "there are sockets");
    client_ = io::Descriptor(pair[0]);
    server().modbus.adopt(io::Descriptor(pair[1]));
  }

  void piece(std::uint8_t flags, View bytes) {
    if ((flags & kIsPdu) != 0) {
      send(with_header(bytes));
    } else {
      send(bytes);
    }
    if ((flags & kGather) != 0) return;
    server().reactor.poll(0);
    if ((flags & kKeepOut) == 0) take();
  }

  void end() {
    do {
      take();
    } while (server().reactor.poll(0) != 0);
    take();
    require(taken_ == model_.responses(), "each request has its own response, and nothing else comes");
    require(server().words == model_.registers, "the registers are those that were written");
    require(server().requests == model_.requests(), "each request to the network is reported once");
    require(closed_ == model_.closed(), "closed is what cannot be Modbus, and only that");
    check_half_request();
    client_.reset();
    server().reactor.poll(0);
    require(server().modbus.clients() == 0, "a client that has gone is forgotten");
  }

 private:
  /// Transaction IDs are all different; the unit IDs are those of the network.
  Bytes with_header(View pdu) {
    const auto length = static_cast<std::uint16_t>(pdu.size() + 1);
    ++transaction_;
    Bytes request{static_cast<std::uint8_t>(transaction_ >> 8),
                  static_cast<std::uint8_t>(transaction_),
                  0,
                  0,
                  static_cast<std::uint8_t>(length >> 8),
                  static_cast<std::uint8_t>(length),
                  kUnits[transaction_ % kUnits.size()]};
    request.insert(request.end(), pdu.begin(), pdu.end());
    return request;
  }

  /// Reads the responses if the server accepts no more bytes.
  void send(View bytes) {
    while (!bytes.empty() && !closed_) {
      const ssize_t sent = ::send(client_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent < 0) {
        take();
        server().reactor.poll(0);
        continue;
      }
      model_.receive(bytes.first(static_cast<std::size_t>(sent)));
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
  }

  void take() {
    std::array<std::uint8_t, 4096> chunk;
    ssize_t count = 0;
    while ((count = recv(client_.get(), chunk.data(), chunk.size(), 0)) > 0)
      taken_.insert(taken_.end(), chunk.begin(), chunk.begin() + count);
    closed_ = closed_ || count == 0 || errno == ECONNRESET;
  }

  void check_half_request() {
    io::ModbusTcp& modbus = server().modbus;
    require((modbus.next_deadline() != kNever) == model_.waits(),
            "half a request, and only that, has a deadline");
    if (model_.waits()) modbus.poll(modbus.next_deadline());
    require(modbus.clients() == (closed_ || model_.waits() ? 0 : 1), "half a request ends with its deadline");
  }

  ModbusModel model_{kAtStart};
  io::Descriptor client_;
  Bytes taken_;
  std::uint16_t transaction_ = 0xFFF0;
  bool closed_ = false;
};

}  // namespace

void run(Input input) {
  Run run;
  unsigned pieces_left = kMostPieces;
  while (input.rest().size() >= 2) {
    const std::uint8_t flags = input.byte();
    const View piece = input.take(input.byte());
    for (unsigned again = flags >> kRepeatShift; pieces_left > 0; --again, --pieces_left) {
      run.piece(flags, piece);
      if (again == 0) break;
    }
  }
  run.end();
}

}  // namespace cbcan::fuzz
