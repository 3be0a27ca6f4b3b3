// SPDX-License-Identifier: MIT
#include "claim.hpp"

#include <algorithm>

namespace cbcan::cia405::detail {

namespace {

constexpr int kNobody = -1;
constexpr std::uint16_t kHighestCount = 0x7FFF;

constexpr bool waits(std::uint16_t word) {
  return (word & 1) != 0;
}

constexpr bool owns(std::uint16_t word) {
  return word != 0 && !waits(word);
}

}  // namespace

bool Claim::others_wait() const {
  for (int program = 0; program < kPrograms; ++program)
    if (program != sharing_.program && waits(seen_[static_cast<std::size_t>(program)].word)) return true;
  return false;
}

Request Claim::ask(Time now) {
  const int dead = dead_program();
  if (dead != kNobody) return write(dead, 0);
  const bool tries = may_try();
  state_ = tries ? State::kTrying : State::kWaiting;
  sent_ = now;
  return write_own(!tries);
}

Request Claim::refresh(Time now) {
  sent_ = now;
  return write_own(false);
}

Request Claim::release(bool wait) {
  forget();
  last_owner_ = sharing_.program;
  if (!wait) return write(sharing_.program, 0);
  state_ = State::kWaiting;
  return write_own(true);
}

void Claim::answered(std::span<const std::uint16_t> words, Time now) {
  note(words, now);
  const int owner = other_owner();
  if (state_ == State::kTrying) state_ = owner == kNobody ? State::kOwner : State::kWaiting;
  if (this->owner()) refreshed_ = sent_;
  if (owner == kNobody) return;
  last_owner_ = owner;
  free_since_ = now;
}

void Claim::forget() {
  state_ = State::kFree;
  heard_ = false;
}

Request Claim::write(int program, std::uint16_t word) const {
  return {static_cast<std::uint16_t>(kClaimWords + program), {word}, regmap::kWindowFirst, kSharedWords};
}

Request Claim::write_own(bool waiting) {
  counter_ = counter_ == kHighestCount ? 1 : static_cast<std::uint16_t>(counter_ + 1);
  return write(sharing_.program, static_cast<std::uint16_t>(counter_ << 1 | (waiting ? 1 : 0)));
}

bool Claim::is_other_owner(int program) const {
  return program != sharing_.program && owns(seen_[static_cast<std::size_t>(program)].word);
}

int Claim::other_owner() const {
  for (int program = 0; program < kPrograms; ++program)
    if (is_other_owner(program)) return program;
  return kNobody;
}

/// By what answers have shown, not by the clock: this program may have been standing still itself.
int Claim::dead_program() const {
  if (!heard_) return kNobody;
  for (int program = 0; program < kPrograms; ++program) {
    const Seen& seen = seen_[static_cast<std::size_t>(program)];
    if (program != sharing_.program && seen.word != 0 && heard_at_ - seen.since >= sharing_.dead_after)
      return program;
  }
  return kNobody;
}

bool Claim::may_try() const {
  if (!heard_ || other_owner() != kNobody) return false;
  // Programs that have seen different last owners may each wait for the other one.
  return next_in_turn() || heard_at_ - free_since_ >= sharing_.dead_after / 4;
}

bool Claim::next_in_turn() const {
  for (int step = 1; step <= kPrograms; ++step) {
    const int program = (last_owner_ + step) % kPrograms;
    if (program == sharing_.program) return true;
    if (waits(seen_[static_cast<std::size_t>(program)].word)) return false;
  }
  return true;
}

void Claim::note(std::span<const std::uint16_t> words, Time now) {
  if (!heard_) free_since_ = now;
  for (std::size_t program = 0; program < seen_.size(); ++program) {
    Seen& seen = seen_[program];
    if (!heard_ || seen.word != words[program]) seen = {words[program], now};
  }
  heard_ = true;
  heard_at_ = now;
}

}  // namespace cbcan::cia405::detail
