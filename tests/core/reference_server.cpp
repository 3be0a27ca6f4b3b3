// SPDX-License-Identifier: MIT
#include <algorithm>

#include "core/reference_server.hpp"

namespace cbcan::test {

namespace {

// 7.2.4.3.17, table 22.
constexpr std::uint32_t kToggle = 0x05030000, kCommand = 0x05040001, kBlockSize = 0x05040002,
                        kSequence = 0x05040003, kCrc = 0x05040004, kMemory = 0x05040005,
                        kWriteOnly = 0x06010001, kReadOnly = 0x06010002, kNoObject = 0x06020000,
                        kLength = 0x06070010, kTooLong = 0x06070012, kNoSub = 0x06090011,
                        kTooHigh = 0x06090031, kTooLow = 0x06090032;

/// Decided [SDO-24]: consecutive unconfirmed sub-blocks until a block upload is aborted.
constexpr unsigned kMostUnconfirmed = 8;

}  // namespace

std::vector<Sdo> ReferenceServer::receive(const Sdo& request) {
  responses_.clear();
  const unsigned specifier = request[0] / 32;
  // Decided: the last segment once more is ignored; from C1h on it could be the end of the transfer.
  if (state_ == State::kBlockDownloadEnd && request[0] == 128 + sequence_ && sequence_ <= 64) return {};
  if (state_ == State::kBlockDownload && request[0] != 0x80) {
    block_download_segment(request);
    return responses_;
  }
  switch (specifier) {
    case 0: download_segment(request); break;
    case 1: initiate_download(request); break;
    case 2: initiate_upload(request); break;
    case 3: upload_segment(request); break;
    case 4: state_ = State::kIdle; break;
    case 5: block_upload(request); break;
    case 6: request[0] % 2 == 0 ? initiate_block_download(request) : end_block_download(request); break;
    default: abort(kCommand);
  }
  return responses_;
}

void ReferenceServer::respond(unsigned command, const Sdo& multiplexer, std::uint32_t tail) {
  Sdo response = multiplexer;
  response[0] = static_cast<std::uint8_t>(command);
  for (unsigned i = 4; i < 8; ++i, tail /= 256)
    response[i] = static_cast<std::uint8_t>(tail);
  responses_.push_back(response);
}

/// Ends the transfer. Decided: an abort contains the multiplexer of the last request that had one.
bool ReferenceServer::abort(std::uint32_t code) {
  state_ = State::kIdle;
  respond(0x80, multiplexer_, code);
  return false;
}

/// Decided: a request that begins a transfer ends the current one without an abort.
bool ReferenceServer::find(const Sdo& request) {
  state_ = State::kIdle;
  multiplexer_ = {0, request[1], request[2], request[3]};
  bytes_.clear();
  done_ = 0;
  object_ = nullptr;
  const unsigned index = request[1] + 256u * request[2];
  bool has_index = false;
  for (ReferenceObject& each : objects_) {
    has_index = has_index || each.index == index;
    if (each.index == index && each.sub == request[3]) object_ = &each;
  }
  return object_ != nullptr || abort(has_index ? kNoSub : kNoObject);
}

// ---- Download

/// Rejects as early as possible. Decided: 0607 0010h for too short (of CiA's two codes for it, table 3 of the
/// CBCAN document has this one); 0504 0005h for an object that is larger than the memory.
bool ReferenceServer::may_be_written(bool sized, std::size_t size) {
  if (!object_->writable) return abort(kReadOnly);
  if (sized && size > object_->longest) return abort(kTooLong);
  if (sized && size < object_->shortest) return abort(kLength);
  if (object_->longest > room_) return abort(kMemory);
  declared_ = sized;
  size_ = size;
  return true;
}

bool ReferenceServer::store() {
  state_ = State::kIdle;
  if (declared_ && bytes_.size() != size_) return abort(kLength);
  if (bytes_.size() > object_->longest) return abort(kTooLong);
  if (bytes_.size() < object_->shortest) return abort(kLength);
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < bytes_.size() && i < 4; ++i)
    number += std::uint64_t{bytes_[i]} << 8 * i;
  if (number > object_->highest) return abort(kTooHigh);
  if (number < object_->lowest) return abort(kTooLow);
  object_->value = bytes_;
  return true;
}

void ReferenceServer::initiate_download(const Sdo& request) {
  const bool expedited = (request[0] & 2) != 0, sized = (request[0] & 1) != 0;
  if (!find(request)) return;
  if (!expedited) {
    if (!may_be_written(sized, tail_of(request))) return;
    state_ = State::kDownload;
    toggle_ = 0;
  } else {
    if (!object_->writable) return void(abort(kReadOnly));
    // Decided: if the size is not indicated, the object takes as many of the four bytes as it has.
    const std::size_t size = sized ? 4 - request[0] / 4 % 4 : std::min<std::size_t>(4, object_->longest);
    bytes_.assign(request.begin() + 4, request.begin() + 4 + static_cast<std::ptrdiff_t>(size));
    declared_ = false;
    if (!store()) return;
  }
  respond(0x60, multiplexer_);
}

void ReferenceServer::download_segment(const Sdo& request) {
  if (state_ != State::kDownload) return void(abort(kCommand));
  const unsigned toggle = request[0] / 16 % 2, size = 7 - request[0] / 2 % 8;
  if (toggle != toggle_) return void(abort(kToggle));
  bytes_.insert(bytes_.end(), request.begin() + 1, request.begin() + 1 + size);
  if (bytes_.size() > object_->longest) return void(abort(kTooLong));
  if (request[0] % 2 == 1 && !store()) return;
  respond(0x20 + 16 * toggle, {});
  toggle_ = 1 - toggle;
}

// ---- Upload

bool ReferenceServer::may_be_read() {
  if (!object_->readable) return abort(kWriteOnly);
  if (object_->value.size() > room_) return abort(kMemory);
  bytes_ = object_->value;
  return true;
}

/// Decided [SDO-23]: an empty value is reported with a size of 0.
void ReferenceServer::initiate_upload(const Sdo& request) {
  if (!find(request) || !may_be_read()) return;
  const auto size = static_cast<unsigned>(bytes_.size());
  if (size == 0 || size > 4) {
    state_ = State::kUpload;
    toggle_ = 0;
    return respond(0x41, multiplexer_, size);
  }
  std::uint32_t number = 0;
  for (unsigned i = 0; i < size; ++i)
    number += std::uint32_t{bytes_[i]} << 8 * i;
  respond(0x43 + 4 * (4 - size), multiplexer_, number);
}

void ReferenceServer::upload_segment(const Sdo& request) {
  if (state_ != State::kUpload) return void(abort(kCommand));
  const unsigned toggle = request[0] / 16 % 2;
  if (toggle != toggle_) return void(abort(kToggle));
  const std::size_t size = std::min<std::size_t>(7, bytes_.size() - done_);
  Sdo response{};
  for (std::size_t i = 0; i < size; ++i)
    response[1 + i] = bytes_[done_++];
  const bool last = done_ == bytes_.size();
  response[0] = static_cast<std::uint8_t>(16 * toggle + 2 * (7 - size) + last);
  responses_.push_back(response);
  toggle_ = 1 - toggle;
  if (last) state_ = State::kIdle;
}

// ---- Block download

void ReferenceServer::initiate_block_download(const Sdo& request) {
  const bool sized = (request[0] & 2) != 0;
  if (!find(request) || !may_be_written(sized, tail_of(request))) return;
  state_ = State::kBlockDownload;
  crc_ = (request[0] & 4) != 0;
  sequence_ = 0;
  begins_ = true;
  block_size_ = crc_ || sized ? 127 : 64;
  respond(0xA4, multiplexer_, block_size_);  // CRC supported
}

/// Decided: a sub-block that begins with a number from 64 on begins with a repeated frame, which is ignored;
/// an invalid sequence number is 0504 0003h; a value that gets too long is rejected immediately, except in
/// its last segment, whose length is only known at the end.
void ReferenceServer::block_download_segment(const Sdo& request) {
  const unsigned number = request[0] % 128;
  const bool last = request[0] >= 128, next = number == sequence_ + 1;
  if (number == 0) return void(abort(kSequence));
  if (std::exchange(begins_, false) && number >= 64) return;
  if (next) {
    if (!last && bytes_.size() + 7 > object_->longest) return void(abort(kTooLong));
    bytes_.insert(bytes_.end(), request.begin() + 1, request.end());
    sequence_ = number;
  }
  if (!last && number != block_size_) return;
  Sdo response{0xA2, static_cast<std::uint8_t>(sequence_), static_cast<std::uint8_t>(block_size_)};
  responses_.push_back(response);
  begins_ = true;
  if (next && last) return void(state_ = State::kBlockDownloadEnd);
  sequence_ = 0;
}

void ReferenceServer::end_block_download(const Sdo& request) {
  if (state_ != State::kBlockDownloadEnd) return void(abort(kCommand));
  const std::size_t unused = request[0] / 4 % 8;
  bytes_.resize(bytes_.size() - unused);  // there is a segment, and `unused` is at most seven
  if (bytes_.size() > object_->longest) return void(abort(kTooLong));
  if (crc_ && reference_crc(bytes_) != request[1] + 256u * request[2]) return void(abort(kCrc));
  if (store()) respond(0xA1, {});
}

// ---- Block upload

void ReferenceServer::block_upload(const Sdo& request) {
  const unsigned step = request[0] % 4;
  if (step == 0) return initiate_block_upload(request);
  if (step == 3 && state_ == State::kBlockUploadStart) return send_sub_block();
  if (step == 2 && state_ == State::kBlockUpload) return acknowledged(request);
  if (step == 1 && state_ == State::kBlockUploadEnd) return void(state_ = State::kIdle);
  abort(kCommand);
}

/// Decided: the protocol switch threshold is not used.
void ReferenceServer::initiate_block_upload(const Sdo& request) {
  if (!find(request) || !may_be_read()) return;
  block_size_ = request[4];
  if (block_size_ < 1 || block_size_ > 127) return void(abort(kBlockSize));
  crc_ = (request[0] & 4) != 0;
  no_progress_count_ = 0;
  state_ = State::kBlockUploadStart;
  respond(0xC6, multiplexer_, static_cast<std::uint32_t>(bytes_.size()));
}

/// The segments after the `done_` confirmed bytes. Decided [SDO-23]: an empty value has one segment without data.
void ReferenceServer::send_sub_block() {
  state_ = State::kBlockUpload;
  sequence_ = 0;
  for (std::size_t at = done_; sequence_ < block_size_ && (at < bytes_.size() || at == 0); at += 7) {
    Sdo segment{};
    for (std::size_t i = 0; i < 7 && at + i < bytes_.size(); ++i)
      segment[1 + i] = bytes_[at + i];
    segment[0] = static_cast<std::uint8_t>(++sequence_ + (at + 7 >= bytes_.size() ? 128 : 0));
    responses_.push_back(segment);
    if (bytes_.empty()) break;
  }
}

void ReferenceServer::acknowledged(const Sdo& request) {
  const unsigned taken = request[1];
  if (taken > sequence_) return void(abort(kSequence));
  block_size_ = request[2];
  if (block_size_ < 1 || block_size_ > 127) return void(abort(kBlockSize));
  no_progress_count_ = taken == 0 ? no_progress_count_ + 1 : 0;
  if (no_progress_count_ == kMostUnconfirmed) return void(abort(kSequence));
  done_ = std::min(done_ + 7 * taken, bytes_.size());
  if (taken == 0 || done_ < bytes_.size()) return send_sub_block();
  const std::size_t unused = bytes_.empty() ? 7 : (7 - bytes_.size() % 7) % 7;
  const unsigned crc = crc_ ? reference_crc(bytes_) : 0;
  state_ = State::kBlockUploadEnd;
  responses_.push_back({static_cast<std::uint8_t>(0xC1 + 4 * unused), static_cast<std::uint8_t>(crc),
                        static_cast<std::uint8_t>(crc >> 8)});
}

}  // namespace cbcan::test
