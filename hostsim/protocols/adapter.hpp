// SPDX-License-Identifier: MIT
#pragma once

/// Clients that join a simulated bus through a text protocol: frames become text, and text becomes frames.
/// Pure: characters in, characters out. The protocols are described in slcan_adapter.cpp and
/// socketcand_adapter.cpp.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"
#include "protocols/stream_session.hpp"
#include "sim/bus.hpp"
#include "sim/schedule.hpp"

namespace cbcan::protocols {

class Adapter : public sim::Receiver, public StreamSession {
 public:
  static constexpr std::size_t kMostUnsent = 64 * 1024;
  static constexpr std::size_t kUnlimited = ~std::size_t{0};

  /// Called after frames have been queued: the bus has to be advanced.
  using OnQueued = std::function<void()>;

  /// Attaches to the bus, without receiving frames yet, and detaches in the destructor; queued frames are still
  /// sent. A frame that would make more than `most_unsent` characters wait for the client is lost and counted
  /// in `lost`, which several adapters may share.
  Adapter(sim::Bus& bus, OnQueued on_queued, std::size_t most_unsent, std::uint64_t* lost)
      : port_(bus.attach(*this)), on_queued_(std::move(on_queued)), most_unsent_(most_unsent), lost_(lost) {}
  ~Adapter() override { port_.detach(); }
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;

  /// sent() erases only when half of the text has been sent, so the rest is seldom moved.
  std::string_view unsent() const override { return std::string_view(unsent_).substr(sent_); }
  void sent(std::size_t count) override {
    sent_ += count;
    if (2 * sent_ < unsent_.size()) return;
    unsent_.erase(0, sent_);
    sent_ = 0;
  }

 protected:
  /// False: there is no room for a frame of this many characters; it is counted as lost.
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
  std::size_t sent_ = 0;  ///< characters of unsent_ that were sent but not erased yet
};

/// A CAN adapter with a serial line: behaves as a LAWICEL CAN232 or CANUSB.
std::unique_ptr<StreamSession> slcan_adapter(sim::Bus& bus, Adapter::OnQueued on_queued,
                                             std::size_t most_unsent = Adapter::kMostUnsent,
                                             std::uint64_t* lost = nullptr);

/// `now` returns the time; frames show it plus `wall_offset`. After `< ok >` no frame is sent for `pause`, so that
/// a client reads it alone even on a busy bus: python-can's gives up otherwise.
struct SocketcandSettings {
  sim::Bus& bus;
  sim::Schedule& schedule;
  std::function<Time()> now;
  Time wall_offset;
  Time pause;
};

/// The server side of socketcand for all clients of a bus.
MakeSession socketcand_adapters(const SocketcandSettings& settings, Adapter::OnQueued on_queued,
                                std::size_t most_unsent = Adapter::kMostUnsent,
                                std::uint64_t* lost = nullptr);

/// CAN frames and commands as socketcand and its clients write them, `< send 123 2 1 f1 >`. Source:
/// linux-can, socketcand, doc/protocol.md.
namespace socketcand {

inline constexpr std::string_view kHi = "< hi >";
inline constexpr std::string_view kOk = "< ok >";

using Words = std::span<const std::string_view>;

/// Splits a stream of characters into elements; what is between two elements is ignored.
class ElementReader {
 public:
  /// Longer than any command.
  static constexpr std::size_t kLongest = 512;

  /// True: element() is complete.
  bool on_char(char c);
  /// The text between < and >; empty if it was too long. Valid until the next on_char().
  std::string_view element() const { return text_; }

 private:
  enum class State : std::uint8_t { kOutside, kInside, kTooLong, kEnded };

  State state_ = State::kOutside;
  std::string text_;
};

/// A frame with only an identifier. It is extended if it has eight digits or is above 7FFh; the kernel's
/// flags (linux/can.h), which some clients add, count too.
std::optional<Frame> parse_identifier(std::string_view word);

/// What follows `send`: identifier, length and that many bytes. Only the last two digits of a byte count:
/// SavvyCAN writes more for bytes above 7Fh.
std::optional<Frame> parse_send(Words words);
/// `< send 1AAAAAAA 2 1 f1 >`; remote frames have the kernel's flag.
void append_send(std::string& text, const Frame& frame);

/// What follows `frame`: identifier, time, and the bytes in one word or several.
std::optional<Frame> parse_received(Words words);
/// `< frame 123 23.424242 1A220344 >`. `time` is in microseconds.
void append_received(std::string& text, const Frame& frame, Time time);

}  // namespace socketcand

}  // namespace cbcan::protocols
