// SPDX-License-Identifier: MIT
#include "sim/bus.hpp"

#include <algorithm>
#include <utility>

namespace cbcan::sim {

namespace {

constexpr std::uint32_t kFilterMask = 0x7FF;

/// The bits in the order of arbitration (ISO 11898-1): dominant is 0, so the lowest value wins.
std::uint64_t arbitration_field(const Frame& frame) {
  const std::uint64_t remote = (frame.flags & Frame::kRemote) != 0 ? 1 : 0;
  if ((frame.flags & Frame::kExtended) == 0) return std::uint64_t{frame.id} << 21 | remote << 20;
  const std::uint64_t base = frame.id >> 18;
  const std::uint64_t rest = frame.id & 0x3FFFF;
  return base << 21 | std::uint64_t{3} << 19 | rest << 1 | remote;
}

/// The first eleven bits of the arbitration field.
std::size_t first_bits(const Frame& frame) {
  return ((frame.flags & Frame::kExtended) == 0 ? frame.id : frame.id >> 18) & kFilterMask;
}

}  // namespace

std::uint32_t bits_of(const Frame& frame) {
  const std::uint32_t data = (frame.flags & Frame::kRemote) != 0 ? 0 : 8u * frame.length;
  return ((frame.flags & Frame::kExtended) != 0 ? 67u : 47u) + data;
}

Time frame_time(const Frame& frame, std::uint32_t bit_rate) {
  return (bits_of(frame) * std::uint64_t{1'000'000} + bit_rate - 1) / bit_rate;
}

bool Port::try_send(const Frame& frame) {
  if (queued() == room_) {
    ++refused_;
    return false;
  }
  queue_[next_ % kQueueFrames] = frame;
  if (next_++ == first_) bus_.arbitration_.add(*this);
  return true;
}

void Bus::Ports::add(Port& port) {
  if (first == nullptr) {
    first = &port;
  } else if (first != &port) {
    if (!others) others = std::make_unique<std::vector<Port*>>();
    if (std::ranges::find(*others, &port) == others->end()) others->push_back(&port);
  }
}

void Bus::Ports::remove(Port& port) {
  if (others) std::erase(*others, &port);
  if (first != &port) return;
  first = !others || others->empty() ? nullptr : others->front();
  if (first != nullptr) others->erase(others->begin());
}

void Port::accept(std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t id = first; id <= last; ++id)
    bus_.accepting_[id].add(*this);
}

void Port::refuse(std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t id = first; id <= last; ++id)
    bus_.accepting_[id].remove(*this);
}

void Port::accept_all() {
  bus_.accepting_all_.add(*this);
}

void Port::refuse_all() {
  bus_.accepting_all_.remove(*this);
}

void Port::detach() {
  refuse_all();
  receiver_ = nullptr;
}

void Port::set_state(BusState state, Time now) {
  if (state == state_) return;
  state_ = state;
  if (state == BusState::kBusOff) bus_.drop_queue(*this);
  follow_state();
  if (receiver_ != nullptr) receiver_->on_bus_state(state, now);
}

/// Where this leaves no room, the queue is empty already.
void Port::follow_state() {
  room_ = state_ == BusState::kBusOff || !bus_.link_ ? 0 : kQueueFrames;
}

/// Compares the front frames of two ports in the same list.
bool Arbitration::wins(const Port& port, const Port& other) {
  const std::uint64_t own = arbitration_field(port.front());
  const std::uint64_t theirs = arbitration_field(other.front());
  return own != theirs ? own < theirs : port.number_ < other.number_;
}

inline void Arbitration::add(Port& port) {
  if (empty()) {
    only_ = &port;
    return;
  }
  if (only_ != nullptr) insert(*std::exchange(only_, nullptr));
  insert(port);
}

void Arbitration::insert(Port& port) {
  const std::size_t bits = first_bits(port.front());
  Port** place = &waiting_[bits];
  if ((bits_[bits / 64] >> bits % 64 & 1) == 0) *place = nullptr;
  while (*place != nullptr && !wins(port, **place))
    place = &(*place)->behind_;
  port.behind_ = std::exchange(*place, &port);
  bits_[bits / 64] |= std::uint64_t{1} << bits % 64;
  words_ |= 1U << bits / 64;
}

void Arbitration::remove(Port& port) {
  if (&port == only_) {
    only_ = nullptr;
    return;
  }
  const std::size_t bits = first_bits(port.front());
  Port** place = &waiting_[bits];
  while (*place != &port)
    place = &(*place)->behind_;
  *place = port.behind_;
  if (waiting_[bits] != nullptr) return;
  bits_[bits / 64] &= ~(std::uint64_t{1} << bits % 64);
  if (bits_[bits / 64] == 0) words_ &= ~(1U << bits / 64);
}

/// The builtins, since neither number is 0, which std::countr_zero would have to check.
inline std::size_t Arbitration::lowest() const {
  const auto word = static_cast<std::size_t>(__builtin_ctz(words_));
  return word * 64 + static_cast<std::size_t>(__builtin_ctzll(bits_[word]));
}

/// x & (x - 1) clears the lowest bit that is set.
inline Port& Arbitration::take_lowest() {
  const std::size_t bits = lowest();
  Port& port = *waiting_[bits];
  waiting_[bits] = port.behind_;
  if (port.behind_ != nullptr) return port;
  std::uint64_t& word = bits_[bits / 64];
  word &= word - 1;
  if (word == 0) words_ &= words_ - 1;
  return port;
}

inline Port* Arbitration::take_winner(Frame& frame) {
  if (only_ == nullptr && words_ == 0) return nullptr;
  Port& port = only_ != nullptr ? *only_ : take_lowest();
  frame = port.front();
  const bool is_empty = ++port.first_ == port.next_;
  if (&port == only_) {
    if (is_empty) only_ = nullptr;
  } else if (!is_empty) {
    add(port);
  }
  return &port;
}

Port& Bus::attach(Receiver& receiver) {
  const auto left = std::ranges::find_if(
      ports_, [](const auto& port) { return port->receiver_ == nullptr && port->queued() == 0; });
  if (left != ports_.end()) {
    (*left)->receiver_ = &receiver;
    return **left;
  }
  const auto number = static_cast<std::uint16_t>(ports_.size());
  ports_.push_back(std::unique_ptr<Port>(new Port(*this, receiver, number)));
  ports_.back()->follow_state();
  return *ports_.back();
}

void Bus::receive(const Frame& frame, Time now) {
  arrive(frame, nullptr, now);
}

void Bus::set_link(bool up) {
  link_ = up;
  stopped_ = false;
  for (auto& port : ports_) {
    if (!up) drop_queue(*port);
    port->follow_state();
  }
  if (up) return;
  current_ends_ = kNever;
}

void Bus::set_state(BusState state, Time now) {
  for (auto& port : ports_)
    port->set_state(state, now);
}

void Bus::advance(Time now) {
  if (stopped_) return;
  for (Time free = now;;) {
    if (current_ends_ == kNever && !start_next(free)) return;
    if (current_ends_ != kNever) {
      if (current_ends_ > now) return;
      free = std::exchange(current_ends_, kNever);
    }
    arrive(current_, sender_, free);
  }
}

void Bus::drop_queue(Port& port) {
  if (port.queued() == 0) return;
  arbitration_.remove(port);
  port.dropped_ += static_cast<std::uint32_t>(port.queued());
  port.first_ = port.next_;
}

/// Puts the winner on the bus; false when there is none, or the outside has no room. Without a bit rate the
/// transmission takes no time.
inline bool Bus::start_next(Time now) {
  if (outside_ != nullptr && !arbitration_.empty() && !outside_->transmit(arbitration_.winner().front())) {
    stopped_ = true;
    return false;
  }
  const Port* const port = arbitration_.take_winner(current_);
  if (port == nullptr) return false;
  sender_ = port;
  if (bit_rate_ != 0 && outside_ == nullptr) current_ends_ = now + frame_time(current_, bit_rate_);
  return true;
}

inline void Bus::arrive(const Frame& frame, const Port* sender, Time now) {
  if (modifier_ != nullptr)
    modifier_->on_arrival(frame, sender, now);
  else
    tell(frame, sender, now);
}

inline void Bus::deliver_to(Port& port, const Frame& frame, const Port* sender, Time now) {
  if (&port != sender && port.state_ != BusState::kBusOff) port.receiver_->on_frame(frame, now);
}

/// Goes by index, since a receiver may change its own filter in the meantime.
void Bus::deliver_to_others(const Ports& ports, const Frame& frame, const Port* sender, Time now) {
  for (std::size_t i = 0; i < ports.others->size(); ++i)
    deliver_to(*(*ports.others)[i], frame, sender, now);
}

inline void Bus::deliver_to(const Ports& ports, const Frame& frame, const Port* sender, Time now) {
  if (ports.first != nullptr) deliver_to(*ports.first, frame, sender, now);
  if (ports.others) deliver_to_others(ports, frame, sender, now);
}

/// What deliver() does, inlined for the path that every frame takes.
inline void Bus::tell(const Frame& frame, const Port* sender, Time now) {
  for (Observer* observer : observers_)
    observer->on_bus_frame(frame, now);
  deliver_to(accepting_[frame.id & kFilterMask], frame, sender, now);
  if (accepting_all_.first != nullptr) deliver_to(accepting_all_, frame, sender, now);
}

void Bus::deliver(const Frame& frame, const Port* sender, Time now) {
  tell(frame, sender, now);
}

}  // namespace cbcan::sim
