// SPDX-License-Identifier: MIT
#pragma once

/// Modbus RTU over the caller's registers, by the core's server (firmware/cbcan/modbus/rtu_server.hpp): on a
/// serial line, and over TCP, where the same frames arrive without silence between them. The first network is
/// at the configured station address, the others at the next ones. Requests are reported to the units as by
/// the Modbus TCP server, so both can serve the same registers.

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/modbus/rtu_server.hpp"
#include "cbcan/time.hpp"
#include "protocols/modbus_unit.hpp"
#include "protocols/stream_session.hpp"

namespace cbcan::protocols {

/// Adapters and the kernel deliver bytes in groups, with gaps between them. If a gap exceeds this, the frame
/// is lost and its master has one time-out.
inline constexpr std::uint32_t kRtuGapUs = 200'000;

/// Turns requests into responses. The units outlive it.
class RtuSession final : public StreamSession {
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
