// SPDX-License-Identifier: MIT
#include "sdo_peer.hpp"

#include <algorithm>

namespace cbcan::test {

namespace {

std::uint16_t crc_of(const std::uint8_t* bytes, std::size_t count) {
  unsigned crc = 0;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= static_cast<unsigned>(bytes[i]) << 8;
    for (int bit = 0; bit < 8; ++bit)
      crc = ((crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1) & 0xFFFF;
  }
  return static_cast<std::uint16_t>(crc);
}

}  // namespace

Frame& SdoPeer::reply(unsigned command) {
  Frame& frame = responses_[tail_++ % responses_.size()];
  frame.id = 0x585;
  frame.length = 8;
  frame.data = {static_cast<std::uint8_t>(command)};
  return frame;
}

Frame& SdoPeer::reply_with_object(unsigned command) {
  Frame& frame = reply(command);
  frame.data[2] = 0x20;
  return frame;
}

void SdoPeer::abort() {
  state_ = State::kIdle;
  Frame& frame = reply_with_object(0x80);
  for (std::size_t i = 0; i < 4; ++i)
    frame.data[4 + i] = static_cast<std::uint8_t>(kRefusal >> 8 * i);
}

void SdoPeer::on_frame(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if (command == 0x80) {
    state_ = State::kIdle;
    return;
  }
  if (state_ == State::kBlockDownload) return block_download_segment(frame);
  switch (command >> 5) {
    case 0: return download_segment(frame);
    case 1: return initiate_download(frame);
    case 2: return initiate_upload();
    case 3: return upload_segment(frame);
    case 5:
      if ((command & 3) == 0) return initiate_block_upload(frame);
      if ((command & 3) == 2) return block_upload_acknowledged(frame);
      if ((command & 3) == 3 && state_ == State::kBlockUploadStart) return stream();
      if ((command & 3) == 1 && state_ == State::kBlockUploadEnd) {
        state_ = State::kIdle;
        return;
      }
      return abort();
    case 6: return (command & 1) == 0 ? initiate_block_download() : end_block_download(frame);
    default: return abort();
  }
}

// ---- Download

/// Keeps bytes 1.. of a segment; false: they do not fit.
bool SdoPeer::keep(const Frame& frame, std::size_t at, std::size_t count) {
  if (at + count > value_.size()) {
    abort();
    return false;
  }
  for (std::size_t i = 0; i < count; ++i)
    value_[at + i] = frame.data[1 + i];
  return true;
}

void SdoPeer::initiate_download(const Frame& frame) {
  done_ = 0;
  toggle_ = 0;
  state_ = State::kDownload;
  if ((frame.data[0] & 2) != 0) {
    const std::size_t size = 4 - (frame.data[0] >> 2 & 3u);
    for (std::size_t i = 0; i < size; ++i)
      value_[i] = frame.data[4 + i];
    state_ = State::kIdle;
  }
  reply_with_object(0x60);
}

void SdoPeer::download_segment(const Frame& frame) {
  if (state_ != State::kDownload) return abort();
  if ((frame.data[0] & 0x10) != toggle_) return abort();
  const std::size_t count = 7 - (frame.data[0] >> 1 & 7u);
  if (!keep(frame, done_, count)) return;
  done_ += count;
  reply(0x20u | toggle_);
  toggle_ ^= 0x10;
  if ((frame.data[0] & 1) == 0) return;
  state_ = State::kIdle;
}

// ---- Upload

/// Copies up to seven bytes from `at` into the frame after the command; returns how many.
std::size_t SdoPeer::fill(Frame& frame, std::size_t at) const {
  const std::size_t count = std::min<std::size_t>(7, size_ - at);
  for (std::size_t i = 0; i < count; ++i)
    frame.data[1 + i] = static_cast<std::uint8_t>(at + i);
  return count;
}

void SdoPeer::initiate_upload() {
  done_ = 0;
  toggle_ = 0;
  if (size_ > 4) {
    state_ = State::kUpload;
    reply_with_object(0x41).data[4] = static_cast<std::uint8_t>(size_);
    return;
  }
  state_ = State::kIdle;
  Frame& frame = reply_with_object(0x43u | (4u - static_cast<unsigned>(size_)) << 2);
  for (std::size_t i = 0; i < size_; ++i)
    frame.data[4 + i] = static_cast<std::uint8_t>(i);
}

void SdoPeer::upload_segment(const Frame& frame) {
  if (state_ != State::kUpload) return abort();
  if ((frame.data[0] & 0x10) != toggle_) return abort();
  Frame& response = reply(toggle_);
  const std::size_t count = fill(response, done_);
  done_ += count;
  toggle_ ^= 0x10;
  response.data[0] |= static_cast<std::uint8_t>((7 - count) << 1);
  if (done_ != size_) return;
  response.data[0] |= 1;
  state_ = State::kIdle;
}

// ---- Block download

void SdoPeer::initiate_block_download() {
  state_ = State::kBlockDownload;
  done_ = 0;
  sequence_ = 0;
  reply_with_object(0xA4).data[4] = kBlockSize;
}

void SdoPeer::block_download_segment(const Frame& frame) {
  const unsigned sequence = frame.data[0] & 0x7Fu;
  const bool last = (frame.data[0] & 0x80) != 0;
  const bool in_order = sequence == sequence_ + 1u;
  if (in_order) {
    if (!keep(frame, done_, 7)) return;
    done_ += 7;
    ++sequence_;
  }
  if (!last && sequence != kBlockSize) return;
  Frame& response = reply(0xA2);
  response.data[1] = sequence_;
  response.data[2] = kBlockSize;
  if (in_order && last) state_ = State::kBlockDownloadEnd;
  sequence_ = 0;
}

void SdoPeer::end_block_download(const Frame& frame) {
  const std::size_t unused = frame.data[0] >> 2 & 7u;
  if (state_ != State::kBlockDownloadEnd || unused > done_) return abort();
  const unsigned crc = frame.data[1] | static_cast<unsigned>(frame.data[2]) << 8;
  if (crc != crc_of(value_.data(), done_ - unused)) return abort();
  state_ = State::kIdle;
  reply(0xA1);
}

// ---- Block upload

void SdoPeer::initiate_block_upload(const Frame& frame) {
  state_ = State::kBlockUploadStart;
  window_ = frame.data[4];
  confirmed_ = 0;
  reply_with_object(0xC6).data[4] = static_cast<std::uint8_t>(size_);
}

void SdoPeer::stream() {
  state_ = State::kBlockUpload;
  done_ = confirmed_;
  for (sequence_ = 0; sequence_ < window_ && done_ < size_;) {
    Frame& frame = reply(++sequence_);
    done_ += fill(frame, done_);
    if (done_ == size_) frame.data[0] |= 0x80;
  }
}

void SdoPeer::block_upload_acknowledged(const Frame& frame) {
  if (state_ != State::kBlockUpload || frame.data[1] > sequence_) return abort();
  const bool all = frame.data[1] == sequence_ && done_ == size_;
  confirmed_ = std::min<std::size_t>(size_, confirmed_ + std::size_t{7} * frame.data[1]);
  window_ = frame.data[2];
  if (!all) return stream();
  std::array<std::uint8_t, kCapacity> bytes{};
  for (std::size_t i = 0; i < size_; ++i)
    bytes[i] = static_cast<std::uint8_t>(i);
  const std::uint16_t crc = crc_of(bytes.data(), size_);
  Frame& response = reply(0xC1u | static_cast<unsigned>((7 - size_ % 7) % 7) << 2);
  response.data[1] = static_cast<std::uint8_t>(crc);
  response.data[2] = static_cast<std::uint8_t>(crc >> 8);
  state_ = State::kBlockUploadEnd;
}

}  // namespace cbcan::test
