// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "contract/remote/child.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::contract {

/// A serial line, or another stream, of an emulator that runs in a process of its own.
struct Stream {
  explicit Stream(std::filesystem::path path);

  /// Where the emulator is to connect to, as QEMU writes it.
  std::string address() const { return "unix:" + path_.string(); }
  void accept();

  void send(const std::string& bytes);
  /// Throws std::runtime_error when they do not come within a minute.
  std::string receive(std::size_t count);
  /// What has come so far.
  std::string receive_available();
  /// Returns when the emulated hardware has taken the last byte that was sent.
  void wait_taken() const;

 private:
  std::filesystem::path path_;
  io::Descriptor listener_;
  io::Descriptor socket_;
};

/// A folder that goes with this object.
struct TemporaryFolder {
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The image for the MPS2 board in QEMU, with its clock in the suite's hands: the board's microsecond counter
/// is told to stand still and is set from outside, as a debugger would do it. The program is the unchanged
/// one.
struct Emulator {
  explicit Emulator(const std::string& image);

  Stream& modbus() { return modbus_; }
  Stream& can() { return can_; }

  /// What the adapter says of its state, all the time: an F line with its CR.
  void set_adapter_state(std::string line) { adapter_state_ = std::move(line); }
  /// Stops the clock; to be called once the image runs.
  void freeze();
  /// Returns when everything that was sent to the image has been dealt with, and what it sent then is there.
  void settle();
  /// Lets `us` microseconds pass: the image wakes at each time that it has asked for, and at the end.
  void pass(std::uint64_t us);

 private:
  std::uint32_t read(std::uint32_t address);
  void write(std::uint32_t address, std::uint32_t value);
  std::uint64_t turn();

  TemporaryFolder folder_;
  Stream modbus_;
  Stream can_;
  Stream hardware_;  ///< QEMU's protocol "qtest": its memory-mapped registers from outside
  Child qemu_;
  std::string adapter_state_ = "F00\r";
  std::uint64_t due_ = 0;  ///< in how many microseconds the image wants to wake
};

}  // namespace cbcan::contract
