// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/channel.hpp"

#include <bit>

#include "cbcan/copy_bytes.hpp"

namespace cbcan {

namespace {

/// R3706 for a node whose state is not known (CBCAN, section 3).
constexpr std::uint8_t kNotDetected = 6;

const regmap::NmtRow* find_nmt_command(std::uint16_t code) {
  for (const regmap::NmtRow& row : regmap::kNmtCommands)
    if (code == row.state_code || code == row.command_code) return &row;
  return nullptr;
}

/// Offsets of words in a request.
constexpr std::size_t kSizePlace = regmap::kDataSize - regmap::kWindowFirst;
constexpr std::size_t kDataPlace = regmap::kData - regmap::kWindowFirst;

/// Data words hold the low byte first, as the words of every supported processor do.
static_assert(std::endian::native == std::endian::little, "the coprocessor needs a little-endian processor");

}  // namespace

void Channel::start(Time now) {
  if constexpr (kServices.scanner_window) scanner_->restart();
  due_ = now;
}

void Channel::reset() {
  transfers_.fill(node_.transfers());
  client_.forget_nodes();
}

void Channel::work(Time now) {
  client_.poll(now);
  if (activity_ == Activity::kSdo && !client_.busy()) end_sdo();
  if (command_refused_) send_command(now);
  if (now >= deadline_) {
    if (activity_ == Activity::kNodeState)
      end_node_state_unanswered(now);
    else
      end(AbortCode::kTimeOut);
  }
  if (activity_ == Activity::kIdle) begin_waiting(now);
  due_ = earlier(client_.deadline(), deadline_);
  if (activity_ == Activity::kIdle && (flagged_ || scanner_waits())) due_ = now;
  if (command_refused_) wake_at(now + kRetryInterval);
}

// ---- The two windows

/// The PLC has written CA0Eh, or has overwritten it.
void Channel::on_flag(bool execute, Time now) {
  flagged_ = execute;
  if (execute) {
    if (activity_ == Activity::kIdle) begin_waiting(now);
    return;
  }
  ++counters_.cancelled;
  if (activity_ != Activity::kIdle && served_ == Window::kRegisters) cancel(now);
}

/// Serves the windows in turn if both have a request. While the own node is being reset they wait.
void Channel::begin_waiting(Time now) {
  if ((!flagged_ && !scanner_waits()) || node_.slave().resetting()) return;
  const bool registers =
      !kServices.scanner_window || (flagged_ && (!scanner_->waiting() || !serves_registers()));
  served_ = registers ? Window::kRegisters : Window::kScanner;
  if (!registers) scanner_->begin();
  if (node_.others() != nullptr) return node_.others()->begin_or_hold_back(*this, now);
  if (node_.manages()) return begin_between_boots(now);
  begin(now);
}

/// Alone with the manager: an SDO request goes between two of the manager's to the same node.
void Channel::begin_between_boots(Time now) {
  const std::uint8_t server = server_of(request());
  if (!kServices.manager() || server == 0 || node_.manager()->node_free_from(server, now) <= now)
    return begin(now);
  hold_back();
  wake_at(now + Manager::kPause);
}

void Channel::hold_back() {
  activity_ = Activity::kHeldBack;
  if (!serves_registers()) scanner_->hold_back();
}

/// The window whose request was delayed is served first, as if the other one had been served last.
void Channel::resume(Time now) {
  activity_ = Activity::kIdle;
  served_ = served_ == Window::kRegisters ? Window::kScanner : Window::kRegisters;
  begin_waiting(now);
}

/// Destination of the data or the abort code.
std::uint16_t* Channel::data_words() const {
  return serves_registers() ? window_.words() + kDataPlace : scanner_->data();
}

void Channel::load_data(std::uint8_t* to, std::size_t size) const {
  copy_bytes(reinterpret_cast<const std::uint8_t*>(words() + kDataPlace), to, size);
}

// ---- One transaction

inline void Channel::begin_sdo(const Request& request, SdoClient::Direction direction, Time now) {
  if (direction == SdoClient::Direction::kWrite) load_data(data_.data(), request.size);
  activity_ = Activity::kSdo;
  direction_ = direction;
  client_.set_timeout(transfers().timeout_ms);
  client_.start({static_cast<std::uint8_t>(request.node), static_cast<std::uint8_t>(request.sub),
                 request.index, request.size, direction, transfers().mode},
                now);
  follow_sdo();
}

/// The checks are in the order of the contract.
void Channel::begin(Time now) {
  ++counters_.executed;
  const Request request = this->request();
  const bool read = request.command == regmap::kSdoRead;
  if (read) {
    if (request.index == regmap::kNodeStateService && request.sub == 0 && request.node <= nmt::kMaxNode)
      return begin_node_state(static_cast<std::uint8_t>(request.node), now);
  } else {
    if (request.command != regmap::kSdoWrite) return finish(regmap::Result::kCommandCodeError);
    if (request.index == regmap::kNmtService) return begin_nmt(request.sub, now);
  }
  if (request.node > nmt::kMaxNode) return finish(regmap::Result::kNodeIdError);
  if (request.sub > 255) return end(AbortCode::kNoSubIndex);
  if (request.size == 0 || request.size > regmap::kMaxDataBytes) return end(AbortCode::kSysLength);
  if (request.node == 0 || request.node == settings_.node_id)
    return begin_local(read, request.index, static_cast<std::uint8_t>(request.sub), request.size, now);
  begin_sdo(request, read ? SdoClient::Direction::kRead : SdoClient::Direction::kWrite, now);
}

/// A request of another channel may wait for the end of this one.
inline bool Channel::others_wait() const {
  return node_.others() != nullptr && node_.others()->any_waits();
}

void Channel::cancel(Time now) {
  client_.cancel(now);
  leave();
  wake_at(flagged_ || scanner_waits() || others_wait() ? now : client_.deadline());
}

void Channel::leave() {
  activity_ = Activity::kIdle;
  command_refused_ = false;
  deadline_ = kNever;
}

/// A waiting request begins at the next poll: this avoids recursion.
void Channel::finish(regmap::Result result, std::size_t size) {
  leave();
  if (result != regmap::Result::kOk) ++counters_.failed;
  if (serves_registers()) {
    flagged_ = false;
    if (scanner_waits()) due_ = 0;
    if (!window_.finish(result)) ++counters_.cancelled;
  } else {
    scanner_->finish(result, size);
    if (flagged_) due_ = 0;
  }
}

void Channel::end(AbortCode code) {
  const auto number = static_cast<std::uint32_t>(code);
  std::uint16_t* const words = data_words();
  words[0] = static_cast<std::uint16_t>(number);
  words[1] = static_cast<std::uint16_t>(number >> 16);
  finish(regmap::Result::kSdoExecutionError);
}

/// Words after the last byte are not changed; the unused half of the last word is 0.
void Channel::end_read(const std::uint8_t* bytes, std::size_t size) {
  if (serves_registers()) window_.words()[kSizePlace] = static_cast<std::uint16_t>(size);
  auto* const to = reinterpret_cast<std::uint8_t*>(data_words());
  copy_bytes(bytes, to, size);
  if (size % 2 != 0) to[size] = 0;
  finish(regmap::Result::kOk, size);
}

// ---- SDO

/// The client's transfer may have ended, and its deadline may have changed.
void Channel::follow_sdo() {
  if (client_.busy()) return wake_at(client_.deadline());
  if (activity_ == Activity::kSdo) end_sdo();
}

void Channel::on_sdo_response(const Frame& frame, Time now) {
  client_.on_frame(frame, now);
  follow_sdo();
}

void Channel::end_sdo() {
  if (others_wait()) due_ = 0;
  if (client_.outcome() == SdoClient::Outcome::kFailed) {
    due_ = 0;  // its abort may be waiting for the port
    return end(client_.error());
  }
  if (direction_ == SdoClient::Direction::kWrite) return finish(regmap::Result::kOk);
  end_read(data_.data(), client_.size());
}

void Channel::begin_local(bool read, std::uint16_t index, std::uint8_t sub, std::size_t size, Time now) {
  std::array<std::uint8_t, regmap::kMaxDataBytes> bytes;
  const std::span<std::uint8_t> value(bytes.data(), size);
  if (!read) load_data(bytes.data(), size);
  node_.access(transfers());
  ObjectDictionary& objects = node_.dictionary();
  const AbortCode refused =
      read ? objects.read(index, sub, value, size, now) : objects.write_whole(index, sub, value, now);
  node_.access_own();
  follow_node();
  if (refused != AbortCode::kNone) return end(refused);
  if (read)
    end_read(bytes.data(), size);
  else
    finish(regmap::Result::kOk);
}

// ---- NMT and node state

void Channel::begin_nmt(std::uint16_t addressed, Time now) {
  if (addressed == 0 || addressed > regmap::kNmtAllNodes) return end(AbortCode::kNoSubIndex);
  const regmap::NmtRow* row = find_nmt_command(words()[kDataPlace]);
  if (row == nullptr) return end(AbortCode::kValue);
  const auto command = static_cast<nmt::Command>(row->specifier);
  if (addressed == node_.node_id()) {
    node_.slave().command(command, now);
    follow_node();
    return finish(regmap::Result::kOk);
  }
  const auto node = addressed == regmap::kNmtAllNodes ? nmt::kAllNodes : static_cast<std::uint8_t>(addressed);
  activity_ = Activity::kNmtCommand;
  command_ = command;
  node_of_service_ = node;
  send_command(now);
}

void Channel::begin_node_state(std::uint8_t node, Time now) {
  if (node == 0 || node == node_.node_id()) return end_node_state(node_.state());
  if (node_.monitor().is_fresh(node, now) && !node_.monitor().in_doubt(node))
    return end_node_state(node_.monitor().last_state(node));
  activity_ = Activity::kNodeState;
  node_of_service_ = node;
  deadline_ = now + settings_.guard_timeout;
  send_command(now);
}

/// An NMT command is done when the port has accepted it; a guarding request then waits for its response.
void Channel::send_command(Time now) {
  const bool is_nmt = activity_ == Activity::kNmtCommand;
  const Frame frame =
      is_nmt ? nmt::command_frame(command_, node_of_service_) : nmt::guard_request(node_of_service_);
  if (!port_.try_send(frame)) {
    const std::uint16_t timeout_ms = transfers().timeout_ms;
    if (is_nmt && !command_refused_ && timeout_ms != 0) deadline_ = now + milliseconds(timeout_ms);
    command_refused_ = true;
    return wake_at(now);
  }
  command_refused_ = false;
  if (is_nmt) {
    node_.on_command(command_, node_of_service_, true, now);
    if (node_.manages()) follow_node();
    return finish(regmap::Result::kOk);
  }
  node_.monitor().guard(node_of_service_);
  deadline_ = now + settings_.guard_timeout;
  wake_at(deadline_);
}

/// Nodes with a heartbeat need not respond: their last report is valid while it is fresh.
void Channel::end_node_state_unanswered(Time now) {
  if (node_.monitor().is_fresh(node_of_service_, now))
    return end_node_state(node_.monitor().last_state(node_of_service_));
  end_with_state(kNotDetected);
}

}  // namespace cbcan
