// SPDX-License-Identifier: MIT
#pragma once

/// What runs on a simulated node whose file has 1F50h (CiA 302-3): its program, or the boot loader if there
/// is none or it was stopped. Without power the program is kept; its bytes are not, as nothing reads them.

#include <optional>
#include <utility>

#include "cbcan/canopen/program_download.hpp"

namespace cbcan::sim {

struct Program {
  static constexpr Time kErase = 5 * kMillisecond;  ///< of a page
  struct Memory {
    static constexpr std::size_t kUnit = 8, kPages = 64, kBytes = 0x100000;
    bool erase(std::size_t) { return startable = 0, true; }
    static bool write(std::size_t, std::span<const std::uint8_t>) { return true; }
    ProgramStatus seal(std::size_t, std::uint32_t crc) { return startable = crc, ProgramStatus::kGood; }
    std::uint32_t crc() const { return startable; }
    void control(ProgramCommand given) { command = given; }

    std::uint32_t startable;
    std::optional<ProgramCommand> command{};
  };

  /// `crc`: 1F56h of the program that the node has at first.
  explicit Program(std::uint32_t crc) : memory{crc} {}

  bool runs() const { return download.runs(); }
  /// Power on, or a reset: the program, if it is whole and not `stopped`.
  void restart(bool stopped = false) {
    download = ProgramDownload(memory, !stopped && memory.startable != 0);
    due = kNever;
  }
  /// True: the node has to reset itself.
  bool poll(Time now) {
    const Time next = download.poll(now);
    due = next == now ? now + kErase : next;
    const auto command = std::exchange(memory.command, std::nullopt);
    if (command) restart(*command == ProgramCommand::kStop);
    return command.has_value();
  }

  Memory memory;
  ProgramDownload<Memory> download{memory, true};
  Time due = kNever;  ///< when poll() is to be called; after a write at once
};

}  // namespace cbcan::sim
