// SPDX-License-Identifier: MIT
#pragma once

/// One program's part in sharing a window ("Several programs" in docs/reference/function-blocks.md has the protocol).
/// Knows no Modbus.

#include <array>
#include <cstdint>
#include <span>

#include "cbcan/cia405.hpp"
#include "cbcan/regmap.hpp"
#include "window/request.hpp"

namespace cbcan::cia405::detail {

using window::Request;

inline constexpr std::uint16_t kClaimWords = regmap::kLastData + 1;  ///< address of program 0's
inline constexpr int kPrograms = 8;
/// The window and the claim words behind it, in one request.
inline constexpr std::uint16_t kSharedWords = regmap::kWindowWords + kPrograms;

class Claim {
 public:
  explicit Claim(const Sharing& sharing) : sharing_(sharing) {}

  bool owner() const { return state_ == State::kOwner; }
  bool others_wait() const;

  /// The next request on the way to owning the window. Responses to all requests that read R3700..R3777 go to
  /// answered().
  Request ask(Time now);
  /// As the owner: a request that reads everything and shows the others that this program lives.
  Request refresh(Time now);
  /// Gives the window back, or stops waiting for it; `wait` = to wait for the next turn.
  Request release(bool wait);
  /// Whether the module may hold a word other than 0 of this program.
  bool registered() const { return state_ != State::kFree; }

  /// `words` are R3770..R3777.
  void answered(std::span<const std::uint16_t> words, Time now);
  /// The owner that has not been heard for so long that others may take it for dead is no owner any more.
  bool expired(Time now) const { return owner() && now - refreshed_ > sharing_.dead_after / 2; }
  /// The connection is gone, or the right to the window: begins anew.
  void forget();

 private:
  enum class State { kFree, kWaiting, kTrying, kOwner };
  struct Seen {
    std::uint16_t word = 0;
    Time since = 0;
  };

  Request write(int program, std::uint16_t word) const;
  Request write_own(bool waiting);
  bool is_other_owner(int program) const;
  int other_owner() const;
  int dead_program() const;
  bool may_try() const;
  bool first_in_turn() const;
  void draw_ticket();
  void note(std::span<const std::uint16_t> words, Time now);

  Sharing sharing_;
  State state_ = State::kFree;
  unsigned count_ = 0;   ///< makes each word another one
  unsigned ticket_ = 1;  ///< the oldest one goes first
  bool heard_ = false;   ///< there was a response since it began to wait
  Time heard_at_ = 0;
  std::array<Seen, kPrograms> seen_{};
  Time free_since_ = 0;  ///< nobody owns the window, as far as seen
  Time sent_ = 0;
  Time refreshed_ = 0;
};

}  // namespace cbcan::cia405::detail
