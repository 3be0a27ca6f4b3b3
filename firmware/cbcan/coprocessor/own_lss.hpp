// SPDX-License-Identifier: MIT
#pragma once

/// LSS (CiA 305) of the coprocessor's own node: an LSS master reads its identity, and gives it a node ID and a
/// bit rate, which the memory of 1010h stores for the next power-on; until then both are unchanged. "Activate
/// bit timing" therefore does not switch.

#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/lss_slave.hpp"

namespace cbcan {

class OwnLss final : private LssApplication {
 public:
  /// Both outlive it.
  OwnLss(const Device& device, DeviceApplication& application, CanPort& port)
      : device_(device), application_(application), slave_(*this, port) {}

  void start(Time now) { slave_.start(device_.node_id(), kReservedLssBitRate, now); }
  void on_frame(const Frame& frame, Time now) { slave_.on_frame(frame, now); }
  void poll(Time now) { slave_.poll(now); }
  Time deadline() const { return slave_.deadline(); }

 private:
  std::uint32_t identity(std::uint8_t part) const override {
    const auto sub = static_cast<std::uint8_t>(part + 1);
    return static_cast<std::uint32_t>(device_.dictionary().get(object::kIdentity, sub));
  }
  bool is_bit_rate_supported(std::uint8_t table_index) const override {
    return table_index < kLssBitRates.size() && application_.memory() != nullptr;
  }
  StoreResult store(std::uint8_t node_id, std::uint8_t bit_rate) override {
    ParameterMemory* const memory = application_.memory();
    if (memory == nullptr) return StoreResult::kNoStorage;
    const bool kept = node_id != LssSlave::kNoNodeId && memory->keep_address(node_id, bit_rate);
    return kept ? StoreResult::kStored : StoreResult::kAccessError;
  }

  const Device& device_;
  DeviceApplication& application_;
  LssSlave slave_;
};

}  // namespace cbcan
