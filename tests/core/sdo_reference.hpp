// SPDX-License-Identifier: MIT
#pragma once

/// SDO once more, server and client, for tests: written from the tables of CiA 301, 7.2.4.3, and not from the
/// product. Where the standard leaves something open, a comment says what is decided and, where it has one,
/// by which row of docs/reference/contract.md. No time passes, and every frame that is sent has room.

#include <array>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace cbcan::test {

/// The eight bytes of a frame.
using Sdo = std::array<std::uint8_t, 8>;
using SdoBytes = std::vector<std::uint8_t>;

// Abort codes of both (7.2.4.3.17, table 22); of the client [SDO-14], [SDO-15], [SDO-18].
inline constexpr std::uint32_t kToggle = 0x05030000, kCommand = 0x05040001, kBlockSize = 0x05040002,
                               kSequence = 0x05040003, kCrc = 0x05040004;

/// Decided [SDO-24]: sub-blocks in a row of which nothing is confirmed, until a block upload is given up.
inline constexpr unsigned kMostFruitless = 8;

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

  /// `longest` = bytes of the longest value that it has room for.
  ReferenceServer(std::vector<ReferenceObject> objects, std::size_t longest)
      : objects_(std::move(objects)), room_(longest) {}

  std::vector<Sdo> receive(const Sdo& request);

  // For whoever makes up the next request.
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
  SdoBytes bytes_;     ///< of a download so far, of an upload in all
  std::size_t done_ = 0;
  bool declared_ = false;
  std::size_t size_ = 0;  ///< as declared
  unsigned toggle_ = 0, sequence_ = 0, block_size_ = 0, no_progress_count_ = 0;
  bool crc_ = false;
};

/// One transfer of a client.
struct ReferenceClient {
  enum class Mode { kAuto, kExpedited, kSegmented, kBlock };
  enum class State {
    kOver,
    kUpload,
    kUploadSegments,
    kDownloadExpedited,
    kDownload,
    kDownloadSegments,
    kBlockDownload,
    kBlockSegments,
    kBlockDownloadEnd,
    kBlockUpload,
    kBlockUploadSegments,
    kBlockUploadEnd
  };
  struct Request {
    bool write;
    Mode mode;
    unsigned index, sub;
    SdoBytes value;    ///< to write
    std::size_t room;  ///< to read
  };

  /// What it sends at once is in sent().
  explicit ReferenceClient(const Request& request);
  /// A frame of `length` bytes on the CAN-ID of the node's responses; the others are 0.
  void receive(const Sdo& response, std::size_t length);

  /// Since the last time.
  std::vector<Sdo> sent() { return std::exchange(sent_, {}); }
  bool over() const { return state_ == State::kOver; }
  std::uint32_t error() const { return error_; }    ///< when it is over; 0 = done
  const SdoBytes& value() const { return value_; }  ///< read

  // For whoever makes up the next response.
  State state() const { return state_; }
  const Request& request() const { return request_; }
  unsigned toggle() const { return toggle_; }
  unsigned sequence() const { return sequence_; }
  unsigned block_size() const { return block_size_; }

 private:
  bool is_short(const Sdo& response, std::size_t length) const;
  bool is_of_another(const Sdo& response) const;
  bool belongs(const Sdo& response) const;
  void respond_to(const Sdo& response);

  void upload_initiated(const Sdo& response);
  void upload_segment(const Sdo& response);
  void download_segment_taken(const Sdo& response);
  void block_download_initiated(const Sdo& response);
  void sub_block_taken(const Sdo& response);
  void block_upload_initiated(const Sdo& response);
  void block_segment(const Sdo& response);
  void block_upload_ended(const Sdo& response);

  void send(unsigned command, State next);
  void send_first(unsigned command, State next, std::uint32_t tail);
  void send_segment();
  void send_sub_block();
  void acknowledge();
  bool accepts_size(bool declared, std::uint32_t size);
  void end(std::uint32_t error);
  void abort(std::uint32_t code);

  Request request_;
  std::vector<Sdo> sent_;
  State state_ = State::kOver;
  std::uint32_t error_ = 0;
  SdoBytes value_;         ///< as far as it has come
  std::size_t done_ = 0;   ///< bytes sent; of a block write, confirmed
  std::size_t most_ = 0;   ///< bytes that may come
  bool declared_ = false;  ///< most_ are those that the server has declared
  bool crc_ = false;
  unsigned toggle_ = 0, sequence_ = 0, block_size_ = 0, no_progress_count_ = 0, segments_ = 0;
};

/// Random frames for either side.
struct RandomSdo {
  explicit RandomSdo(unsigned seed) : chance_(seed) {}

  std::size_t one_of(std::size_t count) { return chance_() % count; }

 protected:
  std::uint8_t byte() { return static_cast<std::uint8_t>(chance_()); }
  Sdo anything() {
    Sdo frame;
    for (std::uint8_t& each : frame)
      each = byte();
    return frame;
  }
  Sdo with(unsigned command) {
    Sdo frame = anything();
    frame[0] = static_cast<std::uint8_t>(command);
    return frame;
  }

 private:
  std::mt19937 chance_;
};

}  // namespace cbcan::test
