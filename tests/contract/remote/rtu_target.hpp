// SPDX-License-Identifier: MIT
#pragma once

/// A target that is an image for a microcontroller: one coprocessor, with Modbus RTU for the PLC.

#include <algorithm>
#include <iostream>
#include <stdexcept>

#include "cbcan/configuration.hpp"
#include "contract/target.hpp"
#include "support/catch.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan::contract {

/// Prints at the end of the program the greatest depth of the stack in any case.
struct DeepestStack {
  DeepestStack() = default;
  DeepestStack(const DeepestStack&) = delete;
  DeepestStack& operator=(const DeepestStack&) = delete;
  ~DeepestStack() { std::cout << "figure: stack, at most " << bytes << " bytes over the contract's suite\n"; }
  std::uint16_t bytes = 0;
};
inline DeepestStack deepest_stack;

struct RtuTarget : Target {
  std::string lacks(Ability ability) const override {
    switch (ability) {
      case Ability::kBusState: return "";
      case Ability::kRefusal: return "the image's queue to the serial adapter holds more than a case sends";
      case Ability::kSecondReader:
      case Ability::kSecondClient: return "a Modbus RTU line has one client";
      case Ability::kChannels: return "the image has one channel";
      case Ability::kSettings: return "the image's settings are built in";
      case Ability::kMorePdos: return "the image has 16 PDOs each way, or fewer";
      case Ability::kBlock: return kServices.block_transfer ? "" : "the image has no block transfer";
    }
    return "unknown";
  }

  void write(unsigned first, const Words& words) override {
    const std::string request = "\x01\x10" + big_endian(first) + values(words);
    const std::string response = ask(request, 8);
    if (response != request.substr(0, 6)) throw std::runtime_error("another response to FC 16");
  }
  Words read(unsigned first, std::size_t count) override {
    return read_by("\x01\x03" + big_endian(first) + big_endian(count), count);
  }
  Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) override {
    return read_by("\x01\x17" + big_endian(from) + big_endian(count) + big_endian(to) + values(words), count);
  }
  Words first_done(const std::function<void()>& /*ending*/) override { return {}; }

 protected:
  /// The response, of `size` bytes, to a request.
  virtual std::string exchange(const std::string& request, std::size_t size) = 0;

  /// Every case ends with it (docs/reference/registers.md, STACK_SIZE and STACK_USED).
  void check_stack() {
    const Words size_and_used = read(4105, 2);
    const std::uint16_t used = size_and_used.at(1);
    CHECK(used <= size_and_used.at(0) / 2);
    deepest_stack.bytes = std::max(deepest_stack.bytes, used);
  }

 private:
  static constexpr std::size_t kFixedBytes = 5;  // station, function, byte count, CRC

  static std::string crc(const std::string& bytes) {
    const std::uint16_t value = test::modbus_crc(bytes);
    return {static_cast<char>(value), static_cast<char>(value >> 8)};
  }
  static std::string big_endian(std::size_t value) {
    return {static_cast<char>(value >> 8), static_cast<char>(value)};
  }
  /// Quantity, byte count and the words.
  static std::string values(const Words& words) {
    std::string bytes = big_endian(words.size()) + static_cast<char>(2 * words.size());
    for (const std::uint16_t word : words)
      bytes += big_endian(word);
    return bytes;
  }

  Words read_by(const std::string& request, std::size_t count) {
    const std::string response = ask(request, kFixedBytes + 2 * count);
    if (response.substr(0, 2) != request.substr(0, 2)) throw std::runtime_error("another response to a read");
    Words words;
    for (std::size_t at = 3; at < response.size(); at += 2)
      words.push_back(static_cast<std::uint16_t>(static_cast<std::uint8_t>(response[at]) << 8 |
                                                 static_cast<std::uint8_t>(response[at + 1])));
    return words;
  }

  /// The response without its CRC, of `size` bytes with it.
  std::string ask(const std::string& request, std::size_t size) {
    const std::string response = exchange(request + crc(request), size);
    const std::string bytes = response.substr(0, size - 2);
    if (crc(bytes) != response.substr(size - 2)) throw std::runtime_error("wrong CRC in a response");
    return bytes;
  }
};

}  // namespace cbcan::contract
