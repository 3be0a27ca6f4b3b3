// SPDX-License-Identifier: MIT
#include "app/simulator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "app/manual_clock.hpp"
#include "cbcan/version.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::app {

namespace {

io::ModbusTcpSettings settings_of(const text::ListenAddress& modbus) {
  io::ModbusTcpSettings settings;
  settings.listen = {modbus.host, modbus.port};
  settings.identity = {"cbcan", "cbcan-sim", kVersion};
  return settings;
}

/// "CBCAN_MODBUS=127.0.0.1:1502" and "CBCAN_SLCAN_2=..." of "modbus=127.0.0.1:1502" and "2/slcan=...".
std::vector<std::string> environment_of(std::string_view where) {
  std::vector<std::string> lines;
  for (const std::string_view word : text::words_of(where)) {
    const auto [name, value] = text::split(word, '=').value_or(std::pair(word, std::string_view()));
    const auto [number, key] = text::split(name, '/').value_or(std::pair(std::string_view(), name));
    std::string line = fmt::format("CBCAN_{}{}{}=", key, number.empty() ? "" : "_", number);
    std::ranges::transform(line, line.begin(), [](char c) {
      return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    });
    lines.push_back(line.append(value));
  }
  return lines;
}

std::unique_ptr<Clock> make_clock(config::ClockKind kind, io::Reactor& reactor, Console& console,
                                  bool reads_input) {
  if (kind == config::ClockKind::kManual) return std::make_unique<ManualClock>(reactor, console, reads_input);
  return std::make_unique<Clock>(reactor);
}

}  // namespace

Simulator::Simulator(const config::Config& config, config::PlantBuild build, Console& console,
                     bool reads_input)
    : console_(console),
      warn_([this](const std::string& line) {
        if (trace_) trace_->poll();
        console_.warn(line);
      }),
      signals_(reactor_),
      clock_(make_clock(config.clock, reactor_, console, reads_input)),
      runs_(clock_->runs()),
      started_(clock_->now()) {
  open_plant(config, std::move(build));
  open_modbus(config);
  open_commands(config);
  open_views(config);
}

void Simulator::on_written(std::size_t network, const adapters::ModbusRange& written) {
  if (!recorder_) return;
  control().set_now(clock_->now());
  const auto registers = plant_->networks()[network - 1]->registers();
  recorder_->on_written(network, written.first, registers.subspan(written.first, written.count));
}

void Simulator::on_fault(std::size_t network, std::string_view text, Time now) {
  warn_(
      fmt::format("{} {}{}", text::seconds_text(std::max(now, started_) - started_), name_of(network), text));
}

/// Prefix of messages; empty if there is only one network.
std::string Simulator::name_of(std::size_t network) const {
  return is_only_network_ ? "" : fmt::format("network {}: ", network);
}

void Simulator::open_plant(const config::Config& config, config::PlantBuild build) {
  plant::NetworkListener& listener = *this;
  const auto store = [this](const std::string& file) -> sim::ParameterStore* {
    if (file.empty()) return nullptr;
    return parameters_.emplace_back(std::make_unique<io::ParameterFile>(file, warn_)).get();
  };
  plant_.emplace(config, std::move(build), clock_->now(), listener, store);
  is_only_network_ = config.networks.size() == 1;
  for (std::size_t i = 0; i < config.networks.size(); ++i) {
    const config::NetworkConfig& network = config.networks[i];
    connections_.push_back(std::make_unique<BusConnections>(
        network, name_of(network.number), *plant_->networks()[i], reactor_, *clock_, warn_));
    if (connections_.back()->exist()) connected_.push_back(connections_.back().get());
  }
  control().on_journal_filled = [this] { poll_views(); };
  find_name_ = names_of(control());
}

/// Without a module in any network there is nothing to serve.
void Simulator::open_modbus(const config::Config& config) {
  if (std::ranges::all_of(plant_->networks(),
                          [](const auto& network) { return network->registers().empty(); }))
    return;
  std::vector<adapters::ModbusUnit*> units;
  for (const auto& network : plant_->networks())
    units.push_back(network.get());
  const config::RtuConfig& rtu = config.rtu;
  if (!rtu.line.device.empty()) rtu_.emplace(reactor_, units, line_of(rtu.line), rtu.station, warn_);
  if (!rtu.listen.empty())
    rtu_tcp_.emplace(reactor_, "rtu over tcp", text::parse_stream_address(rtu.listen),
                     adapters::rtu_over_tcp(units, io::Reactor::now, rtu.station), warn_);
  modbus_.emplace(reactor_, std::move(units), settings_of(config.modbus), warn_);
}

void Simulator::open_views(const config::Config& config) {
  constexpr std::uint64_t kMegabyte = 1'000'000;
  if (config.verbose || config.verbose_frames)
    trace_.emplace(control(), find_name_, config.verbose_frames,
                   [this](std::string_view lines) { console_.tell(lines); });
  if (!config.pcap.empty())
    pcap_.emplace(
        control().journal(),
        io::PcapFile::Settings{config.pcap, config.pcap_mb * kMegabyte, plant_->networks().size(),
                               clock_->wall_offset() + started_, clock_->most_waiting()},
        [this](const auto& event) { return packet_comment(event, control().journal(), find_name_); }, warn_);
  if (!trace_ && !pcap_ && !http_) return;
  control().journal();
  if (modbus_)
    modbus_->on_client = [this](std::uint32_t client, std::string_view address, bool joined) {
      control().journal().add({.kind = journal::Kind::kClient,
                               .network = 0,
                               .state = joined,
                               .code = client,
                               .at = clock_->now() - started_},
                              address);
    };
}

void Simulator::open_commands(const config::Config& config) {
  const auto run = [this](std::string_view line, const auto& dialogue) { return execute(line, dialogue); };
  if (!config.control.empty())
    commands_.emplace(reactor_, "control", text::parse_stream_address(config.control),
                      adapters::command_sessions(run), warn_);
  if (config.http.listen.empty()) return;
  api_.emplace(web::Api::Parts{
      control(), find_name_, run, [this] { advance_and_answer(); }, [this] { return about(); }});
  http_.emplace(
      reactor_, text::parse_listen_address(config.http.listen, 0), config.http.write,
      [this](const adapters::HttpRequest& request) { return api_->respond(request); }, warn_);
}

web::Json Simulator::about() const {
  web::Json json{{"program", "cbcan-sim"}, {"where", where()}, {"clock", clock_->runs() ? "real" : "manual"}};
  json["plant"] = plant_file_;
  json["writable"] = http_->may_write();
  json["streams"] = http_->streams();
  if (modbus_) {
    json["modbus"] = to_string(modbus_->address());
    json["clients"] = modbus_->clients();
    json["requests"] = modbus_->counters().requests;
  }
  return json;
}

void Simulator::poll_views() {
  if (recorder_) recorder_->poll();
  if (trace_) trace_->poll();
  if (pcap_) pcap_->poll();
}

std::string Simulator::where() const {
  std::string text;
  if (modbus_) text += "modbus=" + to_string(modbus_->address()) + " ";
  if (rtu_) text += "rtu=" + rtu_->device() + " ";
  if (rtu_tcp_) text += "rtu_tcp=" + to_string(rtu_tcp_->address()) + " ";
  for (const auto& network : connections_)
    text += (network == connections_.front() ? "" : " ") + network->where();
  if (commands_) text += " control=" + to_string(commands_->address());
  if (http_) text += " http=" + to_string(http_->address());
  return text;
}

std::string Simulator::ways_in() const {
  std::string lines;
  for (const auto& network : connections_)
    lines += network->ways_in();
  return lines;
}

/// The path is absolute, as a recorded scenario may be in any folder.
void Simulator::set_plant(const std::string& plant_file) {
  const bool is_file = !plant_file.empty() && plant_file != "demo";
  plant_file_ = is_file ? std::filesystem::absolute(plant_file).string() : plant_file;
}

void Simulator::run() {
  observed_ = !runs_ || recorder_ || trace_ || pcap_ || commands_ || rtu_ || http_ || !connected_.empty();
  reactor_.read_clock();
  if (runs_) tell_time_of_day();
  plant_->start(observed_);
  clock_->drive(*this);
  flush();
  if (commands_) commands_->flush();
}

int Simulator::run(const std::vector<std::string>& command) {
  child_.emplace(reactor_, command, environment_of(where()), [this] { signals_.restore(); });
  signals_.pass_on([this](int number) { child_->signal(number); });
  run();
  return child_->exit_code().value_or(0);
}

bool Simulator::stop_requested() const {
  return child_ ? child_->exit_code().has_value() : stopping_ || signals_.stop_requested();
}

/// Sets the devices' clocks to this machine's time; on a manual clock they start at midnight of 1984-01-01.
void Simulator::tell_time_of_day() {
  constexpr Time kDay = 24 * 3600 * kSecond;
  constexpr Time kDaysTo1984 = 5113;  // since 1970
  const Time since_1970 = started_ + clock_->wall_offset();
  const TimeOfDay time{static_cast<std::uint32_t>(since_1970 % kDay / kMillisecond),
                       static_cast<std::uint16_t>(since_1970 / kDay - kDaysTo1984)};
  for (const auto& network : plant_->networks())
    for (const auto& node : network->world().nodes())
      node->device().time_stamp().set(time, started_);
}

std::size_t Simulator::poll(Time until) {
  Time next = next_deadline();
  if (observed_ || next <= reactor_.time() || console_.waits()) next = poll_due();
  if (runs_) reactor_.hold_at(plant_->schedule().first_time());
  return reactor_.poll(stopping_ ? 0 : earlier(until, next));
}

/// Does what is due in the plant, in order of time, for kLongestPiece at most; then clients and signals are
/// polled before the rest.
void Simulator::advance_in_pieces() {
  constexpr Time kLongestPiece = 10 * kMillisecond;
  constexpr Time kMostBehind = kSecond;
  const Time end = reactor_.clock() + kLongestPiece;
  const auto is_late = [this] { return plant_->schedule().first_time() <= reactor_.clock(); };
  plant_->schedule().poll(reactor_.time());
  while (is_late() && reactor_.clock() < end) {
    reactor_.hold_at(plant_->schedule().first_time());
    plant_->schedule().poll(reactor_.time());
    reactor_.read_clock();
  }
  reactor_.hold_at(plant_->schedule().first_time());
  const bool is_behind = is_late() && (is_behind_ || reactor_.clock() - reactor_.time() > kMostBehind);
  if (is_behind && !is_behind_)
    warn_(
        "the plant is more than 1 s behind the clock: its nodes take more time than there is; let scripts be "
        "called less often, or use --clock manual");
  is_behind_ = is_behind;
}

/// When something is due, apart from observers.
Time Simulator::next_deadline() const {
  const Time modbus = modbus_ ? modbus_->next_deadline() : kNever;
  return runs_ ? earlier(modbus, plant_->schedule().first_time()) : modbus;
}

/// Does what is due; returns the time of the next action.
Time Simulator::poll_due() {
  for (BusConnections* network : connected_)
    network->advance();
  if (runs_) advance_in_pieces();
  const Time now = reactor_.time();
  if (observed_) poll_waits();
  if (modbus_) modbus_->poll(now);
  const Time observers = observed_ ? poll_observers(now) : kNever;
  return earlier(earlier(observers, next_deadline()), console_.flush());
}

/// Returns the time of their next action.
Time Simulator::poll_observers(Time now) {
  if (rtu_) rtu_->poll(now);
  for (BusConnections* network : connected_)
    network->poll(now);
  poll_views();
  if (commands_) commands_->flush();
  if (http_) http_->poll(now);
  return observers_deadline();
}

/// Does what is due and answers waits.
void Simulator::advance_and_answer() {
  advance();
  poll_waits();
}

std::string Simulator::execute(std::string_view line, const std::shared_ptr<adapters::Dialogue>& dialogue) {
  advance_and_answer();
  plant::Reply reply = control().execute(line, clock_->now());
  advance_and_answer();
  if (reply.shutdown) child_ ? child_->signal(SIGTERM) : void(stopping_ = true);
  std::string response = waits_.take(std::move(reply), dialogue);
  flush();
  return response;
}

bool Simulator::poll_waits() {
  control().set_now(clock_->now());
  if (recorder_) recorder_->poll();
  return waits_.poll();
}

void Simulator::flush() {
  poll_views();
  for (BusConnections* network : connected_)
    network->flush();
  console_.flush();
}

void Simulator::advance() {
  for (BusConnections* network : connected_)
    network->poll_outside();
  plant_->advance();
}

Time Simulator::observers_deadline() const {
  Time next = kNever;
  if (pcap_) next = pcap_->next_deadline();
  if (http_) next = earlier(next, http_->next_deadline());
  if (rtu_) next = earlier(next, rtu_->next_deadline());
  if (runs_) {
    const Time due = waits_.next_deadline();
    if (due != kNever) next = earlier(next, started_ + due);
  } else if (waits_.want_time()) {
    next = 0;
  }
  for (const BusConnections* network : connected_)
    next = earlier(next, network->next_deadline());
  return next;
}

void Clock::drive(Simulator& simulator) {
  while (!simulator.stop_requested())
    simulator.poll(kNever);
}

std::string Simulator::module_summary(const plant::Network& network) const {
  const sim::CoprocessorModule* const module = network.module();
  if (module == nullptr) return {};
  const auto& transactions = module->coprocessor().counters();
  const auto& sdo = module->coprocessor().sdo_client().counters();
  const std::string name = name_of(network.number());
  const std::string second = network.second_writers() == 0
                                 ? ""
                                 : fmt::format("{}writes to scanner windows by a second client {}\n", name,
                                               network.second_writers());
  return fmt::format(
      "{0}transactions {1}, failed {2}, cancelled {3}\n"
      "{0}SDO transfers {4}, timeouts {5}, aborts sent {6}, received {7}, frames ignored {8}\n{9}",
      name, transactions.executed, transactions.failed, transactions.cancelled, sdo.transfers, sdo.timeouts,
      sdo.aborts_sent, sdo.aborts_received,
      sdo.late + sdo.unexpected + sdo.not_data + sdo.too_short + sdo.other_object, second);
}

std::string Simulator::summary() const {
  std::string text;
  for (const auto& network : plant_->networks())
    text += module_summary(*network);
  if (modbus_)
    text += fmt::format("Modbus requests {}, exceptions {}, connections {}\n", modbus_->counters().requests,
                        modbus_->counters().exceptions, modbus_->counters().connections);
  if (rtu_)
    text +=
        fmt::format("Modbus RTU requests {}, exceptions {}, CRC errors {}\n", rtu_->counters().slave_messages,
                    rtu_->counters().slave_exceptions, rtu_->counters().bus_communication_errors);
  for (const BusConnections* network : connected_)
    text += network->plc_summary() + network->adapters_summary();
  return text;
}

}  // namespace cbcan::app
