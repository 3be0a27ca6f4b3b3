// SPDX-License-Identifier: MIT
#pragma once

/// The far end of the benchmark's transfers (CiA 301, 7.2.4): node 5 with one object, 2000h sub-index 0, of
/// the bytes 0, 1, 2, ... It uses nothing of the product except Frame, and checks nothing.

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/frame.hpp"

namespace cbcan::test {

class SdoPeer {
 public:
  /// `size`: 4 or 128 bytes.
  explicit SdoPeer(std::uint8_t size) : size_(size) {}

  /// A request. Its responses, none or several, are returned by response().
  void on_frame(const Frame& frame) {
    const std::uint8_t command = frame.data[0];
    if (in_block_) return block_segment(command);
    const unsigned step = command & 3u, toggle = command & 0x10u;
    switch (command >> 5) {
      case 0: return put({byte(0x20 | toggle)});
      case 1: return put({0x60, 0, 0x20});
      case 2: return initiate_upload();
      case 3: return put_segment(toggle | (last() ? 1 | 2 * unused() : 0));
      case 5: return block_upload(step);
      case 6: return block_download(step);
      default: return;
    }
  }

  /// The next response; null = none. Valid until the next request.
  const Frame* response() { return head_ == tail_ ? nullptr : &responses_[head_++ % responses_.size()]; }

 private:
  using Bytes = std::array<std::uint8_t, 8>;
  static constexpr std::uint8_t kBlockSize = 127;
  static constexpr std::uint8_t kCrcLow = 0x0A, kCrcHigh = 0xE8;  ///< of the bytes 0..127

  static constexpr std::uint8_t byte(unsigned number) { return static_cast<std::uint8_t>(number); }
  bool last() const { return size_ - done_ <= 7; }
  /// Bytes without data in the last segment.
  unsigned unused() const { return (7u - size_ % 7) % 7; }

  void put(const Bytes& data) { responses_[tail_++ % responses_.size()] = {0x585, 8, 0, data}; }
  void put_segment(unsigned command) {
    Bytes data{byte(command)};
    for (std::size_t i = 1; i < data.size() && done_ < size_; ++i)
      data[i] = done_++;
    put(data);
  }

  void initiate_upload() {
    done_ = 0;
    size_ > 4 ? put({0x41, 0, 0x20, 0, size_}) : put({0x43, 0, 0x20, 0, 0, 1, 2, 3});
  }

  void block_upload(unsigned step) {
    if (step == 0) {
      done_ = 0;
      return put({0xC6, 0, 0x20, 0, size_});
    }
    if (step == 2) return put({byte(0xC1 | unused() << 2), kCrcLow, kCrcHigh});
    for (unsigned number = 1; step == 3 && done_ < size_; ++number)
      put_segment(number | (last() ? 0x80u : 0));
  }

  void block_download(unsigned step) {
    if ((step & 1) != 0) return put({0xA1});
    in_block_ = true;
    put({0xA4, 0, 0x20, 0, kBlockSize});
  }
  void block_segment(unsigned command) {
    if (command < 0x80) return;
    in_block_ = false;
    put({0xA2, byte(command & 0x7F), kBlockSize});
  }

  std::uint8_t size_;
  std::uint8_t done_ = 0;
  bool in_block_ = false;  ///< of a download
  std::size_t head_ = 0;
  std::size_t tail_ = 0;
  std::array<Frame, 64> responses_{};
};

}  // namespace cbcan::test
