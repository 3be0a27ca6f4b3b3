// SPDX-License-Identifier: MIT
#include "sim/wire.hpp"

#include <algorithm>
#include <cmath>

namespace cbcan::sim {

namespace {
/// Number of time constants after which a double no longer distinguishes a lag from its final value.
constexpr Time kSettled = 40;
}  // namespace

double Wire::shaped(double value) const {
  if (transfer_.inverted) value = value == 0 ? 1 : 0;
  value = transfer_.scale * value + transfer_.offset;
  if (transfer_.low) value = std::max(value, *transfer_.low);
  if (transfer_.high) value = std::min(value, *transfer_.high);
  return std::isnan(value) ? 0 : value;
}

void Wire::put(double value, Time now) {
  const double next = shaped(value);
  if (!begun_) {
    begun_ = true;
    from_ = to_ = last_ = next;
  }
  if (next == last_) return;
  last_ = next;
  const Time arrives = now + transfer_.delay;
  if (!on_way_.empty() && on_way_.back().first == arrives) on_way_.pop_back();
  on_way_.emplace_back(arrives, next);
}

double Wire::at(Time now) const {
  if (now - since_ >= kSettled * transfer_.lag) return to_;
  const double share = static_cast<double>(now - since_) / static_cast<double>(transfer_.lag);
  return to_ + (from_ - to_) * std::exp(-share);
}

double Wire::take(Time now) {
  for (; !on_way_.empty() && on_way_.front().first <= now; on_way_.pop_front()) {
    const auto [arrived, value] = on_way_.front();
    from_ = at(arrived);
    to_ = value;
    since_ = arrived;
  }
  return at(now);
}

Time Wire::next_change(Time now) const {
  Time next = on_way_.empty() ? kNever : on_way_.front().first;
  const Time settled = since_ + kSettled * transfer_.lag;
  if (from_ == to_ || now >= settled) return next;
  const Time samples = (now - since_) / transfer_.sample_period + 1;
  return earlier(next, std::min(settled, since_ + samples * transfer_.sample_period));
}

}  // namespace cbcan::sim
