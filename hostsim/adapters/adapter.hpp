// SPDX-License-Identifier: MIT
#pragma once

/// Somebody outside who is on a simulated bus by characters: frames become text and text frames. Pure:
/// characters in, characters out. What is said and when is the protocol's, see slcan_adapter.hpp and
/// socketcand_adapter.hpp.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "sim/bus.hpp"

namespace cbcan::adapters {

class Adapter : public sim::Receiver {
 public:
  static constexpr std::size_t kMostUnsent = 64 * 1024;
  static constexpr std::size_t kUnlimited = ~std::size_t{0};

  /// Called for each frame that has been queued: time to let the bus go on.
  using OnQueued = std::function<void()>;

  /// Attaches itself to the bus, deaf. Bus and adapter live equally long. A frame that would make more than
  /// `most_unsent` characters wait for the other side is lost.
  Adapter(sim::Bus& bus, OnQueued on_queued, std::size_t most_unsent)
      : port_(bus.attach(*this)), on_queued_(std::move(on_queued)), most_unsent_(most_unsent) {}
  virtual ~Adapter() = default;
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;

  /// Somebody has come, and is told what a newcomer is told.
  virtual void join() {}
  /// And has gone: deaf, nothing unsent, half a line forgotten. What had been queued still goes out.
  virtual void reset() {
    port_.refuse_all();
    unsent_.clear();
    sent_ = 0;
  }

  /// Characters from the other side, in pieces of any size.
  virtual void receive(std::string_view characters) = 0;

  /// What waits for the other side; sent() takes away the first `count` characters of it. What is sent is
  /// taken out when it is half of all: the rest is moved seldom.
  std::string_view unsent() const { return std::string_view(unsent_).substr(sent_); }
  void sent(std::size_t count) {
    sent_ += count;
    if (2 * sent_ < unsent_.size()) return;
    unsent_.erase(0, sent_);
    sent_ = 0;
  }
  /// How many of them are to leave together, and by themselves.
  virtual std::size_t segment() const { return unsent().size(); }
  /// The other side is to be left once it has them all.
  virtual bool has_ended() const { return false; }

  struct Counters {
    std::uint64_t commands = 0;
    std::uint64_t refused = 0;  ///< of those
    std::uint64_t lost = 0;     ///< frames for which the other side had no room
  };
  const Counters& counters() const { return counters_; }

 protected:
  /// False: a frame of so many characters is lost.
  bool has_room(std::size_t characters) {
    const bool room = unsent().size() + characters <= most_unsent_;
    counters_.lost += room ? 0 : 1;
    return room;
  }

  sim::Port& port_;
  OnQueued on_queued_;
  std::string unsent_;
  Counters counters_;

 private:
  std::size_t most_unsent_;
  std::size_t sent_ = 0;  ///< of unsent_, not yet taken out of it
};

}  // namespace cbcan::adapters
