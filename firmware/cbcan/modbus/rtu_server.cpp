// SPDX-License-Identifier: MIT
#include "cbcan/modbus/rtu_server.hpp"

#include <algorithm>

#include "cbcan/modbus/crc.hpp"
#include "cbcan/modbus/frame_sizes.hpp"

namespace cbcan {

namespace {

using namespace modbus;

constexpr std::uint8_t kBroadcast = 0;
constexpr std::uint8_t kExceptionBit = 0x80;

// Most registers of one request (V1.1b3, 6.3, 6.12, 6.17).
constexpr std::size_t kMaxRead = 125;
constexpr std::size_t kMaxWrite = 123;
constexpr std::size_t kMaxWriteWhileReading = 121;

// Offsets in a frame.
constexpr std::size_t kFunction = 1;
constexpr std::size_t kAddress = 2;
constexpr std::size_t kQuantity = 4;
constexpr std::size_t kWriteAddress = 6;   // FC 23
constexpr std::size_t kWriteQuantity = 8;  // FC 23

constexpr std::size_t kCrcBytes = 2;
constexpr std::size_t kShortestFrame = 4;
constexpr std::size_t kEndsBySilence = SIZE_MAX;  // the size of the frame is not known

// The expected response: station and function code, or
constexpr std::uint16_t kNoResponse = 0;  // no station has the address 0
constexpr std::uint16_t kAnyResponse = 0xFFFF;

bool readable(std::size_t quantity) {
  return quantity >= 1 && quantity <= kMaxRead;
}

}  // namespace

RtuServer::RtuServer(std::span<const RegisterMap> networks, const Settings& settings)
    : networks_(networks),
      settings_(settings),
      skipping_(times_are_exact()),
      asked_(kAnyResponse),
      crc_(kCrcStart) {
  settings_.gap_us = std::max(settings.gap_us, settings.silence_us);
}

// ---- Interrupt

void RtuServer::on_byte(std::uint8_t byte, std::uint32_t now_us) {
  if (!takes(now_us)) return;
  if (size_ == kMaxFrame) {
    skip(counters_.broken_frames);
    if (times_are_exact()) return;
    drop(1);
  }
  buffer_[size_++] = byte;
  if (skipping_) return search();
  crc_ = crc_with(crc_, byte);
  look_for_end();
}

void RtuServer::on_broken_byte(std::uint32_t now_us) {
  if (!takes(now_us) || size_ == 0) return;
  begin_frame();
  skip(counters_.broken_frames);
}

/// True: the received byte is part of a frame, or of what is searched for one.
bool RtuServer::takes(std::uint32_t now_us) {
  const bool after_gap = now_us - last_us_.load(std::memory_order_relaxed) > settings_.gap_us;
  last_us_.store(now_us, std::memory_order_relaxed);
  if (!listens(after_gap)) {
    ++unheard_;
    ++counters_.ignored_bytes;
    return false;
  }
  if (after_gap) end_by_gap();
  if (skipping_) ++counters_.ignored_bytes;
  return !skipping_ || !times_are_exact();
}

/// Cancels a request that poll() has not taken yet: this byte is part of it, or the silence after it is too
/// short, or its master no longer waits.
bool RtuServer::listens(bool after_gap) {
  State state = state_.load(std::memory_order_acquire);
  if (!awaits_silence(state) ||
      !state_.compare_exchange_strong(state, State::kReceiving, std::memory_order_acq_rel))
    return state == State::kReceiving;
  if (state == State::kRequest && (after_gap || frame_size() != kEndsBySilence))
    skip(counters_.broken_frames);
  return true;
}

void RtuServer::end_by_gap() {
  const bool may_end = !is_for_us() || frame_size() == kEndsBySilence;
  if (size_ >= kShortestFrame && crc_ == 0 && may_end)
    on_foreign_frame();
  else if (size_ > 0)
    skip(counters_.broken_frames);
  begin_frame();
  skipping_ = false;
  after_gap_ = true;
}

void RtuServer::look_for_end() {
  const std::size_t end = frame_size();
  if (end == kEndsBySilence) {
    if (!is_for_us() && !times_are_exact()) return search();
    if (size_ < kShortestFrame || crc_ != 0 || !is_for_us() || is_broadcast()) return;
  } else if (end > kMaxFrame) {
    return skip(counters_.broken_frames);
  } else if (size_ < end) {
    return;
  } else if (crc_ != 0) {
    return skip(is_for_us() ? counters_.bus_communication_errors : counters_.broken_frames);
  }
  if (!is_for_us()) return on_foreign_frame();
  asked_ = kNoResponse;
  unheard_ = 0;
  state_.store(State::kRequest, std::memory_order_release);
}

void RtuServer::on_foreign_frame() {
  ++counters_.bus_messages;
  ++counters_.foreign_frames;
  const auto fits = [this](std::size_t size) { return size == size_ || size == kEndsBySilence; };
  if (may_be_request() && fits(request_size()))
    asked_ = station_and_function();
  else
    asked_ = fits(response_size()) ? kNoResponse : kAnyResponse;
  begin_frame();
}

/// The frame is broken. If times are exact the next one begins after a gap, otherwise poll() looks for it.
void RtuServer::skip(std::uint32_t& reason) {
  if (!skipping_) ++reason;
  crc_ = kCrcStart;  // not right at a gap
  lose_step();
  times_are_exact() ? begin_frame() : search();
}

void RtuServer::lose_step() {
  skipping_ = true;
  after_gap_ = true;  // it may have been undetected
  asked_ = kAnyResponse;
}

void RtuServer::search() {
  unheard_ = 0;
  state_.store(State::kSearching, std::memory_order_release);
}

void RtuServer::begin_frame() {
  size_ = 0;
  crc_ = kCrcStart;
  after_gap_ = false;
}

void RtuServer::drop(std::size_t count) {
  size_ -= count;
  std::copy_n(&buffer_[count], size_, buffer_.begin());
}

bool RtuServer::is_broadcast() const {
  return buffer_[0] == kBroadcast;
}

std::size_t RtuServer::request_network() const {
  return is_broadcast() ? 0 : static_cast<std::uint8_t>(buffer_[0] - settings_.station);
}

// ---- Where a frame ends

/// Size of the current frame, with its CRC; a minimum while the bytes that determine it are missing.
std::size_t RtuServer::frame_size() const {
  if (size_ < kShortestFrame) return kShortestFrame;
  return is_for_us() ? request_size() : foreign_size();
}

std::size_t RtuServer::foreign_size() const {
  if (times_are_exact()) return kEndsBySilence;
  const std::size_t as_request = may_be_request() ? request_size() : 0;
  const std::size_t as_response = may_be_response() ? response_size() : 0;
  if (as_request == 0 && as_response == 0) return kEndsBySilence;
  if (as_request == kShortestFrame && size_ == kShortestFrame && crc_ == 0) return as_request;
  if (as_response != 0 && !fits_request()) return as_response;
  return std::max(as_request, as_response);
}

/// May be more than the size of the buffer: then the byte count is not allowed either, and the bytes are not
/// needed.
std::size_t RtuServer::request_size() const {
  return size_by(sizes_of(buffer_[kFunction]).request);
}

std::size_t RtuServer::response_size() const {
  if ((buffer_[kFunction] & kExceptionBit) != 0) return kExceptionSize;
  return size_by(sizes_of(buffer_[kFunction]).response);
}

std::size_t RtuServer::size_by(std::uint8_t rule) const {
  if (rule < kCountAt) return rule == 0 ? kEndsBySilence : rule;
  const std::size_t offset = rule - kCountAt;
  return offset + 1 + (size_ > offset ? buffer_[offset] : 0) + kCrcBytes;
}

std::uint16_t RtuServer::station_and_function() const {
  return static_cast<std::uint16_t>(buffer_[0] << 8 | (buffer_[kFunction] & ~kExceptionBit));
}

bool RtuServer::may_be_response() const {
  return asked_ == kAnyResponse || asked_ == station_and_function();
}

bool RtuServer::may_be_request() const {
  return (buffer_[kFunction] & kExceptionBit) == 0 && (!may_be_response() || after_gap_);
}

/// False: the quantity shows that it can only be a response.
bool RtuServer::fits_request() const {
  switch (buffer_[kFunction]) {
    case kReadHoldingRegisters:
    case kReadInputRegisters: return size_ < 6 || readable(word(kQuantity));
    case kWriteMultipleRegisters: return size_ < 7 || buffer_[6] == 2 * word(kQuantity);
    default: return true;
  }
}

// ---- Loop

std::uint32_t RtuServer::poll(std::uint32_t now_us) {
  State state = state_.load(std::memory_order_acquire);
  if (!awaits_silence(state)) return kNoRequest;
  const std::uint32_t delay = std::max(settings_.silence_us, settings_.response_delay_us);
  const std::uint32_t wait = last_us_.load(std::memory_order_relaxed) + delay - now_us;
  // The byte may have arrived after `now_us`; a past time is a negative number.
  if (static_cast<std::int32_t>(wait) > 0) return wait;
  if (!state_.compare_exchange_strong(state, State::kExecuting, std::memory_order_acq_rel)) return kNoRequest;
  return state == State::kRequest || find_request() ? 0 : kNoRequest;
}

/// Looks for a request for this station that ends with the last byte; without one, bytes are received again.
bool RtuServer::find_request() {
  const bool found = find_frame();
  if (found && is_request()) {
    asked_ = kNoResponse;
    return true;
  }
  if (found && !is_for_us()) {
    on_foreign_frame();
    listen(0);
    return false;
  }
  if (found) lose_step();
  state_.store(State::kReceiving, std::memory_order_release);
  return false;
}

/// Makes the shortest frame with a right CRC that ends with the last byte the current one.
bool RtuServer::find_frame() {
  std::uint16_t crc = 0;
  for (std::size_t begin = size_; begin > 0;) {
    crc = crc_before(crc, buffer_[--begin]);
    if (crc != kCrcStart || size_ - begin < kShortestFrame) continue;
    drop(begin);
    return true;
  }
  return false;
}

bool RtuServer::is_request() const {
  const std::size_t size = request_size();
  return is_for_us() && (size == size_ || (size == kEndsBySilence && !is_broadcast()));
}

bool RtuServer::request_reads(std::uint16_t first, std::size_t count) const {
  switch (buffer_[kFunction]) {
    case kReadHoldingRegisters:
    case kReadInputRegisters:
    case kReadWriteMultipleRegisters: break;
    default: return false;
  }
  const std::uint16_t address = word(kAddress);
  return address < first + count && first < std::size_t{address} + word(kQuantity);
}

std::span<const std::uint8_t> RtuServer::execute() {
  ++counters_.bus_messages;
  ++counters_.slave_messages;
  executed_ = {};
  Exception exception = execute_on(networks_[request_network()]);
  // A broadcast is rejected by all networks or by none: they have the same registers.
  for (std::size_t i = 1; is_broadcast() && i < networks_.size(); ++i)
    exception = execute_on(networks_[i]);
  executed_.valid = exception == Exception::kNone;
  if (exception != Exception::kNone) {
    ++counters_.slave_exceptions;
    buffer_[kFunction] |= kExceptionBit;
    buffer_[2] = static_cast<std::uint8_t>(exception);
    size_ = 3;
  }
  if (is_broadcast()) {
    ++counters_.slave_no_responses;
    listen(0);
    return {};
  }
  return sealed();
}

std::span<const std::uint8_t> RtuServer::respond_with(std::span<const std::uint8_t> pdu) {
  ++counters_.bus_messages;
  ++counters_.slave_messages;
  executed_ = {.valid = (pdu[0] & kExceptionBit) == 0, .first = 0, .count = 0};
  if (!executed_.valid) ++counters_.slave_exceptions;
  std::copy(pdu.begin(), pdu.end(), &buffer_[kFunction]);
  size_ = kFunction + pdu.size();
  return sealed();
}

void RtuServer::on_sent() {
  if (state_.load(std::memory_order_acquire) == State::kSending) listen(size_ + kCrcBytes);
}

/// Bytes received meanwhile may be the first part of another station's frame, unless they are an echo of this
/// length.
void RtuServer::listen(std::size_t echo) {
  begin_frame();
  skipping_ = times_are_exact();
  if (unheard_ != 0 && unheard_ != echo) lose_step();
  state_.store(State::kReceiving, std::memory_order_release);
}

/// Adds the CRC to the response; returns what is to be sent.
std::span<const std::uint8_t> RtuServer::sealed() {
  std::uint16_t crc = kCrcStart;
  for (std::size_t i = 0; i < size_; ++i)
    crc = crc_with(crc, buffer_[i]);
  buffer_[size_] = static_cast<std::uint8_t>(crc);
  buffer_[size_ + 1] = static_cast<std::uint8_t>(crc >> 8);
  state_.store(State::kSending, std::memory_order_release);
  return std::span(buffer_).first(size_ + kCrcBytes);
}

/// Leaves the response in the buffer, `size_` bytes; for a broadcast the request.
RtuServer::Exception RtuServer::execute_on(const RegisterMap& registers) {
  switch (buffer_[kFunction]) {
    case kReadHoldingRegisters:
    case kReadInputRegisters: return read_registers(registers);
    case kWriteSingleRegister: return write_register(registers);
    case kWriteMultipleRegisters: return write_registers(registers);
    case kMaskWriteRegister: return mask_register(registers);
    case kReadWriteMultipleRegisters: return read_write_registers(registers);
    default: return access_bits(registers);
  }
}

/// Coils and discrete inputs, for a server that has them.
RtuServer::Exception RtuServer::access_bits(const RegisterMap& registers) {
  if (settings_.bits == nullptr) return Exception::kFunction;
  const std::span frame(buffer_);
  const BitFunctions::Response served =
      settings_.bits->serve(frame.subspan(kFunction, size_ - kCrcBytes - kFunction), is_broadcast(),
                            registers, frame.subspan(kFunction));
  if (served.exception != 0) return static_cast<Exception>(served.exception);
  if (served.register_count != 0) executed_ = {true, served.register_first, served.register_count};
  if (!is_broadcast()) size_ = kFunction + served.size;
  return Exception::kNone;
}

RtuServer::Exception RtuServer::read_registers(const RegisterMap& registers) {
  const std::uint16_t address = word(kAddress);
  const std::uint16_t count = word(kQuantity);
  if (!readable(count)) return Exception::kValue;
  if (!registers.exist(address, count)) return Exception::kAddress;
  load(registers, address, count);
  return Exception::kNone;
}

RtuServer::Exception RtuServer::write_register(const RegisterMap& registers) {
  if (!registers.writable(word(kAddress), 1)) return Exception::kAddress;
  store(registers, word(kAddress), 1, kQuantity);
  size_ = 6;
  return Exception::kNone;
}

RtuServer::Exception RtuServer::write_registers(const RegisterMap& registers) {
  const std::uint16_t address = word(kAddress);
  if (!values_allowed(kQuantity, kMaxWrite)) return Exception::kValue;
  if (!registers.writable(address, word(kQuantity))) return Exception::kAddress;
  store(registers, address, word(kQuantity), kQuantity + 3);
  size_ = 6;
  return Exception::kNone;
}

RtuServer::Exception RtuServer::mask_register(const RegisterMap& registers) {
  const std::uint16_t address = word(kAddress);
  const std::uint32_t and_mask = word(4);
  const std::uint32_t or_mask = word(6);
  if (!registers.writable(address, 1)) return Exception::kAddress;
  const std::atomic_ref<std::uint16_t> target(registers[address]);
  std::uint16_t before = target.load(std::memory_order_relaxed);
  while (!target.compare_exchange_weak(
      before, static_cast<std::uint16_t>((before & and_mask) | (or_mask & ~and_mask)),
      std::memory_order_release, std::memory_order_relaxed)) {
  }
  executed_.first = address;
  executed_.count = 1;
  size_ = 8;
  return Exception::kNone;
}

RtuServer::Exception RtuServer::read_write_registers(const RegisterMap& registers) {
  const std::uint16_t address = word(kAddress);
  const std::uint16_t count = word(kQuantity);
  if (!readable(count) || !values_allowed(kWriteQuantity, kMaxWriteWhileReading)) return Exception::kValue;
  if (!registers.exist(address, count) || !registers.writable(word(kWriteAddress), word(kWriteQuantity)))
    return Exception::kAddress;
  store(registers, word(kWriteAddress), word(kWriteQuantity), kWriteQuantity + 3);
  load(registers, address, count);
  return Exception::kNone;
}

/// Checks the quantity at `offset` and the byte count after it.
bool RtuServer::values_allowed(std::size_t offset, std::size_t most) const {
  const std::size_t quantity = word(offset);
  return quantity >= 1 && quantity <= most && buffer_[offset + 2] == 2 * quantity;
}

/// Copies registers to the response of FC 3, 4 and 23.
void RtuServer::load(const RegisterMap& registers, std::uint16_t address, std::size_t count) {
  constexpr std::size_t kByteCount = 2;
  if (is_broadcast()) return;
  buffer_[kByteCount] = static_cast<std::uint8_t>(2 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::atomic_ref<std::uint16_t> source(registers[address + i]);
    const std::uint16_t value = source.load(std::memory_order_relaxed);
    buffer_[kByteCount + 1 + 2 * i] = static_cast<std::uint8_t>(value >> 8);
    buffer_[kByteCount + 2 + 2 * i] = static_cast<std::uint8_t>(value);
    if (i == 0) std::atomic_thread_fence(std::memory_order_acquire);
  }
  size_ = kByteCount + 1 + 2 * count;
}

/// Copies the values at `offset` to registers.
void RtuServer::store(const RegisterMap& registers, std::uint16_t address, std::size_t count,
                      std::size_t offset) {
  executed_.first = address;
  executed_.count = static_cast<std::uint16_t>(count);
  for (std::size_t i = count; i-- > 0;) {
    if (i == 0) std::atomic_thread_fence(std::memory_order_release);
    const std::atomic_ref<std::uint16_t> target(registers[address + i]);
    target.store(word(offset + 2 * i), std::memory_order_relaxed);
  }
}

std::uint16_t RtuServer::word(std::size_t offset) const {
  return static_cast<std::uint16_t>(buffer_[offset] << 8 | buffer_[offset + 1]);
}

}  // namespace cbcan
