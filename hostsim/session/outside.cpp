// SPDX-License-Identifier: MIT
#include "session/outside.hpp"

namespace cbcan::session {

protocols::PlcPolling::Exchanges plc_exchanges(const config::NetworkConfig& config, plant::Network& network) {
  using namespace protocols;
  const config::PlcConfig& plc = config.plc;
  const config::ModuleConfig& own = config.module;
  PlcPolling::Exchanges exchanges;
  if (plc.layout == config::PlcLayout::kScanner)
    exchanges.push_back(
        std::make_unique<ScannerExchange>(network, plc.first, own.scanner_out_first, own.scanner_in_first));
  else
    exchanges.push_back(
        std::make_unique<WindowExchange>(network, plc.first, plc.at_start == config::PlcAtStart::kRefuse));
  if (plc.process_first)
    exchanges.push_back(std::make_unique<ProcessExchange>(network, *plc.process_first, own.process_first));
  if (plc.status_first)
    exchanges.push_back(
        std::make_unique<CopyExchange>(network, *plc.status_first, own.status_first, regmap::kStatusWords));
  return exchanges;
}

base::ListenAddress plc_address(const config::PlcConfig& plc) {
  constexpr std::uint16_t kModbusPort = 502;
  return base::parse_listen_address(plc.address, kModbusPort);
}

std::unique_ptr<protocols::Dialect> dialect_of(const config::CanSpec& can) {
  return can.kind == config::CanSpec::Kind::kSlcan ? protocols::slcan_dialect(can.kbit)
                                                   : protocols::socketcand_dialect(can.name);
}

}  // namespace cbcan::session
