// SPDX-License-Identifier: MIT
#include "plant/network.hpp"

#include <algorithm>

#include "cbcan/coprocessor/local_objects.hpp"
#include "cbcan/version.hpp"
#include "journal/event_text.hpp"

namespace cbcan::plant {

namespace {

Coprocessor::Settings settings_of(const config::ModuleConfig& module) {
  Coprocessor::Settings settings = module;
  if (module.plc_lost_state == config::PlcLostState::kStopped) settings.plc_lost = nmt::Command::kStop;
  return settings;
}

/// The windows of all channels.
std::vector<ScannerWindow> scanners_of(std::span<std::uint16_t> all, const config::ModuleConfig& module) {
  std::vector<ScannerWindow> scanners;
  for (unsigned channel = 1; channel <= module.channels; ++channel)
    scanners.emplace_back(
        all.subspan(regmap::of_channel(module.scanner_out_first, channel)).first<regmap::kScannerOutWords>(),
        all.subspan(regmap::of_channel(module.scanner_in_first, channel)).first<regmap::kScannerInWords>());
  return scanners;
}

/// docs/reference/contract.md, "Coils and discrete inputs".
ModbusBits bits_of(const config::ModuleConfig& module) {
  constexpr std::uint16_t kProcessBits = 16 * regmap::kInputWords;
  constexpr std::uint16_t kMapBits = 16 * regmap::kStatusMapWords * regmap::kStatusMapCount;
  const auto maps = static_cast<std::uint16_t>(module.status_first + regmap::kStatusMaps);
  const auto outputs = static_cast<std::uint16_t>(module.process_first + regmap::kInputWords);
  return {{0, kProcessBits, outputs},
          {{{0, kProcessBits, module.process_first}, {kProcessBits, kMapBits, maps}}}};
}

void add_faults(sim::FaultSet& to, const std::vector<config::FaultConfig>& faults, Time started) {
  for (const config::FaultConfig& fault : faults)
    to.add(fault.fault, started);
}

/// The client number of a PLC that owns its registers, and of commands.
constexpr std::uint32_t kOwner = 0xFFFFFFFF;

bool is_in_window(const modbus::Range& written) {
  constexpr std::size_t kEnd = regmap::kWindowFirst + regmap::kWindowWords;
  return written.first >= regmap::kWindowFirst && written.first + written.count <= kEnd;
}

/// Wires and devices without delay may form a loop: this many rounds at one time, then one per millisecond.
constexpr unsigned kMostRounds = 100;

}  // namespace

Network::Network(const config::Config& plant, const config::NetworkConfig& config,
                 std::vector<sim::NodeParts> nodes, const NetworkContext& context,
                 sim::ParameterStore* parameters, config::NetworkImage image)
    : Timed(context.schedule),
      context_(context),
      number_(config.number),
      module_config_(config.module),
      bits_(bits_of(config.module)),
      world_(config.can.bit_rate, config::network_seed(plant, config), this),
      tester_(world_.bus().attach(*this)),
      plc_faults_(sim::FaultPlace::kPlc, "plc", config::network_seed(plant, config), this,
                  [](Time /*now*/) {}) {
  if (config.module.enabled) {
    registers_.resize(regmap::kRegisterFileWords);
    const std::size_t status = config.module.status_first;
    const std::size_t end = status + regmap::kStatusWords;
    const std::span<std::uint16_t> words(registers_);
    ranges_ = {{{0, words.first(status)},
                {config.module.status_first, words.subspan(status, regmap::kStatusWords), false, true},
                {static_cast<std::uint16_t>(end), words.subspan(end)}}};
    bit_functions_ = &bits_;
    registers_[regmap::kExecuteFlag] = config.module.start_result;
    const std::span<std::uint16_t> all(registers_);
    module_ = &world_.add_module(RegisterWindow(all.subspan<regmap::kWindowFirst, regmap::kWindowWords>()),
                                 all.subspan(config.module.process_first).first<regmap::kProcessWords>(),
                                 settings_of(config.module), scanners_of(all, config.module), parameters);
    module_->show_status_in(all.subspan(config.module.status_first).first<regmap::kStatusWords>(),
                            all.subspan<regmap::kNodeRequest, 2>());
    if (!image.bytes.empty()) module_->manage(std::move(image.bytes), all, image.further_first);
  }
  for (sim::NodeParts& node : nodes) {
    node.listener = this;
    world_.add_node(std::move(node));
  }
  add_faults(world_.faults(), config.can.faults, context.now);
  add_faults(plc_faults_, config.plc.faults, context.now);
  for (std::size_t i = 0; i < config.nodes.size(); ++i)
    add_faults(world_.nodes()[i]->faults(), config.nodes[i].faults, context.now);
}

void Network::listen(journal::Journal& journal, Time started) {
  std::vector<journal::PlcWindow> windows;
  const std::span<const std::uint16_t> all(registers_);
  if (module_ != nullptr)
    windows = {{regmap::kWindowFirst, all.subspan(regmap::kWindowFirst, regmap::kWindowWords), {}}};
  for (unsigned channel = 1; module_ != nullptr && channel <= module_config_.channels; ++channel) {
    const std::uint16_t out = regmap::of_channel(module_config_.scanner_out_first, channel);
    const std::uint16_t in = regmap::of_channel(module_config_.scanner_in_first, channel);
    windows.push_back(
        {out, all.subspan(out, regmap::kScannerOutWords), all.subspan(in, regmap::kScannerInWords)});
  }
  watch_.emplace(
      journal,
      journal::Advisor::Network{static_cast<std::uint8_t>(number_), world_, module_, all,
                                module_config_.process_first, module_config_.status_first, started},
      windows);
  world_.bus().observe(*watch_);
  if (module_ != nullptr) module_->watch(&*watch_);
}

void Network::on_fault(std::string_view text, Time now) {
  context_.listener.on_fault(number_, text, now);
  if (watch_) watch_->on_fault(text, now);
}

void Network::on_node_state(std::uint8_t node, std::uint8_t state, Time now) {
  if (watch_) watch_->on_node_state(node, state, now);
}

void Network::on_terminals(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::int32_t before,
                           std::int32_t after, Time now) {
  if (watch_) watch_->on_terminals(node, index, sub, before, after, now);
}

void Network::start(bool observed) {
  observed_ = observed;
  started_ = context_.now;
  world_.start(started_);
  if (wires_ == nullptr) wants(own_deadline());
}

void Network::advance() {
  wires_ != nullptr ? wires_->advance() : advance_alone(context_.now);
}

Time Network::next_deadline() const {
  return wires_ != nullptr ? wires_->next_deadline() : own_deadline();
}

void Network::advance_alone(Time now) {
  for (; replay_due() <= now; ++replayed_) {
    world_.advance(replay_due());
    send(replay_[replayed_].frame);
  }
  world_.advance(now);
  if (wires_ == nullptr) wants(own_deadline());
}

void Network::advance_due() {
  if (wanted() <= context_.now || wires_ != nullptr) advance();
}

void Network::on_request(std::uint32_t client, bool valid, const modbus::Range& written) {
  ++requests_;
  if (!valid) ++exceptions_;
  const bool writes = written.count != 0;
  if (!writes) advance_due();
  if (writes && observed_) context_.listener.on_written(number_, written);
  if (valid && module_ != nullptr) module_->on_plc(client, written.first, written.count, context_.now);
  if (!writes) return;
  apply(written.first, written.count);
  if (observed_) context_.listener.on_applied();
}

/// Such a PLC is alive with each response, whether it writes or not.
void Network::on_taken(const modbus::Range& taken) {
  if (module_ != nullptr) module_->on_plc(kOwner, regmap::kWindowFirst, regmap::kWindowWords, context_.now);
  on_request(kOwner, true, taken);
}

/// Flattened for speed: nearly all that a request passes here is one function.
[[gnu::flatten]] modbus::Pdu Network::handle(const protocols::ModbusRequest& request, Room room) {
  if (!plc_faults_.empty() && !request.is_on_line()) return handle_disturbed(request, room);
  return execute(request, modbus::check(request.pdu, map_, functions_for(request)), room);
}

[[gnu::noinline]] modbus::Pdu Network::handle_disturbed(const protocols::ModbusRequest& request, Room room) {
  const modbus::Access access = modbus::check(request.pdu, map_, functions_for(request));
  const sim::Fault* const fault = fault_on(request, access);
  if (fault == nullptr) return execute(request, access, room);
  const auto [kind, delay] = std::pair(fault->kind, fault->delay);  // execute() may change the faults
  if (kind == sim::FaultKind::kModuleRestart) restart_module();
  if (kind == sim::FaultKind::kModuleRestart || kind == sim::FaultKind::kCutBefore) return {};
  if (kind == sim::FaultKind::kException)
    return execute(request, {modbus::Exception{static_cast<std::uint8_t>(fault->code)}}, room);
  const modbus::Pdu response = execute(request, access, room);
  if (kind == sim::FaultKind::kLate) context_.listener.on_late_response(delay);
  if (kind == sim::FaultKind::kPlcRestart) context_.listener.on_plc_restart();
  return kind == sim::FaultKind::kLate ? response : modbus::Pdu{};
}

modbus::Pdu Network::execute(const protocols::ModbusRequest& request, const modbus::Access& access,
                             Room room) {
  const bool writes = access.written.count != 0;
  const bool diagnoses = access.read.first + access.read.count > regmap::kDiagnosticsFirst;
  if (writes || diagnoses || request.is_on_line()) advance_due();
  if (writes && !is_in_window(access.written)) on_writer(request.client, access.written);
  if (diagnoses) publish();
  const modbus::Pdu response =
      room.first(modbus::execute(request.pdu, access, map_, functions_for(request), room));
  if (watch_) {
    const bool answers = !request.is_on_line() || request.unit != 0;
    watch_->on_modbus({request.client, request.id, request.unit,
                       answers ? static_cast<std::uint8_t>(access.exception) : std::uint8_t{0}, request.pdu,
                       answers ? response : modbus::Pdu{}},
                      access, context_.now);
  }
  on_request(request.client, access.exception == modbus::Exception::kNone, access.written);
  if (watch_) watch_->advisor().on_handled();
  return response;
}

/// Executes it and restores the registers.
bool Network::changes_registers(const protocols::ModbusRequest& request, const modbus::Access& access) {
  advance_due();
  const auto words = std::span(registers_).subspan(access.written.first, access.written.count);
  const std::vector<std::uint16_t> before(words.begin(), words.end());
  std::array<std::uint8_t, modbus::kMaxPdu> unused;
  modbus::execute(request.pdu, access, map_, functions_for(request), unused);
  const bool changed = !std::ranges::equal(words, before);
  std::ranges::copy(before, words.begin());
  return changed;
}

/// One fault at most acts on a request. `after` does not count a cyclic program's writes of what is there.
const sim::Fault* Network::fault_on(const protocols::ModbusRequest& request, const modbus::Access& access) {
  const bool writes = access.written.count != 0;
  const bool changes = writes && changes_registers(request, access);
  const bool reads = !writes && access.read.count != 0;
  const bool counts = changes || (reads && std::exchange(has_changed_, false));
  const bool matches = writes || (reads && std::exchange(has_written_, false));
  if (writes) has_written_ = true;
  if (changes) has_changed_ = true;
  const sim::SetFault* acting = nullptr;
  for (sim::SetFault& set : plc_faults_.all())
    if ((set.fault.after == 0 ? matches : counts) && plc_faults_.acts(set, context_.now) && acting == nullptr)
      acting = &set;
  if (acting == nullptr) return nullptr;
  plc_faults_.tell(*acting,
                   base::made([&](base::Buffer& to) { journal::append_modbus(to, request.pdu, {}); }),
                   context_.now);
  return &acting->fault;
}

void Network::restart_module() {
  std::ranges::fill(registers_, std::uint16_t{0});
  registers_[regmap::kExecuteFlag] = module_config_.start_result;
  if (watch_) watch_->before(context_.now);  // requests in progress end without a result
  module_->restart(context_.now);
  advance();
}

void Network::apply(std::size_t first, std::size_t count) {
  if (module_ != nullptr) module_->on_registers_written(first, count, context_.now);
  if (wires_ != nullptr) return wires_->advance();
  wants(earlier(world_.advance_bus(context_.now), replay_due()));
}

void Network::write(std::size_t first, std::span<const std::uint16_t> words) {
  world_.advance(context_.now);
  std::ranges::copy(words, registers_.begin() + static_cast<std::ptrdiff_t>(first));
  module_->on_plc(kOwner, first, words.size(), context_.now);
  apply(first, words.size());
}

void Network::publish() {
  if (module_ == nullptr) return;
  const auto put = [this](std::uint16_t address, std::uint64_t number) {
    registers_[address] = static_cast<std::uint16_t>(number);
    registers_[address + 1u] = static_cast<std::uint16_t>(number >> 16);
  };
  const sim::Port& port = module_->port();
  const Coprocessor::Counters transactions = module_->coprocessor().counters();
  registers_[regmap::kVersion] = static_cast<std::uint16_t>(kVersionNumbers[0] << 8 | kVersionNumbers[1]);
  registers_[regmap::kPatchLevel] = kVersionNumbers[2];
  registers_[regmap::kResetCause] = static_cast<std::uint16_t>(regmap::ResetCause::kPowerOn);
  registers_[regmap::kCanState] = static_cast<std::uint16_t>(local::kernel_state(port.state()));
  registers_[regmap::kSecondWriters] = static_cast<std::uint16_t>(second_writers_);
  registers_[regmap::kMistakesSeen] = 0;
  for (const journal::Advice& advice : this->advice())
    registers_[regmap::kMistakesSeen] |=
        static_cast<std::uint16_t>(1U << static_cast<unsigned>(advice.mistake));
  put(regmap::kUptime, (context_.now - started_) / kMillisecond);
  put(regmap::kModbusRequests, requests_);
  put(regmap::kModbusExceptions, exceptions_);
  put(regmap::kCanReceived, module_->received());
  put(regmap::kCanSent, port.sent());
  put(regmap::kCanRefused, port.refused());
  put(regmap::kCanLost, port.dropped());
  put(regmap::kTransactions, transactions.executed);
  put(regmap::kTransactionsFailed, transactions.failed);
  put(regmap::kTransactionsCancelled, transactions.cancelled);
}

/// A scanner window may have one writer: a client that writes after a newer one is a second program.
void Network::on_writer(std::uint32_t client, const modbus::Range& written) {
  const std::size_t end = written.first + written.count;
  for (unsigned channel = 1; channel <= module_config_.channels; ++channel) {
    const std::size_t out = regmap::of_channel(module_config_.scanner_out_first, channel);
    if (out < written.first) continue;
    if (out >= end) return;
    std::uint32_t& last = writers_[channel - 1];
    if (client < last) {
      ++second_writers_;
      if (watch_) watch_->advisor().on_second_writer(channel, client, last, context_.now);
    }
    last = client;
  }
}

Wires::Wires(const config::Config& config, std::span<const config::WireConfig> wires,
             std::vector<Network*> networks, const NetworkContext& context)
    : Timed(context.schedule), now_(context.now), networks_(std::move(networks)) {
  for (const config::WireConfig& wire : wires) {
    const End to = end(config, wire.to);
    ActiveWire active{.from = end(config, wire.from),
                      .to = to,
                      .wire = sim::Wire(wire.transfer),
                      .sample_due = wire.from.terminal.is_output ? kNever : 0,
                      .bits = &bits_[{to.node, to.terminal.index, to.terminal.sub}]};
    wires_.push_back(std::move(active));
  }
  if (wires_.empty()) return;
  for (Network* network : networks_)
    network->attach(*this);
  wants(now_);
}

Wires::End Wires::end(const config::Config& config, const config::WireEnd& end) {
  sim::Node& node = *networks_[end.network - 1]->world().nodes()[*config::place_of(config, end)];
  Watched& watched = watched_[&node];
  node.watch(watched.active);
  return {&node, &watched, end.terminal};
}

Time Wires::own_deadline() const {
  const bool is_active = std::ranges::any_of(watched_, [](const auto& node) { return node.second.active; });
  const auto due = [](const ActiveWire& wire) { return earlier(wire.sample_due, wire.due); };
  return earlier(is_active ? std::max(at_, held_until_) : kNever, sim::earliest(wires_, due));
}

Time Wires::next_deadline() const {
  return earlier(own_deadline(), sim::earliest(networks_, &Network::own_deadline));
}

void Wires::begin() {
  for (const Network* network : networks_)
    at_ = std::max(at_, network->started());
  for (ActiveWire& active : wires_)
    if (active.sample_due != kNever) active.sample_due = at_;
}

void Wires::advance() {
  if (!std::exchange(begun_, true)) begin();
  do
    advance_to(std::max(at_, std::min(now_, next_deadline())));
  while (at_ < now_ || next_deadline() <= now_);
  wants(next_deadline());
}

void Wires::advance_to(Time time) {
  if (time != at_) rounds_ = 0;
  at_ = time;
  for (Network* network : networks_)
    network->advance_alone(time);
  const bool samples = held_until_ <= time;
  for (auto& [node, watched] : watched_)
    watched.fresh = samples && std::exchange(watched.active, false);
  bool delivered = false;
  for (ActiveWire& active : wires_) {
    const bool fresh = active.from.watched->fresh || active.to.watched->fresh;
    if (fresh || active.sample_due <= time) sample(active);
    if (fresh || active.due <= time) delivered |= deliver(active);
  }
  if (delivered && ++rounds_ > kMostRounds) held_until_ = time + kMillisecond;
}

void Wires::sample(ActiveWire& active) {
  sim::Node& from = *active.from.node;
  double value = 0;
  if (from.has_power()) {
    if (!active.from.terminal.is_output) from.bring_up_to_date(at_);
    value = from.number(active.from.terminal).value_or(0);
  }
  active.wire.put(value, at_);
  active.due = at_;
  if (active.sample_due <= at_) active.sample_due += active.wire.transfer().sample_period;
}

/// Sum of all wires to a target that adds them; none while one of them has given nothing.
std::optional<double> Wires::total_at(const ActiveWire& active) const {
  if (!active.wire.transfer().sum) return active.given;
  double total = 0;
  for (const ActiveWire& wire : wires_) {
    if (wire.to.node != active.to.node || !(wire.to.terminal == active.to.terminal)) continue;
    if (!wire.given) return std::nullopt;
    total += *wire.given;
  }
  return total;
}

/// True if the input has changed.
bool Wires::deliver(ActiveWire& active) {
  const double value = active.wire.take(at_);
  active.due = active.wire.next_change(at_);
  sim::Node& to = *active.to.node;
  if (!to.has_power()) {
    active.given.reset();
    return false;
  }
  if (active.given == value) return false;
  active.given = value;
  const std::optional<double> total = total_at(active);
  if (!total) return false;
  const sim::Terminal& terminal = active.to.terminal;
  if (terminal.bit) {
    const std::uint64_t mask = std::uint64_t{1} << *terminal.bit;
    *active.bits = *total >= 0.5 ? *active.bits | mask : *active.bits & ~mask;
  }
  to.set_input(terminal.index, terminal.sub, terminal.bit ? static_cast<double>(*active.bits) : *total, at_,
               true);
  return true;
}

}  // namespace cbcan::plant
