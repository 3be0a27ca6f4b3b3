// SPDX-License-Identifier: MIT
// The board's boot loader, whose power fails once there is a program: at the first write of the download,
// after the next start at a later one, and so on, until the download is whole; then in the same way at the
// writes that copy the program before, and at those that install the new one. In turn before, in the middle
// of, and after the write. The emulator's command line is the distance between those writes; of the download,
// which takes long, it is ten times that. Prints the number of each.
#include "boards/common/semihosting.hpp"
#include "boards/mps2_an385/boot_loader.hpp"

namespace {

using namespace cbcan::boards;

/// 0 = no cuts yet; otherwise the number of the write after a start that is cut, from 1. In memory that a
/// reset does not change, and that is 0 in a new emulator.
constexpr Mmio kCut{0x203FFFF0};
constexpr Mmio kInstalls{0x203FFFF4};  ///< 1 after the download

struct CutFlash : mps2::ProgramFlash {
  CutFlash() {
    if (kCut.read(0) == 0 && area(0)[kHeaderAt] != 0) kCut.write(0, 1);
  }

  bool erase(std::size_t number, std::size_t page) {
    return cut([&](bool half) {
      mps2::ProgramFlash::erase(number, page);
      if (half) area(number)[page * kPage + kPage / 2] = 0;
      return true;
    });
  }
  bool write(std::size_t number, std::size_t offset, std::span<const std::uint8_t> unit) {
    const bool done = cut([&](bool half) {
      return mps2::ProgramFlash::write(number, offset, half ? unit.first(unit.size() / 2) : unit);
    });
    if (number != 0 && offset == ProgramAreas<CutFlash>::kBytes && kCut.read(0) != 0) {  // it is whole
      kCut.write(0, 1);
      kInstalls.write(0, 1);
      writes_ = 0;
    }
    return done;
  }

 private:
  bool cut(auto act) {
    const std::uint32_t cut = kCut.read(0);
    if (++writes_ != cut) return act(false);
    if (cut % 3 != 0) act(cut % 3 == 1);
    semihosting::write("cut ");
    semihosting::write_hex(cut);
    semihosting::write("\n");
    kCut.write(0, cut + (kInstalls.read(0) != 0 ? 1 : 10) * distance());
    system_reset();
  }

  static std::uint32_t distance() {
    char text[8] = {};
    semihosting::command_line(text);
    std::uint32_t number = 0;
    for (const char* digit = text; *digit >= '0' && *digit <= '9'; ++digit)
      number = 10 * number + static_cast<std::uint32_t>(*digit - '0');
    return number;
  }

  std::uint32_t writes_ = 0;
};

mps2::Board board(115'200, 500);
mps2::BootLoader<CutFlash> loader(board);

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<board>();

}  // namespace

[[noreturn]] void cbcan::boards::on_fault(const Fault& /*fault*/) {
  semihosting::exit(1);
}

int main() {
  loader.run(0x42);
}
