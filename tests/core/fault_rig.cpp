// SPDX-License-Identifier: MIT
#include "fault_rig.hpp"

#include <algorithm>

namespace cbcan::test {

namespace {

constexpr std::uint32_t kBootUpId = 0x705;
constexpr std::uint8_t kBlockSize = 4;  // smaller than a transfer: several sub-blocks

}  // namespace

FaultRig::FaultRig(const Transfer& transfer)
    : peer_(transfer.size, kBlockSize),
      coprocessor_(RegisterWindow(words_), process_, *this, {.sdo_timeout_ms = kTimeout / kMillisecond}) {
  coprocessor_.start(now_);
  wire_.clear();  // the boot-up message is nobody's here
  on_the_way_.clear();
  tries_ = 0;
}

void FaultRig::hurt(std::size_t number, Harm harm) {
  hurt_number_ = number;
  harm_ = std::move(harm);
}

void FaultRig::interrupt(std::size_t number, const Frame& instead) {
  interrupt_number_ = number;
  instead_ = instead;
}

void FaultRig::refuse(std::size_t number, bool for_ever) {
  refuse_from_ = number;
  refuse_for_ever_ = for_ever;
}

bool FaultRig::try_send(const Frame& frame) {
  const std::size_t number = tries_++;
  if (refuse_for_ever_ ? number >= refuse_from_ : number == refuse_from_) return false;
  put_on_wire(false, frame, 0);
  return true;
}

void FaultRig::put_on_wire(bool from_peer, const Frame& frame, Time delay) {
  const std::size_t number = wire_.size();
  wire_.push_back({from_peer, frame});
  if (number == interrupt_number_) {
    on_the_way_.clear();
    Frame abort;
    abort.data[0] = 0x80;
    peer_.on_frame(abort);
    while (peer_.response() != nullptr) {
    }
    on_the_way_.emplace(now_ + kLatency, Arrival{false, instead_});
    deaf_until_ = instead_.id == kBootUpId ? now_ + kLatency : 0;
    return;
  }
  const Arrivals arrivals = number == hurt_number_ ? harm_(frame) : Arrivals{{0, frame}};
  for (const auto& [later, arriving] : arrivals)
    on_the_way_.emplace(now_ + delay + later, Arrival{!from_peer, arriving});
}

void FaultRig::arrive(const Arrival& arrival) {
  if (!arrival.at_peer) return coprocessor_.on_frame(arrival.frame, now_);
  if (now_ < deaf_until_) return;
  peer_.on_frame(arrival.frame);
  Time delay = 0;
  while (const Frame* response = peer_.response())
    put_on_wire(true, *response, delay += kLatency);
}

/// To whatever comes next: a frame or a deadline.
void FaultRig::step() {
  const Time next = on_the_way_.empty() ? kNever : on_the_way_.begin()->first;
  now_ = std::max(now_, earlier(next, deadline_));
  if (next <= now_) {
    const Arrival arrival = on_the_way_.begin()->second;
    on_the_way_.erase(on_the_way_.begin());
    arrive(arrival);
  }
  deadline_ = coprocessor_.poll(now_);
}

bool FaultRig::run(const Transfer& transfer, std::uint8_t first_byte, Time bound) {
  peer_.hold(first_byte);
  words_ = {0xCA0E, 5066, 0, 0x3004, 0, 1, transfer.mode};
  coprocessor_.poll(now_);
  words_ = {0xCA0E, static_cast<std::uint16_t>(transfer.write ? 5066 : 5055), 5, 0x2000, 0, transfer.size};
  for (std::size_t i = 0; transfer.write && i < transfer.size; ++i)
    words_[6 + i / 2] |= static_cast<std::uint16_t>(static_cast<std::uint8_t>(first_byte + i) << 8 * (i % 2));
  const Time begin = now_;
  deadline_ = coprocessor_.poll(now_);
  while (words_[0] == 0xCA0E) {
    if (now_ - begin > bound) return false;
    step();
  }
  return now_ - begin <= bound;
}

void FaultRig::settle() {
  while (!on_the_way_.empty())
    step();
}

std::uint32_t FaultRig::code() const {
  if (reg(3700) == 0) return 0;
  return reg(3706) | static_cast<std::uint32_t>(reg(3707)) << 16;
}

std::vector<std::uint8_t> FaultRig::data() const {
  std::vector<std::uint8_t> bytes;
  for (unsigned i = 0; i < reg(3705); ++i)
    bytes.push_back(static_cast<std::uint8_t>(reg(3706 + i / 2) >> 8 * (i % 2)));
  return bytes;
}

}  // namespace cbcan::test
