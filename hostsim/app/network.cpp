// SPDX-License-Identifier: MIT
#include "app/network.hpp"

#include <sstream>
#include <utility>

namespace cbcan::app {

namespace {

Coprocessor::Settings settings_of(const ModuleConfig& module) {
  Coprocessor::Settings settings;
  settings.node_id = module.node_id;
  settings.sdo_timeout_ms = module.sdo_timeout_ms;
  settings.state_fresh_for = milliseconds(module.node_state_fresh_ms);
  settings.guard_timeout = milliseconds(module.guarding_timeout_ms);
  settings.plc_timeout_ms = module.plc_timeout_ms;
  settings.plc_lost = module.plc_lost_state == PlcLostState::kStopped ? nmt::Command::kStop
                                                                      : nmt::Command::kEnterPreOperational;
  settings.scanner_out_first = module.scanner_out_first;
  settings.scanner_in_first = module.scanner_in_first;
  settings.process_first = module.process_first;
  return settings;
}

RegisterWindow window_of(std::vector<std::uint16_t>& registers) {
  const std::span<std::uint16_t> all(registers);
  return RegisterWindow(all.subspan<regmap::kWindowFirst, regmap::kWindowWords>());
}

ScannerWindow scanner_of(std::vector<std::uint16_t>& registers, const ModuleConfig& module) {
  const std::span<std::uint16_t> all(registers);
  return {all.subspan(module.scanner_out_first).first<regmap::kScannerOutWords>(),
          all.subspan(module.scanner_in_first).first<regmap::kScannerInWords>()};
}

ProcessRegisters process_of(std::vector<std::uint16_t>& registers, const ModuleConfig& module) {
  return std::span(registers).subspan(module.process_first).first<regmap::kProcessWords>();
}

}  // namespace

Network::Network(const Config& plant, const NetworkConfig& config, std::vector<BuiltNode> nodes,
                 const Surroundings& surroundings)
    : surroundings_(surroundings),
      number_(config.number),
      name_(plant.networks.size() == 1 ? "" : "network " + std::to_string(number_) + ": "),
      can_(can_spec(config.can)),
      registers_(regmap::kRegisterFileWords),
      world_(config.can.bit_rate, network_seed(plant, config), this) {
  if (config.module.enabled)
    module_ = &world_.add_module(window_of(registers_), process_of(registers_, config.module),
                                 settings_of(config.module), scanner_of(registers_, config.module));
  add_nodes(config, std::move(nodes));
  set_faults(config);
  if (config.can.kind == CanKind::kSocketCan)
    socketcan_.emplace(surroundings_.reactor, world_.bus(), config.can.interface_name, surroundings_.warn);
  if (!config.can.slcan.empty()) open_slcan(config);
  if (!config.log.file.empty()) open_log(config);
}

std::span<std::uint16_t> Network::registers() {
  return module_ != nullptr ? std::span(registers_) : std::span<std::uint16_t>();
}

void Network::add_nodes(const NetworkConfig& config, std::vector<BuiltNode> nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const NodeConfig& node = config.nodes[i];
    sim::NodeParts& parts = nodes[i].parts;
    parts.listener = this;
    if (!node.parameters.empty())
      parts.parameters =
          parameters_.emplace_back(std::make_unique<io::ParameterFile>(node.parameters, surroundings_.warn))
              .get();
    const std::uint8_t id = node.id == 0 ? sim::Node::kNoNodeId : node.id;
    sim::Node& made = world_.add_node(id, std::move(nodes[i].image), parts);
    plant_.nodes.push_back({&made, node.name, nodes[i].device});
  }
}

void Network::set_faults(const NetworkConfig& config) {
  for (const FaultConfig& fault : config.can.faults)
    world_.faults().add(fault.fault, surroundings_.started);
  for (std::size_t i = 0; i < plant_.nodes.size(); ++i)
    for (const FaultConfig& fault : config.nodes[i].faults)
      plant_.nodes[i].node->faults().add(fault.fault, surroundings_.started);
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
  for (const PlantNode& plant : plant_.nodes)
    plant.node->device().time_stamp().set(time, surroundings_.started);
}

/// On a manual clock hours may pass between two looks at the clients: nobody is too slow then.
void Network::open_slcan(const NetworkConfig& config) {
  const std::size_t most_unsent =
      surroundings_.clock.runs() ? sim::SlcanAdapter::kMostUnsent : sim::SlcanAdapter::kUnlimited;
  slcan_.emplace(
      surroundings_.reactor, world_.bus(), io::parse_stream_address(config.can.slcan), most_unsent,
      [this] { advance(); }, surroundings_.warn);
}

/// A manual clock's log begins at 0, and is the same every time.
void Network::open_log(const NetworkConfig& config) {
  const std::string interface = config.can.interface_name.empty() ? "virtual" : config.can.interface_name;
  log_.emplace(config.log.file, interface, surroundings_.clock.wall_offset(), surroundings_.warn);
  world_.bus().observe(*log_);
}

std::string Network::where() const {
  const std::string prefix = number_ == 1 ? "" : std::to_string(number_) + "/";
  std::string text = prefix + "can=" + can_;
  if (slcan_) text += " " + prefix + "slcan=" + io::to_string(slcan_->address());
  return text;
}

void Network::start() {
  tell_time_of_day();
  world_.start(surroundings_.clock.now());
}

void Network::on_request(bool valid, const io::ModbusRange& written) {
  advance();
  if (!valid) return;
  const Time now = surroundings_.clock.now();
  module_->on_plc(now);
  if (written.count == 0) return;
  module_->on_registers_written(written.first, written.count, now);
  if (world_.next_deadline() <= now) advance();
}

void Network::on_fault(std::string_view text, Time now) {
  surroundings_.warn(seconds_text(now - surroundings_.started) + " " + name_ + std::string(text));
}

void Network::flush() {
  if (log_) log_->flush();
  if (slcan_) slcan_->flush();
}

void Network::advance() {
  const Time time = surroundings_.clock.now();
  if (socketcan_) socketcan_->poll(time);
  world_.advance(time);
}

Time Network::next_deadline() const {
  const Time next = surroundings_.clock.runs() ? world_.next_deadline() : kNever;
  return socketcan_ ? earlier(next, socketcan_->next_deadline()) : next;
}

std::string Network::module_summary() const {
  if (module_ == nullptr) return {};
  const auto& transactions = module_->coprocessor().counters();
  const auto& sdo = module_->coprocessor().sdo_client().counters();
  std::ostringstream text;
  text << name_ << "transactions " << transactions.executed << ", failed " << transactions.failed
       << ", cancelled " << transactions.cancelled << "\n"
       << name_ << "SDO transfers " << sdo.transfers << ", timeouts " << sdo.timeouts << ", aborts sent "
       << sdo.aborts_sent << ", received " << sdo.aborts_received << ", frames ignored "
       << sdo.late + sdo.unexpected + sdo.not_data + sdo.too_short + sdo.other_object << "\n";
  return text.str();
}

std::string Network::slcan_summary() const {
  if (!slcan_) return {};
  return name_ + "SLCAN connections " + std::to_string(slcan_->counters().connections) +
         ", frames not read in time " + std::to_string(slcan_->counters().lost) + "\n";
}

}  // namespace cbcan::app
