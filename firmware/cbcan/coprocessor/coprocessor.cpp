// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/coprocessor.hpp"

#include <algorithm>
#include <bit>

#include "cbcan/copy_bytes.hpp"

namespace cbcan {

namespace {

/// R3706 for a node whose state nobody knows (CBCAN, section 3).
constexpr std::uint16_t kNotDetected = 6;

const regmap::NmtRow* find_nmt_command(std::uint16_t code) {
  for (const regmap::NmtRow& row : regmap::kNmtCommands)
    if (code == row.state_code || code == row.command_code) return &row;
  return nullptr;
}

/// Words of a request, from its first one.
constexpr std::size_t kSizePlace = regmap::kDataSize - regmap::kWindowFirst;
constexpr std::size_t kDataPlace = regmap::kData - regmap::kWindowFirst;

/// Data words carry the low byte first, and so does every machine that this runs on.
static_assert(std::endian::native == std::endian::little);

/// Do the registers first..first+count-1 and the `words` from `own` on overlap?
constexpr bool overlap(std::size_t first, std::size_t count, std::size_t own, std::size_t words) {
  return first < own + words && own < first + count;
}

}  // namespace

Coprocessor::Coprocessor(RegisterWindow window, ProcessRegisters process, CanPort& port,
                         const Settings& settings, ScannerWindow scanner)
    : window_(window),
      port_(port),
      settings_(settings),
      client_(port, data_),
      scanner_(scanner),
      node_(process, port, client_, {settings.node_id, settings.sdo_timeout_ms, settings.state_fresh_for}) {}

void Coprocessor::start(Time now) {
  scanner_.restart();
  node_.start(now);
  if (settings_.plc_timeout_ms != 0) plc_due_ = now + milliseconds(settings_.plc_timeout_ms);
  plc_heard_at_ = now;
  due_ = now;
}

Time Coprocessor::poll(Time now) {
  const bool execute = window_.flag() == regmap::kExecute;
  if (execute != flagged_) look_at_flag(execute, now);
  if (now >= due_) work(now);
  return due_;
}

void Coprocessor::work(Time now) {
  client_.poll(now);
  if (activity_ == Activity::kSdo && !client_.busy()) end_sdo();
  if (command_refused_) send_command(now);
  if (now >= deadline_)
    activity_ == Activity::kNodeState ? end_node_state_unanswered(now) : end(AbortCode::kTimeOut);
  if (now >= plc_due_) watch_plc(now);
  if (activity_ == Activity::kIdle) begin_waiting(now);
  node_.poll(now);
  due_ = earlier(earlier(client_.deadline(), node_.deadline()), earlier(deadline_, plc_due_));
  if (activity_ == Activity::kIdle && (flagged_ || scanner_.waiting())) due_ = now;
  if (command_refused_) wake_at(now + kRetryInterval);
}

// ---- The two windows

/// The PLC has written CA0Eh, or something else over it.
void Coprocessor::look_at_flag(bool execute, Time now) {
  flagged_ = execute;
  if (execute) {
    if (activity_ == Activity::kIdle) begin_waiting(now);
    return;
  }
  ++counters_.cancelled;
  if (activity_ != Activity::kIdle && served_ == Window::kRegisters) cancel(now);
}

void Coprocessor::on_registers_written(std::size_t first, std::size_t count, Time now) {
  if (overlap(first, count, settings_.process_first, regmap::kProcessWords)) {
    const std::size_t before = settings_.process_first > first ? settings_.process_first - first : 0u;
    if (node_.on_registers_written(first + before - settings_.process_first, count - before, now))
      follow_node();
  }
  const std::size_t out = settings_.scanner_out_first;
  if (!overlap(first, count, out, regmap::kScannerOutWords)) return;
  const std::size_t from = std::max(first, out);
  const auto event =
      scanner_.on_written(from - out, std::min(first + count, out + regmap::kScannerOutWords) - from);
  if (event == ScannerWindow::Event::kNone) return;
  if (activity_ != Activity::kIdle && served_ == Window::kScanner) {
    ++counters_.cancelled;
    cancel(now);
  }
  wake_at(now);
}

/// In turns, where both have a request.
void Coprocessor::begin_waiting(Time now) {
  if (!flagged_ && !scanner_.waiting()) return;
  const bool registers = flagged_ && (!scanner_.waiting() || served_ == Window::kScanner);
  served_ = registers ? Window::kRegisters : Window::kScanner;
  if (!registers) scanner_.begin();
  begin(now);
}

/// Of the request, in the order of R3700..R3769.
const std::uint16_t* Coprocessor::words() const {
  return served_ == Window::kRegisters ? window_.words() : scanner_.words();
}

/// Where its data, or its abort code, are to go.
std::uint16_t* Coprocessor::data_words() const {
  return served_ == Window::kRegisters ? window_.words() + kDataPlace : scanner_.data();
}

/// Each word is looked at once: the PLC's program may write to it meanwhile.
inline Coprocessor::Request Coprocessor::request() const {
  const volatile std::uint16_t* const word = words() - regmap::kWindowFirst;
  return {word[regmap::kCommand], word[regmap::kNodeId], word[regmap::kObjectIndex],
          word[regmap::kObjectSubIndex], word[regmap::kDataSize]};
}

inline void Coprocessor::load_data(std::span<std::uint8_t> bytes) const {
  copy_bytes(reinterpret_cast<const std::uint8_t*>(words() + kDataPlace), bytes.data(), bytes.size());
}

/// Words past the last byte are not touched; the unused half of the last word is 0.
inline void Coprocessor::store_data(std::span<const std::uint8_t> bytes) const {
  auto* const to = reinterpret_cast<std::uint8_t*>(data_words());
  copy_bytes(bytes.data(), to, bytes.size());
  if (bytes.size() % 2 != 0) to[bytes.size()] = 0;
}

// ---- One transaction

inline void Coprocessor::begin_sdo(const Request& request, Time now) {
  const bool read = request.command == regmap::kSdoRead;
  if (!read) load_data(client_.data().first(request.size));
  activity_ = Activity::kSdo;
  reading_ = read;
  client_.set_timeout(node_.sdo_timeout_ms(served_));
  client_.start(
      {static_cast<std::uint8_t>(request.node), static_cast<std::uint8_t>(request.sub), request.index,
       request.size, read ? SdoClient::Direction::kRead : SdoClient::Direction::kWrite,
       node_.transfer_mode(served_)},
      now);
  follow_sdo();
}

/// The checks are in the order of the contract.
void Coprocessor::begin(Time now) {
  ++counters_.executed;
  const Request request = this->request();
  const bool read = request.command == regmap::kSdoRead;
  if (!read && request.command != regmap::kSdoWrite) return finish(regmap::Result::kCommandCodeError);
  if (!read && request.index == regmap::kNmtService) return begin_nmt(request, now);
  if (request.node > nmt::kMaxNode) return finish(regmap::Result::kNodeIdError);
  if (read && request.index == regmap::kNodeStateService && request.sub == 0)
    return begin_node_state(static_cast<std::uint8_t>(request.node), now);
  if (request.sub > 255) return end(AbortCode::kNoSubIndex);
  if (request.size == 0 || request.size > regmap::kMaxDataBytes) return end(AbortCode::kSysLength);
  if (request.node == 0 || request.node == node_.node_id()) return begin_local(request, now);
  begin_sdo(request, now);
}

void Coprocessor::cancel(Time now) {
  client_.cancel(now);
  leave();
  wake_at(flagged_ || scanner_.waiting() ? now : client_.deadline());
}

void Coprocessor::leave() {
  activity_ = Activity::kIdle;
  command_refused_ = false;
  deadline_ = kNever;
}

/// The next request, which may have waited, begins at the next poll: nothing here calls itself.
void Coprocessor::finish(regmap::Result result, std::size_t size) {
  leave();
  if (result != regmap::Result::kOk) ++counters_.failed;
  if (served_ == Window::kScanner) {
    scanner_.finish(result, size);
  } else {
    flagged_ = false;
    if (!window_.finish(result)) ++counters_.cancelled;
  }
  if (flagged_ || scanner_.waiting()) due_ = 0;
}

void Coprocessor::end(AbortCode code) {
  const auto number = static_cast<std::uint32_t>(code);
  std::uint16_t* const words = data_words();
  words[0] = static_cast<std::uint16_t>(number);
  words[1] = static_cast<std::uint16_t>(number >> 16);
  finish(regmap::Result::kSdoExecutionError);
}

void Coprocessor::end_read(std::span<const std::uint8_t> bytes) {
  if (served_ == Window::kRegisters) window_.words()[kSizePlace] = static_cast<std::uint16_t>(bytes.size());
  store_data(bytes);
  finish(regmap::Result::kOk, bytes.size());
}

// ---- SDO

/// The client may have ended its transfer, and may want to be called at another time.
void Coprocessor::follow_sdo() {
  if (activity_ == Activity::kSdo && !client_.busy()) end_sdo();
  wake_at(client_.deadline());
}

void Coprocessor::end_sdo() {
  if (client_.outcome() == SdoClient::Outcome::kFailed) return end(client_.error());
  reading_ ? end_read(client_.data().first(client_.size())) : finish(regmap::Result::kOk);
}

void Coprocessor::begin_local(const Request& request, Time now) {
  std::array<std::uint8_t, regmap::kMaxDataBytes> bytes;
  const std::span<std::uint8_t> value(bytes.data(), request.size);
  const auto sub = static_cast<std::uint8_t>(request.sub);
  if (request.command == regmap::kSdoWrite) {
    load_data(value);
    const AbortCode refused = node_.write(served_, request.index, sub, value, now);
    follow_node();
    return refused == AbortCode::kNone ? finish(regmap::Result::kOk) : end(refused);
  }
  std::size_t size = 0;
  const AbortCode refused = node_.read(served_, request.index, sub, value, size, now);
  refused == AbortCode::kNone ? end_read(value.first(size)) : end(refused);
}

// ---- NMT and node state

void Coprocessor::begin_nmt(const Request& request, Time now) {
  if (request.sub == 0 || request.sub > regmap::kNmtAllNodes) return end(AbortCode::kNoSubIndex);
  const regmap::NmtRow* row = find_nmt_command(words()[kDataPlace]);
  if (row == nullptr) return end(AbortCode::kValue);
  const auto command = static_cast<nmt::Command>(row->specifier);
  if (request.sub == node_.node_id()) {
    node_.command(command, now);
    follow_node();
    return finish(regmap::Result::kOk);
  }
  const auto node =
      request.sub == regmap::kNmtAllNodes ? nmt::kAllNodes : static_cast<std::uint8_t>(request.sub);
  activity_ = Activity::kNmtCommand;
  const std::uint16_t timeout_ms = node_.sdo_timeout_ms(served_);
  deadline_ = timeout_ms == 0 ? kNever : now + milliseconds(timeout_ms);
  command_ = nmt::command_frame(command, node);
  send_command(now);
}

void Coprocessor::begin_node_state(std::uint8_t node, Time now) {
  if (node == 0 || node == node_.node_id()) return end_node_state(node_.state());
  if (node_.monitor().is_fresh(node, now) && !node_.monitor().in_doubt(node))
    return end_node_state(node_.monitor().last_state(node));
  activity_ = Activity::kNodeState;
  state_node_ = node;
  deadline_ = now + settings_.guard_timeout;
  command_ = nmt::guard_request(node);
  send_command(now);
}

/// An NMT command is done when the port has taken it; a guarding request then waits for its response.
void Coprocessor::send_command(Time now) {
  command_refused_ = !port_.try_send(command_);
  if (command_refused_) return wake_at(now);
  if (activity_ == Activity::kNmtCommand) {
    node_.monitor().doubt(static_cast<nmt::Command>(command_.data[0]), command_.data[1]);
    return finish(regmap::Result::kOk);
  }
  node_.monitor().guard(state_node_);
  deadline_ = now + settings_.guard_timeout;
  wake_at(deadline_);
}

/// Nodes with a heartbeat need not answer: what they reported stands while it is fresh.
void Coprocessor::end_node_state_unanswered(Time now) {
  if (node_.monitor().is_fresh(state_node_, now))
    return end_node_state(node_.monitor().last_state(state_node_));
  end_with_state(kNotDetected);
}

void Coprocessor::end_with_state(std::uint16_t state) {
  const std::array<std::uint8_t, 1> byte{static_cast<std::uint8_t>(state)};
  end_read(byte);
}

// ---- Frames

void Coprocessor::on_frame(const Frame& frame, Time now) {
  constexpr unsigned kFunctionShift = 7;
  switch (frame.id >> kFunctionShift) {
    case sdo::kResponseId >> kFunctionShift: return on_sdo_response(frame, now);
    case nmt::kErrorControlId >> kFunctionShift:
      if (frame.flags == 0) return on_error_control(frame, now);
      [[fallthrough]];
    default: return on_own_node(frame, now);
  }
}

void Coprocessor::on_sdo_response(const Frame& frame, Time now) {
  client_.on_frame(frame, now);
  follow_sdo();
}

void Coprocessor::on_own_node(const Frame& frame, Time now) {
  if (node_.on_frame(frame, now)) wake_at(node_.deadline());
}

void Coprocessor::on_bus_state(BusState state, Time now) {
  node_.on_bus_state(state, now);
  follow_node();
}

void Coprocessor::on_plc(Time now) {
  plc_heard_at_ = now;
  if (settings_.plc_timeout_ms == 0 || plc_due_ != kNever) return;
  plc_due_ = now + milliseconds(settings_.plc_timeout_ms);
  wake_at(plc_due_);
}

/// The bus sees that the PLC is gone: TPDOs end, the heartbeat tells. Outputs stay as they are.
void Coprocessor::watch_plc(Time now) {
  plc_due_ = plc_heard_at_ + milliseconds(settings_.plc_timeout_ms);
  if (now < plc_due_) return;
  plc_due_ = kNever;
  if (node_.state() == nmt::State::kOperational) node_.command(settings_.plc_lost, now);
}

void Coprocessor::on_error_control(const Frame& frame, Time now) {
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  if (node == 0) return;  // there is none
  const NodeMonitor::News news = node_.on_error_control(frame, now);
  if (news == NodeMonitor::News::kNone) return;
  if (news == NodeMonitor::News::kBootUp) on_boot_up(node, now);
  if (activity_ == Activity::kNodeState && node == state_node_)
    end_node_state(node_.monitor().last_state(node));
}

void Coprocessor::on_boot_up(std::uint8_t node, Time now) {
  client_.on_boot_up(node, now);
  follow_sdo();
}

}  // namespace cbcan
