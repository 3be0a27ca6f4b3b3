// SPDX-License-Identifier: MIT
#pragma once

#include <linux/sockios.h>
#include <sched.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contract/remote/child.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::contract {

inline constexpr std::chrono::minutes kPatience{1};

// Registers of the board: Application Note AN385, and the Cortex-M System Design Kit.
inline constexpr std::uint32_t kCounter = 0x40028018;
inline constexpr std::uint32_t kPrescale = 0x4002801C;
inline constexpr std::uint32_t kNearlyNever = 0x7FFFFFFE;
inline constexpr std::uint32_t kWakeUpControl = 0x40002008;  ///< not 0 when the image has gone to sleep
inline constexpr std::uint32_t kWakeUpLoad = 0x40002000;     ///< what it has asked for then
inline constexpr std::uint32_t kTicksPerMicrosecond = 25;

// Armv7-M: the application interrupt and reset control register; its key and SYSRESETREQ.
inline constexpr std::uint32_t kAircr = 0xE000ED0C;
inline constexpr std::uint32_t kResetSystem = 0x05FA0004;

/// A serial line, or another stream, of an emulator that runs in a process of its own.
struct Stream {
  explicit Stream(std::filesystem::path path)
      : path_(std::move(path)), listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string name = path_.string();
    if (name.size() >= sizeof address.sun_path) throw std::runtime_error(name + ": too long for a socket");
    std::copy(name.begin(), name.end(), address.sun_path);
    if (bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        listen(listener_.get(), 1) != 0)
      throw std::runtime_error(name + ": no socket");
  }

  /// Where the emulator is to connect to, as QEMU writes it.
  std::string address() const { return "unix:" + path_.string(); }
  void accept() {
    wait_readable(listener_.get(), "QEMU");
    socket_ = io::Descriptor(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  }

  void send(const std::string& bytes) {
    if (::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(bytes.size()))
      throw std::runtime_error("QEMU has closed " + path_.filename().string());
  }
  /// Throws std::runtime_error when they do not come within a minute.
  std::string receive(std::size_t count) {
    std::string bytes(count, '\0');
    for (std::size_t got = 0; got < count;) {
      wait_readable(socket_.get(), "QEMU's " + path_.filename().string());
      const ssize_t part = recv(socket_.get(), bytes.data() + got, count - got, 0);
      if (part <= 0) throw std::runtime_error("QEMU has closed " + path_.filename().string());
      got += static_cast<std::size_t>(part);
    }
    return bytes;
  }
  /// What has come so far.
  std::string receive_available() {
    std::array<char, 4096> part;
    const ssize_t count = recv(socket_.get(), part.data(), part.size(), MSG_DONTWAIT);
    return count > 0 ? std::string(part.data(), static_cast<std::size_t>(count)) : std::string();
  }
  /// Returns when the emulated hardware has taken the last byte that was sent.
  void wait_taken() const {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    for (int waiting = 1; waiting != 0; sched_yield()) {
      if (ioctl(socket_.get(), SIOCOUTQ, &waiting) != 0 || std::chrono::steady_clock::now() > end)
        throw std::runtime_error("QEMU does not read its " + path_.filename().string());
    }
  }

 private:
  std::filesystem::path path_;
  io::Descriptor listener_;
  io::Descriptor socket_;
};

/// A folder that goes with this object.
struct TemporaryFolder {
  TemporaryFolder() {
    std::string name = std::filesystem::temp_directory_path() / "cbcan-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": no folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
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
  explicit Emulator(const std::string& image)
      : modbus_(folder_.path() / "modbus"),
        can_(folder_.path() / "can"),
        hardware_(folder_.path() / "hardware"),
        qemu_({"/usr/bin/qemu-system-arm",
               "-M",
               "mps2-an385",
               "-accel",
               "tcg",
               "-kernel",
               image,
               "-display",
               "none",
               "-monitor",
               "none",
               "-semihosting-config",
               "enable=on,target=native",
               "-serial",
               modbus_.address(),
               "-serial",
               can_.address(),
               "-qtest",
               hardware_.address(),
               "-qtest-log",
               "/dev/null"}) {
    modbus_.accept();
    can_.accept();
    hardware_.accept();
  }

  Stream& modbus() { return modbus_; }
  Stream& can() { return can_; }

  /// The board as after power-on, but for what is left in its RAM.
  void reset() {
    do
      settle();
    while (!can_.receive_available().empty());
    adapter_state_ = "F00\r";
    write(kAircr, kResetSystem);
  }
  /// What the adapter says of its state, all the time: an F line with its CR.
  void set_adapter_state(std::string line) { adapter_state_ = std::move(line); }
  /// Stops the clock; to be called once the image runs.
  void freeze() {
    write(kPrescale, kNearlyNever);
    write(kWakeUpControl, 0);
    settle();
  }
  /// Returns when everything that was sent to the image has been dealt with, and what it sent then is there.
  // A turn of the image's loop that had begun before may end first: the second one began later.
  void settle() {
    can_.wait_taken();
    modbus_.wait_taken();
    turn();
    due_ = turn();
  }
  /// Lets `us` microseconds pass: the image wakes at each time that it has asked for, and at the end.
  void pass(std::uint64_t us) {
    settle();
    std::uint32_t counter = read(kCounter);
    while (us > 0) {
      const std::uint64_t step = std::clamp<std::uint64_t>(due_, 1, us);
      counter += static_cast<std::uint32_t>(step);
      write(kCounter, counter);
      us -= step;
      due_ = turn();
    }
  }

 private:
  std::uint32_t read(std::uint32_t address) {
    hardware_.send("readl " + std::to_string(address) + "\n");
    const std::string response = hardware_.receive(std::string("OK 0x0123456789ABCDEF\n").size());
    return static_cast<std::uint32_t>(std::stoull(response.substr(3), nullptr, 16));
  }
  void write(std::uint32_t address, std::uint32_t value) {
    hardware_.send("writel " + std::to_string(address) + " " + std::to_string(value) + "\n");
    hardware_.receive(std::string("OK\n").size());
  }
  /// Wakes the image by the adapter's state, and returns when it has gone to sleep: in how many microseconds
  /// it wants to wake. Its timer does not know that the clock stands still, and is stopped.
  std::uint64_t turn() {
    can_.send(adapter_state_);
    can_.wait_taken();
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (read(kWakeUpControl) == 0)
      if (std::chrono::steady_clock::now() > end) throw std::runtime_error("the image hangs");
    write(kWakeUpControl, 0);
    return read(kWakeUpLoad) / kTicksPerMicrosecond;
  }

  TemporaryFolder folder_;
  Stream modbus_;
  Stream can_;
  Stream hardware_;  ///< QEMU's protocol "qtest": its memory-mapped registers from outside
  Child qemu_;
  std::string adapter_state_ = "F00\r";
  std::uint64_t due_ = 0;  ///< in how many microseconds the image wants to wake
};

}  // namespace cbcan::contract
