// SPDX-License-Identifier: MIT
#pragma once

/// One CAN bus in this process: bounded queues, arbitration by identifier, optional pacing to a bit rate,
/// bus-off, and optionally a wire that goes on outside (a SocketCAN interface). Pure and single-threaded: it
/// reads no clock, opens nothing and never calls back from inside try_send. What it does not model is in
/// docs/explanation/fidelity.md.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "cbcan/can_port.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan::sim {

class Bus;

/// Whoever gets frames from the bus. Called while the bus delivers; what it sends then is queued and goes out
/// next.
class Receiver {
 public:
  virtual void on_frame(const Frame& frame, Time now) = 0;
  /// The state of this receiver's controller has changed.
  virtual void on_bus_state(BusState state, Time now) = 0;

 protected:
  ~Receiver() = default;
};

/// Sees every frame that was on the bus, once, in bus order; for logs.
class Observer {
 public:
  virtual void on_bus_frame(const Frame& frame, Time now) = 0;

 protected:
  ~Observer() = default;
};

/// The part of the wire that lies outside this process.
class Outside {
 public:
  /// Puts a frame of a local port on the outside wire. False = not now: the frame keeps its place and the bus
  /// stands still until resume(). Must not block and must not call back.
  virtual bool transmit(const Frame& frame) = 0;

 protected:
  ~Outside() = default;
};

class Port;

/// Comes between the wire and everybody who hears it: decides what becomes of a frame. For injected faults
/// (faults/bus_faults.hpp).
class FrameModifier {
 public:
  /// The last bit of this frame has passed. What is to be heard of it goes to Bus::deliver(), now or later.
  /// `sender` is null for a frame from outside.
  virtual void on_arrival(const Frame& frame, const Port* sender, Time now) = 0;

 protected:
  ~FrameModifier() = default;
};

/// Bits of a frame and the pause behind it, without stuff bits.
std::uint32_t bits_of(const Frame& frame);

/// How long a frame and the pause behind it occupy a bus, without stuff bits; `bit_rate` in bit/s, not 0.
Time frame_time(const Frame& frame, std::uint32_t bit_rate);

/// One CAN controller on a bus: a FIFO transmit queue and an acceptance filter. Made by Bus::attach; lives
/// with the bus.
class Port final : public CanPort {
 public:
  static constexpr std::uint32_t kQueueFrames = 64;

  /// False when the queue is full, or the controller is bus-off, or the bus has no link.
  bool try_send(const Frame& frame) override;

  /// Adds identifiers first..last (0..7FFh) to the acceptance filter, or removes them. A new port accepts
  /// none. The filter looks at the lower 11 bits alone: RTR and 29-bit frames that fit pass too, as on a
  /// simple controller.
  void accept(std::uint32_t first, std::uint32_t last);
  void refuse(std::uint32_t first, std::uint32_t last);

  /// Every frame, and no longer; not together with accept(), or a frame is heard twice. For those who come
  /// and go: costs nothing for each identifier.
  void accept_all();
  void refuse_all();
  /// Its receiver, which has accepted all or nothing, goes: what is queued still goes out. Whoever is
  /// attached next may get this port.
  void detach();

  /// Takes this controller off the bus, dropping what it had queued, or puts it back on.
  void set_state(BusState state, Time now);
  BusState state() const { return state_; }

  std::size_t queued() const { return next_ - first_; }

  // Frames since the start, modulo 2^32.
  std::uint32_t sent() const { return next_; }        ///< that it took
  std::uint32_t refused() const { return refused_; }  ///< times that it took none
  std::uint32_t dropped() const { return dropped_; }  ///< lost from its queue

 private:
  friend class Bus;
  friend class Arbitration;
  Port(Bus& bus, Receiver& receiver, std::uint16_t number)
      : bus_(bus), receiver_(&receiver), number_(number) {}
  const Frame& front() const { return queue_[first_ % kQueueFrames]; }
  void follow_state();

  Bus& bus_;
  Receiver* receiver_;  ///< null = it has gone
  std::array<Frame, kQueueFrames> queue_{};
  std::uint32_t first_ = 0;  ///< of those in the queue; both count up, and are places modulo kQueueFrames
  std::uint32_t next_ = 0;   ///< behind them
  std::uint32_t room_ = 0;   ///< how many may be queued: none while it is bus-off or without a link
  std::uint32_t refused_ = 0;
  std::uint32_t dropped_ = 0;
  BusState state_ = BusState::kActive;
  std::uint16_t number_;
  Port* behind_ = nullptr;  ///< in the arbitration's list
};

/// Who of those that have something to send wins the bus (ISO 11898-1): the only one, or else the first of
/// the lowest set bit among the 2,048 that the first eleven bits on the wire can be. Nobody is searched for,
/// however many there are.
class Arbitration {
 public:
  void add(Port& port);
  void remove(Port& port);
  bool empty() const { return only_ == nullptr && words_ == 0; }
  /// Its front frame wins; it stays in. Not to be asked when empty().
  const Port& winner() const { return only_ != nullptr ? *only_ : *waiting_[lowest()]; }
  /// Takes the frame that wins out of its port's queue; null when empty().
  Port* take_winner(Frame& frame);

 private:
  void insert(Port& port);
  Port& take_lowest();
  std::size_t lowest() const;
  static bool wins(const Port& port, const Port& other);

  Port* only_ = nullptr;                  ///< not among the others: there are none
  std::array<Port*, 2048> waiting_{};     ///< by the first eleven bits: a list, the winner first
  std::array<std::uint64_t, 32> bits_{};  ///< which lists are not empty
  std::uint32_t words_ = 0;               ///< which words of bits_ are not 0
};

class Bus {
 public:
  /// `bit_rate` in bit/s paces the bus: a frame is delivered when its last bit has passed. 0 = as fast as
  /// possible.
  explicit Bus(std::uint32_t bit_rate = 0) : bit_rate_(bit_rate) {}
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// A controller whose frames go to `receiver`, which outlives the bus's last advance(), or detaches it.
  Port& attach(Receiver& receiver);

  std::uint32_t bit_rate() const { return bit_rate_; }

  void observe(Observer& observer) { observers_.push_back(&observer); }
  void ignore(Observer& observer) { std::erase(observers_, &observer); }

  /// Joins the outside wire; null takes it away.
  void set_outside(Outside* outside) { outside_ = outside; }

  /// Frames go through `modifier` before anybody hears them; null takes it away.
  void set_modifier(FrameModifier* modifier) { modifier_ = modifier; }

  /// Everybody hears this frame now, the observers first; `sender` does not, null = everybody does. For a
  /// modifier: a frame that comes by itself goes through receive().
  void deliver(const Frame& frame, const Port* sender, Time now);

  /// A frame came in from outside: delivered now to every port that accepts it, and to the observers.
  void receive(const Frame& frame, Time now);

  /// No link (cable pulled, interface down): ports refuse frames and what was queued is dropped.
  void set_link(bool up);
  bool link() const { return link_; }

  /// The outside controller's state, told to every port.
  void set_state(BusState state, Time now);

  /// Transmits and delivers everything that is due up to and including `now`, also what receivers send
  /// meanwhile.
  void advance(Time now);

  /// The outside may have room again: what it refused is due.
  void resume() { stopped_ = false; }

  /// When advance() has something to do next; kNever = only after somebody sends. A bus stopped by its
  /// outside has nothing due: whoever owns the outside knows when to resume it.
  Time next_deadline() const {
    if (current_ends_ != kNever) return current_ends_;
    return arbitration_.empty() || stopped_ ? kNever : 0;
  }

  struct Counters {
    std::uint64_t frames = 0;         ///< transmitted by local ports
    std::uint64_t received = 0;       ///< came in from outside
    std::uint64_t refused = 0;        ///< try_send said no: queue full, bus-off, no link
    std::uint64_t dropped = 0;        ///< queued frames lost to bus-off or a lost link
    std::uint64_t outside_waits = 0;  ///< the outside had no room
  };
  const Counters& counters() const { return counters_; }

 private:
  friend class Port;
  static constexpr std::size_t kIdentifiers = 2048;

  void drop_queue(Port& port);
  bool start_next(Time now);
  void arrive(const Frame& frame, const Port* sender, Time now);
  void tell(const Frame& frame, const Port* sender, Time now);
  static void deliver_to(const std::vector<Port*>& ports, const Frame& frame, const Port* sender, Time now);

  std::uint32_t bit_rate_;
  std::vector<std::unique_ptr<Port>> ports_;
  std::array<std::vector<Port*>, kIdentifiers> accepting_{};
  std::vector<Port*> accepting_all_;
  Arbitration arbitration_;
  std::vector<Observer*> observers_;
  Outside* outside_ = nullptr;
  FrameModifier* modifier_ = nullptr;
  bool link_ = true;
  bool stopped_ = false;  ///< the outside had no room for the winner
  Frame current_{};       ///< on a paced bus, the frame whose bits are passing
  const Port* sender_ = nullptr;
  Time current_ends_ = kNever;
  Counters counters_;
};

}  // namespace cbcan::sim
