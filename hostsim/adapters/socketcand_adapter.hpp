// SPDX-License-Identifier: MIT
#pragma once

/// What socketcand says to one of its clients, on a simulated bus (linux-can, socketcand, doc/protocol.md).
///
///   without a bus  open BUS, by any name of up to 16 characters: the bus is one. Bit timing, BUS B ..., and
///                  control modes, BUS C ..., are acknowledged and have no effect
///   BCM            send, add, update, delete; subscribe, unsubscribe
///   RAW            send; every frame
/// and rawmode, bcmmode, echo in each of the last two. What means nothing is answered by
/// `< error unknown command >`, a command that is wrong by `< error syntax error in COMMAND >`. There is no
/// word for a remote frame: none is told. There are no filters, no control mode and no ISO-TP.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string_view>

#include "adapters/adapter.hpp"
#include "adapters/socketcand_text.hpp"
#include "sim/schedule.hpp"

namespace cbcan::adapters {

/// What all clients of a bus have in common.
class SocketcandBus {
 public:
  /// `now` tells what time it is; frames show that plus `wall_offset`. After `< ok >` nothing is told for
  /// `pause`, so that clients find it alone however busy the bus is: python-can's gives up otherwise.
  SocketcandBus(sim::Bus& bus, sim::Schedule& schedule, std::function<Time()> now, Time wall_offset,
                Time pause)
      : bus_(bus), schedule_(schedule), now_(std::move(now)), wall_offset_(wall_offset), pause_(pause) {}

  /// When a cyclic frame that is due at `now` may be sent: those of all clients together are as many as a bus
  /// of 1 Mbit/s carries, one in 100 us.
  Time slot(Time now);

 private:
  friend class SocketcandAdapter;

  /// Made once for all who are told.
  std::string_view text_of(const Frame& frame, Time now);

  sim::Bus& bus_;
  sim::Schedule& schedule_;
  std::function<Time()> now_;
  Time wall_offset_;
  Time pause_;
  Time free_at_ = 0;
  Frame last_{};
  Time last_at_ = 0;
  std::string text_;  ///< of those
};

class SocketcandAdapter final : public Adapter, private sim::Timed {
 public:
  /// More than these are refused: frames that are sent again and again, and identifiers that are subscribed
  /// to.
  static constexpr std::size_t kMostJobs = 256;
  static constexpr std::size_t kMostSubscriptions = 4096;

  /// The bus lives as long.
  SocketcandAdapter(SocketcandBus& bus, OnQueued on_queued, std::size_t most_unsent = kMostUnsent,
                    std::uint64_t* lost = nullptr)
      : Adapter(bus.bus_, std::move(on_queued), most_unsent, lost), sim::Timed(bus.schedule_), bus_(bus) {
    unsent_ += socketcand::kHi;
  }

  void receive(std::string_view characters) override;
  /// `< hi >` and each `< ok >` are by themselves: there are clients that compare what they read.
  std::size_t segment() const override;
  bool has_ended() const override { return ended_; }

  void on_frame(const Frame& frame, Time now) override;
  void on_bus_state(BusState /*state*/, Time /*now*/) override {}

 private:
  enum Mode : std::uint8_t { kNoBus = 1, kBcm = 2, kRaw = 4 };
  using Words = socketcand::Words;
  struct Command;

  /// A frame that is sent again and again.
  struct Job {
    Frame frame;
    Time interval = 0;
    Time next = 0;
    bool has_slot = false;
  };
  /// What a client wants to know about an identifier.
  struct Subscription {
    Time interval = 0;    ///< from one frame that is told to the next
    Time told_until = 0;  ///< before that, a frame waits
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
  bool remove(Words words);
  bool subscribe(Words words);
  bool unsubscribe(Words words);
  void transmit(const Frame& frame);
  void tell(const Frame& frame, Time now);
  void tell_waiting(Time now);
  void run(Job& job, Time now);
  Time next_due() const;

  SocketcandBus& bus_;
  socketcand::ElementReader reader_;
  Mode mode_ = kNoBus;
  bool ended_ = false;
  std::string held_;                   ///< what is told behind the pause
  Time pause_ends_ = kNever;           ///< kNever = it is over
  std::map<std::uint32_t, Job> jobs_;  ///< by identifier, with the kernel's flag where it is extended
  std::map<std::uint32_t, Subscription> subscriptions_;
  Time waiting_due_ = kNever;  ///< of the frames that wait
};

}  // namespace cbcan::adapters
