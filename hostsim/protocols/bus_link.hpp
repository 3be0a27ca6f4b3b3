// SPDX-License-Identifier: MIT
#pragma once

/// The end of a stream of characters at whose other end a simulated bus goes on. The stream is the caller's:
/// it may be lost, and be made again. While it is, every controller of the bus is bus-off; until the first
/// attempt has failed, frames wait.

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "protocols/dialect.hpp"
#include "sim/bus.hpp"

namespace cbcan::protocols {

class BusLink {
 public:
  using Warn = std::function<void(const std::string& line)>;

  /// `where` begins messages. The bus outlives this.
  BusLink(sim::Bus& bus, std::string where, std::unique_ptr<Dialect> dialect, Warn warn)
      : bus_(bus), where_(std::move(where)), dialect_(std::move(dialect)), warn_(std::move(warn)) {}

  /// Implements sim::Outside::transmit(). Afterwards there may be more to be sent.
  bool transmit(const Frame& frame);

  bool is_connected() const { return connected_; }
  void connected(Time now);
  void receive(std::string_view bytes, Time now);
  /// What is to be sent.
  std::string_view unsent();
  void sent(std::size_t count);
  /// The stream has ended, or could not be made; poll() does the rest, as the bus must not be called back
  /// here.
  void end(const std::string& why) { problem_ = why; }
  /// Why the stream is to be closed, until poll(); empty = it is not.
  const std::string& problem() const { return problem_; }

  /// Passes on the state of the bus; returns when it is to be called next. Call it before the bus is
  /// advanced.
  Time poll(Time now);

 private:
  void take_problem();

  sim::Bus& bus_;
  std::string where_;
  std::unique_ptr<Dialect> dialect_;
  Warn warn_;
  bool connected_ = false;
  bool open_ = false;  ///< the dialect has opened the bus
  bool full_ = false;  ///< the simulated bus waits for room
  bool lost_ = false;  ///< the connection's end was reported
  std::string unsent_;
  std::string problem_;
  BusState told_ = BusState::kActive;
};

}  // namespace cbcan::protocols
