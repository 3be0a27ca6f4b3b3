// SPDX-License-Identifier: MIT
// A PLC that keeps to the handshake of the scanner window, between exchanges, restarts and losses that come
// at random: no old result is believed, nothing is executed twice, nothing is torn.

#include "core/scanner_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

/// What happens to a PLC and a module, one thing at a time.
struct Interleaving {
  explicit Interleaving(std::uint32_t seed) : random_(seed) {}

  void step() {
    const unsigned dice = pick(1000);
    if (dice < 300) {
      plc.scan();
    } else if (dice < 480) {
      module.write(regmap::kScannerOutFirst, plc.out);
    } else if (dice < 660) {
      module.read(regmap::kScannerInFirst, plc.in);
    } else if (dice < 820) {
      module.deliver_response();
    } else if (dice < 960) {
      module.pass(pick(3000));
      other_window();
    } else if (dice < 968) {
      module.lose_response();
    } else if (dice < 976) {
      module.pass(60'000);
    } else if (dice < 982) {
      plc.restart();
    } else if (dice < 986) {
      module.power_on();
    } else if (dice < 992) {  // STOP, or a gateway that has lost its PLC: outputs go to 0, and come back
      module.write(regmap::kScannerOutFirst, std::array<std::uint16_t, ScannerPlc::kOut>{});
    } else if (dice < 996) {
      plc.in.fill(0);
    } else {
      in_pieces();
    }
  }

  ScannedModule module{50};
  ScannerPlc plc{40};

 private:
  unsigned pick(unsigned below) { return static_cast<unsigned>(random_() % below); }

  /// What a master that splits blocks does, the number first or the rest.
  void in_pieces() {
    const std::span words(plc.out);
    const std::size_t cut = 1 + pick(ScannerPlc::kOut - 1);
    const bool number_first = pick(2) == 0;
    const auto write = [&](bool number) {
      number ? module.write(regmap::kScannerOutFirst, words.first(cut))
             : module.write(regmap::kScannerOutFirst + cut, words.subspan(cut));
    };
    write(number_first);
    plc.scan();
    write(!number_first);
  }
  /// Somebody else uses R3700 meanwhile, for an object that the PLC leaves alone.
  void other_window() {
    if (pick(4) != 0 || module.registers[regmap::kExecuteFlag] == regmap::kExecute) return;
    const auto id = static_cast<std::uint16_t>(++other_);
    module.write(regmap::kWindowFirst, std::array<std::uint16_t, 8>{regmap::kExecute, 5066, kScannedNode,
                                                                    0x3000, 0, 4, id, 0x00FF});
  }

  std::mt19937 random_;
  unsigned other_ = 0;
};

void check_interleavings(std::uint32_t seeds) {
  std::map<std::uint16_t, unsigned> results;
  std::size_t done = 0;
  for (std::uint32_t seed = 1; seed <= seeds; ++seed) {
    INFO("seed " << seed);
    Interleaving interleaving(seed);
    for (int i = 0; i < 2000; ++i)
      interleaving.step();
    interleaving.plc.check(interleaving.module.node);
    done += interleaving.plc.done.size();
    for (const auto& [result, times] : interleaving.plc.results)
      results[result] += times;
  }
  CHECK(done > 10'000);
  for (const std::uint16_t result : std::array<std::uint16_t, 4>{0, 4, 5, 6})
    CHECK(results[result] > 100);
}

}  // namespace

TEST_CASE("The scanner window: nothing is believed, executed twice or torn that should not be") {
  check_interleavings(300);
}

TEST_CASE("The scanner window, for long", "[.long]") {
  check_interleavings(30'000);
}
