// SPDX-License-Identifier: MIT
#include "io/modbus/plc_client.hpp"

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
      connection_(std::move(connection)),
      polling_(module, std::move(exchanges), connection_->place(), settings.period, std::move(warn)),
      unit_(settings.unit) {
  connection_->on_close = [this](int descriptor) {
    reactor_.forget(descriptor);
    watched_ = false;
  };
}

void PlcClient::poll(Time now) {
  const auto client_now = static_cast<window::Time>(now);
  if (std::exchange(ready_, false) || now >= next_deadline()) {
    connection_->poll(client_now);
    if (connection_->state() == window::Connection::State::kOn) polling_.begin_round(now);
    receive(client_now);
  }
  send(client_now);
  notice_ends();
  watch();
}

void PlcClient::receive(window::Time now) {
  if (!connection_->response_due()) return;
  if (const auto response = connection_->receive(now)) polling_.answered(*response);
}

void PlcClient::send(window::Time now) {
  quiet_ = !connection_->ready(now);
  if (quiet_) return;  // next() counts on its request being sent
  if (const auto request = polling_.next()) connection_->send(unit_, *request, now);
}

void PlcClient::notice_ends() {
  for (; ends_ != connection_->ends(); ++ends_)
    polling_.lost(connection_->problem());
}

void PlcClient::watch() {
  if (watched_ || connection_->descriptor() < 0) return;
  reactor_.watch(connection_->descriptor(), Reactor::kReadable | Reactor::kWritable | Reactor::kEdge,
                 [this](std::uint32_t) { ready_ = true; });
  watched_ = true;
}

Time PlcClient::next_deadline() const {
  const bool idle = connection_->state() == window::Connection::State::kOn && !connection_->response_due();
  return idle && !quiet_ ? polling_.round_at() : static_cast<Time>(connection_->deadline());
}

}  // namespace cbcan::io
