// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "base/numbers.hpp"
#include "base/words.hpp"
#include "cbcan/version.hpp"
#include "module/instance.hpp"
#include "plant/command_words.hpp"
#include "plant/condition.hpp"
#include "protocols/command_session.hpp"
#include "protocols/rtu_session.hpp"
#include "protocols/slcan_adapter.hpp"

namespace cbcan::module {

Json Instance::services() const {
  const config::Config& config = start_.config;
  Json services = Json::array();
  const auto add = [&services](const std::string& name, const std::string& address) {
    if (address.empty()) return;
    const base::ListenAddress place = base::parse_stream_address(address).tcp;
    services.push_back({{"name", name}, {"host", place.host}, {"port", place.port}});
  };
  const auto& networks = session_->plant().networks();
  if (std::ranges::any_of(networks, [](const auto& network) { return !network->registers().empty(); })) {
    add("modbus", to_string(base::ListenAddress{config.modbus.host, config.modbus.port}));
    add("rtu_tcp", config.rtu.listen);
  }
  for (const config::NetworkConfig& network : config.networks) {
    add(plant::prefix_of(network.number) + "slcan", network.can.slcan);
    add(plant::prefix_of(network.number) + "socketcand", network.can.socketcand);
  }
  add("control", config.control);
  add("http", config.http.listen);
  return services;
}

Json Instance::serve(const std::vector<std::string>& places, Time since_1970, bool alone) {
  alone_ = alone;
  if (clock_runs()) session_->set_time_of_day(since_1970_ = since_1970);
  for (const config::NetworkConfig& network : start_.config.networks)
    addresses_.networks.push_back(
        {network.number, session_->name_of(network.number), config::can_spec(network.can)});
  for (const std::string& place : places)
    open_service(place);
  session_->plant().start(true);
  session_->advance();
  return {{"ready", "ready " + addresses_.where() + "\n"},
          {"ways_in", addresses_.ways_in()},
          {"environment", addresses_.environment()}};
}

void Instance::open_service(std::string_view place) {
  const std::string whole(place);
  const std::string name(base::take_part(place, ' '));
  const base::StreamAddress address = base::parse_stream_address(place);
  std::vector<protocols::ModbusUnit*> units;
  for (const auto& network : session_->plant().networks())
    units.push_back(network.get());
  if (name == "modbus") {
    addresses_.modbus = address.tcp;
    modbus_.emplace(units, modbus::DeviceIdentity{"cbcan", "cbcan-sim", kVersion});
  } else if (name == "rtu_tcp") {
    addresses_.rtu_tcp = address;
    services_[name].connect = protocols::rtu_over_tcp(
        units, [this] { return machine_now_; }, start_.config.rtu.station);
  } else if (name == "control") {
    addresses_.control = address;
    services_[name].connect = protocols::command_sessions(
        [this](std::string_view line, const auto& dialogue) { return session_->execute(line, dialogue); });
  } else if (name == "http") {
    addresses_.http = address.tcp;
    http_.emplace(base::parse_stream_address(start_.config.http.listen).tcp.host, address.tcp,
                  start_.config.http.write,
                  [&api = session_->open_api(start_.config)](const protocols::HttpRequest& request) {
                    return api.respond(request);
                  });
  } else {
    open_bus_service(name, address);
  }
  if (const auto made = services_.find(name); made != services_.end()) made->second.place = whole;
}

/// "slcan", "2/socketcand"
void Instance::open_bus_service(const std::string& name, const base::StreamAddress& address) {
  constexpr Time kPauseBehindOk = 20 * kMillisecond;  // in real time
  const auto [number, kind] = base::split(name, '/').value_or(std::pair("1", std::string_view(name)));
  const std::size_t place = base::parse<std::size_t>(std::string_view(number)).value_or(1) - 1;
  plant::Network& network = *session_->plant().networks()[place];
  sim::World& world = network.world();
  const auto on_queued = [&network] { network.advance(); };
  const std::size_t most = clock_runs() ? protocols::Adapter::kMostUnsent : protocols::Adapter::kUnlimited;
  Service& service = services_[name];
  if (kind == "slcan") {
    addresses_.networks[place].slcan = address;
    service.connect = [&world, on_queued, most, &service] {
      return std::make_unique<protocols::SlcanAdapter>(world.bus(), on_queued, most, &service.lost);
    };
  } else {
    addresses_.networks[place].socketcand = address;
    protocols::SocketcandBus& bus = *socketcand_.emplace_back(std::make_unique<protocols::SocketcandBus>(
        world.bus(), world.schedule(), [this] { return now_; }, since_1970_,
        clock_runs() ? kPauseBehindOk : 0));
    service.connect = [&bus, on_queued, most, &service] {
      return std::make_unique<protocols::SocketcandAdapter>(bus, on_queued, most, &service.lost);
    };
  }
}

std::unique_ptr<protocols::StreamSession> Instance::connect(const std::string& service,
                                                            const std::string& peer) {
  if (service == "modbus" && modbus_) {
    const std::uint32_t client = ++connections_;
    session_->on_client(client, peer, true);
    return std::make_unique<protocols::ModbusTcpSession>(*modbus_, client, [this, client, peer] {
      ++left_;
      session_->on_client(client, peer, false);
    });
  }
  const auto found = services_.find(service);
  if (found == services_.end()) return nullptr;
  Service& served = found->second;
  ++served.connections;
  return protocols::without_browsers(served.connect(), [this, &served] {
    if (!std::exchange(served.has_warned, true))
      session_->warn(served.place +
                     ": a client that speaks HTTP, as a browser does, is turned away; --http serves HTTP");
  });
}

Json Instance::respond(const Json& request) {
  const auto text = [&request](const char* key) { return request.value(key, std::string()); };
  protocols::HttpResponse response =
      http_->respond({text("method"), text("path"), request.value("query", web::Query()), text("body"),
                      text("last_event_id"), text("host"), text("origin")},
                     request.value("too_long", false));
  Json headers{{"Content-Type", response.type}};
  for (const auto& [name, value] : protocols::HttpSite::kHeaders)
    headers[name] = value;
  Json json{{"status", response.status}, {"headers", std::move(headers)}};
  if (!response.stream) {
    json["body"] = response.body;
    return json;
  }
  json["keep_alive"] = response.stream->keep_alive();
  json["stream"] = ++last_stream_;
  streams_[last_stream_].stream = std::move(response.stream);
  return json;
}

Json Instance::fill(unsigned stream) {
  auto& [filled, begun] = streams_.at(stream);
  base::Buffer text;
  const bool has_news = !std::exchange(begun, true) || filled->has_news();
  const bool more = !has_news || filled->fill(text);
  if (!more) drop(stream);
  return {{"text", base::view(text)}, {"more", more}};
}

session::Served Instance::served() const {
  session::Served served{.addresses = addresses_};
  if (modbus_) {
    served.requests = modbus_->counters().requests;
    served.exceptions = modbus_->counters().exceptions;
    served.connections = connections_;
    served.clients = connections_ - left_;
  }
  served.http_may_write = http_ && http_->may_write();
  served.http_streams = streams_.size();
  return served;
}

std::string Instance::summary() const {
  std::string text = session_->summary();
  for (const config::NetworkConfig& network : start_.config.networks)
    text += summary_of(network, "slcan", "SLCAN") + summary_of(network, "socketcand", "socketcand");
  return text;
}

std::string Instance::summary_of(const config::NetworkConfig& network, const std::string& kind,
                                 std::string_view title) const {
  const auto found = services_.find(plant::prefix_of(network.number) + kind);
  if (found == services_.end()) return {};
  const Service& service = found->second;
  return session::adapters_summary(session_->name_of(network.number), title, service.connections,
                                   service.lost);
}

// ---- Time

Time Instance::pass(Time machine_now) {
  machine_now_ = machine_now;
  const session::Waits& waits = session_->waits();
  clock_runs() ? advance_to(machine_now) : let_time_pass();
  if (!input_->waiting) say(std::exchange(input_->unsent, {}));
  if (clock_runs()) return next_event();
  return want_time() ? machine_now_ : waits.plc_deadline();
}

/// Of the plant and its waits.
Time Instance::next_event() const {
  return earlier(session_->plant().schedule().first_time(), session_->waits().next_deadline());
}

void Instance::advance_to(Time end) {
  int steps = 0;
  for (Time next = next_event(); next <= end && steps < kMostSteps;
       next = std::max(next_event(), now_ + 1), ++steps) {
    now_ = std::max(now_, next);
    session_->plant().schedule().poll(now_);
    session_->poll_waits();
  }
  if (steps < kMostSteps) now_ = end;
  warn_if_behind(end - now_);
  session_->advance_and_answer();
}

/// After a pause it catches up: then it is not behind.
void Instance::warn_if_behind(Time lag) {
  const bool is_behind = lag > kSecond && (is_behind_ || lag > lag_);
  if (is_behind && !is_behind_) session_->warn(session::kBehind);
  is_behind_ = is_behind;
  lag_ = lag;
}

/// Until a wait has ended.
void Instance::let_time_pass() {
  session::Waits& waits = session_->waits();
  waits.give_up_on_plc(machine_now_);
  bool is_over = false;
  for (int steps = 0; !is_over && want_time() && steps < kMostSteps; ++steps) {
    now_ = session_->next_step();
    session_->advance();
    is_over = session_->poll_waits();
  }
}

void Instance::say(const std::string& response) {
  const auto [lines, last] = plant::parts_of(response);
  if (!last.starts_with(plant::kError)) return response.empty() ? void() : tell(kOut, response);
  tell(kOut, lines);
  session_->warn(fmt::format("standard input: {}", base::trim(last.substr(plant::kError.size()))));
  const bool in_time = !last.starts_with(plant::kNotWithin);
  end(in_time ? base::ExitCode::kUsage : base::ExitCode::kCheckFailed);
}

}  // namespace cbcan::module
