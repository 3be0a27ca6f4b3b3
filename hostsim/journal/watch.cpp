// SPDX-License-Identifier: MIT
#include "journal/watch.hpp"

#include <utility>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"

namespace cbcan::journal {

using descriptions::BootFailure;

namespace {

constexpr std::uint32_t kFunctionMask = 0x780;

// Values in regmap::kBootSteps.
constexpr std::uint8_t kRuns = 1;
constexpr std::uint8_t kAwaitsStart = 6;
constexpr std::uint8_t kAwaitsData = 7;

constexpr auto kPreOperational = static_cast<std::uint8_t>(nmt::State::kPreOperational);

/// Time after the end of a transaction in which late frames belong to it.
constexpr Time kMostLate = 60 * kSecond;

constexpr std::size_t place(std::uint16_t address) {
  return address - regmap::kWindowFirst;
}

std::span<const std::uint8_t> bytes_of(std::span<const std::uint16_t> words, std::size_t size) {
  return {reinterpret_cast<const std::uint8_t*>(words.data()), std::min(size, 2 * words.size())};
}

Service service_of(std::span<const std::uint16_t> request) {
  const std::uint16_t command = request[place(regmap::kCommand)];
  const std::uint16_t index = request[place(regmap::kObjectIndex)];
  if (command == regmap::kSdoWrite) return index == regmap::kNmtService ? Service::kNmt : Service::kWrite;
  if (command != regmap::kSdoRead) return Service::kNone;
  return index == regmap::kNodeStateService && request[place(regmap::kObjectSubIndex)] == 0 ? Service::kState
                                                                                            : Service::kRead;
}

/// The node in "node 5: fault 1: ..."; 0 for the bus.
std::uint8_t node_in(std::string_view text) {
  const auto words = base::words_of(text.substr(0, text.find(':')));
  return words.size() == 2 ? base::parse<std::uint8_t>(words[1]).value_or(0) & nmt::kMaxNode
                           : std::uint8_t{0};
}

}  // namespace

std::optional<descriptions::EmergencyMessage> emergency_of(const Frame& frame) {
  const bool is_one = frame.id >= EmergencyConsumer::kFirstId + 1 && frame.id <= EmergencyConsumer::kLastId &&
                      frame.flags == 0 && frame.length == frame.data.size();
  return is_one ? std::optional(descriptions::emergency_from(frame.data)) : std::nullopt;
}

std::uint32_t word_at(std::span<const std::uint8_t> pdu, std::size_t place) {
  return place + 1 < pdu.size() ? pdu[place] * 256U + pdu[place + 1] : 0U;
}

NetworkWatch::NetworkWatch(Journal& journal, const Advisor::Network& network,
                           std::span<const PlcWindow> windows)
    : journal_(journal), network_(network), advisor_(journal, network, windows) {
  if (network.module != nullptr)
    status_ = network.registers.subspan(network.status_first, regmap::kStatusWords);
  for (const PlcWindow& window : windows)
    windows_.push_back({window});
  for (Watched& watched : windows_)
    if (!watched.window.in.empty()) watched.taken = watched.window.in[regmap::kScannerTaken];
}

Event NetworkWatch::event(Kind kind, Time now) const {
  return {.kind = kind, .network = network_.number, .at = now - network_.started};
}

// ---- Transactions

/// The PLC may have written CA0Eh or overwritten it. Scanner windows show the number that the module has
/// taken, so they need no look here.
void NetworkWatch::before(Time now) {
  if (windows_.empty() || !windows_.front().has_moved()) return;
  Watched& first = windows_.front();
  if (first.transaction.open)
    end(first, kCancelled, now);
  else
    begin(first, now);
}

/// The module may have written results.
void NetworkWatch::after(Time now) {
  for (Watched& watched : windows_)
    if (watched.has_moved()) look_at(watched, now);
  if (network_.module != nullptr && status_[regmap::kStatusChanges] != changes_) look_at_boots(now);
}

/// A number that was taken is a new request; a number that is answered has its result.
void NetworkWatch::look_at(Watched& watched, Time now) {
  if (watched.window.in.empty()) {
    if (watched.transaction.open) end(watched, watched.window.out[0], now);
    return;
  }
  const std::span<const std::uint16_t> in = watched.window.in;
  if (const std::uint16_t taken = in[regmap::kScannerTaken]; taken != watched.taken) {
    if (watched.transaction.open) end(watched, kCancelled, now);
    watched.taken = taken;
    begin(watched, now);
  }
  if (in[regmap::kScannerAnswered] == watched.taken) end(watched, in[regmap::kScannerResult], now);
}

void NetworkWatch::begin(Watched& watched, Time now) {
  const auto request = watched.window.out;
  Transaction& transaction = watched.transaction;
  Event begun = event(Kind::kBegun, now);
  begun.transaction = journal_.new_transaction();
  begun.service = service_of(request);
  begun.index = request[place(regmap::kObjectIndex)];
  begun.sub = static_cast<std::uint8_t>(request[place(regmap::kObjectSubIndex)]);
  begun.node = static_cast<std::uint8_t>(request[place(regmap::kNodeId)]);
  if (begun.service == Service::kNmt) begun.node = begun.sub == regmap::kNmtAllNodes ? 0 : begun.sub;
  const bool writes = begun.service == Service::kWrite || begun.service == Service::kNmt;
  const std::size_t size = begun.service == Service::kNmt ? 2 : request[place(regmap::kDataSize)];
  const auto value = bytes_of(request.subspan(place(regmap::kData)), writes ? size : 0);
  transaction.value.assign(value.begin(), value.end());
  transaction.open = true;
  transaction.sent = false;
  Event& latest = journal_.latest();
  if (latest.kind == Kind::kModbus && latest.network == network_.number && latest.at == begun.at)
    latest.transaction = begun.transaction;
  begun.state = static_cast<std::uint8_t>(&watched - windows_.data());
  begun.frame.id = watched.taken;
  transaction.request = journal_.add(begun, {transaction.value});
  if (begun.service == Service::kNmt) command_ = begun;
  advisor_.on_begun(transaction.request);
}

void NetworkWatch::end(Watched& watched, std::uint16_t result, Time now) {
  Transaction& transaction = watched.transaction;
  transaction.open = false;
  Event ended = transaction.request;
  ended.kind = Kind::kEnded;
  ended.at = now - network_.started;
  ended.took = ended.at - transaction.request.at;
  const bool scanned = !watched.window.in.empty();
  const bool by_plc = result == kCancelled || (scanned && watched.window.out[0] != watched.taken);
  const bool transfers = ended.service == Service::kRead || ended.service == Service::kWrite;
  ended.result = by_plc && transfers && !transaction.sent ? kNeverSent : result;
  const auto data = scanned ? watched.window.in.subspan(regmap::kScannerData)
                            : watched.window.out.subspan(place(regmap::kData));
  std::span<const std::uint8_t> value = transaction.value;
  if (result == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError))
    ended.code = data[0] | std::uint32_t{data[1]} << 16;
  const bool reads = ended.service == Service::kRead || ended.service == Service::kState;
  if (result == 0 && reads)
    value = bytes_of(data, scanned ? watched.window.in[regmap::kScannerSize]
                                   : watched.window.out[place(regmap::kDataSize)]);
  ended = journal_.add(ended, {value});
  Node& node = nodes_[ended.node & nmt::kMaxNode];
  Transfer& last = node.transfer;
  const bool is_other = last.transaction != 0 && last.transaction != ended.transaction;
  advisor_.on_ended(ended, {node.heard != kNever, is_other && (last.ended == kNever || last.failed)});
  if (last.transaction == ended.transaction) {
    last.ended = ended.at;
    last.failed = failed(ended);
  }
}

/// The transaction in progress with this node that began first; null = none.
NetworkWatch::Transaction* NetworkWatch::first_open(std::uint8_t node, auto fits) {
  Transaction* first = nullptr;
  for (Watched& watched : windows_) {
    Transaction& each = watched.transaction;
    if (!each.open || each.request.node != node || !fits(each.request)) continue;
    if (first == nullptr || each.request.transaction < first->request.transaction) first = &each;
  }
  return first;
}

/// The manager and other masters initiate transfers too.
void NetworkWatch::begin_transfer(Transfer& transfer, std::uint8_t node, const Frame& request) {
  const auto specifier = static_cast<sdo::Request>(sdo::specifier_of(request.data[0]));
  const bool reads = specifier == sdo::Request::kInitiateUpload || specifier == sdo::Request::kBlockUpload;
  const sdo::Multiplexer object = sdo::multiplexer_of(request);
  Transaction* const own = first_open(node, [&](const Event& asked) {
    return asked.service == (reads ? Service::kRead : Service::kWrite) &&
           sdo::multiplexer(asked.index, asked.sub) == object;
  });
  const bool block = specifier >= sdo::Request::kBlockUpload;
  transfer = {.segments_from = !block ? 0 : reads ? sdo::kResponseId : sdo::kRequestId, .object = object};
  if (own == nullptr) return;
  transfer.transaction = own->request.transaction;
  own->sent = true;
}

/// Segments belong to the transfer that was initiated last; other SDO frames name their object. After the end
/// the abort follows, and perhaps a late response.
std::uint32_t NetworkWatch::transfer_of(std::uint8_t node, const Frame& frame, Time at) {
  Transfer& transfer = nodes_[node].transfer;
  const std::uint8_t command = frame.data[0];
  const bool is_abort = command == sdo::command(sdo::Request::kAbort);  // 81h..9Fh can be segments of a block
  const std::uint32_t sender = frame.id & kFunctionMask;
  const bool is_open = transfer.transaction != 0 && transfer.ended == kNever;
  const bool in_block = is_open && transfer.segments_from == sender && !is_abort;
  const bool is_request = sender == sdo::kRequestId && !is_abort;
  if (is_request && sim::initiates(command) && !in_block) begin_transfer(transfer, node, frame);
  if (sender == sdo::kResponseId) transfer.response = frame;
  if (transfer.ended != kNever && at - transfer.ended > kMostLate) return 0;
  return is_request || in_block || sdo::is_about(transfer.object, frame) ? transfer.transaction : 0;
}

std::uint32_t NetworkWatch::transaction_of(const Frame& frame, Time at) {
  if (nmt::is_command(frame)) {
    const std::uint32_t transaction = command_.node == frame.data[1] ? command_.transaction : 0;
    if (transaction != 0) command_ = {};
    return transaction;
  }
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  switch (frame.id & ~std::uint32_t{nmt::kMaxNode}) {
    case nmt::kErrorControlId: {
      const auto is_state = [](const Event& asked) { return asked.service == Service::kState; };
      const Transaction* const first = first_open(node, is_state);
      return first == nullptr ? 0 : first->request.transaction;
    }
    case sdo::kRequestId:
    case sdo::kResponseId: return frame.flags == 0 ? transfer_of(node, frame, at) : 0;
    default: return 0;
  }
}

// ---- Boots

void NetworkWatch::look_at_boots(Time now) {
  changes_ = status_[regmap::kStatusChanges];
  for (std::uint8_t node = 0; node <= nmt::kMaxNode; ++node) {
    const auto step = static_cast<std::uint8_t>(status_[regmap::kStatusNodes + node] >> 8);
    if (const std::uint8_t before = std::exchange(nodes_[node].step, step); before != step)
      on_step(node, before, now);
  }
}

/// A failure is reported once, until there is another one or the node has run.
void NetworkWatch::on_step(std::uint8_t node, std::uint8_t before, Time now) {
  Node& watched = nodes_[node];
  const Manager::Failure& failure = network_.module->coprocessor().manager()->failure(node);
  const bool runs = watched.step == kRuns || watched.step == kAwaitsData;
  const bool kept = runs && before < kAwaitsStart && failure.letter == BootFailure::kKept;
  if (!kept && (runs || watched.step == 0)) {
    watched.failure = {};
    watched.failure_words.clear();
  }
  if (!kept && watched.step < 'A') return;
  BootFailure boot =
      failure_of(node, kept ? failure.letter : static_cast<char>(watched.step), before, failure);
  watched.failure.silent_ms = boot.silent_ms;  // makes no other failure
  const bool is_known = boot == watched.failure;
  if (!kept) watched.failure = boot;
  const sim::Node* const simulated = network_.world.node(node);
  if (simulated != nullptr)
    if (const auto* const object = simulated->description().find(boot.index, boot.sub))
      boot.name = object->name;
  boot.step = before;
  std::string words = failure_text(boot);
  Event said = event(Kind::kBoot, now);
  said.node = node;
  if (!is_known) journal_.add(said, words);
  if (!kept) watched.failure_words = std::move(words);
}

BootFailure NetworkWatch::failure_of(std::uint8_t node, char letter, std::uint8_t before,
                                     const Manager::Failure& failure) const {
  const Coprocessor& coprocessor = network_.module->coprocessor();
  const auto& manager = coprocessor.manager();
  BootFailure boot{.letter = letter, .is_own = node == 0};
  const bool is_lost = letter == BootFailure::kLost;
  const bool commanded = letter == 'K' || (letter == 'F' && before == kAwaitsStart);
  if (is_lost || letter == 'F' || letter == 'K')
    boot.silent_ms = static_cast<std::uint32_t>((commanded ? Manager::kRetries + Time{1} : Time{1}) *
                                                manager->heartbeat_time(node) / kMillisecond);
  if (is_lost && manager->is_guarded(node)) boot.index = object::kGuardTime;
  if (boot.silent_ms != 0) return boot;
  boot.code = static_cast<std::uint32_t>(failure.code);
  boot.index = failure.index;
  boot.sub = failure.sub;
  const Transfer& transfer = nodes_[node].transfer;
  const std::uint8_t response = transfer.response.data[0];
  const bool is_seen = sdo::is(response, sdo::Response::kInitiateUpload) && (response & sdo::kExpedited) != 0;
  if (boot.code != 0 || !is_seen || transfer.object != sdo::multiplexer(boot.index, boot.sub)) return boot;
  boot.seen = sdo::tail_of(transfer.response);
  boot.wanted =
      static_cast<std::uint32_t>(load_little_endian(manager->object(boot.expected_index(), node)));
  return boot;
}

// ---- The bus

void NetworkWatch::on_bus_frame(const Frame& frame, Time now) {
  ++frames_;
  bits_ += sim::bits_of(frame);
  Event seen = event(Kind::kFrame, now);
  seen.frame = frame;
  const std::uint32_t function = frame.id & kFunctionMask;
  const bool of_node =
      frame.flags == 0 && function != 0 && frame.id <= 0x77F && frame.id != 0x80 && frame.id != 0x100;
  if (of_node || (frame.flags == Frame::kRemote && function == nmt::kErrorControlId))
    seen.node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if ((frame.flags & (Frame::kExtended | Frame::kError)) == 0)
    seen.transaction = transaction_of(frame, seen.at);
  journal_.add(seen);
  advisor_.on_frame(frame);
  if (!of_node) return;
  Node& node = nodes_[seen.node];
  if (function != sdo::kRequestId) node.heard = seen.at;
  if (emergency_of(frame)) {
    node.emergency = frame;
    seen.kind = Kind::kEmergency;
    journal_.add(seen);
  }
  if (function != nmt::kErrorControlId || frame.length == 0 || node.is_simulated) return;
  const bool is_boot_up = frame.data[0] == 0;
  note_state(seen.node, is_boot_up ? kPreOperational : frame.data[0] & nmt::kStateMask, now);
}

void NetworkWatch::on_node_state(std::uint8_t node, std::uint8_t state, Time now) {
  if (node == 0 || node > nmt::kMaxNode) return;
  nodes_[node].is_simulated = true;
  note_state(node, state, now);
}

void NetworkWatch::note_state(std::uint8_t node, std::uint8_t state, Time now) {
  if (nodes_[node].state == state) return;
  nodes_[node].state = state;
  Event changed = event(Kind::kState, now);
  changed.node = node;
  changed.state = state;
  journal_.add(changed);
}

void NetworkWatch::on_terminals(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::int32_t before,
                                std::int32_t after, Time now) {
  Event moved = event(Kind::kTerminals, now);
  moved.node = node;
  moved.index = index;
  moved.sub = sub;
  moved.state = static_cast<std::uint8_t>(before ^ after);
  moved.code = static_cast<std::uint32_t>(after);
  journal_.add(moved);
}

void NetworkWatch::on_fault(std::string_view text, Time now) {
  Event fault = event(Kind::kFault, now);
  fault.node = node_in(text);
  if (const Transfer& transfer = nodes_[fault.node].transfer; transfer.ended == kNever)
    fault.transaction = transfer.transaction;
  journal_.add(fault, text);
}

// ---- The PLC

/// The request belongs to the transaction that it begins, or else to the last one of the registers in it.
void NetworkWatch::on_modbus(const protocols::ModbusExchange& exchange, const modbus::Access& access,
                             Time now) {
  Event request = event(Kind::kModbus, now);
  request.node = exchange.unit;
  request.index = static_cast<std::uint16_t>(exchange.request.size());
  request.state = exchange.exception;
  request.result = exchange.id;
  request.code = exchange.client;
  const modbus::Range& about = access.written.count != 0 ? access.written : access.read;
  for (const Watched& watched : windows_)
    if (about.overlaps({watched.window.first, watched.window.out.size()}))
      request.transaction = watched.transaction.request.transaction;
  journal_.add(request, {exchange.request, exchange.response});
  advisor_.on_modbus(exchange.client, access, now);
  before(now);
}

}  // namespace cbcan::journal
