// SPDX-License-Identifier: MIT
#include "session/session.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/text.hpp"
#include "cbcan/version.hpp"
#include "plant/command_words.hpp"
#include "protocols/adapter.hpp"

namespace cbcan::session {

namespace {

/// The command by which a program joins the bus; empty = there is none.
std::string way_in(const Service& service) {
  constexpr std::string_view kSocketCan = "socketcan:";
  if (service.place.empty()) return {};
  if (service.name == "can")
    return service.place.starts_with(kSocketCan)
               ? "socketcan: candump " + service.place.substr(kSocketCan.size())
               : "";
  const base::StreamAddress address = base::parse_stream_address(service.place);
  constexpr std::string_view kLogger = "python3 -m can.logger -i";
  if (service.name == "socketcand" && address.path.empty())
    return fmt::format("socketcand: {} socketcand -c can0 --host={} --port={}", kLogger, address.tcp.host,
                       address.tcp.port);
  if (service.name != "slcan" || (!address.path.empty() && !address.is_pty)) return {};
  return fmt::format("slcan: {} slcan -c {}", kLogger,
                     address.is_pty ? address.path : "socket://" + service.place);
}

/// The name of an object in the EDS file of the node that has the node ID now; `control` outlives it.
journal::FindName names_of(plant::Control& control) {
  return [&control](std::uint8_t network, std::uint8_t id, std::uint16_t index,
                    std::uint8_t sub) -> const descriptions::Object* {
    const sim::Node* const node = control.network(network).world().node(id);
    return node == nullptr ? nullptr : node->description().find(index, sub);
  };
}

std::vector<protocols::ModbusUnit*> units_of(const plant::Plant& plant) {
  std::vector<protocols::ModbusUnit*> units;
  for (const auto& network : plant.networks())
    units.push_back(network.get());
  return units;
}

web::Json wires_of(const config::Config& config) {
  const auto end = [&config](const config::WireEnd& at) {
    return web::Json{
        {"network", at.network}, {"place", *config::place_of(config, at) + 1}, {"text", at.text}};
  };
  web::Json list = web::Json::array();
  for (const config::WireConfig& wire : config.wires)
    list.push_back({{"from", end(wire.from)}, {"to", end(wire.to)}});
  return list;
}

}  // namespace

std::string key_of(const Service& service) {
  return (service.network == 0 ? "" : plant::prefix_of(service.network)).append(service.name);
}

const Service& Services::at(std::string_view name, std::size_t network) const {
  return *std::ranges::find_if(
      *this, [&](const Service& service) { return service.name == name && service.network == network; });
}

std::string Services::where() const {
  std::string text;
  for (const Service& service : *this)
    if (!service.place.empty())
      text += fmt::format("{}{}={}", text.empty() ? "" : " ", key_of(service), service.place);
  return text;
}

std::string Services::ways_in() const {
  std::string lines;
  const bool is_one = std::ranges::none_of(*this, [](const Service& each) { return each.network > 1; });
  for (const Service& bus : *this) {
    if (bus.name != "can") continue;
    for (const std::string_view name : {"slcan", "socketcand", "can"}) {
      const std::string way = way_in(at(name, bus.network));
      if (way.empty()) continue;
      lines += fmt::format("{}{}\n", is_one ? "" : fmt::format("network {}: ", bus.network),
                           cbcan::base::to_utf8(way));
    }
  }
  return lines;
}

std::vector<std::string> Services::environment() const {
  std::vector<std::string> lines;
  for (const Service& service : *this) {
    if (service.place.empty()) continue;
    std::string line = fmt::format("CBCAN_{}", service.name);
    if (service.network > 1) line += fmt::format("_{}", service.network);
    std::ranges::transform(line, line.begin(), [](char c) {
      return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    });
    lines.push_back(line + "=" + service.place);
  }
  return lines;
}

std::string Waits::take(plant::Reply reply, const Dialogue& dialogue) {
  if (!reply.wait) return std::move(reply.text);
  if (auto response = reply.wait->poll()) return std::move(*response);
  dialogue->waiting = true;
  waiting_.push_back({std::move(reply.wait), dialogue, machine_now_()});
  return {};
}

void Waits::answer(const Waiting& waiting, const std::string& response) {
  const auto dialogue = waiting.dialogue.lock();
  dialogue->waiting = false;
  dialogue->unsent += response;
}

bool Waits::poll_waiting() {
  const std::size_t ended = std::erase_if(waiting_, [](const Waiting& waiting) {
    if (waiting.dialogue.expired()) return true;
    const auto response = waiting.wait->poll();
    if (response) answer(waiting, *response);
    return response.has_value();
  });
  return ended != 0;
}

bool Waits::want_time() const {
  return std::ranges::any_of(waiting_, [](const Waiting& waiting) { return !waiting.wait->is_up_to_plc(); });
}

bool Waits::are_passes() const {
  return std::ranges::all_of(waiting_, [](const Waiting& waiting) { return waiting.wait->is_pass; });
}

Time Waits::plc_deadline() const {
  return sim::earliest(waiting_, [](const Waiting& waiting) { return waiting.since + waiting.wait->within; });
}

void Waits::give_up_on_plc(Time now) {
  std::erase_if(waiting_, [now](const Waiting& waiting) {
    const bool is_over = waiting.wait->is_up_to_plc() && now >= waiting.since + waiting.wait->within;
    if (is_over && !waiting.dialogue.expired()) answer(waiting, waiting.wait->give_up());
    return is_over;
  });
}

using base::append;
using journal::Event;
using journal::Kind;
using journal::kinds_of;

Session::Session(const config::Config& config, config::PlantBuild build, std::string plant_file, Host& host)
    : host_(host),
      now_(host.now()),
      plant_file_(std::move(plant_file)),
      is_only_network_(config.networks.size() == 1),
      started_(now_),
      plant_(config, std::move(build), now_, *this,
             [this](const std::string& file) { return host_.store(file); }),
      find_name_(names_of(control())),
      units_(units_of(plant_)),
      modbus_(units_, {"cbcan", "cbcan-sim", kVersion}),
      waits_([this] { return host_.machine_now(); }) {
  if (config.verbose || config.verbose_frames) {
    const journal::Kinds frames = config.verbose_frames ? kinds_of({Kind::kFrame}) : 0;
    const journal::Kinds kinds =
        kinds_of({Kind::kEnded, Kind::kState, Kind::kEmergency, Kind::kAdvice, Kind::kBoot}) | frames;
    trace_.emplace(Trace{journal::Cursor(control().journal(), kinds)});
  }
  list_services(config);
}

void Session::list_services(const config::Config& config) {
  const bool is_modbus = std::ranges::any_of(
      plant_.networks(), [](const auto& network) { return !network->registers().empty(); });
  services_.push_back({.name = "modbus", .listen = is_modbus ? to_string(config.modbus) : ""});
  services_.push_back({.name = "rtu"});
  services_.push_back({.name = "rtu_tcp",
                       .listen = is_modbus ? config.rtu.listen : "",
                       .connect = protocols::rtu_over_tcp(
                           units_, [this] { return host_.machine_now(); }, config.rtu.station)});
  for (const config::NetworkConfig& network : config.networks)
    list_bus_services(network);
  services_.push_back(
      {.name = "control",
       .listen = config.control,
       .connect = protocols::command_sessions(
           [this](std::string_view line, const auto& dialogue) { return execute(line, dialogue); })});
  services_.push_back({.name = "http", .listen = config.http.listen});
}

/// On a manual clock hours may pass before clients can read, so none is too slow.
void Session::list_bus_services(const config::NetworkConfig& config) {
  constexpr Time kPauseBehindOk = 20 * kMillisecond;  // for clients of socketcand, in real time
  plant::Network& network = *plant_.networks()[config.number - 1];
  sim::World& world = network.world();
  const auto on_queued = [&network] { network.advance(); };
  const std::size_t most =
      host_.clock_runs() ? protocols::Adapter::kMostUnsent : protocols::Adapter::kUnlimited;
  services_.push_back({.network = config.number, .name = "can", .place = config::can_spec(config.can)});
  Service& slcan = services_.emplace_back(Service{config.number, "slcan", config.can.slcan});
  slcan.connect = [&, on_queued, most] {
    ++slcan.connections;
    return protocols::slcan_adapter(world.bus(), on_queued, most, &slcan.lost);
  };
  Service& socketcand = services_.emplace_back(Service{config.number, "socketcand", config.can.socketcand});
  socketcand.connect = [this, &world, &socketcand, on_queued, most,
                        make = protocols::MakeSession()]() mutable {
    if (!make)
      make = protocols::socketcand_adapters({world.bus(), world.schedule(), [this] { return now_; },
                                             host_.wall_offset(), host_.clock_runs() ? kPauseBehindOk : 0},
                                            on_queued, most, &socketcand.lost);
    ++socketcand.connections;
    return make();
  };
  services_.push_back({.network = config.number, .name = "plc"});
}

std::string Session::name_of(std::size_t network) const {
  return is_only_network_ ? "" : fmt::format("network {}: ", network);
}

protocols::HttpSite::Handler Session::http(const config::Config& config) {
  control().journal();
  return web::api_of({control(), find_name_,
                      [this](std::string_view line, const auto& dialogue) { return execute(line, dialogue); },
                      [this] { advance_and_answer(); }, [this] { return about(); },
                      web::line_of({{"wires", wires_of(config)}}) + "\n"});
}

web::Json Session::about() const {
  const Served served = host_.served();
  web::Json json{{"program", "cbcan-sim"},
                 {"where", services_.where()},
                 {"clock", host_.clock_runs() ? "real" : "manual"}};
  json["plant"] = plant_file_;
  json["writable"] = served.http_may_write;
  json["streams"] = served.http_streams;
  if (const std::string& modbus = services_.at("modbus").place; !modbus.empty()) {
    json["modbus"] = modbus;
    json["clients"] = modbus_.counters().connections - modbus_.counters().left;
    json["requests"] = modbus_.counters().requests;
  }
  return json;
}

/// Clients of commands may ask for advice, which needs a journal, if only a short one.
void Session::start(bool observed) {
  constexpr std::size_t kEvents = 128;
  constexpr std::size_t kBytes = 256 * kEvents;
  if (observed) control().journal(kEvents, kBytes);
  plant_.start(observed);
}

void Session::record(std::function<void(std::string_view lines)> tell) {
  const journal::Kinds kinds = kinds_of({Kind::kEnded, Kind::kCommand});
  recording_.emplace(Recording{scenario::ScenarioWriter(control(), find_name_),
                               journal::Cursor(control().journal(), kinds), std::move(tell)});
  recording_->tell(scenario::ScenarioWriter::opening(plant_file_));
}

void Session::poll_views() {
  if (recording_) poll_recording();
  if (trace_) poll_trace();
}

void Session::poll_trace() {
  base::Buffer& lines = trace_->lines;
  const std::uint64_t missed = trace_->cursor.look([&](std::uint64_t /*number*/, const Event& event) {
    append(lines, "cbcan-sim: ", base::Seconds{event.at}, ' ');
    if (!is_only_network_) append(lines, "network ", event.network, ": ");
    append_text(lines, event, control().journal(), find_name_);
    append(lines, '\n');
    return true;
  });
  if (missed != 0) append(lines, "cbcan-sim: ", missed, " events are missing here\n");
  if (lines.size() != 0) host_.tell(base::view(lines));
  lines.clear();
}

void Session::poll_recording() {
  recording_->cursor.look([this](std::uint64_t /*number*/, const Event& event) {
    recording_->tell(recording_->writer.text_of(event));
    return true;
  });
}

void Session::warn(std::string_view line) {
  if (trace_) poll_trace();
  host_.tell(fmt::format("cbcan-sim: {}\n", base::to_utf8(line)));
}

void Session::on_fault(std::size_t network, std::string_view text, Time now) {
  warn(
      fmt::format("{} {}{}", base::seconds_text(std::max(now, started_) - started_), name_of(network), text));
}

void Session::on_written(std::size_t network, const modbus::Range& written) {
  if (!recording_) return;
  control().set_now(now_);
  poll_recording();
  const auto words = plant_.networks()[network - 1]->registers().subspan(written.first, written.count);
  recording_->tell(recording_->writer.written(control().now(), network, written.first, words));
}

void Session::on_client(std::uint32_t client, std::string_view address, bool joined) {
  control().journal().add(
      {.kind = Kind::kClient, .network = 0, .state = joined, .code = client, .at = now_ - started_}, address);
}

void Session::set_time_of_day(Time since_1970) {
  constexpr Time kDay = 24 * 3600 * kSecond;
  constexpr Time kDaysTo1984 = 5113;  // since 1970
  const TimeOfDay time{static_cast<std::uint32_t>(since_1970 % kDay / kMillisecond),
                       static_cast<std::uint16_t>(since_1970 / kDay - kDaysTo1984)};
  for (const auto& network : plant_.networks())
    for (const auto& node : network->world().nodes())
      node->device().time_stamp().set(time, started_);
}

std::string Session::execute(std::string_view line, const std::shared_ptr<protocols::Dialogue>& dialogue) {
  advance_and_answer();
  restarted_ = false;
  plant::Reply reply = control().execute(line, now_);
  dialogue->killed = restarted_;
  advance_and_answer();
  if (reply.shutdown) host_.shut_down();
  std::string response = waits_.take(std::move(reply), dialogue);
  host_.flush();
  return response;
}

void Session::advance() {
  host_.advance_buses();
  plant_.advance();
}

bool Session::poll_waits() {
  control().set_now(now_);
  if (recording_) poll_recording();
  if (look_) look_();
  return waits_.poll();
}

void Session::advance_and_answer() {
  advance();
  poll_waits();
}

/// A pass is done in steps, between which the host looks for signals; the result does not depend on them.
bool Session::step(Time& now) {
  constexpr Time kLongestStep = kSecond;
  const Time step = waits_.are_passes() ? now + kLongestStep : now;
  now = std::min(waits_.next_deadline(), std::max(step, plant_.next_deadline()));
  advance();
  return poll_waits();
}

void Session::let_pass(Time duration, Time& now) {
  for (const Time end = now + duration; now < end;) {
    now = std::max(now, earlier(end, plant_.next_deadline()));
    advance_and_answer();
  }
}

/// The effects of a line have happened and been sent before its response.
void Session::say(const std::string& response) {
  const auto [lines, last] = plant::parts_of(response);
  if (!last.starts_with(plant::kError)) {
    if (!response.empty()) host_.say(response);
    return;
  }
  host_.say(lines);
  host_.fail(last.starts_with(plant::kNotWithin) ? base::ExitCode::kCheckFailed : base::ExitCode::kUsage,
             fmt::format("standard input: {}", base::trim(last.substr(plant::kError.size()))));
}

std::string Session::module_summary(const plant::Network& network) const {
  const sim::CoprocessorModule* const module = network.module();
  if (module == nullptr) return {};
  const auto& transactions = module->coprocessor().counters();
  const auto& sdo = module->coprocessor().sdo_client().counters();
  const std::string name = name_of(network.number());
  return fmt::format(
      "{0}transactions {1}, failed {2}, cancelled {3}\n"
      "{0}SDO transfers {4}, timeouts {5}, aborts sent {6}, received {7}, frames ignored {8}\n",
      name, transactions.executed, transactions.failed, transactions.cancelled, sdo.transfers, sdo.timeouts,
      sdo.aborts_sent, sdo.aborts_received,
      sdo.late + sdo.unexpected + sdo.not_data + sdo.too_short + sdo.other_object);
}

std::string Session::summary() const {
  std::string text;
  for (const auto& network : plant_.networks()) {
    text += module_summary(*network);
    for (const journal::Advice& advice : network->advice())
      text += fmt::format("{}advice {}: {} times by client {}\n", name_of(network->number()),
                          journal::name_of(advice.mistake), advice.count, advice.client);
  }
  const protocols::ModbusServer::Counters& counters = modbus_.counters();
  if (!services_.at("modbus").place.empty())
    text += fmt::format("Modbus requests {}, exceptions {}, connections {}\n", counters.requests,
                        counters.exceptions, counters.connections);
  return text;
}

std::string Session::clients_summary(std::size_t network) const {
  std::string text;
  for (const auto& [name, title] : {std::pair("slcan", "SLCAN"), std::pair("socketcand", "socketcand")})
    if (const Service& service = services_.at(name, network); !service.place.empty())
      text += fmt::format("{}{} connections {}, frames not read in time {}\n", name_of(network), title,
                          service.connections, service.lost);
  return text;
}

// ---- Connections with the outside

protocols::PlcPolling::Exchanges plc_exchanges(const config::NetworkConfig& config, plant::Network& network) {
  using namespace protocols;
  const config::PlcConfig& plc = config.plc;
  const config::ModuleConfig& own = config.module;
  PlcPolling::Exchanges exchanges;
  if (plc.layout == config::PlcLayout::kScanner)
    exchanges.push_back(
        std::make_unique<ScannerExchange>(network, plc.first, own.scanner_out_first, own.scanner_in_first));
  else
    exchanges.push_back(
        std::make_unique<WindowExchange>(network, plc.first, plc.at_start == config::PlcAtStart::kRefuse));
  if (plc.process_first)
    exchanges.push_back(std::make_unique<ProcessExchange>(network, *plc.process_first, own.process_first));
  if (plc.status_first)
    exchanges.push_back(
        std::make_unique<CopyExchange>(network, *plc.status_first, own.status_first, regmap::kStatusWords));
  return exchanges;
}

base::ListenAddress plc_address(const config::PlcConfig& plc) {
  constexpr std::uint16_t kModbusPort = 502;
  return base::parse_listen_address(plc.address, kModbusPort);
}

std::unique_ptr<protocols::Dialect> dialect_of(const config::CanSpec& can) {
  return can.kind == config::CanSpec::Kind::kSlcan ? protocols::slcan_dialect(can.kbit)
                                                   : protocols::socketcand_dialect(can.name);
}

}  // namespace cbcan::session
