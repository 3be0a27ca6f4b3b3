// SPDX-License-Identifier: MIT
#include "io/can/slcan_server.hpp"

#include <utility>

namespace cbcan::io {

/// An adapter that is unplugged and put back when the connection ends.
class SlcanServer::Session final : public StreamSession {
 public:
  Session(sim::SlcanAdapter& adapter, std::vector<sim::SlcanAdapter*>& idle)
      : adapter_(adapter), idle_(idle) {}
  ~Session() override {
    adapter_.reset();
    idle_.push_back(&adapter_);
  }

  void receive(std::string_view bytes) override { adapter_.receive(bytes); }
  std::string_view unsent() const override { return adapter_.unsent(); }
  void sent(std::size_t count) override { adapter_.sent(count); }

 private:
  sim::SlcanAdapter& adapter_;
  std::vector<sim::SlcanAdapter*>& idle_;
};

SlcanServer::SlcanServer(Reactor& reactor, sim::Bus& bus, const StreamAddress& address,
                         std::size_t most_unsent, OnQueued on_queued, Warn warn)
    : bus_(bus),
      most_unsent_(most_unsent),
      on_queued_(std::move(on_queued)),
      server_(
          reactor, "slcan", address, [this] { return std::make_unique<Session>(take_adapter(), idle_); },
          std::move(warn)) {}

SlcanServer::Counters SlcanServer::counters() const {
  Counters counters;
  counters.connections = server_.connections();
  for (const auto& adapter : adapters_)
    counters.lost += adapter->counters().lost;
  return counters;
}

sim::SlcanAdapter& SlcanServer::take_adapter() {
  if (idle_.empty()) {
    adapters_.push_back(std::make_unique<sim::SlcanAdapter>(bus_, on_queued_, most_unsent_));
    idle_.reserve(adapters_.size());  // to leave takes no memory
    return *adapters_.back();
  }
  sim::SlcanAdapter* adapter = idle_.back();
  idle_.pop_back();
  return *adapter;
}

}  // namespace cbcan::io
