// SPDX-License-Identifier: MIT
#include "cbcan/modbus/rtu_server.hpp"

#include <algorithm>

#include "cbcan/modbus/crc.hpp"
#include "cbcan/modbus/frame_sizes.hpp"

namespace cbcan {

namespace {

using namespace modbus;

// Offsets in a frame.
constexpr std::size_t kFunction = 1;
constexpr std::size_t kQuantity = 4;

constexpr std::size_t kCrcBytes = 2;
constexpr std::size_t kShortestFrame = 4;
constexpr std::size_t kEndsBySilence = SIZE_MAX;  // the size of the frame is not known

// The expected response: station and function code, or
constexpr std::uint16_t kNoResponse = 0;  // no station has the address 0
constexpr std::uint16_t kAnyResponse = 0xFFFF;

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
  if (times_are_exact())
    begin_frame();
  else
    search();
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
  const std::size_t quantity = word(buffer_, kQuantity);
  switch (buffer_[kFunction]) {
    case kReadHoldingRegisters:
    case kReadInputRegisters: return size_ < 6 || (quantity >= 1 && quantity <= kMaxRead);
    case kWriteMultipleRegisters: return size_ < 7 || buffer_[6] == 2 * quantity;
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

/// The response replaces the request. A broadcast is rejected by all networks or by none, as they have the
/// same registers; its bytes stay as they are, as nothing is read.
std::span<const std::uint8_t> RtuServer::execute() {
  executed_ = access();
  std::span<const RegisterMap> networks = networks_.subspan(request_network(), 1);
  if (is_broadcast()) {
    executed_.read = {};
    networks = networks_.first(executed_.written.count == 0 ? 0 : networks_.size());
  }
  std::size_t size = 0;
  for (const RegisterMap& registers : networks)
    size =
        modbus::execute(pdu(), executed_, registers, settings_.more, std::span(buffer_).subspan(kFunction));
  return finish(size);
}

std::span<const std::uint8_t> RtuServer::respond_with(std::span<const std::uint8_t> pdu) {
  executed_ = {(pdu[0] & kExceptionBit) != 0 ? Exception{pdu[1]} : Exception::kNone};
  std::copy(pdu.begin(), pdu.end(), &buffer_[kFunction]);
  return finish(pdu.size());
}

/// `size`: of the PDU in the buffer.
std::span<const std::uint8_t> RtuServer::finish(std::size_t size) {
  ++counters_.slave_messages;
  if (executed_.exception != Exception::kNone) ++counters_.slave_exceptions;
  if (!is_broadcast()) {
    size_ = kFunction + size;
    return sealed();
  }
  ++counters_.slave_no_responses;
  listen(0);
  return {};
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

}  // namespace cbcan
