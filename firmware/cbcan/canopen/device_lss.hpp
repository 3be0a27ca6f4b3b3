// SPDX-License-Identifier: MIT
#pragma once

/// LSS (CiA 305) of a device: an LSS master reads its identity, and gives it a node ID and a bit rate, which
/// the memory of 1010h stores for the next power-on. The bit rate is unchanged until then: "activate bit
/// timing" does not switch.

#include <array>

#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/lss_slave.hpp"

namespace cbcan {

class DeviceLss : private LssApplication, private LssSlave {
 public:
  using LssSlave::deadline, LssSlave::on_frame, LssSlave::poll, LssSlave::reset_communication;

  /// All outlive it.
  DeviceLss(Device& device, DeviceApplication& application, CanPort& port)
      : LssSlave(*this, port), device_(device), application_(application) {}

  /// Power-on and reset node: see LssSlave.
  void start(std::uint8_t node_id, Time now) { LssSlave::start(node_id, kReservedLssBitRate, now); }

 protected:
  ~DeviceLss() = default;

 private:
  std::uint32_t identity(std::uint8_t part) const override {
    const auto sub = static_cast<std::uint8_t>(part + 1);
    std::array<std::uint8_t, 4> value{};
    std::size_t size = 0;
    device_.dictionary().read(object::kIdentity, sub, value, size, 0);
    return load_word(value.data());
  }
  bool is_bit_rate_supported(std::uint8_t table_index) const override {
    return table_index < kLssBitRates.size() && application_.memory() != nullptr;
  }
  StoreResult store(std::uint8_t node_id, std::uint8_t bit_rate) override {
    ParameterMemory* const memory = application_.memory();
    if (memory == nullptr) return StoreResult::kNoStorage;
    return memory->keep_address(node_id, bit_rate) ? StoreResult::kStored : StoreResult::kAccessError;
  }
  void on_node_id(std::uint8_t node_id, Time now) override {
    device_.set_node_id(node_id);
    device_.start(now);
  }

  Device& device_;
  DeviceApplication& application_;
};

}  // namespace cbcan
