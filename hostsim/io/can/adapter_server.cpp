// SPDX-License-Identifier: MIT
#include "io/can/adapter_server.hpp"

#include <utility>

namespace cbcan::io {

/// An adapter that is unplugged and put back when the connection ends.
class AdapterServer::Session final : public StreamSession {
 public:
  Session(adapters::Adapter& adapter, std::vector<adapters::Adapter*>& idle)
      : adapter_(adapter), idle_(idle) {
    adapter_.join();
  }
  ~Session() override {
    adapter_.reset();
    idle_.push_back(&adapter_);
  }

  void receive(std::string_view bytes) override { adapter_.receive(bytes); }
  std::string_view unsent() const override { return adapter_.unsent(); }
  std::size_t segment() const override { return adapter_.segment(); }
  void sent(std::size_t count) override { adapter_.sent(count); }
  bool has_ended() const override { return adapter_.has_ended(); }

 private:
  adapters::Adapter& adapter_;
  std::vector<adapters::Adapter*>& idle_;
};

AdapterServer::AdapterServer(Reactor& reactor, std::string_view service, const StreamAddress& address,
                             MakeAdapter make, Warn warn)
    : make_(std::move(make)),
      server_(
          reactor, service, address, [this] { return std::make_unique<Session>(take_adapter(), idle_); },
          std::move(warn)) {}

AdapterServer::Counters AdapterServer::counters() const {
  Counters counters;
  counters.connections = server_.connections();
  for (const auto& adapter : adapters_)
    counters.lost += adapter->counters().lost;
  return counters;
}

adapters::Adapter& AdapterServer::take_adapter() {
  if (idle_.empty()) {
    adapters_.push_back(make_());
    idle_.reserve(adapters_.size());  // to leave takes no memory
    return *adapters_.back();
  }
  adapters::Adapter* adapter = idle_.back();
  idle_.pop_back();
  return *adapter;
}

}  // namespace cbcan::io
