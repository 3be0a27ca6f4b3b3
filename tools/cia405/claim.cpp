// SPDX-License-Identifier: MIT
#include "claim.hpp"

namespace cbcan::cia405::detail {

namespace {

constexpr int kNobody = -1;

// A word: count in bits 15..6, ticket in bits 5..1, and whether its program waits in bit 0.
constexpr unsigned kTicketShift = 1, kCountShift = 6;
constexpr unsigned kTickets = 31;  ///< 1..31: so a word in use is never 0
constexpr unsigned kCounts = 1024;

constexpr bool waits(std::uint16_t word) {
  return (word & 1) != 0;
}

constexpr bool owns(std::uint16_t word) {
  return word != 0 && !waits(word);
}

constexpr unsigned ticket_of(std::uint16_t word) {
  return word >> kTicketShift & kTickets;
}

constexpr unsigned after(unsigned ticket) {
  return ticket % kTickets + 1;
}

/// Tickets go round: of two the older one is that with the shorter way to the other.
constexpr bool older(unsigned ticket, unsigned other) {
  const unsigned way = (other + kTickets - ticket) % kTickets;
  return way != 0 && way <= kTickets / 2;
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
  if (!wait) return write(sharing_.program, 0);
  state_ = State::kWaiting;
  draw_ticket();
  return write_own(true);
}

void Claim::answered(std::span<const std::uint16_t> words, Time now) {
  note(words, now);
  const bool taken = other_owner() != kNobody;
  if (state_ == State::kTrying) state_ = taken ? State::kWaiting : State::kOwner;
  if (owner()) refreshed_ = sent_;
  if (taken) free_since_ = now;
}

void Claim::forget() {
  state_ = State::kFree;
  heard_ = false;
}

Request Claim::write(int program, std::uint16_t word) const {
  return {static_cast<std::uint16_t>(kClaimWords + program), {word}, regmap::kWindowFirst, kSharedWords};
}

Request Claim::write_own(bool waiting) {
  count_ = (count_ + 1) % kCounts;
  const unsigned word = count_ << kCountShift | ticket_ << kTicketShift | (waiting ? 1u : 0u);
  return write(sharing_.program, static_cast<std::uint16_t>(word));
}

bool Claim::is_other_owner(int program) const {
  return program != sharing_.program && owns(seen_[static_cast<std::size_t>(program)].word);
}

int Claim::other_owner() const {
  for (int program = 0; program < kPrograms; ++program)
    if (is_other_owner(program)) return program;
  return kNobody;
}

/// By what responses have shown, not by the clock: this program may have been standing still itself.
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
  // The one whose turn it is may have died, or be slow.
  return first_in_turn() || heard_at_ - free_since_ >= sharing_.dead_after / 4;
}

bool Claim::first_in_turn() const {
  for (int program = 0; program < kPrograms; ++program) {
    const std::uint16_t word = seen_[static_cast<std::size_t>(program)].word;
    if (program == sharing_.program || !waits(word)) continue;
    const bool same = ticket_of(word) == ticket_;
    if (same ? program < sharing_.program : older(ticket_of(word), ticket_)) return false;
  }
  return true;
}

/// Behind everybody who has one.
void Claim::draw_ticket() {
  unsigned newest = 0;
  for (int program = 0; program < kPrograms; ++program) {
    const std::uint16_t word = seen_[static_cast<std::size_t>(program)].word;
    if (program == sharing_.program || word == 0) continue;
    if (newest == 0 || older(newest, ticket_of(word))) newest = ticket_of(word);
  }
  if (newest != 0) ticket_ = after(newest);
}

void Claim::note(std::span<const std::uint16_t> words, Time now) {
  // What may have changed and changed back unseen has not stood still.
  const bool anew = now - heard_at_ > sharing_.dead_after / 2;
  for (std::size_t program = 0; program < seen_.size(); ++program) {
    Seen& seen = seen_[program];
    if (anew || seen.word != words[program]) seen = {words[program], now};
  }
  heard_at_ = now;
  if (heard_) return;
  heard_ = true;
  free_since_ = now;
  if (!owner()) draw_ticket();
}

}  // namespace cbcan::cia405::detail
