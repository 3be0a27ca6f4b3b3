// SPDX-License-Identifier: MIT
#pragma once

/// The far end of an in-memory wire: a port whose frames are answered by a hand-written SDO server with one
/// object of 128 bytes. It does the least that the protocol asks for, so that what is measured is the client.

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/ports.hpp"

namespace cbcan::bench {

class Loopback final : public CanPort {
 public:
  static constexpr std::size_t kObjectBytes = 128;

  /// `size`: bytes of the object in reads.
  explicit Loopback(std::size_t size) : size_(size) {}

  bool try_send(const Frame& frame) override;

  /// The next answer; null = none. Valid until the next call.
  const Frame* answer();

 private:
  enum class Stream : std::uint8_t { kNone, kDownload, kUpload };

  void initiate_download(const Frame& frame);
  void initiate_upload();
  void upload_segment(const Frame& frame);
  void block_download(const Frame& frame);
  void block_download_segment(const Frame& frame);
  void block_upload(const Frame& frame);
  Frame& reply(std::uint8_t command);
  std::uint8_t fill(Frame& frame, std::size_t at) const;

  std::size_t size_;
  std::size_t done_ = 0;
  Stream stream_ = Stream::kNone;
  std::uint8_t sequence_ = 0;
  std::size_t head_ = 0;
  std::size_t tail_ = 0;
  std::array<Frame, 32> answers_{};
};

}  // namespace cbcan::bench
