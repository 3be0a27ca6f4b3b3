// SPDX-License-Identifier: MIT
#include "fuzz/rtu_model.hpp"

#include "support/modbus_crc.hpp"

namespace cbcan::fuzz {

namespace {

using Bytes = RtuModel::Bytes;
using View = RtuModel::View;

bool has_right_crc(View frame) {
  const std::size_t size = frame.size() - 2;
  return test::modbus_crc(frame.first(size)) == frame[size] + 256u * frame[size + 1];
}

bool is_known(std::uint8_t function) {
  return function == 3 || function == 6 || function == 16 || function == 22 || function == 23;
}

/// A request's size with its CRC, as far as its bytes tell; 0 = they do not yet.
std::size_t size_of(View frame) {
  const std::size_t count_at = frame[1] == 16 ? 6 : 10;
  if (frame[1] == 3 || frame[1] == 6) return 8;
  if (frame[1] == 22) return 10;
  return frame.size() > count_at ? count_at + 1 + frame[count_at] + 2 : 0;
}

}  // namespace

Bytes with_crc(View bytes) {
  Bytes frame(bytes.begin(), bytes.end());
  const unsigned crc = test::modbus_crc(bytes);
  frame.push_back(static_cast<std::uint8_t>(crc % 256));
  frame.push_back(static_cast<std::uint8_t>(crc / 256));
  return frame;
}

void RtuModel::receive(std::uint8_t byte, std::uint64_t now_us) {
  if (busy_ != Busy::kNo) {
    ++counts_.ignored;
    return;
  }
  const bool new_frame = now_us > last_us_ + settings_.gap_us;
  last_us_ = now_us;
  if (new_frame) {
    if (!frame_.empty()) ++counts_.broken;
    frame_.clear();
    hopeless_ = false;
  }
  if (hopeless_) {
    ++counts_.ignored;
    return;
  }
  frame_.push_back(byte);
  const Verdict verdict = look();
  if (verdict == Verdict::kMore) return;
  counts_.frames += verdict == Verdict::kRight;
  counts_.crc_errors += verdict == Verdict::kWrong;
  counts_.broken += verdict == Verdict::kTooLong;
  hopeless_ = verdict != Verdict::kRight;
  if (verdict == Verdict::kRight && ours()) {
    busy_ = Busy::kRequest;
    return;
  }
  counts_.foreign += verdict == Verdict::kRight;
  frame_.clear();
}

RtuModel::Verdict RtuModel::look() const {
  if (frame_.size() < 4) return Verdict::kMore;
  if (ours() && is_known(frame_[1])) {
    if (frame_.size() != size_of(frame_)) return Verdict::kMore;
    return has_right_crc(frame_) ? Verdict::kRight : Verdict::kWrong;
  }
  if (has_right_crc(frame_)) return Verdict::kRight;
  return frame_.size() == 256 ? Verdict::kTooLong : Verdict::kMore;
}

Bytes RtuModel::poll() {
  if (busy_ != Busy::kRequest) return {};
  ++counts_.executed;
  Bytes answer = answer_to(View(frame_).subspan(1, frame_.size() - 3));
  counts_.exceptions += answer[0] >= 0x80;
  answer.insert(answer.begin(), frame_[0]);
  frame_.clear();
  busy_ = Busy::kSending;
  if (answer[0] != 0) return with_crc(answer);
  ++counts_.unanswered;
  busy_ = Busy::kNo;
  return {};
}

void RtuModel::sent() {
  if (busy_ == Busy::kSending) busy_ = Busy::kNo;
}

/// Only asked about requests that are allowed otherwise.
bool RtuModel::touches_read_only(View pdu) const {
  if (pdu[0] == 3) return false;
  const std::size_t at = pdu[0] == 23 ? 5 : 1;
  const std::size_t count = pdu[0] == 16 || pdu[0] == 23 ? pdu[at + 2] * 256u + pdu[at + 3] : 1;
  for (std::size_t i = 0; i < count; ++i)
    if (pdu[at] * 256u + pdu[at + 1] + i - settings_.read_only_first < settings_.read_only_count) return true;
  return false;
}

Bytes RtuModel::answer_to(View pdu) {
  const std::uint8_t refused = pdu[0] | 0x80;
  if (!is_known(pdu[0])) return {refused, 1};
  if (pdu.size() > 253) return {refused, 3};
  const std::vector<std::uint16_t> before = registers();
  const std::size_t earlier = application_.answers().size();
  Bytes request{0, 0, 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), 0};
  request.insert(request.end(), pdu.begin(), pdu.end());
  application_.receive(request);
  const View answers = View(application_.answers()).subspan(earlier + 7);
  if (answers[0] < 0x80 && touches_read_only(pdu)) {
    application_.registers = before;
    return {refused, 2};
  }
  return Bytes(answers.begin(), answers.end());
}

}  // namespace cbcan::fuzz
