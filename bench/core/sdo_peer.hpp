// SPDX-License-Identifier: MIT
#pragma once

/// A minimal SDO server (CiA 301, 7.2.4) that uses nothing of the product except Frame: node 5 with one object,
/// 2000h sub-index 0.

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/frame.hpp"

namespace cbcan::test {

struct SdoPeer {
  static constexpr std::size_t kCapacity = 128;
  /// The abort code for everything that it does not accept ("local control"): no client creates it itself.
  static constexpr std::uint32_t kRefusal = 0x08000021;

  static constexpr std::uint8_t kBlockSize = 127;  ///< segments of a block download between confirmations

  /// An object of `size` bytes, 1..128: 0, 1, 2, ...
  explicit SdoPeer(std::size_t size) : size_(size) {}

  /// A request. Its responses, none or several, are returned by response().
  void on_frame(const Frame& frame);

  /// The next response; null = none. Valid until the next request.
  const Frame* response() { return head_ == tail_ ? nullptr : &responses_[head_++ % responses_.size()]; }

 private:
  enum class State : std::uint8_t {
    kIdle,
    kDownload,
    kUpload,
    kBlockDownload,
    kBlockDownloadEnd,
    kBlockUploadStart,
    kBlockUpload,
    kBlockUploadEnd,
  };

  void initiate_download(const Frame& frame);
  void download_segment(const Frame& frame);
  void initiate_upload();
  void upload_segment(const Frame& frame);
  void initiate_block_download();
  void block_download_segment(const Frame& frame);
  void end_block_download(const Frame& frame);
  void initiate_block_upload(const Frame& frame);
  void stream();
  void block_upload_acknowledged(const Frame& frame);

  bool keep(const Frame& frame, std::size_t at, std::size_t count);
  std::size_t fill(Frame& frame, std::size_t at) const;
  Frame& reply(unsigned command);
  Frame& reply_with_object(unsigned command);
  void abort();

  std::size_t size_;
  State state_ = State::kIdle;
  std::uint8_t toggle_ = 0;
  std::uint8_t sequence_ = 0;
  std::uint8_t window_ = 0;  ///< segments in a sub-block, as requested by the client
  std::size_t done_ = 0;
  std::size_t confirmed_ = 0;
  std::array<std::uint8_t, kCapacity + 7> value_{};
  std::size_t head_ = 0;
  std::size_t tail_ = 0;
  std::array<Frame, 64> responses_{};
};

}  // namespace cbcan::test
