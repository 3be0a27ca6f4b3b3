// SPDX-License-Identifier: MIT
#pragma once

/// Modbus without sockets and serial ports: units, and servers of them by TCP and RTU.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cbcan/modbus/executor.hpp"
#include "cbcan/modbus/identification.hpp"
#include "cbcan/modbus/rtu_server.hpp"
#include "cbcan/time.hpp"
#include "protocols/stream_session.hpp"

namespace cbcan::protocols {

/// A Modbus request that has been answered.
struct ModbusExchange {
  std::uint32_t client;  ///< its number in events; 0 = a line, which has no clients
  std::uint16_t id;      ///< transaction ID of the MBAP header; 0 over RTU
  std::uint8_t unit;
  std::uint8_t exception;                  ///< 0 = none
  std::span<const std::uint8_t> request;   ///< PDU
  std::span<const std::uint8_t> response;  ///< PDU
};

/// A request to a unit.
struct ModbusRequest {
  std::uint32_t client = 0;  ///< as in ModbusExchange
  std::uint16_t id = 0;
  std::uint8_t unit = 0;  ///< on a line 0 is all stations, and none of them responds
  modbus::Pdu pdu{};
  const modbus::MoreFunctions* more = nullptr;  ///< the server's own; null = the unit's

  bool is_on_line() const { return client == 0; }
};

/// What a unit ID selects: a network's registers.
class ModbusUnit {
 public:
  /// Always the same words; empty = the unit ID selects nothing.
  virtual std::span<std::uint16_t> registers() = 0;

  /// For the PDU of a response.
  using Room = std::span<std::uint8_t, modbus::kMaxPdu>;
  /// Executes a request with all its effects. Writes the PDU of the response into `room` and returns it;
  /// empty = there is none, and the connection is to be closed. Must not destroy the server.
  virtual modbus::Pdu handle(const ModbusRequest& request, Room room) = 0;

  /// The server has refused a request to a unit ID that selects nothing. Called for the first unit.
  virtual void on_other_unit(std::uint32_t /*client*/, std::uint8_t /*unit*/) {}

  /// A PLC that owns its registers has answered, and these registers have got words of it; none = it was
  /// written to.
  virtual void on_taken(const modbus::Range& taken) = 0;

 protected:
  ~ModbusUnit() = default;
};

/// Modbus TCP without sockets: bytes of requests in, bytes of responses out. Registers are in host byte
/// order, register n is address n.
///
/// Function codes 3, 4 (the same registers as 3), 6, 16, 22 and 23, 43/14 (identification), and 1, 2, 5 and
/// 15 if the unit has coils and discrete inputs; others get exception 01. A request is executed as a whole.
///
/// The unit ID selects the network: 1 is the first, 2 the second; 0 and 255 are the first too. Any other one
/// gets exception 0Ah (gateway path unavailable), whatever the function. It is always echoed.
///
/// Sources: Modbus Messaging on TCP/IP Implementation Guide V1.0b for the framing; Modbus Application
/// Protocol V1.1b3 for the rest (cbcan/modbus/executor.hpp).
///
/// The texts of `identity` outlive it.
class ModbusServer {
 public:
  using Bytes = std::span<const std::uint8_t>;

  static constexpr std::size_t kPduOffset = 7;  ///< after the MBAP header
  static constexpr std::size_t kMaxAdu = kPduOffset + modbus::kMaxPdu;

  /// `networks` are 247 at most (Messaging on TCP/IP V1.0b: unit IDs 1..247) and outlive it.
  ModbusServer(std::span<ModbusUnit* const> networks, const modbus::DeviceIdentity& identity)
      : identification_(identity) {
    for (std::size_t i = 0; i < networks.size(); ++i)
      if (!networks[i]->registers().empty()) units_[i + 1] = networks[i];
    units_[kUnitOfServer] = units_[kUnitOfServerToo] = units_[1];
  }

  /// The size of the request at the beginning of these bytes; 0 = it is not Modbus, so the connection is to
  /// be closed; more than there are: it is incomplete.
  static std::size_t request_size(Bytes received) {
    if (received.size() < kUnitOffset) return kLeast;
    const std::size_t size = kUnitOffset + modbus::word(received, kLengthOffset);
    return modbus::word(received, kProtocolOffset) != 0 || size < kLeast || size > kMaxAdu ? 0 : size;
  }

  /// Executes a complete request and returns the response, which is valid until the next one; empty = the
  /// connection is to be closed. `client`: its number in events.
  Bytes execute(std::uint32_t client, Bytes bytes) {
    const std::uint8_t unit = bytes[kUnitOffset];
    const Bytes pdu = bytes.subspan(kPduOffset);
    const ModbusUnit::Room room = std::span(response_).subspan<kPduOffset>();
    if (units_[unit] == nullptr && units_[1] != nullptr) units_[1]->on_other_unit(client, unit);
    const bool identifies = pdu[0] == modbus::kEncapsulatedInterface;
    const Bytes response =
        units_[unit] == nullptr
            ? room.first(modbus::execute(pdu, {modbus::Exception::kNoPath}, RegisterMap({}), nullptr, room))
            : units_[unit]->handle({client, static_cast<std::uint16_t>(modbus::word(bytes, 0)), unit, pdu,
                                    identifies ? &identification_ : nullptr},
                                   room);
    ++counters_.requests;
    if (response.empty()) return {};
    if ((response[0] & modbus::kExceptionBit) != 0) ++counters_.exceptions;
    std::memcpy(response_.data(), bytes.data(), kPduOffset);
    const std::size_t length = 1 + response.size();
    response_[kLengthOffset] = static_cast<std::uint8_t>(length >> 8);
    response_[kLengthOffset + 1] = static_cast<std::uint8_t>(length);
    return Bytes(response_).first(kUnitOffset + length);
  }

  /// A client has connected; returns its number, from 1.
  std::uint32_t join(std::string_view peer) {
    const auto client = static_cast<std::uint32_t>(++counters_.connections);
    if (on_client) on_client(client, peer, true);
    return client;
  }
  void leave(std::uint32_t client, std::string_view peer) {
    ++counters_.left;
    if (on_client) on_client(client, peer, false);
  }
  /// Called when a client connects or leaves: its number, its address and whether it has connected.
  std::function<void(std::uint32_t client, std::string_view peer, bool joined)> on_client;

  struct Counters {
    std::uint64_t requests = 0;     ///< answered, with exceptions
    std::uint64_t exceptions = 0;   ///< answered by an exception
    std::uint64_t connections = 0;  ///< accepted
    std::uint64_t left = 0;         ///< of these
  };
  const Counters& counters() const { return counters_; }

 private:
  // MBAP header: transaction ID, protocol ID, length of what follows, unit ID; then the PDU.
  static constexpr std::size_t kProtocolOffset = 2;
  static constexpr std::size_t kLengthOffset = 4;
  static constexpr std::size_t kUnitOffset = 6;
  static constexpr std::size_t kLeast = 8;  // with a function code

  // Messaging on TCP/IP V1.0b, 4.4.2.1: either one means the server itself.
  static constexpr std::uint8_t kUnitOfServer = 0xFF;
  static constexpr std::uint8_t kUnitOfServerToo = 0;

  modbus::Identification identification_;
  std::array<ModbusUnit*, 256> units_{};          ///< by unit ID; null = none
  std::array<std::uint8_t, kMaxAdu> response_{};  ///< the last one
  Counters counters_;
};

/// A connection to `server`, which outlives it.
class ModbusTcpSession final : public StreamSession {
 public:
  ModbusTcpSession(ModbusServer& server, std::string peer)
      : server_(server), peer_(std::move(peer)), client_(server.join(peer_)) {}
  ~ModbusTcpSession() override { server_.leave(client_, peer_); }
  ModbusTcpSession(const ModbusTcpSession&) = delete;
  ModbusTcpSession& operator=(const ModbusTcpSession&) = delete;

  bool is_text() const override { return false; }
  void receive(std::string_view bytes) override {
    received_.insert(received_.end(), bytes.begin(), bytes.end());
    ModbusServer::Bytes rest(received_);
    std::size_t size = 0;
    for (; !ended_ && (size = ModbusServer::request_size(rest)) <= rest.size(); rest = rest.subspan(size)) {
      const auto response = size != 0 ? server_.execute(client_, rest.first(size)) : ModbusServer::Bytes();
      unsent_.append(response.begin(), response.end());
      ended_ = response.empty();
    }
    received_.erase(received_.begin(), received_.end() - static_cast<std::ptrdiff_t>(rest.size()));
  }
  void end_input() override { received_.clear(); }
  bool is_busy() const override { return !ended_ && !received_.empty(); }
  std::string_view unsent() const override { return unsent_; }
  bool has_ended() const override { return ended_; }
  void sent(std::size_t count) override { unsent_.erase(0, count); }

 private:
  ModbusServer& server_;
  std::string peer_;
  std::uint32_t client_;
  std::vector<std::uint8_t> received_;
  std::string unsent_;
  bool ended_ = false;
};

/// Adapters and the kernel deliver bytes in groups, with gaps between them. If a gap exceeds this, the frame
/// is lost and its master has one time-out.
inline constexpr std::uint32_t kRtuGapUs = 200'000;

/// Modbus RTU over the caller's registers, by the core's server (firmware/cbcan/modbus/rtu_server.hpp): on a
/// serial line, and over TCP, where the same frames arrive without silence between them. The first network is
/// at the configured station address, the others at the next ones. Requests are reported to the units as by
/// the Modbus TCP server, so both can serve the same registers.
///
/// Turns requests into responses. The units outlive it.
class RtuSession : public StreamSession {
 public:
  /// This machine's clock.
  using Now = std::function<Time()>;

  RtuSession(std::vector<ModbusUnit*> networks, Now now, const RtuServer::Settings& settings);

  bool is_text() const override { return false; }
  void receive(std::string_view bytes) override;
  std::string_view unsent() const override { return unsent_; }
  void sent(std::size_t count) override { unsent_.erase(0, count); }

  /// Executes the pending request once its silence has ended. `now` is on the same clock.
  void poll(Time now);
  /// When the silence after the pending request ends; kNever = no request is pending.
  Time deadline() const { return deadline_; }

  const RtuServer::Counters& counters() const { return server_.counters(); }

 private:
  void execute();

  std::vector<ModbusUnit*> networks_;
  Now now_;
  std::vector<RegisterMap> maps_;  ///< empty: the networks have the registers
  RtuServer server_;
  std::string unsent_;
  Time deadline_ = kNever;
};

/// Sessions of RTU over TCP.
MakeSession rtu_over_tcp(std::vector<ModbusUnit*> networks, RtuSession::Now now, std::uint8_t station);

}  // namespace cbcan::protocols
