// SPDX-License-Identifier: MIT
#pragma once

/// A model of the clocks of the STM32F446 (RM0390, chapters 6 and 3.4) and G474 (RM0440, chapters 7 and 3.3):
/// HSI, HSE, one PLL, the switch, prescalers, wait states, the clock security system, the reset of the CAN
/// controller. Its numbers are those of chip_numbers.hpp. What the manual forbids throws. Other registers are
/// words in memory.

#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "chip_numbers.hpp"

namespace cbcan::test {

struct RccModel {
  using Write = std::pair<std::uint32_t, std::uint32_t>;  // offset, value

  // ---- The processor's side.

  std::uint32_t read(std::uint32_t offset) {
    if (offset == kCr) step();
    if (offset == kCfgr) follow_switch();
    return words_[offset];
  }

  void write(std::uint32_t offset, std::uint32_t value) {
    writes.emplace_back(offset, value);
    switch (offset) {
      case kCr: return write_cr(value);
      case kPllcfgr:
        if (is(kCr, 1u << 24)) throw std::logic_error("PLLCFGR while PLLON");
        break;
      case kCfgr: return write_cfgr(value);
      case numbers::kCssClear:
        if ((value & numbers::kCssc) != 0) words_[numbers::kCssFlags] &= ~numbers::kCssf;
        return;
      case numbers::kApb1rstr: on_can_reset((value & 1u << 25) != 0); break;
    }
    words_[offset] = value;
  }

  /// CSSF: cannot be masked.
  bool nmi_line() const { return is(numbers::kCssFlags, numbers::kCssf); }

  // ---- Outside.

  void set_hse(bool comes) {
    hse_comes_ = comes;
    if (comes || !is(kCr, 1u << 17)) return;
    if (!watched_) throw std::logic_error("HSE has failed without a clock security system");
    watched_ = false;
    hse_failed_ = true;
    words_[kCr] &= ~(1u << 17);
    if (on_pll()) {
      words_[kCr] &= ~(3u << 24);
      words_[kCfgr] = (words_[kCfgr] & ~15u) | numbers::kHsi * 5;
    }
    words_[numbers::kCssFlags] |= numbers::kCssf;
  }
  /// The core runs on the PLL, and the PLL on HSE with the intended settings.
  bool on_hse() const { return on_pll() && hse_comes_; }
  bool pll_works = true, switch_works = true;
  std::function<std::uint32_t()> wait_states = [] { return numbers::kWaitStates; };
  std::function<void(bool)> on_can_reset = [](bool) {};

  // ---- Frequencies, in Hz.

  std::uint32_t core() const { return on_pll() ? numbers::pll(words_.at(kPllcfgr)) : 16'000'000; }
  std::uint32_t apb1() const { return core() / divisor(numbers::kPpre1); }
  std::uint32_t apb2() const { return core() / divisor(numbers::kPpre2); }
  /// TIM2..TIM7.
  std::uint32_t timers() const { return divisor(numbers::kPpre1) == 1 ? apb1() : 2 * apb1(); }

  std::vector<Write> writes;
  std::uint32_t& word(std::uint32_t offset) { return words_[offset]; }

 private:
  static constexpr std::uint32_t kCr = 0x00, kPllcfgr = numbers::kPllcfgr, kCfgr = 0x08;

  bool is(std::uint32_t offset, std::uint32_t bit) const { return (words_.at(offset) & bit) != 0; }
  bool on_pll() const { return (words_.at(kCfgr) >> 2 & 3) == numbers::kPll; }
  std::uint32_t divisor(unsigned at) const {
    const std::uint32_t code = words_.at(kCfgr) >> at & 7;
    return code < 4 ? 1 : 2u << (code - 4);
  }

  /// Oscillator and PLL need some reads of CR each.
  void step() {
    if (++reads_ % 3 != 0) return;
    std::uint32_t& cr = words_[kCr];
    const bool pll_has_clock = (cr & 1u << 17) != 0 || !numbers::pll_has_hse(words_[kPllcfgr]);
    if ((cr & 3u << 24) == 1u << 24 && pll_works && pll_has_clock) cr |= 1u << 25;
    if ((cr & 3u << 16) != 1u << 16 || !hse_comes_ || hse_failed_) return;
    cr |= 1u << 17;
    watched_ = watched_ || (!numbers::kCssonFalls && (cr & 1u << 19) != 0);
  }

  void write_cr(std::uint32_t value) {
    const std::uint32_t before = words_[kCr];
    if (((before ^ value) & 1u << 18) != 0 && (before & 1u << 16) != 0)
      throw std::logic_error("HSEBYP while HSEON");
    const std::uint32_t used = numbers::pll_has_hse(words_[kPllcfgr]) ? 1u << 24 | 1u << 16 : 1u << 24;
    if (on_pll() && (value & used) != used) throw std::logic_error("the clock in use is switched off");
    std::uint32_t ready = before & (numbers::kHsiReady | 1u << 17 | 1u << 25);
    if ((value & 1u << 16) == 0) {
      ready &= ~(1u << 17);
      hse_failed_ = false;
    }
    if ((value & ~before & 1u << 19) != 0) watched_ = true;
    if ((value & 1u << 24) == 0) ready &= ~(1u << 25);
    if (!numbers::kCssonFalls) value |= before & 1u << 19;
    words_[kCr] = (value & ~(numbers::kHsiReady | 1u << 17 | 1u << 25)) | ready;
  }

  void write_cfgr(std::uint32_t value) {
    if ((value & 3) < numbers::kHsi) throw std::logic_error("SW: reserved");
    words_[kCfgr] = (value & ~12u) | (words_[kCfgr] & 12u);
    switch_reads_ = 0;
    check_speeds();
  }

  /// Some reads of CFGR after SW.
  void follow_switch() {
    std::uint32_t& cfgr = words_[kCfgr];
    if (!switch_works || ++switch_reads_ < 3 || ((cfgr & 3) == numbers::kPll && !is(kCr, 1u << 25))) return;
    cfgr = (cfgr & ~12u) | (cfgr & 3) << 2;
    check_speeds();
  }

  void check_speeds() const {
    if (core() > 30'000'000 && wait_states() < numbers::kWaitStates)
      throw std::logic_error("too few wait states");
    if (apb1() > numbers::kMostApb1 || apb2() > numbers::kMostApb2)
      throw std::logic_error("a bus is too fast");
  }

  // Reset values.
  std::map<std::uint32_t, std::uint32_t> words_{{kCr, numbers::kCrReset},
                                                {kPllcfgr, numbers::kPllcfgrReset},
                                                {kCfgr, numbers::kHsi * 5},
                                                {numbers::kCssFlags, 0}};
  bool hse_comes_ = false;
  bool hse_failed_ = false;  ///< off until HSEON has been 0
  bool watched_ = false;     ///< by the clock security system, from CSSON's edge on
  unsigned reads_ = 0, switch_reads_ = 0;
};

}  // namespace cbcan::test
