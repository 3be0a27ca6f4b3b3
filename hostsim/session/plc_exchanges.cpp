// SPDX-License-Identifier: MIT
#include "session/plc_exchanges.hpp"

#include <memory>

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

}  // namespace cbcan::session
