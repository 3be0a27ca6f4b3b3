// SPDX-License-Identifier: MIT
#include "io/modbus/plc_client.hpp"

#include <fmt/core.h>

#include <utility>

#include "io/sockets/listener.hpp"

namespace cbcan::io {

std::unique_ptr<window::Connection> plc_over_tcp(const base::ListenAddress& address) {
  const std::string where = "plc " + to_string(address) + ": ";
  const auto number = address_of(looked_up(where, address));
  if (!number) throw EnvironmentError(where + "its address cannot be found; write an IP address");
  return window::tcp_connection(number->host, address.port, kPlcTiming);
}

PlcClient::PlcClient(Reactor& reactor, protocols::ModbusUnit& module,
                     std::unique_ptr<window::Connection> connection, Exchanges exchanges,
                     const PlcSettings& settings, Warn warn)
    : reactor_(reactor),
      module_(module),
      connection_(std::move(connection)),
      exchanges_(std::move(exchanges)),
      settings_(settings),
      warn_(std::move(warn)) {
  connection_->on_close = [this](int descriptor) {
    reactor_.forget(descriptor);
    watched_ = false;
  };
}

void PlcClient::poll(Time now) {
  const auto client_now = static_cast<window::Time>(now);
  if (std::exchange(ready_, false) || now >= next_deadline()) {
    connection_->poll(client_now);
    begin_round(now);
    receive(client_now);
  }
  send(client_now);
  notice_ends();
  watch();
}

void PlcClient::begin_round(Time now) {
  if (connection_->state() != window::Connection::State::kOn || now < round_at_) return;
  round_at_ = now + settings_.period;
  for (const auto& exchange : exchanges_)
    exchange->begin();
}

void PlcClient::receive(window::Time now) {
  if (!connection_->response_due()) return;
  const auto response = connection_->receive(now);
  if (!response) return;
  ++counters_.requests;
  if (std::exchange(lost_, false)) warn_("plc " + place() + ": answers again");
  if (response->exception != 0) return on_exception(response->exception);
  module_.on_taken({});
  exchanges_[asking_]->responded(response->words);
}

void PlcClient::send(window::Time now) {
  quiet_ = !connection_->ready(now);
  if (quiet_) return;  // next() counts on its request being sent
  for (std::size_t i = 0; i < exchanges_.size(); ++i) {
    asking_ = (asking_ + 1) % exchanges_.size();  // in turn: a round may begin before the last has ended
    std::optional<window::Request> request = exchanges_[asking_]->next();
    if (!request) continue;
    request_ = std::move(*request);
    return connection_->send(settings_.unit, request_, now);
  }
}

void PlcClient::on_exception(std::uint8_t exception) {
  ++counters_.exceptions;
  const bool reads = request_.words.empty();
  const std::uint16_t first = reads ? request_.read_address : request_.write_address;
  const std::size_t count = reads ? request_.count : request_.words.size();
  if (refused_.insert(first).second)
    warn_(
        fmt::format("plc {}: answers {} its registers {}..{} by exception {}; give it these registers, or "
                    "change plc.first",
                    place(), reads ? "reading" : "writing", first, first + count - 1, exception));
  exchanges_[asking_]->lost();
}

void PlcClient::notice_ends() {
  if (ends_ == connection_->ends()) return;
  ends_ = connection_->ends();
  for (const auto& exchange : exchanges_)
    exchange->lost();
  if (!std::exchange(lost_, true)) warn_("plc " + connection_->problem() + "; it is retried");
}

void PlcClient::watch() {
  if (watched_ || connection_->descriptor() < 0) return;
  reactor_.watch(connection_->descriptor(), Reactor::kReadable | Reactor::kWritable | Reactor::kEdge,
                 [this](std::uint32_t) { ready_ = true; });
  watched_ = true;
}

Time PlcClient::next_deadline() const {
  const bool idle = connection_->state() == window::Connection::State::kOn && !connection_->response_due();
  return idle && !quiet_ ? round_at_ : static_cast<Time>(connection_->deadline());
}

}  // namespace cbcan::io
