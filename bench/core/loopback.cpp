// SPDX-License-Identifier: MIT
#include "loopback.hpp"

#include <algorithm>

namespace cbcan::bench {

namespace {

constexpr std::uint8_t kNode = 5;
constexpr std::size_t kSegment = 7;

/// CRC (CiA 301, 7.2.4.3.16: x^16 + x^12 + x^5 + 1) of the object, which always holds 00h, 01h .. 7Fh.
constexpr std::uint16_t kCrcOfObject = 0xE80A;

constexpr std::uint8_t byte_at(std::size_t at) {
  return static_cast<std::uint8_t>(at);
}

}  // namespace

Frame& Loopback::reply(std::uint8_t command) {
  Frame& frame = answers_[tail_++ % answers_.size()];
  frame.id = 0x580 + kNode;
  frame.length = 8;
  frame.data = {command};
  return frame;
}

const Frame* Loopback::answer() {
  return head_ == tail_ ? nullptr : &answers_[head_++ % answers_.size()];
}

bool Loopback::try_send(const Frame& frame) {
  if (stream_ == Stream::kDownload) {
    block_download_segment(frame);
    return true;
  }
  switch (frame.data[0] >> 5) {
    case 0: reply(static_cast<std::uint8_t>(0x20 | (frame.data[0] & 0x10))); break;
    case 1: initiate_download(frame); break;
    case 2: initiate_upload(); break;
    case 3: upload_segment(frame); break;
    case 5: block_upload(frame); break;
    case 6: block_download(frame); break;
    default: break;
  }
  return true;
}

void Loopback::initiate_download(const Frame& frame) {
  Frame& answer = reply(0x60);
  answer.data[1] = frame.data[1];
  answer.data[2] = frame.data[2];
  answer.data[3] = frame.data[3];
}

void Loopback::initiate_upload() {
  Frame& answer = reply(size_ <= 4 ? 0x43 : 0x41);
  answer.data[2] = 0x20;
  done_ = 0;
  if (size_ <= 4)
    answer.data[4] = 0x2A;
  else
    answer.data[4] = static_cast<std::uint8_t>(size_);
}

/// Puts up to seven bytes from `at` behind the command; says how many.
std::uint8_t Loopback::fill(Frame& frame, std::size_t at) const {
  const std::size_t count = std::min(kSegment, size_ - at);
  for (std::size_t i = 0; i < count; ++i)
    frame.data[1 + i] = byte_at(at + i);
  return static_cast<std::uint8_t>(count);
}

void Loopback::upload_segment(const Frame& frame) {
  Frame& answer = reply(frame.data[0] & 0x10);
  const std::uint8_t count = fill(answer, done_);
  done_ += count;
  answer.data[0] |= static_cast<std::uint8_t>((7 - count) << 1 | (done_ == size_ ? 1 : 0));
}

void Loopback::block_download(const Frame& frame) {
  if ((frame.data[0] & 1) != 0) {
    const bool good = frame.data[1] == (kCrcOfObject & 0xFF) && frame.data[2] == kCrcOfObject >> 8;
    reply(good ? 0xA1 : 0x80);
    return;
  }
  Frame& answer = reply(0xA4);
  answer.data[2] = 0x20;
  answer.data[4] = 127;
  stream_ = Stream::kDownload;
  sequence_ = 0;
}

void Loopback::block_download_segment(const Frame& frame) {
  ++sequence_;
  if ((frame.data[0] & 0x80) == 0) return;
  stream_ = Stream::kNone;
  Frame& answer = reply(0xA2);
  answer.data[1] = sequence_;
  answer.data[2] = 127;
}

void Loopback::block_upload(const Frame& frame) {
  switch (frame.data[0] & 3) {
    case 0: {
      Frame& answer = reply(0xC6);
      answer.data[2] = 0x20;
      answer.data[4] = static_cast<std::uint8_t>(size_);
      break;
    }
    case 3:
      for (std::size_t at = 0; at < size_; at += kSegment) {
        const bool last = at + kSegment >= size_;
        fill(reply(static_cast<std::uint8_t>((at / kSegment + 1) | (last ? 0x80 : 0))), at);
      }
      break;
    case 2: {
      const std::size_t unused = (kSegment - size_ % kSegment) % kSegment;
      Frame& answer = reply(static_cast<std::uint8_t>(0xC1 | unused << 2));
      answer.data[1] = kCrcOfObject & 0xFF;
      answer.data[2] = kCrcOfObject >> 8;
      break;
    }
    default: break;
  }
}

}  // namespace cbcan::bench
