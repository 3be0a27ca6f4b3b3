// SPDX-License-Identifier: MIT
// Streams that the host makes: a serial line whose master is outside, the bus outside, and PLCs that own
// their registers.

#include "module/instance.hpp"

namespace cbcan::module {

namespace {

constexpr int kAdapterBaud = 115'200;  ///< USB adapters ignore it

/// A line, or the address if it has no device.
Json link(std::string_view name, std::size_t network, const config::LineConfig& line,
          const base::ListenAddress& address = {}) {
  return {{"name", name},          {"network", network},   {"device", line.device}, {"baud", line.baud},
          {"parity", line.parity}, {"host", address.host}, {"port", address.port}};
}

/// One stream of BusLink.
class OutsideSession final : public protocols::StreamSession {
 public:
  OutsideSession(protocols::BusLink& link, const Time& now) : link_(link), now_(now) {
    link_.connected(now_);
  }
  ~OutsideSession() override {
    if (link_.problem().empty()) link_.end("the connection has ended");
  }
  void receive(std::string_view bytes) override { link_.receive(bytes, now_); }
  std::string_view unsent() const override { return link_.unsent(); }
  void sent(std::size_t count) override { link_.sent(count); }
  bool has_ended() const override { return !link_.problem().empty(); }

 private:
  protocols::BusLink& link_;
  const Time& now_;
};

}  // namespace

/// The line, as long as it is open.
class Instance::RtuLine final : public protocols::RtuSession {
 public:
  RtuLine(Instance& instance, const config::RtuConfig& rtu)
      : RtuSession(instance.session_->units(), [&instance] { return instance.machine_now_; },
                   {.station = rtu.station,
                    .silence_us = rtu_silence_us(static_cast<std::uint32_t>(rtu.line.baud)),
                    .gap_us = protocols::kRtuGapUs}),
        open_(instance.rtu_) {
    open_ = this;
  }
  ~RtuLine() override { open_ = nullptr; }

 private:
  protocols::RtuSession*& open_;
};

Json Instance::open_links() {
  Json links = Json::array();
  const auto warn = [this](const std::string& line) { session_->warn(line); };
  session::Services& services = session_->services();
  const config::RtuConfig& rtu = start_.config.rtu;
  if (!services.at("modbus").listen.empty() && !rtu.line.device.empty()) {
    links.push_back(link("rtu", 0, rtu.line));
    services.at("rtu").place = rtu.line.device;
  }
  for (const config::NetworkConfig& network : start_.config.networks) {
    plant::Network& there = *session_->plant().networks()[network.number - 1];
    if (!network.can.outside.empty()) {
      const std::string spec = config::can_spec(network.can);
      const config::CanSpec can = config::parse_can_spec(spec);
      const bool is_adapter = can.kind == config::CanSpec::Kind::kSlcan;
      links.push_back(
          link("can", network.number, {is_adapter ? can.name : "", kAdapterBaud, "N"}, can.remote));
      outside_[network.number] =
          std::make_unique<Outside>(there.world().bus(), spec, session::dialect_of(can), warn);
    }
    const config::PlcConfig& plc = network.plc;
    if (there.module() == nullptr || (plc.address.empty() && plc.line.device.empty())) continue;
    const base::ListenAddress address =
        plc.address.empty() ? base::ListenAddress() : session::plc_address(plc);
    links.push_back(link("plc", network.number, plc.line, address));
    links.back()["unit"] = plc.unit;
    const std::string place = plc.address.empty() ? plc.line.device : to_string(address);
    services.at("plc", network.number).place = place;
    plcs_.emplace(network.number, protocols::PlcPolling(there, session::plc_exchanges(network, there), place,
                                                        milliseconds(plc.period_ms), warn));
  }
  return links;
}

std::unique_ptr<protocols::StreamSession> Instance::join(const std::string& name, std::size_t network) {
  if (name == "rtu") return std::make_unique<RtuLine>(*this, start_.config.rtu);
  return std::make_unique<OutsideSession>(outside_.at(network)->link, now_);
}

Json Instance::plc(std::size_t network, const Json& outcome) {
  protocols::PlcPolling& plc = plcs_.at(network);
  if (outcome.contains("words") || outcome.contains("exception")) {
    plc.answered(
        {outcome.value("exception", std::uint8_t{0}), outcome.value("words", std::vector<std::uint16_t>())});
    return {};
  }
  plc.begin_round(machine_now_);
  const auto request = plc.next();
  if (!request) return {{"at", plc.round_at()}};
  const bool reads = request->words.empty();
  return {{"first", reads ? request->read_address : request->write_address},
          {"count", request->count},
          {"words", request->words}};
}

void Instance::lose(const std::string& name, std::size_t network, const std::string& why) {
  if (name == "can") outside_.at(network)->link.end(why);
  if (name == "plc") plcs_.at(network).lost(plcs_.at(network).place() + ": " + why);
}

void Instance::advance_buses() {
  bus_deadline_ = kNever;
  for (const auto& [network, outside] : outside_)
    bus_deadline_ = earlier(bus_deadline_, outside->link.poll(now_));
}

Time Instance::poll_links() {
  if (!clock_runs() && !outside_.empty()) session_->advance();
  if (rtu_ == nullptr) return bus_deadline_;
  rtu_->poll(machine_now_);
  return earlier(bus_deadline_, rtu_->deadline());
}

}  // namespace cbcan::module
