// SPDX-License-Identifier: MIT
#pragma once

/// The wire of a simulated bus that goes on outside this program.

#include <string>

#include "cbcan/time.hpp"
#include "io/errors.hpp"
#include "io/loop/reactor.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

class OutsideBus : public sim::Outside {
 public:
  virtual ~OutsideBus() = default;

  /// To be called before the bus is advanced: tells the bus what has been found out about the outside.
  virtual void poll(Time now) = 0;

  /// When poll() and then the bus's advance() have something to do; kNever = only after the next frame.
  virtual Time next_deadline() const = 0;
};

/// One that is reached over a connection, which may end and is made again. While there is none every
/// controller of the bus is bus-off; until the first attempt has failed, frames wait.
class RemoteBus : public OutsideBus {
 public:
  /// From the end of a connection to the next attempt.
  static constexpr Time kPause = kSecond;

  ~RemoteBus() override {
    bus_.set_outside(nullptr);
    bus_.resume();
  }
  RemoteBus(const RemoteBus&) = delete;
  RemoteBus& operator=(const RemoteBus&) = delete;

  bool transmit(const Frame& frame) final { return open_ && (send(frame) || !(full_ = true)); }
  void poll(Time now) final;
  Time next_deadline() const final;

 protected:
  /// `spec` is how messages name it. Reactor and bus are the caller's.
  RemoteBus(Reactor& reactor, sim::Bus& bus, const std::string& spec, Warn warn);

  /// Calls open(); to be called at the end of a constructor too, so that who is served hears what comes next.
  void attempt();

  /// Begins to make the connection; opened() or broken() comes then or later.
  virtual void open() = 0;
  virtual void close() = 0;
  /// False: no room, there will be has_room().
  virtual bool send(const Frame& frame) = 0;
  /// What the protocol wants to do at its times; the next one.
  virtual Time keep(Time now) = 0;
  /// As the other side says.
  virtual BusState far_state() const { return BusState::kActive; }

  void opened();
  void broken(const std::string& why);
  void has_room();
  void take(const Frame& frame);

  Reactor& reactor_;
  std::string where_;

 private:
  sim::Bus& bus_;
  Warn warn_;
  bool open_ = false;
  bool full_ = false;    ///< the bus stands still
  std::string problem_;  ///< what has ended the connection, as poll() has to tell
  bool lost_ = false;    ///< that has been told
  Time open_at_ = 0;     ///< the next attempt; kNever while there is one, or a connection
  Time keep_at_ = kNever;
  BusState told_ = BusState::kActive;
};

}  // namespace cbcan::io
