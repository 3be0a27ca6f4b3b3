// SPDX-License-Identifier: MIT
#include "sim/bus.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace cbcan::sim {

namespace {

constexpr std::uint32_t kFilterMask = 0x7FF;

/// The bits in the order in which they fight for the bus (ISO 11898-1, arbitration): dominant is 0, so the
/// lowest wins.
std::uint64_t arbitration_field(const Frame& frame) {
  const std::uint64_t remote = (frame.flags & Frame::kRemote) != 0 ? 1 : 0;
  if ((frame.flags & Frame::kExtended) == 0) return std::uint64_t{frame.id} << 21 | remote << 20;
  const std::uint64_t base = frame.id >> 18;
  const std::uint64_t rest = frame.id & 0x3FFFF;
  return base << 21 | std::uint64_t{3} << 19 | rest << 1 | remote;
}

/// The first eleven of them.
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
  if (count_ == kQueueFrames || state_ == BusState::kBusOff || !bus_.link_) {
    ++bus_.counters_.refused;
    return false;
  }
  queue_[(first_ + count_) % kQueueFrames] = frame;
  if (++count_ == 1) bus_.arbitration_.add(*this);
  return true;
}

void Port::accept(std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t id = first; id <= last; ++id) {
    auto& ports = bus_.accepting_[id];
    if (std::find(ports.begin(), ports.end(), this) == ports.end()) ports.push_back(this);
  }
}

void Port::refuse(std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t id = first; id <= last; ++id)
    std::erase(bus_.accepting_[id], this);
}

void Port::accept_all() {
  if (std::ranges::find(bus_.accepting_all_, this) == bus_.accepting_all_.end())
    bus_.accepting_all_.push_back(this);
}

void Port::refuse_all() {
  std::erase(bus_.accepting_all_, this);
}

void Port::set_state(BusState state, Time now) {
  if (state == state_) return;
  state_ = state;
  if (state == BusState::kBusOff) bus_.drop_queue(*this);
  receiver_.on_bus_state(state, now);
}

/// The frame at the front is on the bus: the one behind it is in its place.
void Port::pop() {
  bus_.arbitration_.remove(*this);
  first_ = (first_ + 1) % kQueueFrames;
  if (--count_ != 0) bus_.arbitration_.add(*this);
}

void Arbitration::add(Port& port) {
  const std::size_t bits = sim::first_bits(port.front());
  const auto before = [key = arbitration_field(port.front()), &port](const Port& other) {
    const std::uint64_t theirs = arbitration_field(other.front());
    return theirs != key ? theirs < key : other.number_ < port.number_;
  };
  Port** place = &waiting_[bits];
  while (*place != nullptr && before(**place))
    place = &(*place)->behind_;
  port.behind_ = std::exchange(*place, &port);
  bits_[bits / 64] |= std::uint64_t{1} << bits % 64;
  words_ |= 1U << bits / 64;
}

void Arbitration::remove(Port& port) {
  const std::size_t bits = sim::first_bits(port.front());
  Port** place = &waiting_[bits];
  while (*place != &port)
    place = &(*place)->behind_;
  *place = port.behind_;
  if (waiting_[bits] != nullptr) return;
  bits_[bits / 64] &= ~(std::uint64_t{1} << bits % 64);
  if (bits_[bits / 64] == 0) words_ &= ~(1U << bits / 64);
}

std::size_t Arbitration::first_bits() const {
  const auto word = static_cast<std::size_t>(std::countr_zero(words_));
  return word * 64 + static_cast<std::size_t>(std::countr_zero(bits_[word]));
}

Port& Bus::attach(Receiver& receiver) {
  const auto number = static_cast<std::uint16_t>(ports_.size());
  ports_.push_back(std::unique_ptr<Port>(new Port(*this, receiver, number)));
  return *ports_.back();
}

void Bus::receive(const Frame& frame, Time now) {
  ++counters_.received;
  arrive(frame, nullptr, now);
}

void Bus::set_link(bool up) {
  link_ = up;
  stopped_ = false;
  if (up) return;
  for (auto& port : ports_)
    drop_queue(*port);
  if (current_ends_ != kNever) ++counters_.dropped;
  current_ends_ = kNever;
}

void Bus::set_state(BusState state, Time now) {
  for (auto& port : ports_)
    port->set_state(state, now);
}

void Bus::advance(Time now) {
  while (!stopped_) {
    if (current_ends_ != kNever) {
      if (current_ends_ > now) return;
      const Time ended = current_ends_;
      finish_current();
      if (!start_next(ended)) return;
    } else if (!start_next(now)) {
      return;
    }
  }
}

Time Bus::next_deadline() const {
  if (current_ends_ != kNever) return current_ends_;
  return arbitration_.empty() || stopped_ ? kNever : 0;
}

void Bus::drop_queue(Port& port) {
  if (port.count_ == 0) return;
  arbitration_.remove(port);
  counters_.dropped += port.count_;
  port.count_ = 0;
}

/// Puts the winner on the bus; false when there is none, or the outside has no room.
bool Bus::start_next(Time now) {
  if (arbitration_.empty()) return false;
  Port& port = arbitration_.winner();
  if (outside_ != nullptr && !outside_->transmit(port.front())) {
    ++counters_.outside_waits;
    stopped_ = true;
    return false;
  }
  current_ = port.front();
  port.pop();
  sender_ = &port;
  ++counters_.frames;
  const bool paced = bit_rate_ != 0 && outside_ == nullptr;
  current_ends_ = paced ? now + frame_time(current_, bit_rate_) : now;
  return true;
}

void Bus::finish_current() {
  const Time ended = std::exchange(current_ends_, kNever);
  arrive(current_, sender_, ended);
}

void Bus::arrive(const Frame& frame, const Port* sender, Time now) {
  if (disturbance_ != nullptr)
    disturbance_->on_arrival(frame, sender, now);
  else
    deliver(frame, sender, now);
}

void Bus::deliver(const Frame& frame, const Port* sender, Time now) {
  for (Observer* observer : observers_)
    observer->on_bus_frame(frame, now);
  for (const std::vector<Port*>* ports : {&accepting_[frame.id & kFilterMask], &accepting_all_}) {
    // By index: a receiver may change its own filter meanwhile.
    for (std::size_t i = 0; i < ports->size(); ++i) {
      Port& port = *(*ports)[i];
      if (&port != sender && port.state_ != BusState::kBusOff) port.receiver_.on_frame(frame, now);
    }
  }
}

}  // namespace cbcan::sim
