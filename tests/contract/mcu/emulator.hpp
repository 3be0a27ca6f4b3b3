// SPDX-License-Identifier: MIT
#pragma once

#include <linux/sockios.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <filesystem>

#include "contract/remote/child.hpp"
#include "io/temporary_folder.hpp"

namespace cbcan::contract {

inline constexpr std::chrono::minutes kPatience{1};

// Registers of the board: Application Note AN385, and the Cortex-M System Design Kit.
inline constexpr std::uint32_t kCounter = 0x40028018;
inline constexpr std::uint32_t kPrescale = 0x4002801C;
inline constexpr std::uint32_t kNearlyNever = 0x7FFFFFFE;
inline constexpr std::uint32_t kWakeUpControl = 0x40002008;  ///< not 0 while the image sleeps
inline constexpr std::uint32_t kWakeUpLoad = 0x40002000;     ///< the requested time then
inline constexpr std::uint32_t kTicksPerMicrosecond = 25;

// Armv7-M: the application interrupt and reset control register; its key and SYSRESETREQ.
inline constexpr std::uint32_t kAircr = 0xE000ED0C;
inline constexpr std::uint32_t kResetSystem = 0x05FA0004;

/// A serial line, or another stream, of an emulator in its own process.
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

  /// The address for the emulator to connect to, in QEMU's format.
  std::string address() const { return "unix:" + path_.string(); }
  void accept() {
    wait_readable(listener_.get(), "QEMU");
    socket_ = io::Descriptor(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  }

  void send(const std::string& bytes) {
    if (::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(bytes.size()))
      throw std::runtime_error("QEMU has closed " + path_.filename().string());
  }
  /// Throws std::runtime_error if they do not arrive within a minute.
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
  /// What has arrived so far.
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

/// The image for the MPS2 board in QEMU, with a clock controlled by the suite: the board's microsecond counter is
/// stopped and set from outside, as by a debugger. The program is unchanged.
struct Emulator {
  explicit Emulator(const std::string& image)
      : modbus_(folder_.file("modbus")),
        can_(folder_.file("can")),
        hardware_(folder_.file("hardware")),
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

  /// The board as after power-on, except that its RAM is not cleared.
  void reset() {
    do
      settle();
    while (!can_.receive_available().empty());
    adapter_state_ = "F00\r";
    write(kAircr, kResetSystem);
  }
  /// The state that the adapter reports: an F line with its CR.
  void set_adapter_state(std::string line) { adapter_state_ = std::move(line); }
  /// Stops the clock; call it when the image is running.
  void freeze() {
    write(kPrescale, kNearlyNever);
    write(kWakeUpControl, 0);
    settle();
  }
  /// Returns when the image has handled everything that was sent to it, and its output has arrived.
  // A turn of the image's loop that had already begun may end first; the second turn began later.
  void settle() {
    can_.wait_taken();
    modbus_.wait_taken();
    turn();
    due_ = turn();
  }
  /// Lets `us` microseconds pass: the image wakes at each time that it has requested, and at the end.
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
  /// Wakes the image with the adapter's state, and returns when it sleeps: the microseconds until it must wake. Its
  /// timer runs independently of the stopped clock, and is stopped too.
  std::uint64_t turn() {
    can_.send(adapter_state_);
    can_.wait_taken();
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (read(kWakeUpControl) == 0)
      if (std::chrono::steady_clock::now() > end) throw std::runtime_error("the image hangs");
    write(kWakeUpControl, 0);
    return read(kWakeUpLoad) / kTicksPerMicrosecond;
  }

  io::test::TemporaryFolder folder_;
  Stream modbus_;
  Stream can_;
  Stream hardware_;  ///< QEMU's protocol "qtest": its memory-mapped registers from outside
  Child qemu_;
  std::string adapter_state_ = "F00\r";
  std::uint64_t due_ = 0;  ///< microseconds until the image must wake
};

}  // namespace cbcan::contract
