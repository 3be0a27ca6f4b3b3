// SPDX-License-Identifier: MIT
// The server side of socketcand for one client, on a simulated bus (linux-can, socketcand, doc/protocol.md).
//
//   without a bus  open BUS, with any name of up to 16 characters: there is only one bus. Bit timing, BUS B
//                  ..., and control modes, BUS C ..., are acknowledged and have no effect
//   BCM            send, add, update, delete; subscribe, unsubscribe
//   RAW            send; the client gets every frame
// and rawmode, bcmmode, echo in both BCM and RAW. An unknown command is answered by
// `< error unknown command >`, one that is wrong by `< error syntax error in COMMAND >`. The protocol has no
// notation for received remote frames, so they are not sent. Filters, control mode and ISO-TP are not
// supported.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "base/text.hpp"
#include "protocols/adapter.hpp"

namespace cbcan::protocols {

using namespace socketcand;

namespace {

constexpr Time kSlot = 100;
constexpr std::size_t kLongestBusName = 16;
/// Limits of cyclic frames and of subscribed identifiers; more are refused.
constexpr std::size_t kMostJobs = 256;
constexpr std::size_t kMostSubscriptions = 4096;

std::uint32_t key_of(const Frame& frame) {
  return frame.id | ((frame.flags & Frame::kExtended) != 0 ? 0x8000'0000 : 0);
}

/// Seconds and microseconds.
std::optional<Time> parse_interval(Words words) {
  if (words.size() < 2) return std::nullopt;
  const auto seconds = base::parse<std::uint32_t>(words[0]);
  const auto microseconds = base::parse<std::uint32_t>(words[1]);
  if (!seconds || !microseconds) return std::nullopt;
  return *seconds * kSecond + *microseconds;
}

/// Erases by the identifier in `words`; false: there is none.
template <class Map>
bool erase_from(Map& map, Words words) {
  const auto frame = words.size() == 1 ? parse_identifier(words[0]) : std::nullopt;
  if (frame) map.erase(key_of(*frame));
  return frame.has_value();
}

/// What all clients of a bus share.
struct SocketcandBus {
  explicit SocketcandBus(const SocketcandSettings& given) : settings(given) {}

  /// When a cyclic frame that is due at `now` may be sent: all clients together send one in 100 us at most,
  /// about what a bus of 1 Mbit/s carries.
  Time slot(Time now) {
    const Time slot = std::max(free_at, now);
    free_at = slot + kSlot;
    return slot;
  }

  /// Composed once for all clients that get the frame.
  std::string_view text_of(const Frame& frame, Time now) {
    if (frame != last || now != last_at || text.empty()) {
      text.clear();
      append_received(text, last = frame, (last_at = now) + settings.wall_offset);
    }
    return text;
  }

  SocketcandSettings settings;
  Time free_at = 0;
  Frame last{};
  Time last_at = 0;
  std::string text;  ///< of the last frame
};

class SocketcandAdapter final : public Adapter, private sim::Timed {
 public:
  SocketcandAdapter(std::shared_ptr<SocketcandBus> bus, OnQueued on_queued, std::size_t most_unsent,
                    std::uint64_t* lost)
      : Adapter(bus->settings.bus, std::move(on_queued), most_unsent, lost),
        sim::Timed(bus->settings.schedule),
        bus_(std::move(bus)) {
    unsent_ += kHi;
  }

  void receive(std::string_view characters) override {
    for (const char c : characters)
      if (!ended_ && reader_.on_char(c)) execute(reader_.element());
    wants(next_due());
    on_queued_();
  }

  /// `< hi >` and each `< ok >` are sent separately: some clients compare the whole of what they read.
  std::size_t segment() const override {
    const std::string_view text = unsent();
    if (text.starts_with(kHi)) return kHi.size();
    if (text.starts_with(kOk)) return kOk.size();
    return std::min(text.find(kOk), text.size());
  }

  bool has_ended() const override { return ended_; }

  void on_frame(const Frame& frame, Time now) override {
    if ((frame.flags & (Frame::kRemote | Frame::kError)) != 0) return;
    if (mode_ == kRaw) return tell(frame, now);
    const auto found = subscriptions_.find(key_of(frame));
    if (found == subscriptions_.end()) return;
    Subscription& subscription = found->second;
    if (now < subscription.told_until) {
      subscription.waiting = frame;
      waiting_due_ = std::min(waiting_due_, subscription.told_until);
      return wants(next_due());
    }
    subscription.told_until = now + subscription.interval;
    tell(frame, now);
  }

 private:
  enum Mode : std::uint8_t { kNoBus = 1, kBcm = 2, kRaw = 4 };

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

  // ---- Commands

  void execute(std::string_view element) {
    using Self = SocketcandAdapter;
    struct Command {
      std::string_view name;
      unsigned modes;
      std::function<bool(Self&, Words)> execute;
    };
    static const std::array<Command, 8> kCommands{{
        {"open", kNoBus, &Self::open},
        {"echo", kBcm | kRaw, &Self::echo},
        {"send", kBcm | kRaw, &Self::send},
        {"add", kBcm, &Self::add},
        {"update", kBcm, &Self::update},
        {"delete", kBcm, [](Self& self, Words words) { return erase_from(self.jobs_, words); }},
        {"subscribe", kBcm, &Self::subscribe},
        {"unsubscribe", kBcm, [](Self& self, Words words) { return erase_from(self.subscriptions_, words); }},
    }};
    const auto words = base::words_of(element);
    const std::string_view name = words.empty() ? std::string_view() : words.front();
    if (mode_ == kNoBus && words.size() > 1 && (words[1] == "B" || words[1] == "C")) {
      unsent_ += kOk;
      return;
    }
    if (mode_ != kNoBus && name == "rawmode") return enter(kRaw);
    if (mode_ != kNoBus && name == "bcmmode") return enter(kBcm);
    const auto command = std::ranges::find_if(
        kCommands, [&](const Command& c) { return c.name == name && (c.modes & mode_) != 0; });
    if (command == kCommands.end()) return refuse("unknown command");
    if (!command->execute(*this, Words(words).subspan(1)))
      refuse(fmt::format("syntax error in {}", command->name));
  }

  void refuse(std::string_view why) { unsent_ += fmt::format("< error {} >", why); }

  /// Clears what belongs to a mode.
  void forget() {
    jobs_.clear();
    subscriptions_.clear();
    held_.clear();
    waiting_due_ = pause_ends_ = kNever;
  }

  void enter(Mode mode) {
    forget();
    mode_ = mode;
    port_.accept_all();
    unsent_ += kOk;
    if (bus_->settings.pause != 0) pause_ends_ = bus_->settings.now() + bus_->settings.pause;
  }

  bool open(Words words) {
    if (words.size() == 1 && words[0].size() <= kLongestBusName) {
      enter(kBcm);
      return true;
    }
    refuse("could not open bus");
    ended_ = true;
    return true;
  }

  bool echo(Words words) {
    unsent_ += words.empty() ? "< echo >" : "";
    return words.empty();
  }

  bool send(Words words) {
    const auto frame = parse_send(words);
    if (!frame) return false;
    transmit(*frame);
    on_queued_();
    return true;
  }

  bool add(Words words) {
    const auto interval = parse_interval(words);
    const auto frame = interval ? parse_send(words.subspan(2)) : std::nullopt;
    if (!frame) return false;
    if (*interval == 0) {
      transmit(*frame);
      return true;
    }
    const bool is_new = !jobs_.contains(key_of(*frame));
    if (is_new && jobs_.size() == kMostJobs) {
      refuse("too many frames to send");
      return true;
    }
    jobs_[key_of(*frame)] = {*frame, *interval, bus_->settings.now()};
    return true;
  }

  bool update(Words words) {
    const auto frame = parse_send(words);
    const auto job = frame ? jobs_.find(key_of(*frame)) : jobs_.end();
    if (job != jobs_.end()) job->second.frame = *frame;
    return frame.has_value();
  }

  bool subscribe(Words words) {
    const auto interval = parse_interval(words);
    const auto frame = words.size() == 3 ? parse_identifier(words[2]) : std::nullopt;
    if (!interval || !frame) return false;
    const bool is_new = !subscriptions_.contains(key_of(*frame));
    if (is_new && subscriptions_.size() == kMostSubscriptions) {
      refuse("too many subscriptions");
      return true;
    }
    subscriptions_[key_of(*frame)] = {*interval};
    return true;
  }

  // ---- Frames

  void transmit(const Frame& frame) {
    if (!port_.try_send(frame)) refuse("the frame is lost, the bus takes no more");
  }

  void tell(const Frame& frame, Time now) {
    const std::string_view text = bus_->text_of(frame, now);
    if (has_room(held_.size() + text.size())) (pause_ends_ == kNever ? unsent_ : held_) += text;
  }

  // ---- Time

  Time next_due() const {
    Time next = std::min(waiting_due_, pause_ends_);
    for (const auto& [id, job] : jobs_)
      next = std::min(next, job.next);
    return next;
  }

  void poll(Time now) override {
    if (pause_ends_ <= now) {
      pause_ends_ = kNever;
      unsent_ += std::exchange(held_, {});
    }
    for (auto& [id, job] : jobs_)
      if (job.next <= now) run(job, now);
    if (waiting_due_ <= now) tell_waiting(now);
    wants(next_due());
  }

  /// Sends once a millisecond at most, which bounds the work for many subscriptions.
  void tell_waiting(Time now) {
    waiting_due_ = kNever;
    for (auto& [id, subscription] : subscriptions_) {
      if (!subscription.waiting) continue;
      if (subscription.told_until <= now) {
        tell(*std::exchange(subscription.waiting, std::nullopt), now);
        subscription.told_until = now + subscription.interval;
      } else {
        waiting_due_ = std::min(waiting_due_, std::max(subscription.told_until, now + kMillisecond));
      }
    }
  }

  void run(Job& job, Time now) {
    if (!job.has_slot) {
      const Time slot = bus_->slot(now);
      job.has_slot = slot > now;
      if (job.has_slot) job.next = slot;
      if (job.has_slot) return;
    }
    job.has_slot = false;
    job.next += job.interval;
    static_cast<void>(port_.try_send(job.frame));  // without room it is dropped; the next one may find some
  }

  std::shared_ptr<SocketcandBus> bus_;
  ElementReader reader_;
  Mode mode_ = kNoBus;
  bool ended_ = false;
  std::string held_;                   ///< frames to send after the pause
  Time pause_ends_ = kNever;           ///< kNever = no pause
  std::map<std::uint32_t, Job> jobs_;  ///< by identifier, with the kernel's flag if it is extended
  std::map<std::uint32_t, Subscription> subscriptions_;
  Time waiting_due_ = kNever;  ///< of the earliest waiting frame
};

}  // namespace

MakeSession socketcand_adapters(const SocketcandSettings& settings, Adapter::OnQueued on_queued,
                                std::size_t most_unsent, std::uint64_t* lost) {
  return [bus = std::make_shared<SocketcandBus>(settings), on_queued = std::move(on_queued), most_unsent,
          lost] { return std::make_unique<SocketcandAdapter>(bus, on_queued, most_unsent, lost); };
}

}  // namespace cbcan::protocols
