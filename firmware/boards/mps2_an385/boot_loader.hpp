// SPDX-License-Identifier: MIT
#pragma once

/// A boot loader (program_areas.hpp): starts the program, or is a node whose program can be downloaded.
/// boot_loader.cpp is its image.

#include <optional>

#include "boards/mps2_an385/board.hpp"
#include "boards/mps2_an385/program_flash.hpp"
#include "cbcan/canopen/slave.hpp"
#include "cbcan/copy_bytes.hpp"
#include "updatable.hpp"

namespace cbcan::boards::mps2 {

/// `Flash`: a ProgramFlash. A Slave alone, which is half the size of an EdsDevice.
template <class Flash>
class BootLoader final : private Application {
 public:
  explicit BootLoader(Board& board) : board_(board) {}

  /// `node_id`: that of the program, too.
  [[noreturn]] void run(std::uint8_t node_id) {
    const bool stays = kBootRequest.read(0) == kStay;
    kBootRequest.write(0, 0);
    if (!stays && areas_.boot()) start_program(Flash::kRunsAt);
    board_.start();
    slave_.sdo_server().set_stream(download_.emplace(areas_, false));
    slave_.set_node_id(node_id);
    slave_.start(board_.now());
    for (;;) {
      const Time now = board_.now();
      for (Frame frame; board_.receive(0, frame);)
        slave_.on_frame(frame, now);
      const Time due = slave_.poll(now);
      board_.sleep_until(earlier(due, download_->poll(now)));
    }
  }

 private:
  using Areas = ProgramAreas<Flash, true>;

  AbortCode on_read(const ObjectEntry& entry, std::uint8_t /*sub*/, std::span<std::uint8_t> out,
                    std::size_t& size, Time /*now*/) override {
    if (!is_program_number(entry.index)) return AbortCode::kNone;  // it is in `out`
    size = entry.capacity;
    return download_->on_read(entry.index, out.first(size));
  }
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t /*sub*/, std::span<const std::uint8_t> value,
                     Time now) override {
    return entry.index == object::kProgramControl ? download_->on_write(value[0], now) : AbortCode::kNone;
  }
  void on_stored(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/, Time now) override {
    slave_.configure(now);
  }
  void restore(std::uint16_t /*first_index*/, std::uint16_t /*last_index*/, Time /*now*/) override {
    copy_bytes(updatable::kDictionary.power_on.data(), values_.data(),
               updatable::kDictionary.power_on.size());
  }

  Board& board_;
  Flash flash_;
  Areas areas_{flash_, {.board = "mps2_an385", .control = control}};
  std::optional<ProgramDownload<Areas>> download_;  ///< if no program is started: it reads that of area 0
  std::array<std::uint8_t, updatable::kDictionary.value_bytes> values_;
  std::array<std::uint8_t, updatable::kDictionary.largest_value> buffer_;
  Slave slave_{0, {updatable::kDictionary.entries, values_, {}, {}}, buffer_, *this, board_.can()};
};

}  // namespace cbcan::boards::mps2
