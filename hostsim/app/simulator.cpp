// SPDX-License-Identifier: MIT
#include "app/simulator.hpp"

#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <sstream>
#include <utility>

#include "app/manual_clock.hpp"
#include "cbcan/version.hpp"

namespace cbcan::app {

namespace {

io::ModbusTcpSettings settings_of(const plant::ModbusConfig& modbus) {
  io::ModbusTcpSettings settings;
  settings.listen = {modbus.host, modbus.port};
  settings.identity = {"cbcan", "cbcan-sim", std::string(kVersion)};
  return settings;
}

constexpr std::string_view kError = "error: ";

}  // namespace

Simulator::Simulator(const plant::Config& config, std::vector<std::vector<plant::BuiltNode>> nodes,
                     const io::Warn& warn)
    : warn_(warn),
      signals_(reactor_),
      started_(config.time.clock == plant::ClockKind::kManual ? 0 : io::Reactor::now()) {
  if (config.time.clock == plant::ClockKind::kManual) input_.emplace(reactor_, STDIN_FILENO);
  open_networks(config, std::move(nodes));
  open_modbus(config);
  if (!config.control.listen.empty()) open_control(config);
}

void Simulator::open_networks(const plant::Config& config, std::vector<std::vector<plant::BuiltNode>> nodes) {
  const Surroundings surroundings{reactor_, warn_, [this] { return now(); }, started_, input_.has_value()};
  std::vector<PlantNetwork*> plants;
  for (std::size_t i = 0; i < config.networks.size(); ++i) {
    networks_.push_back(
        std::make_unique<Network>(config, config.networks[i], std::move(nodes[i]), surroundings));
    plants.push_back(&networks_.back()->plant());
  }
  control_.emplace(std::move(plants), started_);
}

/// Where no network has a module there is nothing to serve.
void Simulator::open_modbus(const plant::Config& config) {
  std::vector<io::ModbusTcp::Registers> registers;
  for (const auto& network : networks_)
    registers.push_back(network->registers());
  if (std::ranges::all_of(registers, [](const auto& words) { return words.empty(); })) return;
  modbus_.emplace(
      reactor_, std::move(registers), settings_of(config.modbus),
      [this](std::size_t network, bool wrote) { networks_[network]->on_request(wrote); }, warn_);
}

void Simulator::open_control(const plant::Config& config) {
  commands_.emplace(
      reactor_, text::parse_stream_address(config.control.listen),
      [this](std::string_view line) { return execute(line); }, warn_);
}

std::string Simulator::where() const {
  std::string text;
  if (modbus_) text += "modbus=" + to_string(modbus_->address()) + " ";
  for (const auto& network : networks_)
    text += (network == networks_.front() ? "" : " ") + network->where();
  if (commands_) text += " control=" + to_string(commands_->address());
  return text;
}

void Simulator::run() {
  for (const auto& network : networks_)
    network->start();
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
  std::string answer = control_->execute(line, now());
  advance();
  flush();
  return answer;
}

void Simulator::flush() {
  for (const auto& network : networks_)
    network->flush();
}

void Simulator::advance() {
  for (const auto& network : networks_)
    network->advance();
}

Time Simulator::next_deadline() const {
  Time next = input_ ? input_->next_deadline() : kNever;
  if (modbus_) next = earlier(next, modbus_->next_deadline());
  for (const auto& network : networks_)
    next = earlier(next, network->next_deadline());
  return next;
}

std::string Simulator::summary() const {
  std::ostringstream text;
  for (const auto& network : networks_)
    text << network->module_summary();
  if (modbus_)
    text << "Modbus requests " << modbus_->counters().requests << ", exceptions "
         << modbus_->counters().exceptions << ", connections " << modbus_->counters().connections << "\n";
  for (const auto& network : networks_)
    text << network->slcan_summary();
  return text.str();
}

}  // namespace cbcan::app
