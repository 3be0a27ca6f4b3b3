// SPDX-License-Identifier: MIT
#include "app/bus_connections.hpp"

#include <fmt/core.h>

#include <utility>

namespace cbcan::app {

window::Line line_of(const config::LineConfig& config) {
  return {config.device, static_cast<int>(config.baud), config.parity.front()};
}

BusConnections::BusConnections(const config::NetworkConfig& config, plant::Network& network,
                               io::Reactor& reactor, const session::Host& host, const io::Warn& warn)
    : network_(network), reactor_(reactor), host_(host), warn_(warn) {
  if (!config.can.outside.empty()) open_outside(config::can_spec(config.can));
  if (network.module() != nullptr) open_plc(config);
  if (!config.log.empty()) open_log(config);
}

void BusConnections::open_outside(const std::string& can_spec) {
  using Kind = config::CanSpec::Kind;
  sim::Bus& bus = network_.world().bus();
  const config::CanSpec& can = spec_.emplace(config::parse_can_spec(can_spec));
  const bool is_adapter = can.kind == Kind::kSlcan;
  if (can.kind == Kind::kSocketCan)
    outside_ = io::socketcan_bus(reactor_, bus, can.name, warn_);
  else
    outside_ =
        io::stream_bus(reactor_, bus, can_spec, is_adapter ? can.name : "", can.remote,
                       is_adapter ? io::slcan_dialect(can.kbit) : io::socketcand_dialect(can.name), warn_);
}

void BusConnections::open_plc(const config::NetworkConfig& config) {
  constexpr std::uint16_t kModbusPort = 502;
  const config::PlcConfig& plc = config.plc;
  if (plc.address.empty() && plc.line.device.empty()) return;
  std::unique_ptr<window::Connection> connection;
  if (plc.address.empty())
    connection = window::rtu_connection(line_of(plc.line), io::kPlcTiming);
  else
    connection = io::plc_over_tcp(base::parse_listen_address(plc.address, kModbusPort));
  io::PlcClient::Exchanges exchanges;
  if (plc.layout == config::PlcLayout::kScanner)
    exchanges.push_back(std::make_unique<io::ScannerExchange>(
        network_, plc.first, config.module.scanner_out_first, config.module.scanner_in_first));
  else
    exchanges.push_back(std::make_unique<io::WindowExchange>(network_, plc.first,
                                                             plc.at_start == config::PlcAtStart::kRefuse));
  if (plc.process_first)
    exchanges.push_back(
        std::make_unique<io::ProcessExchange>(network_, *plc.process_first, config.module.process_first));
  if (plc.status_first)
    exchanges.push_back(std::make_unique<io::CopyExchange>(network_, *plc.status_first,
                                                           config.module.status_first, regmap::kStatusWords));
  plc_.emplace(reactor_, network_, std::move(connection), std::move(exchanges),
               io::PlcSettings{plc.unit, milliseconds(plc.period_ms)}, warn_);
}

/// On a manual clock the log begins at 0 and is reproducible, so it drops nothing for a slow reader.
void BusConnections::open_log(const config::NetworkConfig& config) {
  const bool on_interface = spec_ && spec_->kind == config::CanSpec::Kind::kSocketCan;
  const std::string interface = on_interface ? spec_->name : "virtual";
  log_.emplace(config.log, interface, host_.wall_offset(), warn_, most_waiting(host_));
  network_.world().bus().observe(*log_);
}

void BusConnections::poll(Time now) {
  if (plc_) plc_->poll(now);
  flush();
}

Time BusConnections::next_deadline() const {
  Time next = kNever;
  if (log_) next = earlier(next, log_->next_deadline());
  if (plc_) next = earlier(next, plc_->next_deadline());
  return outside_ ? earlier(next, outside_->next_deadline()) : next;
}

std::string BusConnections::plc_summary(std::string_view name) const {
  if (!plc_) return {};
  return fmt::format("{}PLC requests {}, exceptions {}, connections lost {}\n", name,
                     plc_->counters().requests, plc_->counters().exceptions, plc_->lost());
}

}  // namespace cbcan::app
