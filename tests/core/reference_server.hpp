// SPDX-License-Identifier: MIT
#pragma once

/// A second SDO server, for tests: written from the tables of CiA 301, 7.2.4.3, independently of the product. If
/// the standard leaves something open, a comment gives the decision and its id in docs/reference/contract.md, if
/// it has one. No time passes, and no frame is refused.

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace cbcan::test {

/// The eight bytes of a frame.
using Sdo = std::array<std::uint8_t, 8>;
using SdoBytes = std::vector<std::uint8_t>;

/// Bytes 4 to 7 as a number.
inline std::uint32_t tail_of(const Sdo& frame) {
  return frame[4] + 256u * frame[5] + 65536u * frame[6] + 16777216u * frame[7];
}

/// CRC of block transfers (7.2.4.3.16): x^16 + x^12 + x^5 + 1, initial value 0, a bit at a time.
inline unsigned reference_crc(const SdoBytes& bytes) {
  unsigned crc = 0;
  for (const unsigned byte : bytes)
    for (int bit = 7; bit >= 0; --bit) {
      const bool carry = ((crc >> 15 ^ byte >> bit) & 1) != 0;
      crc = (crc << 1 & 0xFFFF) ^ (carry ? 0x1021u : 0u);
    }
  return crc;
}

struct ReferenceObject {
  unsigned index, sub;
  bool readable, writable;
  std::size_t shortest, longest;
  unsigned lowest, highest;  ///< of a value of up to four bytes
  SdoBytes value;
};

struct ReferenceServer {
  enum class State {
    kIdle,
    kDownload,
    kUpload,
    kBlockDownload,
    kBlockDownloadEnd,
    kBlockUploadStart,
    kBlockUpload,
    kBlockUploadEnd
  };

  /// `longest`: size of its memory for a value, in bytes.
  ReferenceServer(std::vector<ReferenceObject> objects, std::size_t longest)
      : objects_(std::move(objects)), room_(longest) {}

  std::vector<Sdo> receive(const Sdo& request);

  const std::vector<ReferenceObject>& objects() const { return objects_; }

  // For the generator of the next request.
  State state() const { return state_; }
  const ReferenceObject* object() const { return object_; }
  unsigned toggle() const { return toggle_; }
  unsigned sequence() const { return sequence_; }
  const SdoBytes& bytes() const { return bytes_; }

 private:
  void initiate_download(const Sdo& request);
  void download_segment(const Sdo& request);
  void initiate_upload(const Sdo& request);
  void upload_segment(const Sdo& request);
  void initiate_block_download(const Sdo& request);
  void block_download_segment(const Sdo& request);
  void end_block_download(const Sdo& request);
  void block_upload(const Sdo& request);
  void initiate_block_upload(const Sdo& request);
  void send_sub_block();
  void acknowledged(const Sdo& request);

  bool find(const Sdo& request);
  bool may_be_written(bool sized, std::size_t size);
  bool may_be_read();
  bool store();
  void respond(unsigned command, const Sdo& multiplexer, std::uint32_t tail = 0);
  bool abort(std::uint32_t code);

  std::vector<ReferenceObject> objects_;
  std::size_t room_;
  std::vector<Sdo> responses_;
  State state_ = State::kIdle;
  ReferenceObject* object_ = nullptr;
  Sdo multiplexer_{};  ///< in bytes 1..3, of the last request that had one
  SdoBytes bytes_;     ///< of a download so far; of an upload all
  std::size_t done_ = 0;
  bool declared_ = false;
  std::size_t size_ = 0;  ///< as declared
  unsigned toggle_ = 0, sequence_ = 0, block_size_ = 0, no_progress_count_ = 0;
  bool crc_ = false, begins_ = false;
};

}  // namespace cbcan::test
