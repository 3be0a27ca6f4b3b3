// SPDX-License-Identifier: MIT
#include <algorithm>

#include "core/sdo_reference.hpp"

namespace cbcan::test {

namespace {

// The client's own codes, by what they are for in docs/reference/contract.md.
constexpr std::uint32_t kLargerThanRoom = 0x05040005;  // [SDO-16], and without an end [SDO-24]
constexpr std::uint32_t kNotAsDeclared = 0x06070010;   // [SDO-17]
constexpr std::uint32_t kNotExpedited = 0x06010000;    // [SDO-7]
constexpr std::uint32_t kNoCode = 0x08000000;          // [SDO-11]

constexpr unsigned kMostEmpty = 256;  // [SDO-24]

/// Decided: segments that a block read asks for at a time: what the room needs [SDO-25], and 64 at most.
constexpr std::size_t kSegmentsAtATime = 64;

}  // namespace

ReferenceClient::ReferenceClient(const Request& request) : request_(request) {
  const std::size_t size = request_.value.size();
  if (!request.write && request.mode == Mode::kBlock) {
    block_size_ = static_cast<unsigned>(std::min((request.room + 6) / 7, kSegmentsAtATime));
    send_first(0xA4, State::kBlockUpload, block_size_);
  } else if (!request.write) {
    send_first(0x40, State::kUpload, 0);
  } else if (request.mode == Mode::kExpedited && size > 4) {
    end(kNotExpedited);
  } else if (request.mode == Mode::kBlock) {
    send_first(0xC6, State::kBlockDownload, static_cast<std::uint32_t>(size));
  } else if (request.mode == Mode::kSegmented || size > 4) {
    send_first(0x21, State::kDownload, static_cast<std::uint32_t>(size));
  } else {
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < size; ++i)
      number += std::uint32_t{request_.value[i]} << 8 * i;
    send_first(0x23 + 4 * (4 - static_cast<unsigned>(size)), State::kDownloadExpedited, number);
  }
}

// ---- What goes out

void ReferenceClient::send_first(unsigned command, State next, std::uint32_t tail) {
  send(command, next);
  Sdo& frame = sent_.back();
  frame[1] = static_cast<std::uint8_t>(request_.index);
  frame[2] = static_cast<std::uint8_t>(request_.index >> 8);
  frame[3] = static_cast<std::uint8_t>(request_.sub);
  for (unsigned i = 4; i < 8; ++i, tail /= 256)
    frame[i] = static_cast<std::uint8_t>(tail);
}

void ReferenceClient::send(unsigned command, State next) {
  state_ = next;
  sent_.push_back({static_cast<std::uint8_t>(command)});
}

void ReferenceClient::end(std::uint32_t error) {
  state_ = State::kOver;
  error_ = error;
}

/// [SDO-20]
void ReferenceClient::abort(std::uint32_t code) {
  send_first(0x80, State::kOver, code);
  end(code);
}

// ---- What comes in

/// [SDO-22]: without a byte that its command needs (7.2.4.3: tables of each service).
bool ReferenceClient::is_short(const Sdo& response, std::size_t length) const {
  const unsigned command = response[0];
  const bool low = command % 2 == 1;
  if (length == 0) return true;
  if (state_ == State::kBlockUploadSegments && command != 0x80) return length < 8;
  switch (command / 32) {
    case 0: return length < 1 + (7 - command / 2 % 8);
    case 2:
      if ((command & 2) == 0) return length < (low ? 8 : 4);
      return length < (low ? 8 - command / 4 % 4 : 8);
    case 3: return length < 4;
    case 4: return length < 8;
    case 5: return length < (command % 4 == 0 ? 5u : command % 4 == 2 ? 3u : 1u);
    case 6: return length < (low ? 3u : (command & 2) != 0 ? 8u : 4u);
    default: return false;
  }
}

/// [SDO-22], [SDO-12]: those that have an index and a sub-index, and not this transfer's. An abort may have
/// zeros.
bool ReferenceClient::is_of_another(const Sdo& response) const {
  const unsigned specifier = response[0] / 32, step = response[0] % 4;
  if (state_ == State::kBlockUploadSegments && response[0] != 0x80) return false;
  const bool has = specifier == 2 || specifier == 3 || specifier == 4 || (specifier == 5 && step == 0) ||
                   (specifier == 6 && step % 2 == 0);
  const unsigned index = response[1] + 256u * response[2];
  const bool zeros = index == 0 && response[3] == 0;
  return has && !(index == request_.index && response[3] == request_.sub) && !(specifier == 4 && zeros);
}

void ReferenceClient::receive(const Sdo& response, std::size_t length) {
  if (over() || is_short(response, length) || is_of_another(response)) return;
  const bool among_segments = state_ == State::kBlockUploadSegments || state_ == State::kBlockUploadEnd;
  if (response[0] == 0x80 || (response[0] / 32 == 4 && !among_segments))
    return end(tail_of(response) == 0 ? kNoCode : tail_of(response));  // [SDO-11], [SDO-21]
  if (!belongs(response)) return abort(kCommand);
  respond_to(response);
}

/// By server command specifier; those of a block's segments are looked at one by one.
bool ReferenceClient::belongs(const Sdo& response) const {
  switch (state_) {
    case State::kUpload: return response[0] / 32 == 2;
    case State::kUploadSegments: return response[0] / 32 == 0;
    case State::kDownloadExpedited:
    case State::kDownload: return response[0] / 32 == 3;
    case State::kDownloadSegments: return response[0] / 32 == 1;
    case State::kBlockDownload: return response[0] / 32 == 5 && response[0] % 4 == 0;
    case State::kBlockSegments: return response[0] / 32 == 5 && response[0] % 4 == 2;
    case State::kBlockDownloadEnd: return response[0] / 32 == 5 && response[0] % 4 == 1;
    case State::kBlockUpload: return response[0] / 32 == 6 && response[0] % 2 == 0;
    default: return true;
  }
}

void ReferenceClient::respond_to(const Sdo& response) {
  switch (state_) {
    case State::kUpload: return upload_initiated(response);
    case State::kUploadSegments: return upload_segment(response);
    case State::kDownload: return send_segment();
    case State::kDownloadSegments: return download_segment_taken(response);
    case State::kBlockDownload: return block_download_initiated(response);
    case State::kBlockSegments: return sub_block_taken(response);
    case State::kBlockUpload: return block_upload_initiated(response);
    case State::kBlockUploadSegments: return block_segment(response);
    case State::kBlockUploadEnd: return block_upload_ended(response);
    default: return end(0);
  }
}

// ---- Upload

bool ReferenceClient::accepts_size(bool declared, std::uint32_t size) {
  declared_ = declared;
  most_ = declared ? size : request_.room;
  return most_ <= request_.room;
}

void ReferenceClient::upload_initiated(const Sdo& response) {
  const bool sized = response[0] % 2 == 1;
  if (response[0] / 2 % 2 == 1) {
    // Without a size it is four bytes, cut to the room [SDO-23].
    const std::size_t size = sized ? 4 - response[0] / 4 % 4 : std::min<std::size_t>(4, request_.room);
    if (size > request_.room) return end(kLargerThanRoom);  // the server is done: nothing to tell it
    value_.assign(response.begin() + 4, response.begin() + 4 + static_cast<std::ptrdiff_t>(size));
    return end(0);
  }
  if (request_.mode == Mode::kExpedited) return abort(kNotExpedited);
  if (!accepts_size(sized, tail_of(response))) return abort(kLargerThanRoom);
  send(0x60, State::kUploadSegments);
}

void ReferenceClient::upload_segment(const Sdo& response) {
  const unsigned toggle = response[0] / 16 % 2, size = 7 - response[0] / 2 % 8;
  if (toggle != toggle_) return abort(kToggle);
  if (value_.size() + size > most_) return abort(declared_ ? kNotAsDeclared : kLargerThanRoom);
  value_.insert(value_.end(), response.begin() + 1, response.begin() + 1 + size);
  if (response[0] % 2 == 1)
    return declared_ && value_.size() != most_ ? abort(kNotAsDeclared) : end(0);  // [SDO-33]
  if (size == 0 && ++no_progress_count_ == kMostEmpty) return abort(kLargerThanRoom);
  toggle_ = 1 - toggle_;
  send(0x60 + 16 * toggle_, State::kUploadSegments);
}

// ---- Download

void ReferenceClient::send_segment() {
  const std::size_t size = std::min<std::size_t>(7, request_.value.size() - done_);
  const bool last = done_ + size == request_.value.size();
  send(16 * toggle_ + 2 * (7 - static_cast<unsigned>(size)) + last, State::kDownloadSegments);
  for (std::size_t i = 0; i < size; ++i)
    sent_.back()[1 + i] = request_.value[done_++];
}

void ReferenceClient::download_segment_taken(const Sdo& response) {
  if (response[0] / 16 % 2 != toggle_) return abort(kToggle);
  if (done_ == request_.value.size()) return end(0);
  toggle_ = 1 - toggle_;
  send_segment();
}

// ---- Block download

void ReferenceClient::block_download_initiated(const Sdo& response) {
  crc_ = (response[0] & 4) != 0;
  block_size_ = response[4];
  if (block_size_ < 1 || block_size_ > 127) return abort(kBlockSize);
  send_sub_block();
}

void ReferenceClient::send_sub_block() {
  const std::size_t size = request_.value.size();
  sequence_ = 0;
  for (std::size_t at = done_; at < size && sequence_ < block_size_; at += 7) {
    send(++sequence_ + (at + 7 >= size ? 128 : 0), State::kBlockSegments);
    for (std::size_t i = 0; i < 7 && at + i < size; ++i)
      sent_.back()[1 + i] = request_.value[at + i];
  }
}

void ReferenceClient::sub_block_taken(const Sdo& response) {
  const unsigned taken = response[1];
  const SdoBytes& value = request_.value;
  if (taken > sequence_) return abort(kSequence);
  block_size_ = response[2];
  if (block_size_ < 1 || block_size_ > 127) return abort(kBlockSize);
  no_progress_count_ = taken == 0 ? no_progress_count_ + 1 : 0;
  if (no_progress_count_ == kMostFruitless) return abort(kSequence);
  done_ = std::min(done_ + 7 * taken, value.size());
  if (done_ < value.size()) return send_sub_block();
  const unsigned crc = crc_ ? reference_crc(value) : 0;
  send(0xC1 + 4 * static_cast<unsigned>((7 - value.size() % 7) % 7), State::kBlockDownloadEnd);
  sent_.back()[1] = static_cast<std::uint8_t>(crc);
  sent_.back()[2] = static_cast<std::uint8_t>(crc >> 8);
}

// ---- Block upload

void ReferenceClient::block_upload_initiated(const Sdo& response) {
  crc_ = (response[0] & 4) != 0;
  if (!accepts_size((response[0] & 2) != 0, tail_of(response))) return abort(kLargerThanRoom);
  sequence_ = segments_ = 0;
  send(0xA3, State::kBlockUploadSegments);
}

/// Those in order are kept; at the end of the sub-block the server is told which was the last of them.
void ReferenceClient::block_segment(const Sdo& response) {
  const unsigned number = response[0] % 128;
  const bool last = response[0] >= 128;
  if (number == 0 || number > block_size_ || ++segments_ > 127) return abort(kSequence);  // [SDO-24]
  const bool next = number == sequence_ + 1;
  if (next) {
    if (!last && value_.size() + 7 > most_) return abort(declared_ ? kNotAsDeclared : kLargerThanRoom);
    value_.insert(value_.end(), response.begin() + 1, response.end());
    sequence_ = number;
  }
  if (next && last) {
    acknowledge();
    state_ = State::kBlockUploadEnd;
  } else if (last || number == block_size_) {
    no_progress_count_ = sequence_ == 0 ? no_progress_count_ + 1 : 0;
    if (no_progress_count_ == kMostFruitless) return abort(kSequence);
    acknowledge();
    sequence_ = segments_ = 0;
  }
}

void ReferenceClient::acknowledge() {
  send(0xA2, State::kBlockUploadSegments);
  sent_.back()[1] = static_cast<std::uint8_t>(sequence_);
  sent_.back()[2] = static_cast<std::uint8_t>(block_size_);
}

/// Decided: segments that come once more are let pass; no end looks like them, as there are 64 at most.
void ReferenceClient::block_upload_ended(const Sdo& response) {
  const unsigned number = response[0] % 128;
  if (number >= 1 && number <= block_size_) return;
  if (response[0] / 32 != 6 || response[0] % 2 != 1) return abort(kCommand);
  value_.resize(value_.size() - response[0] / 4 % 8);
  if (declared_ && value_.size() != most_) return abort(kNotAsDeclared);
  if (value_.size() > request_.room) return abort(kLargerThanRoom);
  if (crc_ && reference_crc(value_) != response[1] + 256u * response[2]) return abort(kCrc);
  send(0xA1, State::kOver);
  end(0);
}

}  // namespace cbcan::test
