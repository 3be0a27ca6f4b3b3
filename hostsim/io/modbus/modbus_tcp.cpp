// SPDX-License-Identifier: MIT
#include "io/modbus/modbus_tcp.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "cbcan/regmap.hpp"

namespace cbcan::io {

namespace {

// MBAP header: transaction ID, protocol ID, length of what follows, unit ID; then the PDU.
constexpr std::size_t kProtocolOffset = 2;
constexpr std::size_t kLengthOffset = 4;
constexpr std::size_t kUnitOffset = 6;
constexpr std::size_t kLeast = 8;  // with a function code

// Messaging on TCP/IP V1.0b, 4.4.2.1: either one means the server itself.
constexpr std::uint8_t kUnitOfServer = 0xFF;
constexpr std::uint8_t kUnitOfServerToo = 0;

}  // namespace

struct ModbusTcp::Connection {
  explicit Connection(Descriptor accepted) : socket(std::move(accepted)) {}

  Descriptor socket;
  std::uint32_t number = 0;
  std::string peer;
  std::size_t received = 0;
  Time deadline = kNever;            ///< of an incomplete request in the buffer
  std::vector<std::uint8_t> unsent;  ///< while not empty, nothing is read from this client
  std::array<std::uint8_t, kMaxAdu> buffer;
};

ModbusTcp::ModbusTcp(Reactor& reactor, const std::vector<adapters::ModbusUnit*>& networks,
                     ModbusTcpSettings settings, Warn warn)
    : reactor_(reactor),
      settings_(std::move(settings)),
      acceptor_(reactor, "modbus", {"", settings_.listen}, *this, std::move(warn)) {
  for (std::size_t i = 0; i < networks.size(); ++i)
    served_[i + 1] = {networks[i], networks[i]->registers()};
  served_[kUnitOfServer] = served_[kUnitOfServerToo] = served_[1];
}

ModbusTcp::~ModbusTcp() {
  for (const auto& [fd, client] : connections_)
    reactor_.forget(fd);
}

void ModbusTcp::poll(Time now) {
  while (next_deadline() <= now)
    close_client(*connections_.at(deadlines_.begin()->second));
}

void ModbusTcp::adopt(Descriptor socket) {
  const int fd = socket.get();
  auto made = std::make_unique<Connection>(std::move(socket));
  reactor_.watch(fd, Reactor::kReadable | Reactor::kUrgent, [this, &client = *made](std::uint32_t) {
    if (!on_ready(client)) close_client(client);
  });
  made->number = static_cast<std::uint32_t>(++counters_.connections);
  if (on_client) on_client(made->number, made->peer = peer_of(fd), true);
  connections_[fd] = std::move(made);
}

void ModbusTcp::close_client(Connection& client) {
  set_deadline(client, kNever);
  if (on_client) on_client(client.number, client.peer, false);
  reactor_.forget(client.socket.get());
  connections_.erase(client.socket.get());
}

/// This and the functions below return false when the connection is to be closed. Flattened for speed: everything
/// a request passes is one function, with modbus_request.cpp's if that is compiled together with this file.
[[gnu::flatten]] bool ModbusTcp::on_ready(Connection& client) {
  if (client.unsent.empty()) return receive(client);
  if (!send_rest(client)) return false;
  if (!client.unsent.empty()) return true;
  return reactor_.change(client.socket.get(), Reactor::kReadable) && advance(client);
}

/// One read per turn, of at most one buffer: the rest waits in the socket until the other clients have been
/// served.
inline bool ModbusTcp::receive(Connection& client) {
  const ssize_t count = ::recv(client.socket.get(), client.buffer.data() + client.received,
                               client.buffer.size() - client.received, 0);
  if (count <= 0) return count < 0 && is_temporary(errno);
  client.received += static_cast<std::size_t>(count);
  return advance(client);
}

bool ModbusTcp::advance(Connection& client) {
  const std::uint8_t* rest = client.buffer.data();
  while (client.received >= kUnitOffset && client.unsent.empty()) {
    const std::size_t size = kUnitOffset + adapters::word({rest, kUnitOffset}, kLengthOffset);
    if (adapters::word({rest, kUnitOffset}, kProtocolOffset) != 0 || size < kLeast || size > kMaxAdu) return false;
    if (client.received < size) break;
    if (!execute(client, {rest, size})) return false;
    rest += size;
    client.received -= size;
  }
  if (client.received != 0) std::memmove(client.buffer.data(), rest, client.received);
  const bool half = client.received != 0 && client.unsent.empty();
  if (half || client.deadline != kNever)
    set_deadline(client, half ? reactor_.time() + settings_.half_request_timeout : kNever);
  return true;
}

inline bool ModbusTcp::execute(Connection& client, Bytes bytes) {
  const Bytes pdu = bytes.subspan(kPduOffset);
  const Served to = served_[bytes[kUnitOffset]];
  const bool reached = !to.registers.empty();
  const adapters::ModbusRequest request =
      reached ? adapters::look_at_request(pdu, to.registers.size())
              : adapters::ModbusRequest{adapters::ModbusException::kGatewayPathUnavailable};
  ++counters_.requests;
  if (request.written.count != 0) {
    to.unit->advance_due();
    const auto [first, count] = request.written;
    const bool window =
        first >= regmap::kWindowFirst && first + count <= regmap::kWindowFirst + regmap::kWindowWords;
    if (!window) to.unit->on_writer(client.number, request.written);
  }
  if (request.read.first + request.read.count > regmap::kDiagnosticsFirst) to.unit->on_diagnostics();
  const Bytes response = respond(bytes, request, to.registers);
  const bool alive = send(client, response);
  if (!reached) return alive;
  if (to.unit->listens())
    to.unit->on_exchange({client.number, static_cast<std::uint16_t>(adapters::word(bytes, 0)),
                          bytes[kUnitOffset], static_cast<std::uint8_t>(request.exception), pdu,
                          response.subspan(kPduOffset)});
  to.unit->on_request(request.exception == adapters::ModbusException::kNone, request.written);
  return alive;
}

inline ModbusTcp::Bytes ModbusTcp::respond(Bytes bytes, const adapters::ModbusRequest& request,
                                           std::span<std::uint16_t> registers) {
  const Bytes pdu = bytes.subspan(kPduOffset);
  const adapters::ModbusResponse response = std::span(response_).last<adapters::kMaxPduBytes>();
  std::size_t size = 0;
  if (request.exception != adapters::ModbusException::kNone) {
    ++counters_.exceptions;
    size = adapters::exception_response(pdu[0], request.exception, response);
  } else if (pdu[0] == static_cast<std::uint8_t>(adapters::ModbusFunction::kEncapsulatedInterface)) {
    size = modbus::identification_response(pdu, settings_.identity, response);
  } else {
    size = adapters::execute(pdu, request, registers, response);
  }
  std::memcpy(response_.data(), bytes.data(), kPduOffset);
  response_[kLengthOffset] = static_cast<std::uint8_t>((1 + size) >> 8);
  response_[kLengthOffset + 1] = static_cast<std::uint8_t>(1 + size);
  return Bytes(response_).first(kPduOffset + size);
}

inline bool ModbusTcp::send(Connection& client, Bytes bytes) {
  if (!send_some(client, bytes)) return false;
  if (bytes.empty()) return true;
  client.unsent.assign(bytes.begin(), bytes.end());
  ++counters_.waits_for_room;
  return reactor_.change(client.socket.get(), Reactor::kWritable);
}

bool ModbusTcp::send_rest(Connection& client) {
  Bytes rest(client.unsent);
  if (!send_some(client, rest)) return false;
  client.unsent.assign(rest.begin(), rest.end());
  return true;
}

/// Reduces `rest` to what the connection has no room for.
inline bool ModbusTcp::send_some(Connection& client, Bytes& rest) {
  const ssize_t count = ::send(client.socket.get(), rest.data(), rest.size(), MSG_NOSIGNAL);
  if (count < 0) return is_temporary(errno);
  rest = rest.subspan(static_cast<std::size_t>(count));
  return true;
}

void ModbusTcp::set_deadline(Connection& client, Time deadline) {
  if (client.deadline == deadline) return;
  const int fd = client.socket.get();
  if (client.deadline != kNever) deadlines_.erase({client.deadline, fd});
  if (deadline != kNever) deadlines_.insert({deadline, fd});
  client.deadline = deadline;
}

}  // namespace cbcan::io
