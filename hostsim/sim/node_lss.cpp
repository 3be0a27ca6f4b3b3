// SPDX-License-Identifier: MIT
#include "sim/node_lss.hpp"

#include <algorithm>

namespace cbcan::sim {

namespace {

/// A rate that is not in the table gets the index of the empty row, whose rate is 0: stored, it means none.
std::uint8_t index_of(std::uint32_t bit_rate) {
  auto found = std::ranges::find(kLssBitRates, bit_rate);
  if (found == kLssBitRates.end()) found = std::ranges::find(kLssBitRates, 0u);
  return static_cast<std::uint8_t>(found - kLssBitRates.begin());
}

}  // namespace

void NodeLss::start(std::uint8_t node_id, std::uint32_t stored_bit_rate, Time now) {
  own_rate_ = stored_bit_rate == 0 ? bus_rate_ : stored_bit_rate;
  set_on_bus(true, now);
  slave_.start(node_id, index_of(own_rate_), now);
}

bool NodeLss::is_bit_rate_supported(std::uint8_t table_index) const {
  return table_index < kLssBitRates.size() && kLssBitRates[table_index] != 0;
}

void NodeLss::set_on_bus(bool on, Time now) {
  const bool hears = on && (bus_rate_ == 0 || own_rate_ == bus_rate_);
  switching_ = true;
  port_.set_state(hears ? BusState::kActive : BusState::kBusOff, now);
  switching_ = false;
}

void NodeLss::activate_bit_rate(std::uint8_t table_index, Time /*now*/) {
  own_rate_ = kLssBitRates[table_index];
}

LssApplication::StoreResult NodeLss::store(std::uint8_t node_id, std::uint8_t bit_rate) {
  const bool kept = node_.keep({node_id, kLssBitRates[bit_rate]});
  return kept ? StoreResult::kStored : StoreResult::kAccessError;
}

}  // namespace cbcan::sim
