// SPDX-License-Identifier: MIT
#include "protocols/modbus_server.hpp"

namespace cbcan::protocols {

namespace {

std::uint32_t counter(Time time) {
  return static_cast<std::uint32_t>(time);
}

}  // namespace

RtuSession::RtuSession(std::vector<ModbusUnit*> networks, Now now, const RtuServer::Settings& settings)
    : networks_(std::move(networks)),
      now_(std::move(now)),
      maps_(networks_.size(), RegisterMap({})),
      server_(maps_, settings) {}

void RtuSession::receive(std::string_view bytes) {
  const Time now = now_();
  for (const char byte : bytes) {
    server_.on_byte(static_cast<std::uint8_t>(byte), counter(now));
    poll(now);
  }
}

void RtuSession::poll(Time now) {
  const std::uint32_t silence = server_.poll(counter(now));
  deadline_ = silence == 0 || silence == RtuServer::kNoRequest ? kNever : now + silence;
  if (silence == 0) execute();
}

void RtuSession::execute() {
  const std::span<ModbusUnit* const> all(networks_);
  const auto meant = server_.is_broadcast() ? all : all.subspan(server_.request_network(), 1);
  const modbus::Pdu frame = server_.request();
  std::array<std::uint8_t, modbus::kMaxPdu> room;
  modbus::Pdu pdu;
  for (ModbusUnit* const network : meant)
    pdu = network->handle({.unit = frame[0], .pdu = frame.subspan(1)}, room);
  const auto response = server_.respond_with(pdu);
  unsent_.append(response.begin(), response.end());
  server_.on_sent();
}

MakeSession rtu_over_tcp(std::vector<ModbusUnit*> networks, RtuSession::Now now, std::uint8_t station) {
  const RtuServer::Settings settings{.station = station, .silence_us = 0, .gap_us = kRtuGapUs};
  return [networks = std::move(networks), now = std::move(now), settings] {
    return std::make_unique<RtuSession>(networks, now, settings);
  };
}

}  // namespace cbcan::protocols
