// SPDX-License-Identifier: MIT
#include "modbus/rtu_server.hpp"

namespace cbcan {

namespace {

constexpr std::uint8_t kBroadcast = 0;
constexpr std::uint8_t kExceptionBit = 0x80;

enum Function : std::uint8_t {
  kReadHoldingRegisters = 3,
  kWriteSingleRegister = 6,
  kWriteMultipleRegisters = 16,
  kMaskWriteRegister = 22,
  kReadWriteMultipleRegisters = 23,
};

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

// Serial Line V1.02, 2.5.1.2: x^16 + x^15 + x^2 + 1, reflected, start value FFFFh. Over a frame and its CRC,
// low byte first, it comes out as 0.
constexpr std::uint16_t kCrcStart = 0xFFFF;
constexpr std::uint16_t kPolynomial = 0xA001;

/// For four bits at a time: 32 bytes of flash instead of 512, for five instructions more a byte.
constexpr std::array<std::uint16_t, 16> kCrcTable = [] {
  std::array<std::uint16_t, 16> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    std::size_t value = i;
    for (int bit = 0; bit < 4; ++bit)
      value = (value & 1) != 0 ? value >> 1 ^ kPolynomial : value >> 1;
    table[i] = static_cast<std::uint16_t>(value);
  }
  return table;
}();

std::uint16_t crc_with(std::uint16_t crc, std::uint8_t byte) {
  std::uint32_t value = crc ^ std::uint32_t{byte};
  value = value >> 4 ^ kCrcTable[value & 0xF];
  value = value >> 4 ^ kCrcTable[value & 0xF];
  return static_cast<std::uint16_t>(value);
}

bool readable(std::size_t quantity) {
  return quantity >= 1 && quantity <= kMaxRead;
}

}  // namespace

// ---- interrupt

void RtuServer::on_byte(std::uint8_t byte, std::uint32_t now_us) {
  if (state_.load(std::memory_order_acquire) != State::kReceiving) {
    ++counters_.ignored_bytes;
    return;
  }
  if (now_us - last_us_ > settings_.gap_us) {
    if (size_ > 0) ++counters_.broken_frames;
    begin_frame();
    skipping_ = false;
  }
  last_us_ = now_us;
  if (skipping_) {
    ++counters_.ignored_bytes;
    return;
  }
  if (size_ < buffer_.size()) buffer_[size_] = byte;
  ++size_;
  crc_ = crc_with(crc_, byte);
  look_for_end();
}

void RtuServer::look_for_end() {
  const std::size_t known_size = request_size();
  if (known_size == 0 ? size_ < kShortestFrame : size_ < known_size) return;
  if (crc_ == 0) {
    on_frame();
  } else if (known_size != 0) {
    skip_to_gap(counters_.bus_communication_errors);
  } else if (size_ == kMaxFrame) {
    skip_to_gap(counters_.broken_frames);
  }
}

void RtuServer::on_frame() {
  ++counters_.bus_messages;
  if (is_for_us()) {
    state_.store(State::kRequest, std::memory_order_release);
    return;
  }
  ++counters_.foreign_frames;
  begin_frame();
}

void RtuServer::skip_to_gap(std::uint32_t& reason) {
  ++reason;
  begin_frame();
  skipping_ = true;
}

bool RtuServer::is_broadcast() const {
  return buffer_[0] == kBroadcast;
}

bool RtuServer::is_for_us() const {
  return request_network() < settings_.networks;
}

std::size_t RtuServer::request_network() const {
  return is_broadcast() ? 0 : static_cast<std::uint8_t>(buffer_[0] - settings_.station);
}

/// Size of the request under way, with its CRC; 0 = cannot be known. It may be more than the buffer has:
/// then the byte count is not allowed either, and its bytes are not needed.
std::size_t RtuServer::request_size() const {
  if (size_ < 2 || !is_for_us()) return 0;
  switch (buffer_[kFunction]) {
    case kReadHoldingRegisters:
    case kWriteSingleRegister: return 8;
    case kMaskWriteRegister: return 10;
    case kWriteMultipleRegisters: return size_ < 7 ? 9 : 9u + buffer_[6];
    case kReadWriteMultipleRegisters: return size_ < 11 ? 13 : 13u + buffer_[10];
    default: return 0;
  }
}

void RtuServer::begin_frame() {
  size_ = 0;
  crc_ = kCrcStart;
}

// ---- loop

bool RtuServer::request_reads(std::uint16_t first, std::size_t count) const {
  if (!request_waiting()) return false;
  const std::uint8_t function = buffer_[kFunction];
  if (function != kReadHoldingRegisters && function != kReadWriteMultipleRegisters) return false;
  const std::uint16_t address = word(kAddress);
  return address < first + count && first < std::size_t{address} + word(kQuantity);
}

std::span<const std::uint8_t> RtuServer::poll() {
  if (!request_waiting()) return {};
  ++counters_.slave_messages;
  base_ = request_network() * network_size_;
  Exception exception = execute();
  // A broadcast is refused by all networks or by none: their registers are alike.
  while (is_broadcast() && (base_ += network_size_) < registers_.size())
    exception = execute();
  if (exception != Exception::kNone) {
    ++counters_.slave_exceptions;
    buffer_[kFunction] |= kExceptionBit;
    buffer_[2] = static_cast<std::uint8_t>(exception);
    size_ = 3;
  }
  if (is_broadcast()) {
    ++counters_.slave_no_responses;
    listen();
    return {};
  }
  return sealed();
}

void RtuServer::on_sent() {
  if (state_.load(std::memory_order_acquire) == State::kSending) listen();
}

void RtuServer::listen() {
  begin_frame();
  state_.store(State::kReceiving, std::memory_order_release);
}

/// The response with its CRC, on its way.
std::span<const std::uint8_t> RtuServer::sealed() {
  std::uint16_t crc = kCrcStart;
  for (std::size_t i = 0; i < size_; ++i)
    crc = crc_with(crc, buffer_[i]);
  buffer_[size_] = static_cast<std::uint8_t>(crc);
  buffer_[size_ + 1] = static_cast<std::uint8_t>(crc >> 8);
  state_.store(State::kSending, std::memory_order_release);
  return std::span(buffer_).first(size_ + kCrcBytes);
}

/// Leaves the response in the buffer, `size_` bytes; of a broadcast the request.
RtuServer::Exception RtuServer::execute() {
  switch (buffer_[kFunction]) {
    case kReadHoldingRegisters: return read_registers();
    case kWriteSingleRegister: return write_register();
    case kWriteMultipleRegisters: return write_registers();
    case kMaskWriteRegister: return mask_register();
    case kReadWriteMultipleRegisters: return read_write_registers();
    default: return Exception::kFunction;
  }
}

RtuServer::Exception RtuServer::read_registers() {
  const std::uint16_t address = word(kAddress);
  const std::uint16_t count = word(kQuantity);
  if (!readable(count)) return Exception::kValue;
  if (!exist(address, count)) return Exception::kAddress;
  load(address, count);
  return Exception::kNone;
}

RtuServer::Exception RtuServer::write_register() {
  if (!writable(word(kAddress), 1)) return Exception::kAddress;
  store(word(kAddress), 1, kQuantity);
  size_ = 6;
  return Exception::kNone;
}

RtuServer::Exception RtuServer::write_registers() {
  const std::uint16_t address = word(kAddress);
  if (!values_allowed(kQuantity, kMaxWrite)) return Exception::kValue;
  if (!writable(address, word(kQuantity))) return Exception::kAddress;
  store(address, word(kQuantity), kQuantity + 3);
  size_ = 6;
  return Exception::kNone;
}

RtuServer::Exception RtuServer::mask_register() {
  const std::uint16_t address = word(kAddress);
  const std::uint32_t and_mask = word(4);
  const std::uint32_t or_mask = word(6);
  if (!writable(address, 1)) return Exception::kAddress;
  const std::atomic_ref<std::uint16_t> target(registers_[base_ + address]);
  std::uint16_t before = target.load(std::memory_order_relaxed);
  while (!target.compare_exchange_weak(
      before, static_cast<std::uint16_t>((before & and_mask) | (or_mask & ~and_mask)),
      std::memory_order_release, std::memory_order_relaxed)) {
  }
  size_ = 8;
  return Exception::kNone;
}

RtuServer::Exception RtuServer::read_write_registers() {
  const std::uint16_t address = word(kAddress);
  const std::uint16_t count = word(kQuantity);
  if (!readable(count) || !values_allowed(kWriteQuantity, kMaxWriteWhileReading)) return Exception::kValue;
  if (!exist(address, count) || !writable(word(kWriteAddress), word(kWriteQuantity)))
    return Exception::kAddress;
  store(word(kWriteAddress), word(kWriteQuantity), kWriteQuantity + 3);
  load(address, count);
  return Exception::kNone;
}

/// Quantity at `offset`, and the byte count behind it.
bool RtuServer::values_allowed(std::size_t offset, std::size_t most) const {
  const std::size_t quantity = word(offset);
  return quantity >= 1 && quantity <= most && buffer_[offset + 2] == 2 * quantity;
}

bool RtuServer::exist(std::uint16_t address, std::size_t count) const {
  return address + count <= network_size_;
}

bool RtuServer::writable(std::uint16_t address, std::size_t count) const {
  const std::size_t first = settings_.read_only_first;
  const std::size_t end = first + settings_.read_only_count;
  const bool apart = first == end || address >= end || address + count <= first;
  return exist(address, count) && apart;
}

/// Registers into the response of FC 3 and FC 23.
void RtuServer::load(std::uint16_t address, std::size_t count) {
  constexpr std::size_t kByteCount = 2;
  if (is_broadcast()) return;
  buffer_[kByteCount] = static_cast<std::uint8_t>(2 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::atomic_ref<std::uint16_t> source(registers_[base_ + address + i]);
    put_word(kByteCount + 1 + 2 * i, source.load(std::memory_order_relaxed));
    if (i == 0) std::atomic_thread_fence(std::memory_order_acquire);
  }
  size_ = kByteCount + 1 + 2 * count;
}

/// The values at `offset` into registers.
void RtuServer::store(std::uint16_t address, std::size_t count, std::size_t offset) {
  for (std::size_t i = count; i-- > 0;) {
    if (i == 0) std::atomic_thread_fence(std::memory_order_release);
    const std::atomic_ref<std::uint16_t> target(registers_[base_ + address + i]);
    target.store(word(offset + 2 * i), std::memory_order_relaxed);
  }
}

std::uint16_t RtuServer::word(std::size_t offset) const {
  return static_cast<std::uint16_t>(buffer_[offset] << 8 | buffer_[offset + 1]);
}

void RtuServer::put_word(std::size_t offset, std::uint16_t value) {
  buffer_[offset] = static_cast<std::uint8_t>(value >> 8);
  buffer_[offset + 1] = static_cast<std::uint8_t>(value);
}

}  // namespace cbcan
