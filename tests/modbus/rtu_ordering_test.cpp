// SPDX-License-Identifier: MIT
// The order in which words shared with another context are read and written (docs/reference/contract.md).
#include "contract/core/watched_registers.hpp"
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

/// The register file; R3700 is watched.
using TrappedRegisters = contract::WatchedRegisters<regmap::kRegisterFileWords, regmap::kExecuteFlag>;

/// A server whose first window register and the others are in different ranges.
struct SharedServer {
  TrappedRegisters registers;
  std::array<RegisterRange, 2> ranges{
      {{0, std::span(registers.words()).first(3701)}, {3701, std::span(registers.words()).subspan(3701)}}};
  RegisterMap map{ranges};
  RtuServer server{{&map, 1}, {}};
  std::uint32_t now = 0;
};

/// The request writes 13BFh, 0042h, 6411h, 0001h to R3701..R3704, and then CA0Eh to R3700.
void check_flag_comes_last(const Bytes& request) {
  SharedServer shared;
  TrappedRegisters& registers = shared.registers;
  std::array<std::uint16_t, 5> seen{};
  const auto record = [&] {
    for (std::size_t i = 0; i < seen.size(); ++i)
      seen[i] = registers.words()[regmap::kWindowFirst + i];
  };
  REQUIRE(registers.run(
      PROT_READ, [&] { test::ask(shared.server, shared.now, request); }, record));
  CHECK(seen == std::array<std::uint16_t, 5>{0, 0x13BF, 0x0042, 0x6411, 0x0001});
  CHECK(registers.words()[regmap::kExecuteFlag] == 0xCA0E);
}

TEST_CASE("RTU: one FC 16 or FC 23 stores R3700 after the registers that follow it") {
  check_flag_comes_last(hex("01 10 0E 74 00 05 0A CA 0E 13 BF 00 42 64 11 00 01 6B DC"));
  check_flag_comes_last(hex("01 17 0E 75 00 01 0E 74 00 05 0A CA 0E 13 BF 00 42 64 11 00 01 9A 71"));
}

TEST_CASE("RTU: a read loads R3700 before the registers that follow it") {
  SharedServer shared;
  TrappedRegisters& registers = shared.registers;
  registers.words()[regmap::kExecuteFlag] = 0xCA0E;
  Bytes response;
  // Another context ends a transaction at the last moment: R3700 then shows its result, so the rest must too.
  const auto finish = [&] {
    registers.words()[regmap::kDataSize] = 2;
    registers.words()[regmap::kData] = 0x012C;
    registers.words()[regmap::kExecuteFlag] = 0;
  };
  const Bytes read = hex("01 03 0E 74 00 07 46 FA");
  REQUIRE(registers.run(
      PROT_NONE, [&] { response = test::ask(shared.server, shared.now, read); }, finish));
  CHECK(response == hex("01 03 0E 00 00 00 00 00 00 00 00 00 00 00 02 01 2C 4E 98"));
}

}  // namespace
}  // namespace cbcan
