// SPDX-License-Identifier: MIT
#pragma once

/// Registers as a unit of Modbus servers.

#include <cstdint>
#include <span>
#include <vector>

#include "protocols/modbus_server.hpp"

namespace cbcan::test {

struct RegisterUnit : protocols::ModbusUnit {
  explicit RegisterUnit(std::vector<std::uint16_t> registers) : words(std::move(registers)) {}

  std::span<std::uint16_t> registers() override { return words; }
  modbus::Pdu handle(const protocols::ModbusRequest& request, Room room) override {
    const RegisterRange range{0, words};
    const RegisterMap map(std::span(&range, 1));
    const modbus::Access access = modbus::check(request.pdu, map, request.more);
    const auto size = modbus::execute(request.pdu, access, map, request.more, room);
    on_request(access.exception == modbus::Exception::kNone, access.written);
    return room.first(size);
  }
  void on_taken(const modbus::Range& /*taken*/) override {}
  virtual void on_request(bool /*valid*/, const modbus::Range& /*written*/) {}

  std::vector<std::uint16_t> words;

 protected:
  ~RegisterUnit() = default;
};

}  // namespace cbcan::test
