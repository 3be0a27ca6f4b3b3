// SPDX-License-Identifier: MIT
// Process data of started nodes: 300Ah names the node and the mapping of the TPDO that an own RPDO receives.
// An event-driven TPDO is sent once at its node's start and then after changes: one that was missed is
// replaced by a read of its objects.
#include "cbcan/canopen/manager/manager.hpp"

namespace cbcan {

namespace {

// Node::at in kInputs: RPDO and entry.
constexpr unsigned kEntryBits = 6;
constexpr unsigned kEntryMask = (1u << kEntryBits) - 1;

struct Mapped {
  std::uint16_t index;
  std::uint8_t sub;
  std::uint8_t bits;
};

Mapped mapped(NetworkObjects::Bytes source, std::size_t entry) {
  const std::uint8_t* const bytes = &source[RpdoSource::kHead + entry * RpdoSource::kEntryBytes];
  return {static_cast<std::uint16_t>(bytes[2] | bytes[3] << 8), bytes[1], bytes[0]};
}

std::size_t entries(NetworkObjects::Bytes source) {
  return source.size() < RpdoSource::kHead ? 0
                                           : (source.size() - RpdoSource::kHead) / RpdoSource::kEntryBytes;
}

bool has_flag(NetworkObjects::Bytes source, std::uint8_t bit) {
  return (source[RpdoSource::kFlags] >> bit & 1) != 0;
}

}  // namespace

NetworkObjects::Bytes Manager::source(std::size_t rpdo) const {
  return objects_.find(object::kRpdoSource, static_cast<std::uint8_t>(rpdo + 1));
}

bool Manager::awaits_inputs(std::uint8_t node) const {
  for (std::size_t rpdo = 0; rpdo != sources_.size(); ++rpdo)
    if (sources_[rpdo] == node && !own_.has_received(rpdo)) return true;
  return false;
}

void Manager::forget_inputs(std::uint8_t node) {
  for (std::size_t rpdo = 0; rpdo != sources_.size(); ++rpdo)
    if (sources_[rpdo] == node) own_.forget_received(rpdo);
}

/// Node::at, or the next object to be read. False: there is none.
bool Manager::next_input(std::uint8_t node) {
  std::uint16_t& at = nodes_[node].at;
  for (std::size_t rpdo = at >> kEntryBits; rpdo < sources_.size();
       at = static_cast<std::uint16_t>(++rpdo << kEntryBits)) {
    if (sources_[rpdo] != node || own_.has_received(rpdo)) continue;
    const NetworkObjects::Bytes from = source(rpdo);
    if (has_flag(from, RpdoSource::kReadAtStart) && (at & kEntryMask) < entries(from)) return true;
  }
  return false;
}

void Manager::ask_input(Client& client, Time now) {
  if (!next_input(client.node)) return release(client);
  const std::uint16_t at = nodes_[client.node].at;
  if ((at & kEntryMask) == 0) client.inputs = client.input_bits = 0;
  const Mapped object = mapped(source(at >> kEntryBits), at & kEntryMask);
  request_read(client, object.index, object.sub, (object.bits + 7u) / 8, now);
}

void Manager::input_read(Client& client, Time now) {
  std::uint16_t& at = nodes_[client.node].at;
  const std::size_t rpdo = at >> kEntryBits;
  const NetworkObjects::Bytes from = source(rpdo);
  const Mapped object = mapped(from, at & kEntryMask);
  const std::uint64_t value = load_little_endian(client.data_read());
  const std::uint64_t mask = object.bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << object.bits) - 1;
  if (client.input_bits < 64) client.inputs |= (value & mask) << client.input_bits;
  client.input_bits = static_cast<std::uint8_t>(client.input_bits + object.bits);
  if ((++at & kEntryMask) < entries(from)) return;
  at = static_cast<std::uint16_t>((rpdo + 1) << kEntryBits);
  if (!own_.has_received(rpdo)) own_.put_rpdo(rpdo, client.inputs, now);
}

/// The registers keep their values until the PDO arrives.
void Manager::input_failed(Client& client, Time /*now*/) {
  std::uint16_t& at = nodes_[client.node].at;
  at = static_cast<std::uint16_t>(((at >> kEntryBits) + 1u) << kEntryBits);
}

void Manager::look_for_inputs(std::uint8_t node, Time now) {
  if (!awaits_inputs(node)) return enter(node, Phase::kRun, kNever);
  nodes_[node].due = now + kInputsPeriod;
}

void Manager::zero_inputs(std::uint8_t node, Time now) {
  for (std::size_t rpdo = 0; rpdo != sources_.size(); ++rpdo)
    if (sources_[rpdo] == node && has_flag(source(rpdo), RpdoSource::kZeroWhenLost))
      own_.put_rpdo(rpdo, 0, now);
}

/// What the own TPDOs carry now. Nothing has been written that could be replaced by zeros: nothing is sent.
Pdo::Outputs Manager::outputs() const {
  const std::uint32_t mode = outputs_mode();
  if (!active_) return Pdo::Outputs::kValues;
  if (!outputs_written_ && (mode & OutputsMode::kAtOnce) == 0) return Pdo::Outputs::kNone;
  if (!plc_lost_) return Pdo::Outputs::kValues;
  return (mode & OutputsMode::kZero) != 0 ? Pdo::Outputs::kZeros : Pdo::Outputs::kNone;
}

void Manager::take_outputs(Time now) {
  plc_lost_ = false;
  outputs_written_ = true;
  own_.send_outputs(outputs(), now);
  starts_ = active_;
}

/// With kStop also a node that is lost is stopped: it may run, and be heard again.
void Manager::on_plc_lost(Time now) {
  plc_lost_ = true;
  own_.send_outputs(outputs(), now);
  if (!active_ || !plc_stops_nodes()) return;
  for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node) {
    if (is_started(phase(node))) stop(node, now);
    if (phase(node) != Phase::kLost) continue;
    stopped_.insert(node);
    want_command(node, now);
  }
}

/// What a listed node sends counts from its start on.
void Manager::ignore_inputs(std::uint8_t node, bool ignored) {
  for (std::size_t rpdo = 0; rpdo != sources_.size(); ++rpdo)
    if (sources_[rpdo] == node) own_.ignore_rpdo(rpdo, ignored);
}

}  // namespace cbcan
