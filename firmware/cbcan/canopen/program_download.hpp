// SPDX-License-Identifier: MIT
#pragma once

/// Program download (CiA 302-3): objects 1F50h, 1F51h, 1F56h and 1F57h, sub-index 1, of a device that keeps
/// programs in flash. An application with these objects in its EDS file gives the class to
/// SdoServer::set_stream(), calls on_read() and on_write() from its own for the
/// sub-indices 1 of what is_program_number(), and poll().
///
///   1F51h  0 stop, 1 start, 2 reset, 3 clear; anything else is 0609 0030h. It reads 1 while a program runs,
///          which can only be stopped or reset.
///   1F50h  takes the program's bytes after a clear, otherwise 0800 0022h, or 0606 0000h if the flash fails,
///          or 0607 0012h if there is no more room. Several downloads continue each other, so that a client
///          with little memory can send pieces; an aborted one ends it, until the next clear.
///   1F56h  CRC-32 (IEEE 802.3) of the bytes received since the clear; without a clear, of the stored program
///   1F57h  bit 0 busy, bits 7..1 as in ProgramStatus
///
/// A start lets Memory check what its flash has against that CRC, and make it startable. All responses are
/// sent before the device erases or restarts. Nothing blocks longer than Memory does.

#include <algorithm>
#include <array>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/sdo/server.hpp"

namespace cbcan {

/// 1F51h.
enum class ProgramCommand : std::uint8_t { kStop, kStart, kReset, kClear };

/// 1F57h, bits 7..1: kFormat = no program for this device, or no right signature; kAddress = no more room.
enum class ProgramStatus : std::uint8_t { kGood, kNoProgram, kFormat, kCrc, kNotCleared, kWrite, kAddress };

/// 1F51h, 1F56h, 1F57h.
constexpr bool is_program_number(std::uint16_t index) {
  return index == object::kProgramControl || index == object::kProgramIdentification ||
         index == object::kFlashStatus;
}

/// CRC-32 (IEEE 802.3) of the bytes so far, whose CRC is `crc`, and these.
constexpr std::uint32_t crc32(std::uint32_t crc, std::span<const std::uint8_t> bytes) {
  crc = ~crc;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      crc = crc >> 1 ^ (0xEDB88320 & (0 - (crc & 1)));
  }
  return ~crc;
}

/// `Memory`, the place of one program, has
///   kUnit, kPages, kBytes    bytes that are written at once (4..32), pages to erase, bytes of a program
///   bool erase(std::size_t page)  from page 0 on, which first makes the program unstartable
///   bool write(std::size_t offset, std::span<const std::uint8_t> unit)  once for each unit after an erase
///   ProgramStatus seal(std::size_t size, std::uint32_t crc)  if that many bytes have this CRC in the flash,
///                            and are for this device, makes them startable; its last write decides
///   std::uint32_t crc()      of the program that is startable here; 0 = none
///   void control(ProgramCommand)  stops, starts or resets, 100 ms after the response
template <class Memory>
class ProgramDownload final : public DownloadStream {
 public:
  /// `runs`: see runs().
  ProgramDownload(Memory& memory, bool runs) : memory_(&memory), runs_(runs), crc_(memory.crc()) {}

  /// This is the program, not its boot loader.
  bool runs() const { return runs_; }
  /// `out`: of the object's size.
  AbortCode on_read(std::uint16_t index, std::span<std::uint8_t> out) const {
    store_little_endian(out, number(index));
    return AbortCode::kNone;
  }
  /// A write of 1F51h.
  AbortCode on_write(std::uint8_t value, Time now) {
    const auto command = static_cast<ProgramCommand>(value);
    if (command > ProgramCommand::kClear) return AbortCode::kValue;
    if (command == ProgramCommand::kClear) {
      if (runs_) return AbortCode::kDeviceState;
      phase_ = Phase::kClearing;
      status_ = ProgramStatus::kGood;
      page_ = size_ = crc_ = 0;
    }
    if (!runs_ && command == ProgramCommand::kStart)
      if (const AbortCode refused = finish(); refused != AbortCode::kNone) return refused;
    command_ = command;  // the last one counts, and acts after the response
    command_at_ = runs_ == (command == ProgramCommand::kStart) ? kNever : now + 100 * kMillisecond;
    return AbortCode::kNone;
  }

  AbortCode on_piece(const Piece& piece, Time /*now*/) override {
    if (phase_ == Phase::kClearing) return AbortCode::kLater;
    if (status_ != ProgramStatus::kGood) return AbortCode::kDeviceState;  // 1F57h keeps the first reason
    if (phase_ != Phase::kCleared) return end(ProgramStatus::kNotCleared, AbortCode::kDeviceState);
    if (size_ + piece.bytes.size() > Memory::kBytes)
      return end(ProgramStatus::kAddress, AbortCode::kParameterLength);
    for (const std::uint8_t byte : piece.bytes) {
      unit_[size_++ % Memory::kUnit] = byte;
      if (size_ % Memory::kUnit == 0 && !memory_->write(size_ - Memory::kUnit, unit_))
        return end(ProgramStatus::kWrite, AbortCode::kHardware);
    }
    crc_ = crc32(crc_, piece.bytes);
    return AbortCode::kNone;
  }
  /// Bytes of a piece may be missing: only a clear begins again.
  void on_aborted() override {
    if (phase_ == Phase::kCleared) end(ProgramStatus::kCrc, AbortCode::kNone);
  }

  /// Returns the time of the next call.
  Time poll(Time now) {
    if (phase_ == Phase::kClearing) {
      if (!memory_->erase(page_))
        end(ProgramStatus::kWrite, AbortCode::kHardware);
      else if (++page_ == Memory::kPages)
        phase_ = Phase::kCleared;
      return now;
    }
    if (now < command_at_) return command_at_;
    command_at_ = kNever;
    memory_->control(command_);
    return kNever;
  }

 private:
  enum class Phase : std::uint8_t { kEnded, kClearing, kCleared };

  std::uint32_t number(std::uint16_t index) const {
    if (index == object::kProgramControl) return runs_;
    if (index == object::kProgramIdentification) return crc_;
    const bool none = status_ == ProgramStatus::kGood && crc_ == 0;
    const ProgramStatus status = none ? ProgramStatus::kNoProgram : status_;
    return static_cast<std::uint32_t>(status) << 1 | (phase_ == Phase::kClearing);
  }

  AbortCode end(ProgramStatus why, AbortCode code) {
    status_ = why;
    phase_ = Phase::kEnded;
    return code;
  }

  /// What was received becomes startable, unless it is already; without a clear, what was there has to be.
  AbortCode finish() {
    if (phase_ != Phase::kCleared || size_ == 0) {
      if (status_ == ProgramStatus::kGood && crc_ != 0) return AbortCode::kNone;
      return memory_->crc() != 0 ? AbortCode::kNone : AbortCode::kDeviceState;
    }
    const std::size_t rest = size_ % Memory::kUnit;
    std::ranges::fill(std::span(unit_).subspan(rest), std::uint8_t{0xFF});
    if (rest != 0 && !memory_->write(size_ - rest, unit_))
      return end(ProgramStatus::kWrite, AbortCode::kHardware);
    const ProgramStatus sealed = memory_->seal(size_, crc_);
    return end(sealed, sealed == ProgramStatus::kGood ? AbortCode::kNone : AbortCode::kHardware);
  }

  Memory* memory_;
  bool runs_;
  Phase phase_ = Phase::kEnded;
  ProgramStatus status_ = ProgramStatus::kGood;
  ProgramCommand command_ = ProgramCommand::kStop;
  Time command_at_ = kNever;
  std::size_t page_ = 0;  ///< to be erased next
  std::size_t size_ = 0;  ///< bytes received
  std::uint32_t crc_;
  std::array<std::uint8_t, Memory::kUnit> unit_{};
};

}  // namespace cbcan
