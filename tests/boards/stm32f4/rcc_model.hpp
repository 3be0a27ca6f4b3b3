// SPDX-License-Identifier: MIT
#pragma once

/// A model of the STM32F446's clocks, from RM0390, chapter 6 (RCC) and 3.4 (wait states): HSI, HSE, one PLL,
/// the switch, prescalers, the clock security system, CAN1's reset. Its numbers are taken from the manual
/// independently. What the manual forbids throws. Other registers are words in memory.

#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

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
      case kCir:
        if ((value & 1u << 23) != 0) words_[kCir] &= ~(1u << 7);  // CSSC, CSSF
        return;
      case kApb1rstr: on_can1_reset((value & 1u << 25) != 0); break;
    }
    words_[offset] = value;
  }

  /// CSSF: cannot be masked.
  bool nmi_line() const { return is(kCir, 1u << 7); }

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
      words_[kCfgr] &= ~15u;
    }
    words_[kCir] |= 1u << 7;
  }
  /// The core runs on the PLL, and the PLL on HSE with the intended settings.
  bool on_hse() const { return on_pll() && hse_comes_; }
  bool pll_works = true, switch_works = true;
  std::function<std::uint32_t()> wait_states = [] { return 5u; };
  std::function<void(bool)> on_can1_reset = [](bool) {};

  // ---- Frequencies, in Hz.

  std::uint32_t core() const { return on_pll() ? pll() : 16'000'000; }
  std::uint32_t apb1() const { return core() / divisor(10); }
  std::uint32_t apb2() const { return core() / divisor(13); }
  /// TIM2..TIM7.
  std::uint32_t timers() const { return divisor(10) == 1 ? apb1() : 2 * apb1(); }

  std::vector<Write> writes;
  std::uint32_t& word(std::uint32_t offset) { return words_[offset]; }

 private:
  static constexpr std::uint32_t kCr = 0x00, kPllcfgr = 0x04, kCfgr = 0x08, kCir = 0x0C, kApb1rstr = 0x20;

  bool is(std::uint32_t offset, std::uint32_t bit) const { return (words_.at(offset) & bit) != 0; }
  bool on_pll() const { return (words_.at(kCfgr) >> 2 & 3) == 2; }
  std::uint32_t pll() const {
    const std::uint32_t value = words_.at(kPllcfgr);
    const std::uint32_t source = (value & 1u << 22) != 0 ? 8'000'000 : 16'000'000;
    return source / (value & 63) * (value >> 6 & 511) / (2 * (value >> 16 & 3) + 2);
  }
  std::uint32_t divisor(unsigned at) const {
    const std::uint32_t code = words_.at(kCfgr) >> at & 7;
    return code < 4 ? 1 : 2u << (code - 4);
  }

  /// Oscillator and PLL need some reads of CR each.
  void step() {
    if (++reads_ % 3 != 0) return;
    std::uint32_t& cr = words_[kCr];
    const bool pll_has_clock = (cr & 1u << 17) != 0 || (words_[kPllcfgr] & 1u << 22) == 0;
    if ((cr & 3u << 24) == 1u << 24 && pll_works && pll_has_clock) cr |= 1u << 25;
    if ((cr & 3u << 16) == 1u << 16 && hse_comes_ && !hse_failed_) cr |= 1u << 17;
  }

  void write_cr(std::uint32_t value) {
    const std::uint32_t before = words_[kCr];
    if (((before ^ value) & 1u << 18) != 0 && (before & 1u << 16) != 0)
      throw std::logic_error("HSEBYP while HSEON");
    const std::uint32_t used = is(kPllcfgr, 1u << 22) ? 1u << 24 | 1u << 16 : 1u << 24;
    if (on_pll() && (value & used) != used) throw std::logic_error("the clock in use is switched off");
    std::uint32_t ready = before & (1u << 1 | 1u << 17 | 1u << 25);
    if ((value & 1u << 16) == 0) {
      ready &= ~(1u << 17);
      hse_failed_ = false;
    }
    if ((value & ~before & 1u << 19) != 0) watched_ = true;
    if ((value & 1u << 24) == 0) ready &= ~(1u << 25);
    words_[kCr] = (value & ~(1u << 1 | 1u << 17 | 1u << 25)) | ready;
  }

  void write_cfgr(std::uint32_t value) {
    words_[kCfgr] = (value & ~12u) | (words_[kCfgr] & 12u);
    switch_reads_ = 0;
    check_speeds();
  }

  /// Some reads of CFGR after SW.
  void follow_switch() {
    std::uint32_t& cfgr = words_[kCfgr];
    if (!switch_works || ++switch_reads_ < 3 || ((cfgr & 3) == 2 && !is(kCr, 1u << 25))) return;
    cfgr = (cfgr & ~12u) | (cfgr & 3) << 2;
    check_speeds();
  }

  void check_speeds() const {
    if (core() > 30'000'000 && wait_states() < 5) throw std::logic_error("too few wait states");
    if (apb1() > 45'000'000 || apb2() > 90'000'000) throw std::logic_error("a bus is too fast");
  }

  std::map<std::uint32_t, std::uint32_t> words_{
      {kCr, 0x83}, {kPllcfgr, 0x24003010}, {kCfgr, 0}, {kCir, 0}};  // reset values, 6.3
  bool hse_comes_ = false;
  bool hse_failed_ = false;  ///< off until HSEON has been 0
  bool watched_ = false;     ///< by the clock security system, from CSSON's edge on
  unsigned reads_ = 0, switch_reads_ = 0;
};

}  // namespace cbcan::test
