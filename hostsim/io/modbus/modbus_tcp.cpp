// SPDX-License-Identifier: MIT
#include "io/modbus/modbus_tcp.hpp"

#include <linux/sockios.h>
#include <modbus.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

namespace cbcan::io {

namespace {

// MBAP header: transaction ID, protocol ID, length of what follows, unit ID.
constexpr std::size_t kProtocolOffset = 2;
constexpr std::size_t kLengthOffset = 4;
constexpr std::size_t kUnitOffset = 6;
constexpr std::size_t kPduOffset = 7;
constexpr std::size_t kMinLength = 2;
constexpr std::size_t kMaxLength = 1 + kMaxPduBytes;
constexpr std::size_t kMaxAduBytes = kUnitOffset + kMaxLength;
constexpr std::size_t kMinResponseBytes = kPduOffset + 2;

// Messaging on TCP/IP V1.0b, 4.4.2.1: either stands for the server itself where there is nothing to select.
constexpr std::uint8_t kUnitOfServer = 0xFF;
constexpr std::uint8_t kUnitOfServerToo = 0;

// More than the kernel charges for one small segment with its bookkeeping.
constexpr int kSendBufferPerResponse = 4096;

std::size_t word(std::span<const std::uint8_t> bytes, std::size_t offset) {
  return static_cast<std::size_t>(bytes[offset] << 8 | bytes[offset + 1]);
}

/// Place of the network that a unit ID selects; there may be none.
std::size_t network_of(std::uint8_t unit) {
  return unit == kUnitOfServer || unit == kUnitOfServerToo ? 0 : std::size_t{unit} - 1;
}

/// Of a listener, and of every socket that it accepts.
int send_buffer_bytes(int listener) {
  int bytes = 0;
  socklen_t size = sizeof bytes;
  getsockopt(listener, SOL_SOCKET, SO_SNDBUF, &bytes, &size);
  return bytes;
}

}  // namespace

/// One context for all clients, answering to the socket that it is told.
struct ModbusTcp::Libmodbus {
  Libmodbus();

  bool reply(int socket, Bytes request, Registers registers) {
    mapping.nb_registers = static_cast<int>(registers.size());
    mapping.tab_registers = registers.data();
    mapping.nb_input_registers = mapping.nb_registers;
    mapping.tab_input_registers = mapping.tab_registers;
    modbus_set_socket(context.get(), socket);
    return modbus_reply(context.get(), request.data(), static_cast<int>(request.size()), &mapping) > 0;
  }

  struct Free {
    void operator()(modbus_t* unused) const { modbus_free(unused); }
  };
  std::unique_ptr<modbus_t, Free> context{modbus_new_tcp("127.0.0.1", 0)};
  modbus_mapping_t mapping{};
  std::array<Descriptor, 2> tray;  ///< socket pair in which it leaves a response that cannot go out at once
};

ModbusTcp::Libmodbus::Libmodbus() {
  int pair[2];
  if (!context || socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) != 0)
    throw EnvironmentError("modbus: " + reason(errno));
  tray = {Descriptor(pair[0]), Descriptor(pair[1])};
  // It sleeps this long before it refuses a request. It is given none to refuse; should it find one, it must
  // not hold up the others.
  modbus_set_response_timeout(context.get(), 0, 1);
}

struct ModbusTcp::Connection {
  explicit Connection(Descriptor accepted) : socket(std::move(accepted)) {}

  Descriptor socket;
  std::uint32_t number = 0;
  std::string peer;
  std::size_t received = 0;
  std::uint64_t unconfirmed = 0;     ///< responses sent since the client was last known to have got them all
  Time deadline = kNever;            ///< of the half request in the buffer
  std::vector<std::uint8_t> unsent;  ///< while not empty, nothing is read from this client
  std::array<std::uint8_t, kMaxAduBytes> buffer;
};

ModbusTcp::ModbusTcp(Reactor& reactor, std::vector<ModbusUnit*> networks, ModbusTcpSettings settings,
                     Warn warn)
    : reactor_(reactor),
      settings_(std::move(settings)),
      networks_(std::move(networks)),
      libmodbus_(std::make_unique<Libmodbus>()),
      acceptor_(
          reactor, "modbus", {"", settings_.listen}, [this](Descriptor socket) { adopt(std::move(socket)); },
          [this] { return clients(); }, std::move(warn)) {
  const int bytes = send_buffer_bytes(acceptor_.listener().socket());
  direct_responses_ = static_cast<std::uint64_t>(bytes / kSendBufferPerResponse);
}

ModbusTcp::~ModbusTcp() {
  for (const auto& [fd, client] : connections_)
    reactor_.forget(fd);
}

void ModbusTcp::poll(Time now) {
  while (next_deadline() <= now) {
    ++counters_.half_requests;
    close_client(*connections_.at(deadlines_.begin()->second));
  }
}

void ModbusTcp::adopt(Descriptor socket) {
  const int fd = socket.get();
  auto made = std::make_unique<Connection>(std::move(socket));
  reactor_.watch(fd, Reactor::kReadable, [this, &client = *made](std::uint32_t) {
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

/// This and the functions below are false when the connection is to be closed.
bool ModbusTcp::on_ready(Connection& client) {
  if (client.unsent.empty()) return receive(client);
  if (!send_rest(client)) return false;
  if (!client.unsent.empty()) return true;
  return reactor_.change(client.socket.get(), Reactor::kReadable) && serve_buffered(client);
}

/// One read per turn, of at most one buffer: what is left in the socket waits for the next turn, after the
/// others.
bool ModbusTcp::receive(Connection& client) {
  const ssize_t count = ::recv(client.socket.get(), client.buffer.data() + client.received,
                               client.buffer.size() - client.received, 0);
  if (count > 0) {
    client.received += static_cast<std::size_t>(count);
    return serve_buffered(client);
  }
  if (count == 0) return false;
  if (errno == EAGAIN || errno == EINTR) return true;
  ++counters_.broken;
  return false;
}

bool ModbusTcp::serve_buffered(Connection& client) {
  Bytes rest(client.buffer.data(), client.received);
  while (client.unsent.empty() && rest.size() >= kUnitOffset) {
    const std::size_t length = word(rest, kLengthOffset);
    if (word(rest, kProtocolOffset) != 0 || length < kMinLength || length > kMaxLength) {
      ++counters_.bad_frames;
      return false;
    }
    if (rest.size() < kUnitOffset + length) break;
    if (!serve(client, rest.first(kUnitOffset + length))) return false;
    rest = rest.subspan(kUnitOffset + length);
  }
  std::copy(rest.begin(), rest.end(), client.buffer.begin());
  client.received = rest.size();
  const bool half = !rest.empty() && client.unsent.empty();
  set_deadline(client, half ? Reactor::now() + settings_.half_request_timeout : kNever);
  return true;
}

bool ModbusTcp::serve(Connection& client, Bytes request) {
  const Bytes pdu = request.subspan(kPduOffset);
  const std::size_t network = network_of(request[kUnitOffset]);
  const Registers registers = network < networks_.size() ? networks_[network]->registers() : Registers();
  const bool reached = !registers.empty();
  const ModbusException exception =
      reached ? check_request(pdu, registers.size()) : ModbusException::kGatewayPathUnavailable;
  ++counters_.requests;
  const bool alive = respond(client, request, registers, exception);
  const bool valid = exception == ModbusException::kNone;
  if (reached && networks_[network]->listens()) tell(client, request, *networks_[network], exception);
  if (reached) networks_[network]->on_request(valid, valid ? written_by(pdu) : ModbusRange());
  return alive;
}

void ModbusTcp::tell(const Connection& client, Bytes request, ModbusUnit& unit,
                     ModbusException exception) const {
  const Bytes pdu = request.subspan(kPduOffset);
  const ModbusResponse response =
      exception != ModbusException::kNone ? exception_response(pdu[0], exception)
      : pdu[0] == static_cast<std::uint8_t>(ModbusFunction::kEncapsulatedInterface)
          ? identification_response(pdu, settings_.identity)
          : register_response(pdu, unit.registers());
  unit.on_exchange({client.number, static_cast<std::uint16_t>(word(request, 0)), request[kUnitOffset],
                    static_cast<std::uint8_t>(exception), pdu, Bytes(response.bytes).first(response.size)});
}

bool ModbusTcp::respond(Connection& client, Bytes request, Registers registers, ModbusException exception) {
  const Bytes pdu = request.subspan(kPduOffset);
  if (exception != ModbusException::kNone) {
    ++counters_.exceptions;
    return send_own(client, request, exception_response(pdu[0], exception));
  }
  if (pdu[0] == static_cast<std::uint8_t>(ModbusFunction::kEncapsulatedInterface))
    return send_own(client, request, identification_response(pdu, settings_.identity));
  return respond_by_libmodbus(client, request, registers);
}

/// libmodbus sends a response itself and cannot tell how much of it went out. So it may do that only where
/// the socket has room for certain; else it leaves the response in the tray, and we send it piece by piece.
bool ModbusTcp::respond_by_libmodbus(Connection& client, Bytes request, Registers registers) {
  if (has_room(client)) {
    ++client.unconfirmed;
    if (libmodbus_->reply(client.socket.get(), request, registers)) return true;
    ++counters_.broken;
    return false;
  }
  std::array<std::uint8_t, kMaxAduBytes> response;
  if (!libmodbus_->reply(libmodbus_->tray[0].get(), request, registers)) return false;
  const ssize_t size = ::recv(libmodbus_->tray[1].get(), response.data(), response.size(), 0);
  return size > 0 && send(client, Bytes(response.data(), static_cast<std::size_t>(size)));
}

bool ModbusTcp::send_own(Connection& client, Bytes request, const ModbusResponse& response) {
  std::array<std::uint8_t, kMaxAduBytes> bytes;
  std::copy_n(request.begin(), kPduOffset, bytes.begin());
  const std::size_t length = 1 + response.size;
  bytes[kLengthOffset] = static_cast<std::uint8_t>(length >> 8);
  bytes[kLengthOffset + 1] = static_cast<std::uint8_t>(length);
  std::copy_n(response.bytes.begin(), response.size, bytes.begin() + kPduOffset);
  return send(client, Bytes(bytes).first(kPduOffset + response.size));
}

bool ModbusTcp::send(Connection& client, Bytes bytes) {
  client.unsent.assign(bytes.begin(), bytes.end());
  ++client.unconfirmed;
  if (!send_rest(client)) return false;
  if (client.unsent.empty()) return true;
  ++counters_.waits_for_room;
  return reactor_.change(client.socket.get(), Reactor::kWritable);
}

bool ModbusTcp::send_rest(Connection& client) {
  const ssize_t count = ::send(client.socket.get(), client.unsent.data(), client.unsent.size(), MSG_NOSIGNAL);
  if (count >= 0) {
    client.unsent.erase(client.unsent.begin(), client.unsent.begin() + count);
    return true;
  }
  if (errno == EAGAIN || errno == EINTR) return true;
  ++counters_.broken;
  return false;
}

/// Counts responses rather than asking the kernel before each: a client that waits for its responses costs
/// one question in `direct_responses_` requests.
bool ModbusTcp::has_room(Connection& client) const {
  if (client.unconfirmed < direct_responses_) return true;
  int bytes = 0;
  if (ioctl(client.socket.get(), SIOCOUTQ, &bytes) != 0) return false;
  const std::uint64_t most = (static_cast<std::uint64_t>(bytes) + kMinResponseBytes - 1) / kMinResponseBytes;
  client.unconfirmed = std::min(client.unconfirmed, most);
  return client.unconfirmed < direct_responses_;
}

void ModbusTcp::set_deadline(Connection& client, Time deadline) {
  if (client.deadline == deadline) return;
  const int fd = client.socket.get();
  if (client.deadline != kNever) deadlines_.erase({client.deadline, fd});
  if (deadline != kNever) deadlines_.insert({deadline, fd});
  client.deadline = deadline;
}

}  // namespace cbcan::io
