// SPDX-License-Identifier: MIT
#include "app/simulator.hpp"

#include <algorithm>
#include <chrono>
#include <sstream>
#include <utility>

#include "cbcan/version.hpp"

namespace cbcan::app {

namespace {

Coprocessor::Settings settings_of(const ModuleConfig& module) {
  Coprocessor::Settings settings;
  settings.node_id = module.node_id;
  settings.sdo_timeout_ms = module.sdo_timeout_ms;
  settings.state_fresh_for = milliseconds(module.node_state_fresh_ms);
  settings.guard_timeout = milliseconds(module.guarding_timeout_ms);
  return settings;
}

io::ModbusTcpSettings settings_of(const ModbusConfig& modbus) {
  io::ModbusTcpSettings settings;
  settings.listen = {modbus.host, modbus.port};
  settings.identity = {"cbcan", "cbcan-sim", std::string(kVersion)};
  return settings;
}

RegisterWindow window_of(std::vector<std::uint16_t>& registers) {
  const std::span<std::uint16_t> all(registers);
  return RegisterWindow(all.subspan<regmap::kWindowFirst, regmap::kWindowWords>());
}

}  // namespace

Simulator::Simulator(const Config& config, std::vector<sim::NodeImage> images, const io::Warn& warn)
    : can_(can_spec(config.can)),
      signals_(reactor_),
      world_(config.can.bit_rate),
      module_(world_.add_module(window_of(registers_), settings_of(config.module))),
      modbus_(
          reactor_, registers_, settings_of(config.modbus),
          [this](bool /*wrote*/) { advance(io::Reactor::now()); }, warn) {
  for (std::size_t i = 0; i < images.size(); ++i)
    world_.add_node(config.nodes[i].id, std::move(images[i]));
  if (config.can.kind == CanKind::kSocketCan)
    socketcan_.emplace(reactor_, world_.bus(), config.can.interface_name, warn);
  if (config.log.file.empty()) return;
  const std::string interface = config.can.interface_name.empty() ? "virtual" : config.can.interface_name;
  log_.emplace(config.log.file, interface, io::Reactor::wall_offset(), warn);
  world_.bus().observe(*log_);
}

std::string Simulator::where() const {
  return "modbus=" + io::to_string(modbus_.address()) + " can=" + can_;
}

void Simulator::run() {
  world_.start(io::Reactor::now());
  while (!signals_.stop_requested()) {
    const Time now = io::Reactor::now();
    advance(now);
    modbus_.poll(now);
    if (log_) log_->flush();
    reactor_.run_once(next_deadline());
  }
}

void Simulator::advance(Time now) {
  if (socketcan_) socketcan_->poll(now);
  world_.advance(now);
}

Time Simulator::next_deadline() const {
  const Time world = earlier(world_.next_deadline(), modbus_.next_deadline());
  return socketcan_ ? earlier(world, socketcan_->next_deadline()) : world;
}

std::string Simulator::summary() const {
  const Coprocessor& coprocessor = module_.coprocessor();
  const auto& sdo = coprocessor.sdo_client().counters();
  const auto& modbus = modbus_.counters();
  std::ostringstream text;
  text << "transactions " << coprocessor.counters().executed << ", failed " << coprocessor.counters().failed
       << ", cancelled " << coprocessor.counters().cancelled << "\n"
       << "SDO transfers " << sdo.transfers << ", timeouts " << sdo.timeouts << ", aborts sent "
       << sdo.aborts_sent << ", received " << sdo.aborts_received << ", frames ignored "
       << sdo.late + sdo.unexpected + sdo.not_data + sdo.too_short + sdo.other_object << "\n"
       << "Modbus requests " << modbus.requests << ", exceptions " << modbus.exceptions << ", connections "
       << modbus.connections << "\n";
  return text.str();
}

}  // namespace cbcan::app
