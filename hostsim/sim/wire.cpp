// SPDX-License-Identifier: MIT
#include "sim/wire.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cbcan::sim {

Wire::Wire(const TransferFunction& transfer)
    : transfer_(transfer),
      delay_(Block::dead_time(transfer.delay)),
      block_(transfer.block.empty() ? Block::lag(transfer.lag) : Block::parse(transfer.block).block) {}

double Wire::shaped(double value) const {
  if (transfer_.inverted) value = value == 0 ? 1 : 0;
  value = transfer_.scale * value + transfer_.offset;
  if (transfer_.low) value = std::max(value, *transfer_.low);
  if (transfer_.high) value = std::min(value, *transfer_.high);
  return std::isnan(value) ? 0 : value;
}

void Wire::put(double value, Time now) {
  const double next = shaped(value);
  delay_.put(next, now);
  if (!std::exchange(begun_, true)) block_.put(next, now);
}

double Wire::take(Time now) {
  for (Time arrived = delay_.next_step(); arrived <= now; arrived = delay_.next_step())
    block_.put(delay_.at(arrived), arrived);
  return block_.at(now);
}

Time Wire::next_change(Time now) const {
  const Time next = earlier(delay_.next_step(), block_.next_step());
  const Time until = block_.moves_until();
  if (now >= until) return next;
  const Time samples = (now - block_.since()) / transfer_.sample_period + 1;
  return earlier(next, std::min(until, block_.since() + samples * transfer_.sample_period));
}

}  // namespace cbcan::sim
