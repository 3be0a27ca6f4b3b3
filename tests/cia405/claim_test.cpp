// SPDX-License-Identifier: MIT
// The protocol of Sharing on its own: eight words, programs in every order, some of which stop for a while.

#include "claim.hpp"

#include "support/catch.hpp"

namespace cbcan::cia405::detail {

namespace {

constexpr Time kMs = 1000;
constexpr Time kSecond = 1000 * kMs;

/// R3700..R3777.
struct Registers {
  std::vector<std::uint16_t> words = std::vector<std::uint16_t>(kSharedWords);

  std::span<const std::uint16_t> claims() const { return std::span(words).subspan(70); }
  std::uint16_t& claim(int program) { return words[70u + static_cast<unsigned>(program)]; }
  /// FC 23.
  std::vector<std::uint16_t> serve(const Request& request) {
    words.at(request.write_address - 3700u) = request.words.at(0);
    return {claims().begin(), claims().end()};
  }
};

Claim claim_of(int program) {
  return Claim(Sharing{.program = program});
}

/// One request of a program that wants the window.
void ask(Claim& claim, Registers& registers, Time now) {
  claim.answered(registers.serve(claim.ask(now)), now);
}

}  // namespace

TEST_CASE("a word is odd while its program waits, even while it owns, and another one each time") {
  Registers registers;
  Claim claim = claim_of(2);
  ask(claim, registers, 0);
  CHECK(registers.claim(2) == 0x0043);  // count 1, ticket 1, waits
  CHECK_FALSE(claim.owner());
  ask(claim, registers, 1);
  CHECK(registers.claim(2) == 0x0082);
  CHECK(claim.owner());
  claim.answered(registers.serve(claim.refresh(2)), 2);
  CHECK(registers.claim(2) == 0x00C2);
  registers.serve(claim.release(false));
  CHECK(registers.claim(2) == 0);
  CHECK_FALSE(claim.owner());
  CHECK_FALSE(claim.registered());
}

TEST_CASE("the count goes round without 0") {
  Registers registers;
  Claim claim = claim_of(0);
  ask(claim, registers, 0);
  ask(claim, registers, 0);
  for (int i = 0; i < 3000; ++i) {
    const std::uint16_t before = registers.claim(0);
    claim.answered(registers.serve(claim.refresh(i)), i);
    REQUIRE(registers.claim(0) != 0);
    REQUIRE(registers.claim(0) % 2 == 0);
    REQUIRE(registers.claim(0) != before);
  }
}

TEST_CASE("a program that saw nobody and comes second goes back to waiting") {
  Registers registers;
  Claim claim = claim_of(1);
  ask(claim, registers, 0);
  registers.claim(5) = 8;  // another one owns it since then
  ask(claim, registers, 0);
  CHECK_FALSE(claim.owner());
  ask(claim, registers, 0);
  CHECK(registers.claim(1) % 2 == 1);
}

TEST_CASE("a program draws a ticket behind the newest one, and tickets go round") {
  Registers registers;
  Claim claim = claim_of(1);
  registers.claim(4) = 30 << 1 | 1;
  registers.claim(5) = 31 << 1 | 1;
  registers.claim(6) = 2 << 1 | 1;  // the newest
  ask(claim, registers, 0);
  ask(claim, registers, 0);
  CHECK((registers.claim(1) >> 1 & 31) == 3);
  registers.claim(6) = 31 << 1;
  claim = claim_of(1);
  ask(claim, registers, 0);
  ask(claim, registers, 0);
  CHECK((registers.claim(1) >> 1 & 31) == 1);
}

TEST_CASE("the oldest ticket goes first, and others after a quarter of a second") {
  Registers registers;
  Claim claim = claim_of(1);
  registers.claim(6) = 9 << 1 | 1;  // waits, and its turn is before ours
  for (Time now = 0; now <= 250 * kMs; now += kMs) {
    ask(claim, registers, now);
    REQUIRE(registers.claim(1) % 2 == 1);
    registers.claim(6) ^= 64;
  }
  ask(claim, registers, 251 * kMs);
  CHECK(claim.owner());
}

TEST_CASE("a word that stands still for a second is cleared by those who wait; not one that moves") {
  Registers registers;
  Claim claim = claim_of(1);
  registers.claim(3) = 8;
  registers.claim(4) = 8;
  for (Time now = 0; now < kSecond; now += kMs) {
    ask(claim, registers, now);
    REQUIRE(registers.claim(3) == 8);
    registers.claim(4) ^= 64;
  }
  ask(claim, registers, kSecond);
  ask(claim, registers, kSecond + 1);
  CHECK(registers.claim(3) == 0);
  CHECK(registers.claim(4) != 0);
}

TEST_CASE("a program that stood still itself takes nobody for dead") {
  Registers registers;
  Claim claim = claim_of(1);
  registers.claim(3) = 8;
  ask(claim, registers, 0);
  registers.claim(3) = 72;
  ask(claim, registers, 5 * kSecond);
  CHECK(registers.claim(3) == 72);
  CHECK_FALSE(claim.owner());
  ask(claim, registers, 10 * kSecond);  // the same word: nobody knows what it was in between
  ask(claim, registers, 10 * kSecond);
  CHECK(registers.claim(3) == 72);
}

TEST_CASE("an owner that was not heard for half a second is none any more") {
  Registers registers;
  Claim claim = claim_of(0);
  ask(claim, registers, 0);
  ask(claim, registers, kMs);
  CHECK_FALSE(claim.expired(kMs + kSecond / 2));
  CHECK(claim.expired(kMs + kSecond / 2 + 1));
  claim.answered(registers.serve(claim.refresh(100 * kMs)), 400 * kMs);
  CHECK(claim.expired(600 * kMs + 1));  // the word is as old as the request
}

namespace {

/// The same on every machine.
struct Dice {
  explicit Dice(std::uint32_t seed) : state_(seed) {}
  std::uint32_t operator()(std::uint32_t sides) {
    state_ = state_ * 1664525 + 1013904223;
    return (state_ >> 8) % sides;
  }

 private:
  std::uint32_t state_;
};

/// A program with requests and responses that take their time.
struct Peer {
  explicit Peer(int number) : claim(claim_of(number)) {}

  Claim claim;
  int turns = 0;
  int held = 0;     ///< polls of this turn so far
  Time asleep = 0;  ///< does nothing until then
  enum { kRests, kOnItsWay, kComesBack } request = kRests;
  Request sent{};
  std::vector<std::uint16_t> response{};
};

void step(Peer& peer, Registers& registers, Dice& dice, Time now) {
  switch (peer.request) {
    case Peer::kRests:
      if (peer.claim.expired(now)) peer.claim.forget();
      if (!peer.claim.owner()) {
        peer.sent = peer.claim.ask(now);
        peer.held = 0;
      } else if (++peer.held > 3) {
        ++peer.turns;
        peer.sent = peer.claim.release(dice(2) == 0);
      } else {
        peer.sent = peer.claim.refresh(now);
      }
      peer.request = Peer::kOnItsWay;
      return;
    case Peer::kOnItsWay:
      peer.response = registers.serve(peer.sent);
      peer.request = Peer::kComesBack;
      return;
    case Peer::kComesBack:
      peer.claim.answered(peer.response, now);
      peer.request = Peer::kRests;
      return;
  }
}

}  // namespace

TEST_CASE("in no order of requests, responses and pauses do two programs own the window, and all get it") {
  const auto seed = static_cast<std::uint32_t>(GENERATE(range(1, 21)));
  Dice dice(seed);
  Registers registers;
  std::vector<Peer> peers;
  for (int number = 0; number < 5; ++number)
    peers.emplace_back(number);
  Time now = 0;
  for (int i = 0; i < 100'000; ++i) {
    now += dice(kMs);
    Peer& peer = peers[dice(5)];
    if (now < peer.asleep) continue;
    step(peer, registers, dice, now);
    // Between a request and its response nobody sleeps here: what a stalled network can do is in the header.
    if (peer.request == Peer::kRests && dice(2000) == 0) peer.asleep = now + 3 * kSecond;
    int owners = 0;
    for (const Peer& each : peers)
      owners += each.claim.owner() && !each.claim.expired(now) ? 1 : 0;
    REQUIRE(owners <= 1);
  }
  for (const Peer& peer : peers)
    CHECK(peer.turns > 20);
}

}  // namespace cbcan::cia405::detail
