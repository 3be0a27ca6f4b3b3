// SPDX-License-Identifier: MIT
#include "app/network.hpp"

#include <fmt/core.h>

#include <utility>

#include "adapters/slcan_adapter.hpp"
#include "io/can/socketcan.hpp"
#include "io/can/stream_bus.hpp"
#include "io/can/udp_bus.hpp"
#include "plant/words.hpp"
#include "text/numbers.hpp"
#include "window/rtu_connection.hpp"

namespace cbcan::app {

namespace {

/// In real time, for clients of socketcand.
constexpr Time kPauseBehindOk = 20 * kMillisecond;
constexpr std::uint16_t kModbusPort = 502;

/// What hours that pass at once bring to a pipe.
constexpr std::size_t kMostLogWaitingOnManualClock = 256 * 1024 * 1024;

}  // namespace

window::Line line_of(const config::LineConfig& config) {
  return {config.device, static_cast<int>(config.baud), config.parity.front()};
}

Network::Network(const config::Config& plant, const config::NetworkConfig& config,
                 std::vector<sim::NodeParts> nodes, const Surroundings& surroundings)
    : Timed(surroundings.schedule),
      surroundings_(surroundings),
      number_(config.number),
      name_(plant.networks.size() == 1 ? "" : fmt::format("network {}: ", number_)),
      can_(config::can_spec(config.can)),
      core_(plant, config, with_parameters(config, std::move(nodes)), surroundings.started, this,
            parameters_in(config.module.parameters)) {
  if (!config.can.outside.empty()) open_outside();
  open_servers(config.can);
  if (core_.module() != nullptr) open_plc(config);
  if (!config.log.empty()) open_log(config);
}

std::vector<sim::NodeParts> Network::with_parameters(const config::NetworkConfig& config,
                                                     std::vector<sim::NodeParts> nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i)
    nodes[i].parameters = parameters_in(config.nodes[i].parameters);
  return nodes;
}

/// Null: no file is named.
sim::ParameterStore* Network::parameters_in(const std::string& file) {
  if (file.empty()) return nullptr;
  return parameters_.emplace_back(std::make_unique<io::ParameterFile>(file, surroundings_.warn)).get();
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

void Network::open_outside() {
  using Door = config::CanSpec::Kind;
  io::Reactor& reactor = surroundings_.reactor;
  sim::Bus& bus = world().bus();
  const config::CanSpec& can = spec_.emplace(config::parse_can_spec(can_));
  const bool is_adapter = can.kind == Door::kSlcan;
  if (can.kind == Door::kSocketCan)
    outside_ = std::make_unique<io::SocketCan>(reactor, bus, can.name, surroundings_.warn);
  else if (can.kind == Door::kUdp)
    outside_ = std::make_unique<io::UdpBus>(reactor, bus, can_, can.remote, surroundings_.warn);
  else
    outside_ = std::make_unique<io::StreamBus>(
        reactor, bus, can_, is_adapter ? can.name : "", can.remote,
        is_adapter ? io::slcan_dialect(can.kbit) : io::socketcand_dialect(can.name), surroundings_.warn);
}

/// On a manual clock hours may pass between two looks at the clients: nobody is too slow then.
void Network::open_servers(const config::CanConfig& config) {
  const std::size_t most_unsent =
      surroundings_.clock.runs() ? adapters::Adapter::kMostUnsent : adapters::Adapter::kUnlimited;
  const auto serve = [&](auto& server, std::string_view service, const std::string& address, auto make) {
    if (!address.empty())
      server.emplace(surroundings_.reactor, service, text::parse_stream_address(address), make,
                     surroundings_.warn);
  };
  serve(slcan_, "slcan", config.slcan, [this, most_unsent] {
    return std::make_unique<adapters::SlcanAdapter>(
        world().bus(), [this] { advance(); }, most_unsent);
  });
  if (!config.socketcand.empty())
    socketcand_bus_.emplace(
        world().bus(), world().schedule(), [this] { return surroundings_.clock.now(); },
        surroundings_.clock.wall_offset(), surroundings_.clock.runs() ? kPauseBehindOk : 0);
  serve(socketcand_, "socketcand", config.socketcand, [this, most_unsent] {
    return std::make_unique<adapters::SocketcandAdapter>(
        *socketcand_bus_, [this] { advance(); }, most_unsent);
  });
  if (!config.beacon.empty() && surroundings_.clock.runs())
    beacon_.emplace(text::parse_listen_address(config.beacon, config::kSocketcandBeacon),
                    socketcand_->address().tcp, surroundings_.warn);
}

void Network::open_plc(const config::NetworkConfig& config) {
  const config::PlcConfig& plc = config.plc;
  if (plc.address.empty() && plc.line.device.empty()) return;
  std::unique_ptr<window::Connection> connection;
  if (plc.address.empty())
    connection = std::make_unique<window::RtuConnection>(line_of(plc.line), io::kPlcTiming);
  else
    connection = io::plc_over_tcp(text::parse_listen_address(plc.address, kModbusPort));
  io::PlcClient::Exchanges exchanges;
  if (plc.layout == config::PlcLayout::kScanner)
    exchanges.push_back(std::make_unique<io::ScannerExchange>(
        *this, plc.first, config.module.scanner_out_first, config.module.scanner_in_first));
  else
    exchanges.push_back(
        std::make_unique<io::WindowExchange>(*this, plc.first, plc.at_start == config::PlcAtStart::kRefuse));
  if (plc.process_first)
    exchanges.push_back(
        std::make_unique<io::ProcessExchange>(*this, *plc.process_first, config.module.process_first));
  plc_.emplace(surroundings_.reactor, *this, std::move(connection), std::move(exchanges),
               io::PlcSettings{plc.unit, milliseconds(plc.period_ms)}, surroundings_.warn);
}

/// A manual clock's log begins at 0, and is the same every time: a reader may be slow while hours pass.
void Network::open_log(const config::NetworkConfig& config) {
  const bool on_interface = spec_ && spec_->kind == config::CanSpec::Kind::kSocketCan;
  const std::string interface = on_interface ? spec_->name : "virtual";
  const std::size_t most_waiting =
      surroundings_.clock.runs() ? io::Output::kMostWaiting : kMostLogWaitingOnManualClock;
  log_.emplace(config.log, interface, surroundings_.clock.wall_offset(), surroundings_.warn, most_waiting);
  world().bus().observe(*log_);
}

std::string Network::where() const {
  const std::string prefix = plant::prefix_of(number_);
  const auto server = [&](std::string_view name, const auto& served) {
    return served ? fmt::format(" {}{}={}", prefix, name, to_string(served->address())) : "";
  };
  return fmt::format("{0}can={1}{2}{3}{4}", prefix, can_, server("slcan", slcan_),
                     server("socketcand", socketcand_),
                     plc_ ? fmt::format(" {}plc={}", prefix, plc_->place()) : "");
}

std::string Network::ways_in() const {
  std::string lines;
  const auto logger = [&](std::string_view door, const std::string& arguments) {
    lines += fmt::format("{}{}: python3 -m can.logger -i {}\n", name_, door, arguments);
  };
  const auto at = [](const text::ListenAddress& tcp) {
    return fmt::format("--host={} --port={}", tcp.host, tcp.port);
  };
  if (slcan_ && slcan_->address().path.empty())
    logger("slcan", "slcan -c socket://" + to_string(slcan_->address()));
  else if (slcan_ && slcan_->address().is_terminal)
    logger("slcan", "slcan -c " + slcan_->address().path);
  if (socketcand_ && socketcand_->address().path.empty())
    logger("socketcand", "socketcand -c can0 " + at(socketcand_->address().tcp));
  if (spec_ && spec_->kind == config::CanSpec::Kind::kUdp)
    logger("udp", fmt::format("udp_multicast -c {} --port={}", spec_->remote.host, spec_->remote.port));
  if (spec_ && spec_->kind == config::CanSpec::Kind::kSocketCan)
    lines += fmt::format("{}socketcan: candump {}\n", name_, spec_->name);
  return lines;
}

void Network::start(bool attended) {
  attended_ = attended;
  tell_time_of_day();
  core_.start(surroundings_.clock.now());
  wants(next_event());
}

void Network::catch_up() {
  if (wanted() <= surroundings_.clock.now() || core_.is_together()) advance();
}

void Network::on_request(bool valid, const adapters::ModbusRange& written) {
  const Time now = surroundings_.clock.now();
  const bool writes = written.count != 0;
  core_.on_request(valid);
  if (!writes) catch_up();
  if (writes && attended_) surroundings_.on_written(number_, written);
  if (valid) core_.on_plc(now);
  if (!writes) return;
  wants(core_.on_written(written.first, written.count, now));
  if (attended_) surroundings_.on_applied();
}

void Network::on_fault(std::string_view text, Time now) {
  surroundings_.warn(fmt::format("{} {}{}", text::seconds_text(now - surroundings_.started), name_, text));
}

void Network::turn(Time now) {
  if (plc_) plc_->poll(now);
  if (beacon_) beacon_->poll(now);
  flush();
}

void Network::flush() {
  if (log_) log_->flush();
  if (slcan_) slcan_->flush();
  if (socketcand_) socketcand_->flush();
}

void Network::advance() {
  const Time time = surroundings_.clock.now();
  if (outside_) outside_->poll(time);
  core_.advance(time);
  wants(next_event());
}

Time Network::door_deadline() const {
  Time next = kNever;
  if (log_) next = earlier(next, log_->next_deadline());
  if (plc_) next = earlier(next, plc_->next_deadline());
  if (beacon_) next = earlier(next, beacon_->next_deadline());
  return outside_ ? earlier(next, outside_->next_deadline()) : next;
}

std::string Network::module_summary() const {
  const sim::CoprocessorModule* const module = core_.module();
  if (module == nullptr) return {};
  const auto& transactions = module->coprocessor().counters();
  const auto& sdo = module->coprocessor().sdo_client().counters();
  const std::string second =
      core_.second_writers() == 0
          ? ""
          : fmt::format("{}writes to scanner windows by a second client {}\n", name_, core_.second_writers());
  return fmt::format(
      "{0}transactions {1}, failed {2}, cancelled {3}\n"
      "{0}SDO transfers {4}, timeouts {5}, aborts sent {6}, received {7}, frames ignored {8}\n{9}",
      name_, transactions.executed, transactions.failed, transactions.cancelled, sdo.transfers, sdo.timeouts,
      sdo.aborts_sent, sdo.aborts_received,
      sdo.late + sdo.unexpected + sdo.not_data + sdo.too_short + sdo.other_object, second);
}

std::string Network::plc_summary() const {
  if (!plc_) return {};
  return fmt::format("{}PLC requests {}, exceptions {}, connections lost {}\n", name_,
                     plc_->counters().requests, plc_->counters().exceptions, plc_->lost());
}

std::string Network::doors_summary() const {
  const auto summary = [&](std::string_view name, const auto& served) {
    return served ? fmt::format("{}{} connections {}, frames not read in time {}\n", name_, name,
                                served->counters().connections, served->counters().lost)
                  : "";
  };
  return summary("SLCAN", slcan_) + summary("socketcand", socketcand_);
}

}  // namespace cbcan::app
