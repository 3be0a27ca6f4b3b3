// SPDX-License-Identifier: MIT
#include "cbcan/canopen/lss_slave.hpp"

#include <span>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"

namespace cbcan {

namespace {

using namespace lss;

// Command specifiers of services that are only here.
constexpr std::uint8_t kIdentifyVendor = 0x46;
constexpr std::uint8_t kIdentifyProduct = 0x47;
constexpr std::uint8_t kIdentifyRevisionLow = 0x48;
constexpr std::uint8_t kIdentifySerialLow = 0x4A;
constexpr std::uint8_t kIdentifySerialHigh = 0x4B;
constexpr std::uint8_t kIdentifyNonConfigured = 0x4C;
constexpr std::uint8_t kNonConfiguredIdentified = 0x50;

constexpr std::uint8_t kOk = 0;
constexpr std::uint8_t kOutOfRange = 1;

constexpr std::uint8_t kBitRateTable = 0;
constexpr std::uint8_t kLastBitRate = 9;

constexpr std::uint8_t kNothing = 0;

std::uint32_t number_in(const Frame& frame, std::size_t bytes) {
  return static_cast<std::uint32_t>(load_little_endian(std::span(frame.data).subspan(1, bytes)));
}

}  // namespace

void LssSlave::start(std::uint8_t node_id, std::uint8_t bit_rate, Time now) {
  pending_node_id_ = node_id;
  pending_bit_rate_ = bit_rate;
  reset_communication(now);
}

std::uint8_t LssSlave::reset_communication(Time now) {
  node_id_ = pending_node_id_;
  outbox_.drop();
  enter_waiting(now);
  switch_at_ = kNever;
  if (is_off_bus()) {
    return_at_ = kNever;
    application_.set_on_bus(true, now);
  }
  return node_id_;
}

void LssSlave::on_frame(const Frame& frame, Time now) {
  if (frame.id != kRequestId || frame.flags != 0 || frame.length != kLength) return;
  if (state_ == State::kInitial || is_off_bus()) return;
  outbox_.drop();
  const std::uint8_t command = frame.data[0];
  if (command == kSwitchStateGlobal) {
    if (frame.data[1] == kModeWaiting) enter_waiting(now);
    if (frame.data[1] == kModeConfiguration) state_ = State::kConfiguration;
    return;
  }
  if (command >= kIdentifyVendor && command <= kIdentifySerialHigh)
    return select_or_identify(command, number_in(frame, 4), now);
  if (command == kIdentifyNonConfigured) {
    if (is_unconfigured()) respond(kNonConfiguredIdentified, 0, now);
    return;
  }
  if (state_ == State::kConfiguration) return configure(frame, now);
  if (command >= kSelectVendor && command <= kSelectSerial)
    select_or_identify(command, number_in(frame, 4), now);
  else if (command == kFastscan && is_unconfigured())
    fastscan(frame, now);
}

void LssSlave::enter_waiting(Time now) {
  state_ = State::kWaiting;
  expected_ = kNothing;
  fastscan_part_ = kVendor;
  if (node_id_ != kNoNodeId || pending_node_id_ == kNoNodeId) return;
  node_id_ = pending_node_id_;
  application_.on_node_id(node_id_, now);
}

/// The services of the configuration state.
void LssSlave::configure(const Frame& frame, Time now) {
  const std::uint8_t command = frame.data[0];
  if (command >= kInquireVendor && command <= kInquireSerial)
    return respond(command, application_.identity(static_cast<std::uint8_t>(command - kInquireVendor)), now);
  switch (command) {
    case kConfigureNodeId: return configure_node_id(frame.data[1], now);
    case kConfigureBitTiming: return configure_bit_timing(frame.data[1], frame.data[2], now);
    case kActivateBitTiming: return activate_bit_timing(milliseconds(number_in(frame, 2)), now);
    case kStoreConfiguration: {
      const auto result = application_.store(pending_node_id_, pending_bit_rate_);
      return respond(command, static_cast<std::uint8_t>(result), now);
    }
    case kInquireNodeId: return respond(command, node_id_ == kNoNodeId ? pending_node_id_ : node_id_, now);
    default: return;
  }
}

/// Both services are sequences of frames with consecutive specifiers. The device that matches all of them
/// responds to the last one.
void LssSlave::select_or_identify(std::uint8_t command, std::uint32_t number, Time now) {
  const bool in_order = command == kSelectVendor || command == kIdentifyVendor || command == expected_;
  if (!in_order || !matches(command, number)) {
    expected_ = kNothing;
    return;
  }
  expected_ = static_cast<std::uint8_t>(command + 1);
  if (command == kSelectSerial) {
    state_ = State::kConfiguration;
    respond(kSelected, 0, now);
  } else if (command == kIdentifySerialHigh) {
    respond(kIdentified, 0, now);
  }
}

/// Specifiers are in the order of the parts; an identification has the lowest and the highest revision and
/// serial number.
bool LssSlave::matches(std::uint8_t command, std::uint32_t number) const {
  constexpr std::array kParts{kVendor, kProduct, kRevision, kRevision, kSerial, kSerial};
  const bool selects = command <= kSelectSerial;
  const std::uint32_t own = application_.identity(selects ? static_cast<std::uint8_t>(command - kSelectVendor)
                                                          : kParts[command - kIdentifyVendor]);
  if (selects || command <= kIdentifyProduct) return number == own;
  const bool is_lowest = command == kIdentifyRevisionLow || command == kIdentifySerialLow;
  return is_lowest ? number <= own : number >= own;
}

/// All devices whose bits match, down to the requested one, respond with the same frame. When a part is
/// complete the master goes on to the next; going back to an earlier part, as from the last to part 0, ends
/// the scan.
void LssSlave::fastscan(const Frame& frame, Time now) {
  const std::uint8_t bit = frame.data[5];
  const std::uint8_t part = frame.data[6];
  const std::uint8_t next = frame.data[7];
  if (bit == kScanStart) {
    fastscan_part_ = kVendor;
    return respond(kIdentified, 0, now);
  }
  if (bit > kScanLastBit || part != fastscan_part_ || next > kSerial) return;
  if ((application_.identity(part) ^ number_in(frame, 4)) >> bit != 0) return;
  fastscan_part_ = next;
  if (bit == 0 && next < part) state_ = State::kConfiguration;
  respond(kIdentified, 0, now);
}

void LssSlave::configure_node_id(std::uint8_t node_id, Time now) {
  const bool valid = (node_id >= 1 && node_id <= nmt::kMaxNode) || node_id == kNoNodeId;
  if (valid) pending_node_id_ = node_id;
  respond(kConfigureNodeId, valid ? kOk : kOutOfRange, now);
}

void LssSlave::configure_bit_timing(std::uint8_t table, std::uint8_t index, Time now) {
  const bool exists = table == kBitRateTable && index <= kLastBitRate && index != kReservedLssBitRate;
  const bool valid = exists && application_.is_bit_rate_supported(index);
  if (valid) pending_bit_rate_ = index;
  respond(kConfigureBitTiming, valid ? kOk : kOutOfRange, now);
}

/// Silent for twice the delay: first until every device has stopped, then until every device has switched.
void LssSlave::activate_bit_timing(Time delay, Time now) {
  if (!application_.is_bit_rate_supported(pending_bit_rate_)) return;
  switch_at_ = now + delay;
  return_at_ = switch_at_ + delay;
  application_.set_on_bus(false, now);
  poll(now);
}

void LssSlave::poll(Time now) {
  if (now >= switch_at_) {
    switch_at_ = kNever;
    application_.activate_bit_rate(pending_bit_rate_, now);
  }
  if (now >= return_at_) {
    return_at_ = kNever;
    application_.set_on_bus(true, now);
  }
  outbox_.retry(now);
}

/// `value` goes into bytes 1..4; an error code is in its lowest byte.
void LssSlave::respond(std::uint8_t command, std::uint32_t value, Time now) {
  Frame& frame = outbox_.frame();
  frame.id = kResponseId;
  frame.length = kLength;
  frame.data[0] = command;
  store_little_endian(std::span(frame.data).subspan(1, 4), value);
  outbox_.send(now);
}

}  // namespace cbcan
