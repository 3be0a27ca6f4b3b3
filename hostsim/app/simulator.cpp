// SPDX-License-Identifier: MIT
#include "app/simulator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <thread>
#include <utility>

#include "scenario/scenario_writer.hpp"

namespace cbcan::app {

namespace {

/// A shell's background job would be stopped if it read the terminal.
bool is_background_job() {
  const pid_t foreground = ::tcgetpgrp(STDIN_FILENO);
  return foreground >= 0 && foreground != ::getpgrp();
}

}  // namespace

window::Line line_of(const config::LineConfig& config) {
  return {config.device, static_cast<int>(config.baud), config.parity.front()};
}

BusConnections::BusConnections(const config::NetworkConfig& config, plant::Network& network,
                               io::Reactor& reactor, const session::Host& host, const io::Warn& warn)
    : network_(network), reactor_(reactor), host_(host), warn_(warn) {
  if (!config.can.outside.empty()) open_outside(config::can_spec(config.can));
  if (network.module() != nullptr) open_plc(config);
  if (!config.log.empty()) open_log(config);
}

void BusConnections::open_outside(const std::string& can_spec) {
  using Kind = config::CanSpec::Kind;
  sim::Bus& bus = network_.world().bus();
  const config::CanSpec& can = spec_.emplace(config::parse_can_spec(can_spec));
  const bool is_adapter = can.kind == Kind::kSlcan;
  if (can.kind == Kind::kSocketCan)
    outside_ = io::socketcan_bus(reactor_, bus, can.name, warn_);
  else
    outside_ = io::stream_bus(reactor_, bus, can_spec, is_adapter ? can.name : "", can.remote,
                              session::dialect_of(can), warn_);
}

void BusConnections::open_plc(const config::NetworkConfig& config) {
  const config::PlcConfig& plc = config.plc;
  if (plc.address.empty() && plc.line.device.empty()) return;
  std::unique_ptr<window::Connection> connection;
  if (plc.address.empty())
    connection = window::rtu_connection(line_of(plc.line), io::kPlcTiming);
  else
    connection = io::plc_over_tcp(session::plc_address(plc));
  plc_.emplace(reactor_, network_, std::move(connection), session::plc_exchanges(config, network_),
               io::PlcSettings{plc.unit, milliseconds(plc.period_ms)}, warn_);
}

/// On a manual clock the log begins at 0 and is reproducible, so it replaces a file and drops nothing for a
/// slow reader.
void BusConnections::open_log(const config::NetworkConfig& config) {
  const bool on_interface = spec_ && spec_->kind == config::CanSpec::Kind::kSocketCan;
  const std::string interface = on_interface ? spec_->name : "virtual";
  using Content = io::Output::Content;
  log_.emplace(io::CandumpLog::Settings{config.log, interface, host_.wall_offset(),
                                        host_.clock_runs() ? Content::kKept : Content::kReplaced,
                                        config.log_mb * kMegabyte, most_waiting(host_)},
               warn_);
  network_.world().bus().observe(*log_);
}

void BusConnections::poll(Time now) {
  if (plc_) plc_->poll(now);
  flush();
}

Time BusConnections::next_deadline() const {
  Time next = kNever;
  if (log_) next = earlier(next, log_->next_deadline());
  if (plc_) next = earlier(next, plc_->next_deadline());
  return outside_ ? earlier(next, outside_->next_deadline()) : next;
}

std::string BusConnections::plc_summary(std::string_view name) const {
  if (!plc_) return {};
  return fmt::format("{}PLC requests {}, exceptions {}, connections lost {}\n", name,
                     plc_->counters().requests, plc_->counters().exceptions, plc_->counters().lost);
}

Simulator::Simulator(const config::Config& config, config::PlantBuild build, const std::string& plant_file,
                     Console& console, bool reads_input, Files files)
    : console_(console),
      warn_([this](const std::string& line) { session_ ? session_->warn(line) : console_.warn(line); }),
      signals_(reactor_),
      clock_runs_(config.clock == config::ClockKind::kReal),
      reads_input_(reads_input) {
  if (files == Files::kCopied) copies_.emplace(build.read);
  const std::string folder = std::filesystem::current_path().string();
  session_.emplace(config, std::move(build), scenario::absolute_plant(plant_file, folder),
                   static_cast<session::Host&>(*this));
  open_buses(config);
  open_modbus(config);
  open_services(config);
  open_views(config);
  signals_.on_hangup([this] {
    return std::ranges::count_if(connections_, [](auto& network) { return network->reopen_log(); }) != 0;
  });
}

sim::ParameterStore* Simulator::store(const std::string& file) {
  if (copies_) return copies_->find(file);
  return parameters_.emplace_back(std::make_unique<io::ParameterFile>(file, warn_)).get();
}

void Simulator::advance_buses() {
  for (BusConnections* network : connected_)
    network->poll_outside();
}

void Simulator::shut_down() {
  if (child_)
    child_->signal(SIGTERM);
  else
    stop();
}

void Simulator::fail(base::ExitCode code, const std::string& why) {
  if (code == base::ExitCode::kCheckFailed) throw CheckFailed(why);
  throw io::UsageError(why);
}

void Simulator::open_buses(const config::Config& config) {
  const session::Host& host = *this;
  for (std::size_t i = 0; i < config.networks.size(); ++i) {
    const config::NetworkConfig& network = config.networks[i];
    connections_.push_back(
        std::make_unique<BusConnections>(network, *plant().networks()[i], reactor_, host, warn_));
    if (connections_.back()->exist()) connected_.push_back(connections_.back().get());
    session_->services().at("plc", network.number).place = connections_.back()->plc();
  }
  session_->control().on_journal_filled = [this] { poll_views(); };
}

/// Without a module in any network there is nothing to serve.
void Simulator::open_modbus(const config::Config& config) {
  session::Services& services = session_->services();
  if (services.at("modbus").listen.empty()) return;
  const config::RtuConfig& rtu = config.rtu;
  if (!rtu.line.device.empty())
    rtu_.emplace(reactor_, session_->units(), line_of(rtu.line), rtu.station, warn_);
  if (!rtu.listen.empty())
    rtu_tcp_.emplace(reactor_, "rtu over tcp", base::parse_stream_address(rtu.listen),
                     services.at("rtu_tcp").connect, warn_);
  modbus_.emplace(reactor_, config.modbus, session_->modbus(), warn_);
  services.at("modbus").place = to_string(modbus_->address());
  if (rtu_) services.at("rtu").place = rtu_->device();
  if (rtu_tcp_) services.at("rtu_tcp").place = to_string(rtu_tcp_->address());
}

void Simulator::open_views(const config::Config& config) {
  if (!config.record.empty()) {
    const auto file = std::make_shared<io::Output>(io::Output::open("record", config.record));
    session_->record([this, file, path = config.record, ended = false](std::string_view lines) mutable {
      if (ended) return;
      const bool is_added = file->add(lines);
      const int error = file->flush();
      ended = !is_added || error != 0;
      if (!ended) return;
      file->take_rest();
      warn_(fmt::format(
          "record {}: {}; the recording ends here, the simulation goes on; make room, or record into another file",
          path, error != 0 ? io::reason(error) : "it is not read"));
    });
  }
  if (!config.pcap.empty())
    pcap_.emplace(
        session_->control().journal(),
        io::PcapFile::Settings{config.pcap, config.pcap_mb * kMegabyte, plant().networks().size(),
                               wall_offset() + session_->started(), most_waiting(*this)},
        [this](base::Buffer& to, const auto& event) {
          append_packet_comment(to, event, session_->control().journal(), session_->find_name());
        },
        warn_);
  if (modbus_ && (session_->has_views() || pcap_ || http_))
    session_->modbus().on_client = std::bind_front(&session::Session::on_client, &*session_);
}

void Simulator::open_services(const config::Config& config) {
  for (session::Service& service : session_->services()) {
    if (service.listen.empty() || !service.connect || service.name == "rtu_tcp") continue;
    const io::StreamServer& server =
        (service.network == 0 ? commands_ : bus_servers_)
            .emplace_back(reactor_, service.name, base::parse_stream_address(service.listen), service.connect,
                          warn_);
    service.place = to_string(server.address());
    service.connections = 0;  // a terminal has a session before its first client
  }
  session::Service& http = session_->services().at("http");
  if (http.listen.empty()) return;
  http_.emplace(reactor_, base::parse_listen_address(http.listen, 0), config.http.write,
                session_->http(config), warn_);
  http.place = to_string(http_->address());
}

session::Served Simulator::served() const {
  return http_ ? session::Served{http_->may_write(), http_->streams()} : session::Served{};
}

void Simulator::poll_views() {
  session_->poll_views();
  if (pcap_) pcap_->poll();
}

void Simulator::run() {
  observed_ = !clock_runs_ || session_->has_views() || pcap_ || rtu_ || http_ || !commands_.empty() ||
              !bus_servers_.empty() || !connected_.empty();
  reactor_.read_clock();
  if (clock_runs_) session_->set_time_of_day(session_->started() + wall_offset());
  session_->start(observed_);
  if (!clock_runs_) drive_by_commands();
  while (clock_runs_ && !stop_requested())
    poll(kNever);
  flush();
  for (io::StreamServer& server : commands_)
    server.flush();
}

void Simulator::restart_command() {
  if (!command_.empty())
    child_.emplace(reactor_, command_, session_->services().environment(), [this] {
      signals_.restore();
      ::dup2(command_error_, STDERR_FILENO);
    });
}

int Simulator::run(const std::vector<std::string>& command, int error) {
  command_ = command;
  command_error_ = error;
  restart_command();
  signals_.pass_on([this](int number) { child_->signal(number); });
  run();
  return child_->exit_code().value_or(SIGKILL);
}

bool Simulator::stop_requested() const {
  return stopping_ || (child_ ? child_->exit_code().has_value() : signals_.stop_requested());
}

std::size_t Simulator::poll(Time until) {
  Time next = next_deadline();
  if (observed_ || next <= reactor_.time() || console_.waits()) next = poll_due();
  if (clock_runs_) reactor_.hold_at(plant().schedule().first_time());
  return reactor_.poll(stopping_ ? 0 : earlier(until, next));
}

/// Does what is due in the plant, in order of time, for kLongestPiece at most; then clients and signals are
/// polled before the rest.
void Simulator::advance_in_pieces() {
  constexpr Time kLongestPiece = 10 * kMillisecond;
  constexpr Time kMostBehind = kSecond;
  const Time end = reactor_.clock() + kLongestPiece;
  const auto is_late = [this] { return plant().schedule().first_time() <= reactor_.clock(); };
  plant().schedule().poll(reactor_.time());
  while (is_late() && reactor_.clock() < end) {
    reactor_.hold_at(plant().schedule().first_time());
    plant().schedule().poll(reactor_.time());
    reactor_.read_clock();
  }
  reactor_.hold_at(plant().schedule().first_time());
  const bool is_behind = is_late() && (is_behind_ || reactor_.clock() - reactor_.time() > kMostBehind);
  if (is_behind && !is_behind_) warn_(std::string(session::kBehind));
  is_behind_ = is_behind;
}

/// When something is due, apart from observers.
Time Simulator::next_deadline() const {
  const Time modbus = modbus_ ? modbus_->next_deadline() : kNever;
  return clock_runs_ ? earlier(modbus, session_->plant().schedule().first_time()) : modbus;
}

/// Does what is due; returns the time of the next action.
Time Simulator::poll_due() {
  for (BusConnections* network : connected_)
    network->advance();
  if (clock_runs_) advance_in_pieces();
  const Time now = reactor_.time();
  if (observed_) session_->poll_waits();
  if (modbus_) modbus_->poll(now);
  const Time observers = observed_ ? poll_observers(now) : kNever;
  return earlier(earlier(observers, next_deadline()), console_.flush());
}

/// Returns the time of their next action. Views come before the responses to commands.
Time Simulator::poll_observers(Time now) {
  if (rtu_) rtu_->poll(now);
  for (BusConnections* network : connected_)
    network->poll(now);
  poll_views();
  for (auto* servers : {&bus_servers_, &commands_})
    for (io::StreamServer& server : *servers)
      server.flush();
  poll_views();
  if (http_) http_->poll(now);
  return observers_deadline();
}

void Simulator::flush() {
  poll_views();
  for (BusConnections* network : connected_)
    network->flush();
  for (io::StreamServer& server : bus_servers_)
    server.flush();
  console_.flush();
}

Time Simulator::observers_deadline() const {
  Time next = kNever;
  if (pcap_) next = pcap_->next_deadline();
  if (http_) next = earlier(next, http_->next_deadline());
  if (rtu_) next = earlier(next, rtu_->next_deadline());
  if (clock_runs_) {
    const Time due = session_->waits().next_deadline();
    if (due != kNever) next = earlier(next, session_->started() + due);
  } else if (session_->waits().want_time()) {
    next = 0;
  }
  return earlier(next, sim::earliest(connected_, &BusConnections::next_deadline));
}

/// On a clock that runs, the plant does afterwards what was due.
void Simulator::let_pass(Time duration) {
  if (clock_runs_) {
    std::this_thread::sleep_for(std::chrono::microseconds(duration));
    reactor_.read_clock();
  } else {
    session_->let_pass(duration, manual_now_);
  }
}

std::string Simulator::summary() const {
  std::string text = session_->summary();
  if (rtu_)
    text +=
        fmt::format("Modbus RTU requests {}, exceptions {}, CRC errors {}\n", rtu_->counters().slave_messages,
                    rtu_->counters().slave_exceptions, rtu_->counters().bus_communication_errors);
  for (const auto& network : session_->plant().networks()) {
    const std::size_t number = network->number();
    text +=
        connections_[number - 1]->plc_summary(session_->name_of(number)) + session_->clients_summary(number);
  }
  return text;
}

// ---- On a manual clock: only the commands pass and wait let time pass, from wherever they come

/// Requests that have arrived are handled before time passes, in this many turns at most: endless requests do
/// not stop the clock.
void Simulator::poll_clients() {
  constexpr int kMostTurns = 100;
  for (int turns = 0; turns < kMostTurns && poll(0) != 0; ++turns) {
  }
}

/// Takes no further lines while the responses are not read.
void Simulator::drive_by_commands() {
  std::optional<io::LineInput> input;
  if (reads_input_ && !is_background_job()) input.emplace(reactor_);
  while (!stop_requested() && !(input && input->ended() && !session_->input_waits())) {
    const Time look = !console_.heard() ? io::Reactor::now() + io::Output::kRetry
                      : input           ? input->next_deadline()
                                        : kNever;
    poll(earlier(look, session_->waits().plc_deadline()));
    session_->waits().give_up_on_plc(io::Reactor::now());
    let_time_pass();
    if (input) take_lines(*input);
  }
}

void Simulator::take_lines(io::LineInput& input) {
  input.poll();
  while (console_.heard() && !stop_requested() && !session_->input_waits()) {
    const auto line = input.take();
    if (!line) break;
    poll_clients();
    session_->input(*line);
    let_time_pass();
  }
}

/// While a wait wants it, until one has ended, a signal has come or stop() was called; then says what standard input has waited
/// for.
void Simulator::let_time_pass() {
  if (session_->waits().want_time()) {
    poll_clients();
    bool is_over = false;
    while (!is_over && !stopping_ && session_->waits().want_time() && !signals_.poll())
      is_over = session_->step(manual_now_);
    flush();
  }
  session_->say_responses();
}

}  // namespace cbcan::app
