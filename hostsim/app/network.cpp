// SPDX-License-Identifier: MIT
#include "app/network.hpp"

#include <fmt/core.h>

#include <utility>

#include "io/modbus/rtu_connection.hpp"
#include "scenario/words.hpp"
#include "text/numbers.hpp"

namespace cbcan::app {

namespace {

constexpr std::uint16_t kModbusPort = 502;

/// What hours that pass at once bring to a pipe.
constexpr std::size_t kMostLogWaitingOnManualClock = 256 * 1024 * 1024;

}  // namespace

io::SerialSettings line_of(const plant::LineConfig& config) {
  return {config.device, config.baud, config.parity.front()};
}

Network::Network(const plant::Config& plant, const plant::NetworkConfig& config,
                 std::vector<sim::NodeParts> nodes, const Surroundings& surroundings)
    : Timed(surroundings.schedule),
      surroundings_(surroundings),
      number_(config.number),
      name_(plant.networks.size() == 1 ? "" : fmt::format("network {}: ", number_)),
      can_(plant::can_spec(config.can)),
      core_(plant, config, with_parameters(config, std::move(nodes)), surroundings.started, this) {
  if (!config.can.interface_name.empty())
    socketcan_.emplace(surroundings_.reactor, world().bus(), config.can.interface_name, surroundings_.warn);
  if (!config.can.slcan.empty()) open_slcan(config);
  if (core_.module() != nullptr) open_plc(config);
  if (!config.log.empty()) open_log(config);
}

std::vector<sim::NodeParts> Network::with_parameters(const plant::NetworkConfig& config,
                                                     std::vector<sim::NodeParts> nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (const std::string& file = config.nodes[i].parameters; !file.empty())
      nodes[i].parameters =
          parameters_.emplace_back(std::make_unique<io::ParameterFile>(file, surroundings_.warn)).get();
  return nodes;
}

/// Devices' clocks show this machine's time; on a manual clock it is midnight of 1984-01-01 when the world
/// begins.
void Network::tell_time_of_day() {
  constexpr Time kDay = 24 * 3600 * kSecond;
  constexpr Time kDaysTo1984 = 5113;  // since 1970
  if (!surroundings_.clock.runs()) return;
  const Time since_1970 = surroundings_.started + surroundings_.clock.wall_offset();
  const TimeOfDay time{static_cast<std::uint32_t>(since_1970 % kDay / kMillisecond),
                       static_cast<std::uint16_t>(since_1970 / kDay - kDaysTo1984)};
  for (const auto& node : world().nodes())
    node->device().time_stamp().set(time, surroundings_.started);
}

/// On a manual clock hours may pass between two looks at the clients: nobody is too slow then.
void Network::open_slcan(const plant::NetworkConfig& config) {
  const std::size_t most_unsent =
      surroundings_.clock.runs() ? sim::SlcanAdapter::kMostUnsent : sim::SlcanAdapter::kUnlimited;
  slcan_.emplace(
      surroundings_.reactor, world().bus(), text::parse_stream_address(config.can.slcan), most_unsent,
      [this] { advance(); }, surroundings_.warn);
}

void Network::open_plc(const plant::NetworkConfig& config) {
  const plant::PlcConfig& plc = config.plc;
  if (plc.address.empty() && plc.line.device.empty()) return;
  std::unique_ptr<client::Connection> connection;
  if (plc.address.empty())
    connection = std::make_unique<io::RtuConnection>(line_of(plc.line), io::kPlcTiming);
  else
    connection = io::plc_over_tcp(text::parse_listen_address(plc.address, kModbusPort));
  io::PlcClient::Exchanges exchanges;
  if (plc.layout == plant::PlcLayout::kScanner)
    exchanges.push_back(std::make_unique<io::ScannerExchange>(
        *this, plc.first, config.module.scanner_out_first, config.module.scanner_in_first));
  else
    exchanges.push_back(std::make_unique<io::WindowExchange>(*this, plc.first));
  if (plc.process_first)
    exchanges.push_back(
        std::make_unique<io::ProcessExchange>(*this, *plc.process_first, config.module.process_first));
  plc_.emplace(surroundings_.reactor, *this, std::move(connection), std::move(exchanges),
               io::PlcSettings{plc.unit, milliseconds(plc.period_ms)}, surroundings_.warn);
}

/// A manual clock's log begins at 0, and is the same every time: a reader may be slow while hours pass.
void Network::open_log(const plant::NetworkConfig& config) {
  const std::string interface = config.can.interface_name.empty() ? "virtual" : config.can.interface_name;
  const std::size_t most_waiting =
      surroundings_.clock.runs() ? io::Output::kMostWaiting : kMostLogWaitingOnManualClock;
  log_.emplace(config.log, interface, surroundings_.clock.wall_offset(), surroundings_.warn, most_waiting);
  world().bus().observe(*log_);
}

std::string Network::where() const {
  const std::string prefix = scenario::prefix_of(number_);
  return fmt::format("{0}can={1}{2}{3}", prefix, can_,
                     slcan_ ? fmt::format(" {}slcan={}", prefix, to_string(slcan_->address())) : "",
                     plc_ ? fmt::format(" {}plc={}", prefix, plc_->place()) : "");
}

void Network::start() {
  tell_time_of_day();
  core_.start(surroundings_.clock.now());
  wants(next_event());
}

void Network::catch_up() {
  if (wanted() <= surroundings_.clock.now() || core_.is_together()) advance();
}

void Network::on_request(bool valid, const io::ModbusRange& written) {
  const Time now = surroundings_.clock.now();
  if (written.count == 0)
    catch_up();
  else
    surroundings_.on_written(number_, written);
  if (valid) core_.on_request(written.first, written.count, now);
  if (written.count == 0) return;
  wants(next_event());
  surroundings_.on_applied();
}

void Network::on_fault(std::string_view text, Time now) {
  surroundings_.warn(fmt::format("{} {}{}", text::seconds_text(now - surroundings_.started), name_, text));
}

void Network::turn(Time now) {
  if (plc_) plc_->poll(now);
  flush();
}

void Network::flush() {
  if (log_) log_->flush();
  if (slcan_) slcan_->flush();
}

void Network::advance() {
  const Time time = surroundings_.clock.now();
  if (socketcan_) socketcan_->poll(time);
  core_.advance(time);
  wants(next_event());
}

Time Network::door_deadline() const {
  Time next = kNever;
  if (log_) next = earlier(next, log_->next_deadline());
  if (plc_) next = earlier(next, plc_->next_deadline());
  return socketcan_ ? earlier(next, socketcan_->next_deadline()) : next;
}

std::string Network::module_summary() const {
  const sim::CoprocessorModule* const module = core_.module();
  if (module == nullptr) return {};
  const auto& transactions = module->coprocessor().counters();
  const auto& sdo = module->coprocessor().sdo_client().counters();
  return fmt::format(
      "{0}transactions {1}, failed {2}, cancelled {3}\n"
      "{0}SDO transfers {4}, timeouts {5}, aborts sent {6}, received {7}, frames ignored {8}\n",
      name_, transactions.executed, transactions.failed, transactions.cancelled, sdo.transfers, sdo.timeouts,
      sdo.aborts_sent, sdo.aborts_received,
      sdo.late + sdo.unexpected + sdo.not_data + sdo.too_short + sdo.other_object);
}

std::string Network::plc_summary() const {
  if (!plc_) return {};
  return fmt::format("{}PLC requests {}, exceptions {}, connections lost {}\n", name_,
                     plc_->counters().requests, plc_->counters().exceptions, plc_->lost());
}

std::string Network::slcan_summary() const {
  if (!slcan_) return {};
  return fmt::format("{}SLCAN connections {}, frames not read in time {}\n", name_,
                     slcan_->counters().connections, slcan_->counters().lost);
}

}  // namespace cbcan::app
