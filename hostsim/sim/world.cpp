// SPDX-License-Identifier: MIT
#include "sim/world.hpp"

#include <algorithm>
#include <utility>

namespace cbcan::sim {

namespace {

constexpr std::uint32_t kRateOfUnpacedBus = 1'000'000;
constexpr std::uint32_t kIdBits = 11;
constexpr std::uint32_t kExtendedIdBits = 29;
constexpr std::uint32_t kDlcBits = 4;
constexpr std::uint8_t kMostData = 8;

Frame load_frame(const Fault& fault) {
  return {.id = fault.id, .length = kMostData};
}

Time load_interval(const Fault& fault, std::uint32_t bit_rate) {
  if (fault.rate != 0) return std::max<Time>(kSecond / fault.rate, 1);
  const std::uint32_t rate = bit_rate != 0 ? bit_rate : kRateOfUnpacedBus;
  return frame_time(load_frame(fault), rate) * 100 / fault.percent;
}

/// Inverts bit `bit` of identifier, DLC and data, in this order; a DLC above 8 means eight bytes.
void turn_over(Frame& frame, std::uint32_t bit, std::uint32_t id_bits) {
  if (bit < id_bits) {
    frame.id ^= 1u << bit;
  } else if (bit < id_bits + kDlcBits) {
    const auto length = static_cast<std::uint8_t>(frame.length ^ 1u << (bit - id_bits));
    frame.length = std::min(length, kMostData);
  } else {
    const std::uint32_t of_data = bit - id_bits - kDlcBits;
    frame.data[of_data / 8] ^= static_cast<std::uint8_t>(1u << of_data % 8);
  }
}

std::uint32_t data_bits_of(const Frame& frame) {
  return (frame.flags & Frame::kRemote) != 0 ? 0 : 8u * frame.length;
}

Frame corrupted(const Frame& frame, FramePart part, Random& random) {
  const std::uint32_t id_bits = (frame.flags & Frame::kExtended) != 0 ? kExtendedIdBits : kIdBits;
  const std::uint32_t head = id_bits + kDlcBits, data = data_bits_of(frame);
  const std::array<std::pair<std::uint32_t, std::uint32_t>, 4> parts{
      {{0, head + data}, {0, id_bits}, {id_bits, kDlcBits}, {head, data}}};  // the first bit and their number
  const auto [first, count] = parts[static_cast<std::size_t>(part)];
  Frame other = frame;
  turn_over(other, first + random.below(count), id_bits);
  return other;
}

bool concerns(const Fault& fault, const Frame& frame, bool is_of_module) {
  if (fault.kind == FaultKind::kModuleNmt) return is_of_module;
  if (!is_of_frames(fault.kind) || frame.id < fault.first_id || frame.id > fault.last_id) return false;
  const bool in_data = fault.kind == FaultKind::kFrameCorrupt && fault.part == FramePart::kData;
  return !in_data || data_bits_of(frame) != 0;
}

}  // namespace

void BusFaults::follow_set(Time now) {
  bool frames = false;
  for (const SetFault& set : faults_.list()) {
    const bool is_command = set.fault.kind == FaultKind::kModuleNmt;
    frames = frames || is_of_frames(set.fault.kind) || is_command || set.waits;
    if ((set.fault.kind == FaultKind::kBusLoad || is_command) && own_port_ == nullptr)
      own_port_ = &bus_.attach(*this);
  }
  bus_.set_modifier(frames ? this : nullptr);
  poll(now);
}

void BusFaults::poll(Time now) {
  deliver_late(now);
  follow_states(now);
  send_load(now);
  wants(next());
}

Time BusFaults::next() const {
  return late_.empty() ? faults_.deadline() : earlier(faults_.deadline(), late_.front().due);
}

void BusFaults::on_arrival(const Frame& frame, const Port* sender, Time now) {
  Frame arriving = frame;
  Time due = now;
  unsigned copies = 1;
  const bool is_of_module = module_ != nullptr && sender == &module_->port();
  for (SetFault& set : faults_.all()) {
    if (set.fault.kind != FaultKind::kModuleBusOff || is_of_module) faults_.begins(set, frame, now);
    if (!concerns(set.fault, frame, is_of_module) || !faults_.happens(set, frame, now)) continue;
    switch (set.fault.kind) {
      case FaultKind::kFrameLoss: return;
      case FaultKind::kFrameTwice: copies = 2; break;
      case FaultKind::kModuleNmt: send_command(set, now); break;
      case FaultKind::kFrameLate: due = now + set.fault.delay; break;
      default: arriving = corrupted(arriving, set.fault.part, set.random); break;
    }
  }
  for (; copies != 0; --copies) {
    if (due == now) {
      bus_.deliver(arriving, sender, now);
      continue;
    }
    late_.insert(std::ranges::upper_bound(late_, due, {}, &Late::due), {arriving, sender, due});
  }
  wants(next());
}

void BusFaults::deliver_late(Time now) {
  while (!late_.empty() && late_.front().due <= now) {
    const Late late = late_.front();
    late_.erase(late_.begin());
    bus_.deliver(late.frame, late.sender, now);
  }
}

void BusFaults::follow_states(Time now) {
  const BusState state = faults_.follow_states(now);
  const bool is_module_off = std::ranges::any_of(faults_.list(), [](const SetFault& set) {
    return set.fault.kind == FaultKind::kModuleBusOff && set.open;
  });
  if (module_ != nullptr) module_->keep_off(is_module_off, state, now);
  const bool holds = state != BusState::kActive;
  if (std::exchange(has_state_, holds) || holds) bus_.set_state(state, now);
}

/// One command at any time: without a bit rate a reset and the boot-up message would go on without end.
void BusFaults::send_command(SetFault& set, Time now) {
  set.begins = now + 1;
  constexpr std::array<nmt::Command, 5> kCommands{nmt::Command::kResetNode, nmt::Command::kResetCommunication,
                                                  nmt::Command::kStop, nmt::Command::kEnterPreOperational,
                                                  nmt::Command::kStart};
  const std::uint8_t node =
      module_ == nullptr ? std::uint8_t{0} : module_->coprocessor().own_node().node_id();
  if (node == 0) return;  // would be all nodes
  const auto specifier = static_cast<std::uint8_t>(kCommands[static_cast<std::size_t>(set.fault.command)]);
  own_port_->try_send({.id = nmt::kCommandId, .length = 2, .data = {specifier, node}});
}

/// A frame for which the queue still has no room when the next one is due is not sent: a load builds no
/// backlog. A full load is one frame ahead, so that the bus is never idle.
void BusFaults::send_load(Time now) {
  for (SetFault& set : faults_.all()) {
    const Fault& fault = set.fault;
    if (fault.kind != FaultKind::kBusLoad) continue;
    const bool full = fault.percent == 100 && fault.rate == 0 && bus_.bit_rate() != 0;
    const std::size_t most = full ? 2 : 1;
    while (faults_.beat_due(set, load_interval(fault, bus_.bit_rate()), now))
      while (own_port_->queued() < most && own_port_->try_send(load_frame(fault))) {
      }
  }
}

Node& World::add_node(NodeParts parts) {
  nodes_.push_back(std::make_unique<Node>(bus_, schedule_, std::move(parts)));
  return *nodes_.back();
}

Node* World::node(std::uint8_t id) const {
  const auto found = std::ranges::find(nodes_, id, [](const auto& each) { return each->device().node_id(); });
  return found == nodes_.end() ? nullptr : found->get();
}

CoprocessorModule& World::add_module(RegisterWindow window, ProcessRegisters process,
                                     const Coprocessor::Settings& settings,
                                     std::span<const ScannerWindow> scanners, ParameterStore* parameters) {
  modules_.push_back(
      std::make_unique<CoprocessorModule>(bus_, schedule_, window, process, settings, scanners, parameters));
  faults_.set_module(*modules_.back());
  return *modules_.back();
}

void World::start(Time now) {
  now_ = now;
  faults_.start(now);
  for (auto& module : modules_)
    module->start(now);
  for (auto& node : nodes_)
    node->start(now);
  run_until(now);
}

void World::advance(Time now) {
  advance_bus(now);
  for (auto& module : modules_)
    module->poll(now);
  run_until(now);
}

Time World::advance_bus(Time now) {
  // Frames that wait on an idle bus were sent since the last call: neither before the next deadline nor after now.
  if (bus_.next_deadline() <= now_) now_ = std::max(now_, std::min(now, schedule_.first_time()));
  return run_until(now);
}

inline Time World::run_until(Time now) {
  Time due = next_deadline();
  for (; due <= now; due = next_deadline()) {
    now_ = std::max(now_, due);
    bus_.advance(now_);
    schedule_.poll(now_);
  }
  now_ = now;
  return due;
}

}  // namespace cbcan::sim
