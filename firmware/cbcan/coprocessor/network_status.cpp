// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/network_status.hpp"

#include <array>

namespace cbcan {

namespace {

using regmap::StatusMap;

/// High byte of a node's register, by phase; of a failed node it is the letter.
constexpr std::array<std::uint8_t, Manager::kPhases> kSteps{0, 2, 3, 4, 4, 4, 5, 6, 6, 7, 1, 0x58, 0};

constexpr std::size_t kWordBits = 16;

void assign(NodeSet& set, std::uint8_t node, bool value) {
  if (value)
    set.insert(node);
  else
    set.erase(node);
}

}  // namespace

void NetworkStatus::show_in(StatusRegisters words, NodeRequestRegisters requests) {
  words_ = words;
  requests_ = requests;
  for (std::uint8_t node = 0; !words.empty() && node <= nmt::kMaxNode; ++node)
    update(node);
}

void NetworkStatus::put(std::size_t word, std::uint16_t value) {
  if (std::exchange(words_[word], value) != value) ++changes_;
}

void NetworkStatus::put_bit(StatusMap map, std::uint8_t node, bool value) {
  const std::size_t word = regmap::status_map(map) + node / kWordBits;
  const auto bit = static_cast<std::uint16_t>(1u << node % kWordBits);
  put(word, static_cast<std::uint16_t>(value ? words_[word] | bit : words_[word] & ~bit));
}

bool NetworkStatus::is_heard(std::uint8_t node) const {
  return monitor_.was_seen(node) && manager_.phase(node) != Manager::Phase::kLost;
}

/// A lost node has no state, and one that runs unwatched may have any.
std::uint8_t NetworkStatus::state_of(std::uint8_t node) const {
  if (node == 0) return static_cast<std::uint8_t>(own_.state());
  const bool known = is_heard(node) && (manager_.is_watched(node) || !manager_.is_operational(node));
  return known ? static_cast<std::uint8_t>(monitor_.last_state(node)) : std::uint8_t{0};
}

std::uint16_t NetworkStatus::step_of(std::uint8_t node) const {
  const Manager::Phase phase = manager_.phase(node);
  const char letter = manager_.failure(node).letter;
  const bool alike = letter == Manager::kAlike && Manager::is_looked_for(phase);
  const bool tried = phase == Manager::Phase::kWait || phase == Manager::Phase::kFailed || node == 0;
  if (alike || (letter != 0 && tried)) return static_cast<std::uint8_t>(letter);
  return kSteps[static_cast<std::size_t>(phase)];
}

void NetworkStatus::update(std::uint8_t node) {
  if (words_.empty()) return;
  put(regmap::kStatusNodes + node, static_cast<std::uint16_t>(step_of(node) << 8 | state_of(node)));
  if (node != 0) {
    assign(unlisted_, node, is_heard(node) && !manager_.is_listed(node) && node != own_.node_id());
    assign(unwatched_, node, manager_.is_operational(node) && !manager_.is_watched(node));
    put_bit(StatusMap::kHeard, node, is_heard(node));
    put_bit(StatusMap::kConfigured, node, manager_.is_configured(node));
    put_bit(StatusMap::kRunning, node, manager_.is_operational(node));
    put_bit(StatusMap::kEmergency, node, in_error_.has(node));
    put_bit(StatusMap::kLost, node, manager_.was_lost(node));
  }
  put(regmap::kStatusSummary, summary());
  put(regmap::kStatusCounts, static_cast<std::uint16_t>(manager_.listed() << 8 | manager_.running()));
  put(regmap::kStatusFirstUnwell, manager_.first_unwell());
  words_[regmap::kStatusChanges] = changes_;
}

std::uint16_t NetworkStatus::summary() const {
  const bool own_runs = own_.state() == nmt::State::kOperational;
  const bool all_well = manager_.listed() != 0 && manager_.first_unwell() == 0 && own_runs;
  const std::array<bool, regmap::kStatusBits.size()> bits{
      all_well,
      manager_.booting() != 0,
      manager_.mandatory_missing(),
      !in_error_.empty(),
      own_runs,
      bus_off_,
      manager_.active() && !unlisted_.empty(),
      manager_.any_twin(),
      plc_was_lost_,
      !unwatched_.empty(),
  };
  unsigned value = 0;
  for (std::size_t bit = 0; bit != bits.size(); ++bit)
    value |= static_cast<unsigned>(bits[bit]) << bit;
  return static_cast<std::uint16_t>(value);
}

void NetworkStatus::on_emergency(std::uint8_t node) {
  assign(in_error_, node, kServices.emergencies && EmergencyConsumer::is_error(emergencies_->last(node)));
  update(node);
}

void NetworkStatus::forget_emergency(std::uint8_t node) {
  in_error_.erase(node);
  update(node);
}

void NetworkStatus::forget_emergencies() {
  for (std::uint8_t node = 0; (node = in_error_.next(0)) != 0;)
    forget_emergency(node);
}

void NetworkStatus::on_bus_state(BusState state) {
  bus_off_ = state == BusState::kBusOff;
  update(0);
}

void NetworkStatus::on_plc_lost() {
  plc_was_lost_ = true;
  update(0);
}

void NetworkStatus::on_written(std::size_t first, std::size_t count) {
  if (words_.empty()) return;
  const auto written = [&](std::size_t word) {
    return word >= first && word < first + count ? words_[word] : std::uint16_t{0};
  };
  if ((written(regmap::kStatusSummary) >> regmap::kStatusPlcLost & 1) != 0) plc_was_lost_ = false;
  const auto is_cleared = [&](StatusMap map, std::uint8_t node) {
    return (written(regmap::status_map(map) + node / kWordBits) >> node % kWordBits & 1) != 0;
  };
  for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node) {
    if (is_cleared(StatusMap::kLost, node)) manager_.forget_loss(node);
    if (is_cleared(StatusMap::kEmergency, node)) in_error_.erase(node);
  }
  for (const StatusMap map : {StatusMap::kHeard, StatusMap::kConfigured, StatusMap::kRunning,
                              StatusMap::kEmergency, StatusMap::kLost})
    put_bit(map, 0, false);
  // What changes here has been changed by the PLC, but for the two above.
  const std::uint16_t changes = changes_;
  for (std::uint8_t node = 0; node <= nmt::kMaxNode; ++node)
    update(node);
  changes_ = static_cast<std::uint16_t>(changes + 1);
  words_[regmap::kStatusChanges] = changes_;
}

// ---- Requests to nodes

void NetworkStatus::on_request(Time now) {
  if (requests_.empty()) return;
  const auto request = static_cast<regmap::NodeRequest>(requests_[0] >> 8);
  const auto node = static_cast<std::uint8_t>(requests_[0]);
  const bool reads = request >= regmap::NodeRequest::kEmergencyCode;
  const bool known = reads && request <= regmap::NodeRequest::kAbortCodeHigh && node <= nmt::kMaxNode;
  const bool done = reads ? known : command(request, node, now);
  requests_[1] = known ? detail(request, node) : std::uint16_t{0};
  requests_[0] = done ? std::uint16_t{0} : regmap::kNodeRefused;
}

/// False: there is no such request, node or state, or the port has no room.
bool NetworkStatus::command(regmap::NodeRequest request, std::uint8_t node, Time now) {
  using enum regmap::NodeRequest;
  if (node == 0 || node > regmap::kNmtAllNodes) return false;
  if (request == kBoot) return manager_.boot_again(node, now);
  if (request >= kStart && request <= kResetCommunication) {
    const std::size_t row = static_cast<std::size_t>(request) - static_cast<std::size_t>(kStart);
    return manager_.command(static_cast<nmt::Command>(regmap::kNmtCommands[row].specifier), node, now);
  }
  if (request != kForgetEmergency) return false;
  node == regmap::kNmtAllNodes ? forget_emergencies() : forget_emergency(node);
  return true;
}

std::uint16_t NetworkStatus::detail(regmap::NodeRequest request, std::uint8_t node) const {
  using enum regmap::NodeRequest;
  const Manager::Failure& failure = manager_.failure(node == own_.node_id() ? std::uint8_t{0} : node);
  const auto code = static_cast<std::uint32_t>(failure.code);
  switch (request) {
    case kEmergencyCode:
      if constexpr (!kServices.emergencies) return 0;
      return static_cast<std::uint16_t>(load_little_endian(std::span(emergencies_->last(node)).first<2>()));
    case kFailureIndex: return failure.index;
    case kFailureSubIndex: return static_cast<std::uint16_t>(failure.letter << 8 | failure.sub);
    case kAbortCodeLow: return static_cast<std::uint16_t>(code);
    default: return static_cast<std::uint16_t>(code >> 16);
  }
}

}  // namespace cbcan
