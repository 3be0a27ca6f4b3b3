// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>

#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/coprocessor/scanner_window.hpp"

namespace cbcan::test {

/// All registers of a module with one channel, where they are by default, and the parts that it uses.
struct RegisterFile {
  std::uint16_t& operator[](std::size_t address) { return words.at(address); }
  template <class Values = std::initializer_list<std::uint16_t>>
  void put(std::size_t address, const Values& values) {
    for (const std::uint16_t value : values)
      (*this)[address++] = value;
  }

  template <std::size_t kFirst, std::size_t kCount>
  std::span<std::uint16_t, kCount> part() {
    return std::span<std::uint16_t, kCount>(&words.at(kFirst), kCount);
  }
  RegisterWindow window() { return RegisterWindow(part<regmap::kWindowFirst, regmap::kWindowWords>()); }
  ProcessRegisters process() { return part<regmap::kProcessFirst, regmap::kProcessWords>(); }
  StatusRegisters status() { return part<regmap::kStatusFirst, regmap::kStatusWords>(); }
  NodeRequestRegisters node_requests() { return part<regmap::kNodeRequest, 2>(); }
  ScannerWindow scanner() {
    return {part<regmap::kScannerOutFirst, regmap::kScannerOutWords>(),
            part<regmap::kScannerInFirst, regmap::kScannerInWords>()};
  }

  std::array<std::uint16_t, regmap::kRegisterFileWords> words{};
};

}  // namespace cbcan::test
