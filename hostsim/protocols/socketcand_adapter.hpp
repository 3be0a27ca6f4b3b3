// SPDX-License-Identifier: MIT
#pragma once

/// The server side of socketcand for one client, on a simulated bus (linux-can, socketcand, doc/protocol.md).
///
///   without a bus  open BUS, with any name of up to 16 characters: there is only one bus. Bit timing, BUS B
///                  ..., and control modes, BUS C ..., are acknowledged and have no effect
///   BCM            send, add, update, delete; subscribe, unsubscribe
///   RAW            send; the client gets every frame
/// and rawmode, bcmmode, echo in both BCM and RAW. An unknown command is answered by
/// `< error unknown command >`, one that is wrong by `< error syntax error in COMMAND >`. The protocol has no
/// notation for received remote frames, so they are not sent. Filters, control mode and ISO-TP are not
/// supported.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string_view>

#include "protocols/adapter.hpp"
#include "protocols/socketcand_text.hpp"
#include "sim/schedule.hpp"

namespace cbcan::protocols {

/// What all clients of a bus share.
class SocketcandBus {
 public:
  /// `now` returns the time; frames show it plus `wall_offset`. After `< ok >` no frame is sent for `pause`, so
  /// that a client reads it alone even on a busy bus: python-can's gives up otherwise.
  SocketcandBus(sim::Bus& bus, sim::Schedule& schedule, std::function<Time()> now, Time wall_offset,
                Time pause)
      : bus_(bus), schedule_(schedule), now_(std::move(now)), wall_offset_(wall_offset), pause_(pause) {}

  /// When a cyclic frame that is due at `now` may be sent: all clients together send one in 100 us at most,
  /// about what a bus of 1 Mbit/s carries.
  Time slot(Time now);

 private:
  friend class SocketcandAdapter;

  /// Composed once for all clients that get the frame.
  std::string_view text_of(const Frame& frame, Time now);

  sim::Bus& bus_;
  sim::Schedule& schedule_;
  std::function<Time()> now_;
  Time wall_offset_;
  Time pause_;
  Time free_at_ = 0;
  Frame last_{};
  Time last_at_ = 0;
  std::string text_;  ///< of the last frame
};

class SocketcandAdapter final : public Adapter, private sim::Timed {
 public:
  /// Limits of cyclic frames and of subscribed identifiers; more are refused.
  static constexpr std::size_t kMostJobs = 256;
  static constexpr std::size_t kMostSubscriptions = 4096;

  /// The bus outlives the adapter.
  SocketcandAdapter(SocketcandBus& bus, OnQueued on_queued, std::size_t most_unsent = kMostUnsent,
                    std::uint64_t* lost = nullptr)
      : Adapter(bus.bus_, std::move(on_queued), most_unsent, lost), sim::Timed(bus.schedule_), bus_(bus) {
    unsent_ += socketcand::kHi;
  }

  void receive(std::string_view characters) override;
  /// `< hi >` and each `< ok >` are sent separately: some clients compare the whole of what they read.
  std::size_t segment() const override;
  bool has_ended() const override { return ended_; }

  void on_frame(const Frame& frame, Time now) override;

 private:
  enum Mode : std::uint8_t { kNoBus = 1, kBcm = 2, kRaw = 4 };
  using Words = socketcand::Words;

  /// A cyclic frame.
  struct Job {
    Frame frame;
    Time interval = 0;
    Time next = 0;
    bool has_slot = false;
  };
  /// Subscription of one identifier.
  struct Subscription {
    Time interval = 0;    ///< minimum time between two frames
    Time told_until = 0;  ///< until then a frame waits
    std::optional<Frame> waiting{};
  };

  void poll(Time now) override;
  void execute(std::string_view element);
  void refuse(std::string_view why);
  void enter(Mode mode);
  void forget();
  bool open(Words words);
  bool echo(Words words);
  bool send(Words words);
  bool add(Words words);
  bool update(Words words);
  bool subscribe(Words words);
  void transmit(const Frame& frame);
  void tell(const Frame& frame, Time now);
  void tell_waiting(Time now);
  void run(Job& job, Time now);
  Time next_due() const;

  SocketcandBus& bus_;
  socketcand::ElementReader reader_;
  Mode mode_ = kNoBus;
  bool ended_ = false;
  std::string held_;                   ///< frames to send after the pause
  Time pause_ends_ = kNever;           ///< kNever = no pause
  std::map<std::uint32_t, Job> jobs_;  ///< by identifier, with the kernel's flag if it is extended
  std::map<std::uint32_t, Subscription> subscriptions_;
  Time waiting_due_ = kNever;  ///< of the earliest waiting frame
};

}  // namespace cbcan::protocols
