// SPDX-License-Identifier: MIT
#include "app/simulator.hpp"

#include <unistd.h>

#include <iostream>
#include <sstream>
#include <utility>

#include "app/manual_clock.hpp"
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

ProcessRegisters process_of(std::vector<std::uint16_t>& registers, const ModuleConfig& module) {
  return std::span(registers).subspan(module.process_first).first<regmap::kProcessWords>();
}

constexpr std::string_view kError = "error: ";

std::string summary_of(const Coprocessor& coprocessor, const io::ModbusTcp::Counters& modbus) {
  const auto& sdo = coprocessor.sdo_client().counters();
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

}  // namespace

Simulator::Simulator(const Config& config, std::vector<BuiltNode> nodes, const io::Warn& warn)
    : can_(can_spec(config.can)),
      warn_(warn),
      signals_(reactor_),
      started_(config.time.clock == ClockKind::kManual ? 0 : io::Reactor::now()),
      world_(config.can.bit_rate, config.random.seed, this),
      control_(world_, nodes_, started_) {
  if (config.time.clock == ClockKind::kManual) input_.emplace(reactor_, STDIN_FILENO);
  if (config.module.enabled) {
    module_ = &world_.add_module(window_of(registers_), process_of(registers_, config.module),
                                 settings_of(config.module));
    modbus_.emplace(
        reactor_, registers_, settings_of(config.modbus), [this](bool wrote) { on_request(wrote); }, warn);
  }
  add_nodes(config, std::move(nodes));
  set_faults(config);
  if (config.can.kind == CanKind::kSocketCan)
    socketcan_.emplace(reactor_, world_.bus(), config.can.interface_name, warn);
  if (!config.can.slcan.empty()) open_slcan(config);
  if (!config.control.listen.empty()) open_control(config);
  if (!config.log.file.empty()) open_log(config);
}

void Simulator::add_nodes(const Config& config, std::vector<BuiltNode> nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const NodeConfig& node = config.nodes[i];
    sim::NodeParts& parts = nodes[i].parts;
    parts.listener = this;
    if (!node.parameters.empty())
      parts.parameters =
          parameters_.emplace_back(std::make_unique<io::ParameterFile>(node.parameters, warn_)).get();
    const std::uint8_t id = node.id == 0 ? sim::Node::kNoNodeId : node.id;
    sim::Node& made = world_.add_node(id, std::move(nodes[i].image), parts);
    nodes_.push_back({&made, node.name, nodes[i].device});
  }
}

void Simulator::set_faults(const Config& config) {
  for (const FaultConfig& fault : config.can.faults)
    world_.faults().add(fault.fault, started_);
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    for (const FaultConfig& fault : config.nodes[i].faults)
      nodes_[i].node->add_fault(fault.fault, started_);
}

/// Devices' clocks show this machine's time; on a manual clock it is midnight of 1984-01-01 when the world
/// begins.
void Simulator::tell_time_of_day() {
  constexpr Time kDay = 24 * 3600 * kSecond;
  constexpr Time kDaysTo1984 = 5113;  // since 1970
  if (input_) return;
  const Time since_1970 = started_ + io::Reactor::wall_offset();
  const TimeOfDay time{static_cast<std::uint32_t>(since_1970 % kDay / kMillisecond),
                       static_cast<std::uint16_t>(since_1970 / kDay - kDaysTo1984)};
  for (const PlantNode& plant : nodes_)
    plant.node->device().time_stamp().set(time, started_);
}

/// On a manual clock hours may pass between two looks at the clients: nobody is too slow then.
void Simulator::open_slcan(const Config& config) {
  const std::size_t most_unsent = input_ ? sim::SlcanAdapter::kUnlimited : sim::SlcanAdapter::kMostUnsent;
  slcan_.emplace(
      reactor_, world_.bus(), io::parse_stream_address(config.can.slcan), most_unsent, [this] { advance(); },
      warn_);
}

void Simulator::open_control(const Config& config) {
  commands_.emplace(
      reactor_, io::parse_stream_address(config.control.listen),
      [this](std::string_view line) { return execute(line); }, warn_);
}

/// A manual clock's log begins at 0, and is the same every time.
void Simulator::open_log(const Config& config) {
  const std::string interface = config.can.interface_name.empty() ? "virtual" : config.can.interface_name;
  log_.emplace(config.log.file, interface, input_ ? 0 : io::Reactor::wall_offset(), warn_);
  world_.bus().observe(*log_);
}

std::string Simulator::where() const {
  std::string text;
  if (modbus_) text += "modbus=" + io::to_string(modbus_->address()) + " ";
  text += "can=" + can_;
  if (slcan_) text += " slcan=" + io::to_string(slcan_->address());
  if (commands_) text += " control=" + io::to_string(commands_->address());
  return text;
}

void Simulator::run() {
  tell_time_of_day();
  world_.start(now());
  while (!signals_.stop_requested() && !(input_ && input_->ended())) {
    turn(kNever);
    if (input_) take_input();
  }
}

/// Does what is due, waits until `until` at most, and takes in what has come; returns how many had something.
std::size_t Simulator::turn(Time until) {
  advance();
  if (modbus_) modbus_->poll(io::Reactor::now());
  flush();
  if (commands_) commands_->flush();
  return reactor_.run_once(earlier(until, next_deadline()));
}

void Simulator::take_input() {
  input_->poll();
  for (auto line = input_->take(); line && !signals_.stop_requested(); line = input_->take()) {
    for (int turns = 0; turns < kMostTurnsBeforeLine && turn(0) != 0; ++turns) {
    }
    take_line(*line);
  }
}

/// A line that means nothing ends the program: whoever wrote it is a script.
void Simulator::take_line(const std::string& line) {
  if (is_pass(line)) return pass(parse_pass(line));
  const std::string answer = execute(line);
  if (answer.starts_with(kError))
    throw io::UsageError("standard input: " +
                         answer.substr(kError.size(), answer.size() - kError.size() - 1));
  std::cout << answer << std::flush;
}

/// What came due has been sent when the answer is printed.
void Simulator::pass(Time duration) {
  now_ += duration;
  advance();
  flush();
  std::cout << "at " << seconds_text(now_) << std::endl;
}

/// What the command brings about has happened when it is answered.
std::string Simulator::execute(std::string_view line) {
  advance();
  std::string answer = control_.execute(line, now());
  advance();
  flush();
  return answer;
}

void Simulator::on_fault(std::string_view text, Time now) {
  warn_(seconds_text(now - started_) + " " + std::string(text));
}

/// The log and the adapters have what the bus has brought.
void Simulator::flush() {
  if (log_) log_->flush();
  if (slcan_) slcan_->flush();
}

void Simulator::on_request(bool wrote) {
  advance();
  if (wrote) module_->on_registers_written(now());
}

void Simulator::advance() {
  const Time time = now();
  if (socketcan_) socketcan_->poll(time);
  world_.advance(time);
}

Time Simulator::next_deadline() const {
  Time next = input_ ? input_->next_deadline() : world_.next_deadline();
  if (modbus_) next = earlier(next, modbus_->next_deadline());
  return socketcan_ ? earlier(next, socketcan_->next_deadline()) : next;
}

std::string Simulator::summary() const {
  std::ostringstream text;
  if (module_ != nullptr) text << summary_of(module_->coprocessor(), modbus_->counters());
  if (slcan_)
    text << "SLCAN connections " << slcan_->counters().connections << ", frames not read in time "
         << slcan_->counters().lost << "\n";
  return text.str();
}

}  // namespace cbcan::app
