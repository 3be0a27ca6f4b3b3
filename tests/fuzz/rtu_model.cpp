// SPDX-License-Identifier: MIT
#include "fuzz/rtu_model.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "support/modbus_crc.hpp"

namespace cbcan::fuzz {

namespace {

using Bytes = RtuModel::Bytes;
using View = RtuModel::View;

bool has_right_crc(View frame) {
  const std::size_t size = frame.size() - 2;
  return test::modbus_crc(frame.first(size)) == frame[size] + 256u * frame[size + 1];
}

bool is_executed(std::uint8_t function) {
  return function == 3 || function == 6 || function == 16 || function == 22 || function == 23;
}

}  // namespace

/// Of a frame with its CRC; `known` = false: only silence ends it.
struct RtuModel::Size {
  bool known;
  std::size_t bytes;

  /// So many bytes, a count at their end, what it counts, and the CRC; more than there are until it is there.
  static Size counted(View frame, std::size_t head) {
    return {true, frame.size() < head ? head + 2 : head + frame[head - 1] + 2};
  }

  static Size of_request(View frame) {
    constexpr unsigned kFixed[] = {0, 8, 8, 8, 8, 8, 8, 4, 0, 0,  0, 4, 4,
                                   0, 0, 0, 0, 4, 0, 0, 0, 0, 10, 0, 6};
    const std::uint8_t function = frame[1];
    if (function == 15 || function == 16) return counted(frame, 7);
    if (function == 20 || function == 21) return counted(frame, 3);
    if (function == 23) return counted(frame, 11);
    if (function >= std::size(kFixed) || kFixed[function] == 0) return {false, 0};
    return {true, kFixed[function]};
  }

  static Size of_response(View frame) {
    constexpr unsigned kFixed[] = {0, 0, 0, 0, 0, 8, 8, 5, 0, 0, 0, 8, 0, 0, 0, 8, 8, 0, 0, 0, 0, 0, 10};
    constexpr std::string_view kCounted{"\1\2\3\4\14\21\24\25\27"};
    const std::uint8_t function = frame[1];
    if (function >= 0x80) return {true, 5};
    if (function == 24) return counted(frame, 4);
    if (kCounted.find(static_cast<char>(function)) != kCounted.npos) return counted(frame, 3);
    if (function >= std::size(kFixed) || kFixed[function] == 0) return {false, 0};
    return {true, kFixed[function]};
  }

  /// A request's quantity is none.
  static bool only_response(View frame) {
    const std::size_t quantity = frame.size() > 5 ? frame[4] * 256u + frame[5] : 1;
    if (frame[1] == 3 || frame[1] == 4) return quantity < 1 || quantity > 125;
    return frame[1] == 16 && frame.size() > 6 && frame[6] != 2 * quantity;
  }
};

Bytes with_crc(View bytes) {
  Bytes frame(bytes.begin(), bytes.end());
  const unsigned crc = test::modbus_crc(bytes);
  frame.push_back(static_cast<std::uint8_t>(crc % 256));
  frame.push_back(static_cast<std::uint8_t>(crc / 256));
  return frame;
}

void RtuModel::receive(std::uint8_t byte, std::uint64_t now_us) {
  if (!hears(now_us)) return;
  frame_.push_back(byte);
  look();
}

void RtuModel::receive_broken(std::uint64_t now_us) {
  if (hears(now_us) && !frame_.empty()) lose(counts_.broken);
}

/// False: whatever has come is part of no frame.
bool RtuModel::hears(std::uint64_t now_us) {
  const bool gap = now_us > last_us_ + settings_.gap_us;
  last_us_ = now_us;
  if (busy_ == Busy::kSending) {
    ++unheard_;
    ++counts_.ignored;
    return false;
  }
  if (busy_ == Busy::kRequest && (gap || size().known)) lose(counts_.broken);
  busy_ = Busy::kNo;
  if (gap) end_by_gap();
  if (hopeless_) ++counts_.ignored;
  return !hopeless_;
}

void RtuModel::end_by_gap() {
  const bool whole = frame_.size() >= 4 && has_right_crc(frame_) && (!ours() || !size().known);
  if (whole)
    end_of_foreign();
  else if (!frame_.empty())
    lose(counts_.broken);
  frame_.clear();
  hopeless_ = false;
  after_gap_ = true;
}

void RtuModel::look() {
  if (frame_.size() < 4) return;
  const Size expected = size();
  const bool right = has_right_crc(frame_);
  if (!expected.known) {
    if (frame_.size() > 256) return lose(counts_.broken);
    if (right && frame_[0] == settings_.station) {
      busy_ = Busy::kRequest;
      turn_ = Turn::kMaster;
    }
    return;
  }
  if (frame_.size() < expected.bytes) return;
  if (!right) return lose(ours() ? counts_.crc_errors : counts_.broken);
  if (!ours()) return end_of_foreign();
  busy_ = Busy::kRequest;
  turn_ = Turn::kMaster;
}

void RtuModel::end_of_foreign() {
  ++counts_.frames;
  ++counts_.foreign;
  const auto fits = [&](Size size) { return !size.known || size.bytes == frame_.size(); };
  if (may_be_request() && fits(Size::of_request(frame_))) {
    turn_ = Turn::kStation;
    asked_station_ = frame_[0];
    asked_function_ = frame_[1];
  } else {
    turn_ = fits(Size::of_response(frame_)) ? Turn::kMaster : Turn::kUnknown;
  }
  frame_.clear();
  after_gap_ = false;
}

void RtuModel::lose(std::uint32_t& count) {
  ++count;
  frame_.clear();
  after_gap_ = false;
  hopeless_ = true;
  turn_ = Turn::kUnknown;
}

/// It has the station and the function code of the request before it.
bool RtuModel::responses_turn() const {
  return turn_ == Turn::kStation && frame_[0] == asked_station_ && frame_[1] % 0x80 == asked_function_;
}

bool RtuModel::may_be_response() const {
  return turn_ == Turn::kUnknown || responses_turn();
}

bool RtuModel::may_be_request() const {
  return frame_[1] < 0x80 && (!may_be_response() || after_gap_);
}

RtuModel::Size RtuModel::size() const {
  if (ours()) return Size::of_request(frame_);
  if (exact()) return {false, 0};
  const Size request = Size::of_request(frame_);
  const Size response = Size::of_response(frame_);
  if (!may_be_response()) return may_be_request() ? request : Size{false, 0};
  if (!may_be_request() || Size::only_response(frame_)) return response;
  return {request.known && response.known, std::max(request.bytes, response.bytes)};
}

std::optional<std::uint64_t> RtuModel::wait(std::uint64_t now_us) const {
  if (busy_ != Busy::kRequest) return {};
  const std::uint64_t end = last_us_ + std::max(settings_.silence_us, settings_.response_delay_us);
  return end > now_us ? end - now_us : 0;
}

Bytes RtuModel::execute() {
  ++counts_.frames;
  ++counts_.executed;
  Bytes response = response_to(View(frame_).subspan(1, frame_.size() - 3));
  counts_.exceptions += response[0] >= 0x80;
  response.insert(response.begin(), frame_[0]);
  if (response[0] == 0) {
    ++counts_.unanswered;
    response_ = 0;
    busy_ = Busy::kSending;
    sent();
    return {};
  }
  busy_ = Busy::kSending;
  response = with_crc(response);
  response_ = response.size();
  return response;
}

void RtuModel::sent() {
  if (busy_ != Busy::kSending) return;
  const bool missed = unheard_ != 0 && unheard_ != response_;
  if (missed) turn_ = Turn::kUnknown;
  hopeless_ = missed || exact();
  unheard_ = 0;
  busy_ = Busy::kNo;
  frame_.clear();
  after_gap_ = false;
}

/// Only asked about requests that are allowed otherwise.
bool RtuModel::touches_others_registers(View pdu) const {
  const auto number = [&](std::size_t at) { return pdu[at] * 256u + pdu[at + 1]; };
  const auto overlap = [&](std::size_t at, std::size_t words, bool writes) {
    const std::size_t begin = settings_.read_only_first + (writes ? 0 : settings_.read_only_count);
    const std::size_t end = settings_.read_only_first + settings_.read_only_count + settings_.missing_count;
    return number(at) < end && begin < number(at) + words && begin != end;
  };
  switch (pdu[0]) {
    case 3: return overlap(1, number(3), false);
    case 16: return overlap(1, number(3), true);
    case 23: return overlap(1, number(3), false) || overlap(5, number(7), true);
    default: return overlap(1, 1, true);
  }
}

Bytes RtuModel::response_to(View pdu) {
  if (pdu[0] == 4) {
    Bytes as_fc_3(pdu.begin(), pdu.end());
    as_fc_3[0] = 3;
    Bytes response = response_to(as_fc_3);
    ++response[0];
    return response;
  }
  const std::uint8_t refused = pdu[0] | 0x80;
  if (!is_executed(pdu[0])) return {refused, 1};
  if (pdu.size() > 253) return {refused, 3};
  const std::vector<std::uint16_t> before = registers();
  const std::size_t earlier = application_.responses().size();
  Bytes request{0, 0, 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), 0};
  request.insert(request.end(), pdu.begin(), pdu.end());
  application_.receive(request);
  const View responses = View(application_.responses()).subspan(earlier + 7);
  if (responses[0] < 0x80 && touches_others_registers(pdu)) {
    application_.registers = before;
    return {refused, 2};
  }
  return Bytes(responses.begin(), responses.end());
}

}  // namespace cbcan::fuzz
