// SPDX-License-Identifier: MIT
#include <algorithm>
#include <functional>
#include <utility>

#include "base/text.hpp"
#include "module/instance.hpp"

namespace cbcan::module {

Json Instance::services() const {
  Json services = Json::array();
  for (const session::Service& service : session_->services()) {
    if (service.listen.empty()) continue;
    const base::ListenAddress place = base::parse_stream_address(service.listen).tcp;
    services.push_back({{"name", key_of(service)}, {"host", place.host}, {"port", place.port}});
  }
  return services;
}

Json Instance::serve(const std::vector<std::string>& places, Time since_1970, bool alone) {
  alone_ = alone;
  if (clock_runs()) session_->set_time_of_day(since_1970_ = since_1970);
  for (const std::string& place : places)
    open_service(place);
  session_->modbus().on_client = std::bind_front(&session::Session::on_client, &*session_);
  session_->start(true);
  session_->advance();
  return {{"ready", "ready " + session_->services().where() + "\n"},
          {"ways_in", session_->services().ways_in()},
          {"environment", session_->services().environment()}};
}

void Instance::open_service(std::string_view place) {
  const std::string_view name = base::take_part(place, ' ');
  session::Service& service = *find(name);
  service.place = place;
  if (name == "http")
    http_ = {base::parse_stream_address(service.listen).tcp.host,
             base::parse_stream_address(service.place).tcp, start_.config.http.write,
             session_->http(start_.config)};
}

/// null = none with this key.
session::Service* Instance::find(std::string_view key) {
  session::Services& services = session_->services();
  const auto found = std::ranges::find(services, key, session::key_of);
  return found == services.end() ? nullptr : &*found;
}

std::unique_ptr<protocols::StreamSession> Instance::connect(const std::string& service,
                                                            const std::string& peer) {
  if (service == "modbus") return std::make_unique<protocols::ModbusTcpSession>(session_->modbus(), peer);
  session::Service* const served = find(service);
  if (served == nullptr || !served->connect) return nullptr;
  return protocols::without_browsers(served->connect(), [this, served] {
    if (!std::exchange(served->has_warned, true))
      session_->warn(session::key_of(*served) + " " + served->place +
                     ": a client that speaks HTTP, as a browser does, is turned away; --http serves HTTP");
  });
}

Json Instance::respond(const Json& request) {
  const auto text = [&request](const char* key) { return request.value(key, std::string()); };
  protocols::HttpResponse response =
      http_->respond({text("method"), text("path"), request.value("query", web::Query()), text("body"),
                      text("last_event_id"), text("host"), text("origin")},
                     request.value("too_long", false));
  if (response.stream && response.stream->is_answer()) {
    base::Buffer part;  // of a bounded size: a full one gets no more
    for (bool more = true; more; part.clear()) {
      more = response.stream->fill(part);
      response.body += base::view(part);
    }
    response.stream.reset();
  }
  Json headers{{"Content-Type", response.type}};
  for (const auto& [name, value] : protocols::HttpSite::kHeaders)
    headers[name] = value;
  if (response.closes) headers["Connection"] = "close";
  Json json{{"status", response.status}, {"headers", std::move(headers)}};
  if (!response.stream) {
    json["body"] = response.body;
    return json;
  }
  json["keep_alive"] = response.stream->keep_alive();
  json["stream"] = ++last_stream_;
  streams_[last_stream_] = std::move(response.stream);
  return json;
}

Json Instance::fill(unsigned stream) {
  protocols::HttpStream& filled = *streams_.at(stream);
  base::Buffer text;
  const bool more = !filled.has_news() || filled.fill(text);
  if (!more) drop(stream);
  return {{"text", base::view(text)}, {"more", more}};
}

session::Served Instance::served() const {
  return {http_ && http_->may_write(), streams_.size()};
}

std::string Instance::summary() const {
  std::string text = session_->summary();
  for (const auto& network : session_->plant().networks())
    text += session_->clients_summary(network->number());
  return text;
}

// ---- Time

Time Instance::pass(Time machine_now) {
  machine_now_ = machine_now;
  if (clock_runs())
    advance_to(machine_now);
  else
    let_time_pass();
  session_->say_responses();
  const Time links = poll_links();
  if (clock_runs()) return earlier(links, next_event());
  return earlier(links, want_time() ? machine_now_ : session_->waits().plc_deadline());
}

/// Next event of the plant and its waits.
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

/// Warns, but not after a pause, when it catches up.
void Instance::warn_if_behind(Time lag) {
  const bool is_behind = lag > kSecond && (is_behind_ || lag > lag_);
  if (is_behind && !is_behind_) session_->warn(session::kBehind);
  is_behind_ = is_behind;
  lag_ = lag;
}

/// Lets time pass until a wait has ended, or the trial.
void Instance::let_time_pass() {
  session_->waits().give_up_on_plc(machine_now_);
  bool is_over = false;
  for (int steps = 0; !is_over && !stopping_ && want_time() && steps < kMostSteps; ++steps)
    is_over = session_->step(now_);
}

void Instance::fail(base::ExitCode code, const std::string& why) {
  session_->warn(why);
  end(code);
}

}  // namespace cbcan::module
