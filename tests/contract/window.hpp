// SPDX-License-Identifier: MIT
#pragma once

/// A PLC program and the nodes of a bus, as short calls on a Target.
///
/// The name of every case quotes what it proves: a row of a table, its cells joined by " | ", or a sentence
/// of docs/reference/contract.md; rows.py compares the two.

#include <exception>

#include "contract/target.hpp"
#include "support/catch.hpp"
#include "support/hex.hpp"
#include "support/skips.hpp"

/// Skips a case that the target cannot run, and reports the target's reason.
#define CONTRACT_NEEDS(window, ability)                                        \
  do {                                                                         \
    if (const std::string reason = (window).lacks(ability); !reason.empty()) { \
      cbcan::test::skip_case(reason);                                          \
      return;                                                                  \
    }                                                                          \
  } while (false)

namespace cbcan::contract {

using test::hex_of;

// SDO abort codes.
inline constexpr std::uint32_t kNoObject = 0x06020000, kNoSubIndex = 0x06090011;

// Values of 3004h.
inline constexpr std::uint16_t kAuto = 0, kExpedited = 1, kSegmented = 2, kBlock = 3;

// OUT and IN of the scanner window.
inline constexpr unsigned kOut = 500;
inline constexpr unsigned kIn = 600;

/// A frame that must be sent, and the node's response; "" = none.
struct Step {
  const char* sent;
  const char* answered;
};

inline Words words_of(std::uint32_t value) {
  return {static_cast<std::uint16_t>(value), static_cast<std::uint16_t>(value >> 16)};
}

/// A coprocessor between a PLC and a bus that the case plays. Every sent frame must be expected, in order, and
/// none may be left at the end.
struct Window {
  static constexpr std::uint16_t kOwnNode = 127;
  static constexpr std::uint16_t kExecute = 0xCA0E;

  explicit Window(const Settings& settings = {}) : target_(make_target(settings)) {}
  ~Window() noexcept(false) {
    if (std::uncaught_exceptions() == 0) expect_silence();
  }

  Target& target() { return *target_; }
  std::string lacks(Ability ability) const { return target_->lacks(ability); }

  // The PLC.
  std::uint16_t reg(unsigned address) { return target_->read(address, 1).at(0); }
  Words image() { return target_->read(3700, 70); }
  Window& set(unsigned first, const Words& words) {
    target_->write(first, words);
    return *this;
  }
  /// R3701.. = words, with CA0Eh in the same request.
  Window& start(const Words& words) {
    Words request{kExecute};
    request.insert(request.end(), words.begin(), words.end());
    set(3700, request);
    return *this;
  }
  Window& read(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t room) {
    start({5055, node, index, sub, room});
    return *this;
  }
  Window& write(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t size,
                const Words& data) {
    Words words{5066, node, index, sub, size};
    words.insert(words.end(), data.begin(), data.end());
    start(words);
    return *this;
  }
  /// Writes a local object.
  void configure(std::uint16_t index, std::uint16_t sub, std::uint16_t size, const Words& data) {
    write(0, index, sub, size, data);
    check_done();
  }
  /// A number of four bytes.
  void put(unsigned index, std::uint16_t sub, std::uint32_t value) {
    configure(static_cast<std::uint16_t>(index), sub, 4, words_of(value));
  }
  /// An NMT service, which is done with this frame.
  void command(std::uint16_t node, std::uint16_t service, const std::string& frame) {
    write(0, 0x1F82, node, 1, {service}).expect(frame);
    check_done();
  }
  void set_mode(std::uint16_t mode) { configure(0x3004, 0, 1, {mode}); }
  bool busy() { return reg(3700) == kExecute; }
  void check_done() { CHECK(reg(3700) == 0); }
  /// R3700 = 4, and the abort code.
  void check_failed(std::uint32_t code) {
    CHECK(reg(3700) == 4);
    CHECK(abort_code() == code);
  }
  std::uint32_t abort_code() {
    const Words words = target_->read(3706, 2);
    return words[0] | static_cast<std::uint32_t>(words[1]) << 16;
  }
  /// All 70 registers are unchanged, except these.
  void check_changes(Words before, const std::map<unsigned, std::uint16_t>& changes) {
    for (const auto& [address, value] : changes)
      before.at(address - 3700) = value;
    CHECK(image() == before);
  }

  // The bus.
  template <class... More>
  void expect(const std::string& frame, const More&... more) {
    CHECK(target_->next_frame() == frame);
    if constexpr (sizeof...(more) != 0) expect(more...);
  }
  void expect_silence() {
    for (std::string left = target_->next_frame(); !left.empty(); left = target_->next_frame())
      FAIL_CHECK("left over: " << left);
  }
  template <class... Frames>
  Window& arrive(const Frames&... frames) {
    (target_->arrive(frames), ...);
    return *this;
  }
  Window& exchange(const std::vector<Step>& steps) {
    for (const Step& step : steps) {
      if (*step.sent != 0) expect(step.sent);
      if (*step.answered != 0) arrive(step.answered);
    }
    return *this;
  }

  // Time.
  Window& pass(Duration duration) {
    target_->pass(duration);
    return *this;
  }
  /// Until just before the end of `duration`; pass_rest() then is until just after it.
  Window& pass_nearly(Duration duration) {
    pass(duration - 4 * target_->precision());
    return *this;
  }
  Window& pass_rest() {
    pass(5 * target_->precision());
    return *this;
  }

 private:
  std::unique_ptr<Target> target_;
};

/// R3700..R3769 with a different value in each data word.
inline Words filled_data() {
  Words words;
  for (unsigned address = 3706; address <= 3769; ++address)
    words.push_back(static_cast<std::uint16_t>(0xD000 + address));
  return words;
}

}  // namespace cbcan::contract
