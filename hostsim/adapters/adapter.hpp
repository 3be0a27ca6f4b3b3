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

#include "adapters/stream_session.hpp"
#include "sim/bus.hpp"

namespace cbcan::adapters {

class Adapter : public sim::Receiver, public StreamSession {
 public:
  static constexpr std::size_t kMostUnsent = 64 * 1024;
  static constexpr std::size_t kUnlimited = ~std::size_t{0};

  /// Called for each frame that has been queued: time to let the bus go on.
  using OnQueued = std::function<void()>;

  /// Attaches itself to the bus, deaf, and leaves it at its end: what has been queued still goes out. A frame
  /// that would make more than `most_unsent` characters wait for the other side is lost, which `lost` counts
  /// for all who share it.
  Adapter(sim::Bus& bus, OnQueued on_queued, std::size_t most_unsent, std::uint64_t* lost)
      : port_(bus.attach(*this)), on_queued_(std::move(on_queued)), most_unsent_(most_unsent), lost_(lost) {}
  ~Adapter() override { port_.detach(); }
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;

  /// What waits for the other side; sent() takes away the first `count` characters of it. What is sent is
  /// taken out when it is half of all: the rest is moved seldom.
  std::string_view unsent() const override { return std::string_view(unsent_).substr(sent_); }
  void sent(std::size_t count) override {
    sent_ += count;
    if (2 * sent_ < unsent_.size()) return;
    unsent_.erase(0, sent_);
    sent_ = 0;
  }

 protected:
  /// False: a frame of so many characters is lost.
  bool has_room(std::size_t characters) {
    const bool room = unsent().size() + characters <= most_unsent_;
    if (!room && lost_ != nullptr) ++*lost_;
    return room;
  }

  sim::Port& port_;
  OnQueued on_queued_;
  std::string unsent_;

 private:
  std::size_t most_unsent_;
  std::uint64_t* lost_;
  std::size_t sent_ = 0;  ///< of unsent_, not yet taken out of it
};

}  // namespace cbcan::adapters
