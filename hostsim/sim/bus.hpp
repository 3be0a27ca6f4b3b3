// SPDX-License-Identifier: MIT
#pragma once

/// One CAN bus in this process: bounded queues, arbitration by identifier, optional pacing to a bit rate,
/// bus-off, and optionally a connection to a bus outside (a SocketCAN interface). Pure and single-threaded: it
/// reads no clock, opens nothing and never calls back from inside try_send. docs/explanation/fidelity.md says
/// what it does not model.

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

/// Gets frames from the bus. Called while the bus delivers; frames that it sends then are queued. One that only
/// sends needs neither function.
class Receiver {
 public:
  virtual void on_frame(const Frame& /*frame*/, Time /*now*/) {}
  /// The state of this receiver's controller has changed.
  virtual void on_bus_state(BusState /*state*/, Time /*now*/) {}

 protected:
  ~Receiver() = default;
};

/// Sees every frame on the bus, once, in bus order; for logs.
class Observer {
 public:
  virtual void on_bus_frame(const Frame& frame, Time now) = 0;

 protected:
  ~Observer() = default;
};

/// The part of the bus outside this process.
class Outside {
 public:
  /// Sends a frame of a local port on the outside bus. False = not now: the frame keeps its place and this bus
  /// stops until resume(). Must not block and must not call back.
  virtual bool transmit(const Frame& frame) = 0;

 protected:
  ~Outside() = default;
};

class Port;

/// Decides what receivers and observers get of each frame. For injected faults (BusFaults in world.hpp).
class FrameModifier {
 public:
  /// The last bit of this frame has passed. What is to be received goes to Bus::deliver(), now or later.
  /// `sender` is null for a frame from outside.
  virtual void on_arrival(const Frame& frame, const Port* sender, Time now) = 0;

 protected:
  ~FrameModifier() = default;
};

/// Bits of a frame and the interframe space after it, without stuff bits.
std::uint32_t bits_of(const Frame& frame);

/// How long a frame and the interframe space after it occupy a bus, without stuff bits; `bit_rate` in bit/s,
/// not 0.
Time frame_time(const Frame& frame, std::uint32_t bit_rate);

/// One CAN controller on a bus: a FIFO transmit queue and an acceptance filter. Made by Bus::attach; lives
/// with the bus.
class Port final : public CanPort {
 public:
  static constexpr std::uint32_t kQueueFrames = 64;

  /// False when the queue is full, the controller is bus-off, or the bus has no link.
  bool try_send(const Frame& frame) override;

  /// Adds identifiers first..last (0..7FFh) to the acceptance filter, or removes them. A new port accepts
  /// none. The filter compares only the lower 11 bits: RTR and 29-bit frames that match pass too, as on a
  /// simple controller.
  void accept(std::uint32_t first, std::uint32_t last);
  void refuse(std::uint32_t first, std::uint32_t last);

  /// Accepts every frame, or none again. Not to be combined with accept(), or a frame is received twice. For
  /// temporary receivers: there is no cost for each identifier.
  void accept_all();
  void refuse_all();
  /// The receiver, which must have accepted all frames or none, leaves: queued frames are still sent. The next
  /// receiver that is attached may get this port.
  void detach();

  /// Bus-off drops what is queued, and the controller is off the bus until it gets another state.
  void set_state(BusState state, Time now);
  BusState state() const { return state_; }

  std::size_t queued() const { return next_ - first_; }

  // Frames since the start, modulo 2^32.
  std::uint32_t sent() const { return next_; }        ///< accepted by try_send()
  std::uint32_t refused() const { return refused_; }  ///< refused by try_send()
  std::uint32_t dropped() const { return dropped_; }  ///< lost from the queue

 private:
  friend class Bus;
  friend class Arbitration;
  Port(Bus& bus, Receiver& receiver, std::uint16_t number)
      : bus_(bus), receiver_(&receiver), number_(number) {}
  const Frame& front() const { return queue_[first_ % kQueueFrames]; }
  void follow_state();

  Bus& bus_;
  Receiver* receiver_;  ///< null = detached
  std::array<Frame, kQueueFrames> queue_{};
  std::uint32_t first_ = 0;  ///< number of the first queued frame; its slot is that modulo kQueueFrames
  std::uint32_t next_ = 0;   ///< number of the next frame
  std::uint32_t room_ = 0;   ///< how many frames may be queued: none in bus-off or without a link
  std::uint32_t refused_ = 0;
  std::uint32_t dropped_ = 0;
  BusState state_ = BusState::kActive;
  std::uint16_t number_;
  Port* behind_ = nullptr;  ///< in the arbitration's list
};

/// Which of the ports with queued frames wins the bus (ISO 11898-1): the only one, or else the first in the
/// lowest of 2,048 lists, one for each value of the first eleven bits on the wire. Bit sets find that list
/// without a search, however many ports there are.
class Arbitration {
 public:
  void add(Port& port);
  void remove(Port& port);
  bool empty() const { return only_ == nullptr && words_ == 0; }
  /// The port whose front frame wins; it stays in. Not to be called when empty().
  const Port& winner() const { return only_ != nullptr ? *only_ : *waiting_[lowest()]; }
  /// Takes the frame that wins out of its port's queue; null when empty().
  Port* take_winner(Frame& frame);

 private:
  void insert(Port& port);
  Port& take_lowest();
  std::size_t lowest() const;
  static bool wins(const Port& port, const Port& other);

  Port* only_ = nullptr;                  ///< the only port that waits: the lists are empty
  std::array<Port*, 2048> waiting_;       ///< lists by the first eleven bits, the winner first; not cleared
  std::array<std::uint64_t, 32> bits_{};  ///< which lists are not empty
  std::uint32_t words_ = 0;               ///< which words of bits_ are not 0
};

class Bus {
 public:
  /// `bit_rate` in bit/s: a frame is delivered when its last bit has passed. 0 = not paced, as fast as possible.
  explicit Bus(std::uint32_t bit_rate = 0) : bit_rate_(bit_rate) {}
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// A controller whose frames go to `receiver`, which outlives the bus's last advance(), or detaches it.
  Port& attach(Receiver& receiver);

  std::uint32_t bit_rate() const { return bit_rate_; }

  void observe(Observer& observer) { observers_.push_back(&observer); }
  void ignore(Observer& observer) { std::erase(observers_, &observer); }

  /// Connects the bus outside; null disconnects it.
  void set_outside(Outside* outside) { outside_ = outside; }

  /// Frames go through `modifier` before they are delivered; null removes it.
  void set_modifier(FrameModifier* modifier) { modifier_ = modifier; }

  /// Delivers this frame now, first to the observers, then to all ports that accept it except `sender` (null =
  /// no exception). For a modifier; a frame from outside goes through receive().
  void deliver(const Frame& frame, const Port* sender, Time now);

  /// A frame came in from outside: delivered now to every port that accepts it, and to the observers.
  void receive(const Frame& frame, Time now);

  /// No link (cable pulled, interface down): ports refuse frames and what was queued is dropped.
  void set_link(bool up);
  bool link() const { return link_; }

  /// Sets the state of every port, for example to that of the controller outside.
  void set_state(BusState state, Time now);

  /// Transmits and delivers everything that is due up to and including `now`, also what receivers send in the
  /// meantime.
  void advance(Time now);

  /// The outside may have room again: the frame that it refused is due.
  void resume() { stopped_ = false; }

  /// When advance() has something to do next; kNever = only after a frame is sent. A bus stopped by its outside
  /// has nothing due: the owner of the outside knows when to resume it.
  Time next_deadline() const {
    if (current_ends_ != kNever) return current_ends_;
    return arbitration_.empty() || stopped_ ? kNever : 0;
  }

 private:
  friend class Port;
  static constexpr std::size_t kIdentifiers = 2048;
  /// Most identifiers have one: no memory for it. Small, as each bus clears 2,048.
  struct Ports {
    void add(Port& port);
    void remove(Port& port);

    Port* first = nullptr;
    std::unique_ptr<std::vector<Port*>> others{};  ///< null until there was one
  };

  void drop_queue(Port& port);
  bool start_next(Time now);
  void arrive(const Frame& frame, const Port* sender, Time now);
  void tell(const Frame& frame, const Port* sender, Time now);
  static void deliver_to(Port& port, const Frame& frame, const Port* sender, Time now);
  static void deliver_to(const Ports& ports, const Frame& frame, const Port* sender, Time now);
  static void deliver_to_others(const Ports& ports, const Frame& frame, const Port* sender, Time now);

  std::uint32_t bit_rate_;
  std::vector<std::unique_ptr<Port>> ports_;
  std::array<Ports, kIdentifiers> accepting_{};
  Ports accepting_all_;
  Arbitration arbitration_;
  std::vector<Observer*> observers_;
  Outside* outside_ = nullptr;
  FrameModifier* modifier_ = nullptr;
  bool link_ = true;
  bool stopped_ = false;  ///< the outside had no room for the winner
  Frame current_{};       ///< on a paced bus, the frame that is being transmitted
  const Port* sender_ = nullptr;
  Time current_ends_ = kNever;
};

}  // namespace cbcan::sim
