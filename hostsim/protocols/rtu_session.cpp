// SPDX-License-Identifier: MIT
#include "protocols/rtu_session.hpp"

#include <span>
#include <utility>

#include "cbcan/regmap.hpp"

namespace cbcan::protocols {

namespace {

std::uint32_t counter(Time time) {
  return static_cast<std::uint32_t>(time);
}

/// A frame is the station address, the PDU and, in the response, the CRC.
void tell_exchange(ModbusUnit& unit, std::span<const std::uint8_t> request, std::string_view response) {
  const std::span all(reinterpret_cast<const std::uint8_t*>(response.data()), response.size());
  const bool has_pdu = all.size() > 3;
  const auto pdu = has_pdu ? all.subspan(1, all.size() - 3) : all.first(0);
  const bool refused = has_pdu && (pdu[0] & modbus::kExceptionBit) != 0;
  unit.on_exchange({0, 0, request[0], refused ? pdu[1] : std::uint8_t{0}, request.subspan(1), pdu});
}

RtuServer::Settings with_bits(RtuServer::Settings settings, const ModbusUnit& unit) {
  settings.more = unit.bits();
  return settings;
}

}  // namespace

RtuSession::RtuSession(std::vector<ModbusUnit*> networks, Now now, const RtuServer::Settings& settings)
    : networks_(std::move(networks)),
      now_(std::move(now)),
      ranges_([this] {
        std::vector<RegisterRange> ranges;
        for (ModbusUnit* unit : networks_)
          ranges.push_back({0, unit->registers()});
        return ranges;
      }()),
      maps_([this] {
        std::vector<RegisterMap> maps;
        for (const RegisterRange& range : ranges_)
          maps.emplace_back(std::span(&range, 1));
        return maps;
      }()),
      server_(maps_, with_bits(settings, *networks_.front())) {}

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
  const std::size_t asked = server_.request_network();
  const std::span<ModbusUnit* const> meant =
      server_.is_broadcast() ? std::span<ModbusUnit* const>(networks_) : std::span(&networks_[asked], 1);
  const auto frame = networks_[asked]->listens() ? server_.request() : std::span<const std::uint8_t>();
  const std::vector<std::uint8_t> request(frame.begin(), frame.end());
  const bool diagnostics = server_.request_reads(regmap::kDiagnosticsFirst, regmap::kDiagnosticsWords + 1);
  for (ModbusUnit* const network : meant) {
    network->advance_due();
    if (diagnostics) network->on_diagnostics();
  }
  const auto response = server_.execute();
  const std::size_t before = unsent_.size();
  unsent_.append(response.begin(), response.end());
  const std::string_view sent = std::string_view(unsent_).substr(before);
  server_.on_sent();
  const auto& [exception, written, read] = server_.executed();
  for (ModbusUnit* const network : meant) {
    if (!request.empty()) tell_exchange(*network, request, sent);
    network->on_writer(0, written);
    network->on_request(exception == modbus::Exception::kNone, written);
  }
}

MakeSession rtu_over_tcp(std::vector<ModbusUnit*> networks, RtuSession::Now now, std::uint8_t station) {
  const RtuServer::Settings settings{.station = station, .silence_us = 0, .gap_us = kRtuGapUs};
  return [networks = std::move(networks), now = std::move(now), settings] {
    return std::make_unique<RtuSession>(networks, now, settings);
  };
}

}  // namespace cbcan::protocols
