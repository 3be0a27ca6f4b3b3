// SPDX-License-Identifier: MIT
#include "app/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/manual_clock.hpp"
#include "cbcan/version.hpp"

namespace cbcan::app {

namespace {

io::ModbusTcpSettings settings_of(const text::ListenAddress& modbus) {
  io::ModbusTcpSettings settings;
  settings.listen = {modbus.host, modbus.port};
  settings.identity = {"cbcan", "cbcan-sim", std::string(kVersion)};
  return settings;
}

std::unique_ptr<Clock> make_clock(plant::ClockKind kind, io::Reactor& reactor, Console& console) {
  if (kind == plant::ClockKind::kManual) return std::make_unique<ManualClock>(reactor, console);
  return std::make_unique<Clock>();
}

}  // namespace

Simulator::Simulator(const plant::Config& config, std::vector<std::vector<sim::NodeParts>> nodes,
                     Console& console)
    : console_(console),
      warn_([&console](const std::string& line) { console.warn(line); }),
      signals_(reactor_),
      clock_(make_clock(config.clock, reactor_, console)),
      started_(clock_->now()) {
  open_networks(config, std::move(nodes));
  open_modbus(config);
  if (!config.control.empty()) open_control(config);
}

void Simulator::open_networks(const plant::Config& config, std::vector<std::vector<sim::NodeParts>> nodes) {
  const Surroundings surroundings{reactor_, warn_, *clock_, started_};
  std::vector<sim::World*> worlds;
  for (std::size_t i = 0; i < config.networks.size(); ++i) {
    networks_.push_back(
        std::make_unique<Network>(config, config.networks[i], std::move(nodes[i]), surroundings));
    worlds.push_back(&networks_.back()->world());
  }
  control_.emplace(std::move(worlds), started_);
}

/// Where no network has a module there is nothing to serve.
void Simulator::open_modbus(const plant::Config& config) {
  if (std::ranges::all_of(networks_, [](const auto& network) { return network->registers().empty(); }))
    return;
  std::vector<io::ModbusUnit*> units;
  for (const auto& network : networks_)
    units.push_back(network.get());
  open_rtu(config.rtu, units);
  modbus_.emplace(reactor_, std::move(units), settings_of(config.modbus), warn_);
}

void Simulator::open_rtu(const plant::RtuConfig& config, const std::vector<io::ModbusUnit*>& units) {
  if (!config.line.device.empty()) rtu_.emplace(reactor_, units, line_of(config.line), config.station, warn_);
  if (!config.listen.empty())
    rtu_tcp_.emplace(reactor_, "rtu over tcp", text::parse_stream_address(config.listen),
                     io::rtu_over_tcp(units, config.station), warn_);
}

void Simulator::open_control(const plant::Config& config) {
  commands_.emplace(reactor_, "control", text::parse_stream_address(config.control),
                    io::command_sessions([this](std::string_view line) { return execute(line); }), warn_);
}

std::string Simulator::where() const {
  std::string text;
  if (modbus_) text += "modbus=" + to_string(modbus_->address()) + " ";
  if (rtu_) text += "rtu=" + rtu_->device() + " ";
  if (rtu_tcp_) text += "rtu_tcp=" + to_string(rtu_tcp_->address()) + " ";
  for (const auto& network : networks_)
    text += (network == networks_.front() ? "" : " ") + network->where();
  if (commands_) text += " control=" + to_string(commands_->address());
  return text;
}

void Simulator::run() {
  for (const auto& network : networks_)
    network->start();
  clock_->drive(*this);
}

std::size_t Simulator::turn(Time until) {
  advance();
  if (modbus_) modbus_->poll(io::Reactor::now());
  if (rtu_) rtu_->poll(io::Reactor::now());
  for (const auto& network : networks_)
    network->poll_plc(io::Reactor::now());
  flush();
  if (commands_) commands_->flush();
  return reactor_.run_once(earlier(until, next_deadline()));
}

std::string Simulator::execute(std::string_view line) {
  advance();
  std::string response = control_->execute(line, clock_->now());
  advance();
  flush();
  return response;
}

void Simulator::flush() {
  for (const auto& network : networks_)
    network->flush();
  console_.flush();
}

void Simulator::advance() {
  for (const auto& network : networks_)
    network->advance();
}

Time Simulator::next_deadline() const {
  Time next = console_.next_deadline();
  if (modbus_) next = earlier(next, modbus_->next_deadline());
  if (rtu_) next = earlier(next, rtu_->next_deadline());
  for (const auto& network : networks_)
    next = earlier(next, network->next_deadline());
  return next;
}

Time Simulator::next_event() const {
  Time next = kNever;
  for (const auto& network : networks_)
    next = earlier(next, network->next_event());
  return next;
}

std::string Simulator::summary() const {
  std::string text;
  for (const auto& network : networks_)
    text += network->module_summary();
  if (modbus_)
    text += fmt::format("Modbus requests {}, exceptions {}, connections {}\n", modbus_->counters().requests,
                        modbus_->counters().exceptions, modbus_->counters().connections);
  if (rtu_)
    text +=
        fmt::format("Modbus RTU requests {}, exceptions {}, CRC errors {}\n", rtu_->counters().slave_messages,
                    rtu_->counters().slave_exceptions, rtu_->counters().bus_communication_errors);
  for (const auto& network : networks_)
    text += network->plc_summary() + network->slcan_summary();
  return text;
}

}  // namespace cbcan::app
