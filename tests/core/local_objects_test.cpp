// SPDX-License-Identifier: MIT
// R3702 = 0 or the own node ID: accesses the local object dictionary, without an SDO frame on the bus.

#include "support/bench.hpp"

using namespace cbcan;
using cbcan::test::Bench;

// With CAN-ID 0 it would be an NMT command without bytes.
TEST_CASE("1005h: SYNC cannot have a CAN-ID that CiA 301 restricts (7.3.5)") {
  Bench bench;
  constexpr std::uint16_t kRestricted[] = {0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601,
                                           0x67F, 0x6E0, 0x6FF, 0x701, 0x77F, 0x780, 0x7FF};
  for (const std::uint16_t id : kRestricted)
    bench.write(0, 0x1005, 0, 4, {id, 0x4000}).check_failed(0x06090030);
  constexpr std::uint16_t kFree[] = {0x080, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF, 0x700};
  for (const std::uint16_t id : kFree)
    bench.write(0, 0x1005, 0, 4, {id, 0}).check_done();  // while bit 30 is set the CAN-ID stays
}

TEST_CASE("Power on: the boot-up message, then Pre-operational") {
  cbcan::test::CoprocessorRig rig({.node_id = 42});
  rig.port.refuse_next = 2;
  rig.coprocessor.start(rig.now);
  rig.expect_silence();
  const cbcan::Time next = rig.coprocessor.poll(rig.now);
  CHECK(next <= rig.now + kMillisecond);
  rig.coprocessor.poll(next);
  rig.expect("72A#00");
  CHECK(rig.coprocessor.own_node().state() == cbcan::nmt::State::kPreOperational);
}

namespace {

struct Subs {
  unsigned index, first, last, bytes;
};

/// docs/reference/contract.md, "Local objects" and "Process data"; CiA 301 for the structure of 14xxh to
/// 1Axxh.
std::vector<Subs> all_objects() {
  std::vector<Subs> all{
      {0x1000, 0, 0, 4},   {0x1001, 0, 0, 1},   {0x1003, 0, 0, 1},   {0x1005, 0, 0, 4},   {0x1006, 0, 0, 4},
      {0x1007, 0, 0, 4},   {0x1010, 0, 0, 1},   {0x1010, 1, 4, 4},   {0x1011, 0, 0, 1},   {0x1011, 1, 4, 4},
      {0x1012, 0, 0, 4},   {0x1014, 0, 0, 4},   {0x1015, 0, 0, 2},   {0x1016, 0, 0, 1},   {0x1016, 1, 127, 4},
      {0x1017, 0, 0, 2},   {0x1018, 0, 0, 1},   {0x1018, 1, 4, 4},   {0x1019, 0, 0, 1},   {0x1029, 0, 1, 1},
      {0x1200, 0, 0, 1},   {0x1200, 1, 2, 4},   {0x3001, 0, 0, 1},   {0x3002, 0, 0, 1},   {0x3003, 0, 0, 2},
      {0x3004, 0, 0, 1},   {0x3005, 0, 0, 1},   {0x3006, 0, 0, 9},   {0x3007, 0, 127, 1}, {0x3005, 1, 127, 8},
      {0x3008, 0, 0, 6},   {0x1F22, 0, 0, 1},   {0x1F25, 0, 0, 1},   {0x1F80, 0, 0, 4},   {0x1F89, 0, 0, 4},
      {0x1F8A, 0, 127, 1}, {0x3009, 0, 0, 1},   {0x3009, 1, 127, 8}, {0x300A, 0, 0, 1},   {0x300B, 0, 0, 1},
      {0x300D, 0, 0, 1},   {0x300D, 1, 127, 2}, {0x102A, 0, 0, 2},   {0x300E, 0, 0, 20},  {0x300F, 0, 0, 20},
      {0x3010, 0, 0, 1},   {0x3010, 1, 127, 1},
  };
  for (const unsigned of_nodes : {0x1F26u, 0x1F27u, 0x1F81u, 0x1F84u, 0x1F85u, 0x1F86u, 0x1F87u, 0x1F88u})
    all.insert(all.end(), {{of_nodes, 0, 0, 1}, {of_nodes, 1, 127, 4}});
  for (unsigned pdo = 0; pdo < 16; ++pdo)
    for (const unsigned first : {0x1400u + pdo, 0x1800u + pdo}) {
      all.insert(all.end(), {{first, 0, 0, 1}, {first, 1, 1, 4}, {first, 2, 2, 1}, {first, 5, 5, 2}});
      if (first >= 0x1800) all.insert(all.end(), {{first, 3, 3, 2}, {first, 6, 6, 1}});
      all.insert(all.end(), {{first + 0x200, 0, 0, 1}, {first + 0x200, 1, 8, 4}});
    }
  const unsigned bytes[] = {1, 1, 0, 2, 2, 3, 3, 4, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8};  // 0: BOOLEAN
  for (const unsigned area : {0xA000u, 0xA480u})
    for (unsigned type = 0; type < 18; ++type) {
      const unsigned index = area + 0x40 * type;
      if (bytes[type] != 0)
        all.insert(all.end(), {{index, 0, 0, 1}, {index, 1, 128 / bytes[type], bytes[type]}});
      for (unsigned k = 0; k < 5 && bytes[type] == 0; ++k)
        all.push_back({index + k, 0, k < 4 ? 254u : 1024 - 4 * 254, 1});
    }
  return all;
}

}  // namespace

TEST_CASE("Each object has its sub-indices with their sizes, and there are no others") {
  std::map<std::pair<unsigned, unsigned>, unsigned> sizes;
  std::set<unsigned> indices{0x1003, 0x1008, 0x1009, 0x100A};
  for (const Subs& object : all_objects()) {
    indices.insert(object.index);
    for (unsigned sub = object.first; sub <= object.last; ++sub)
      sizes[{object.index, sub}] = object.bytes;
  }
  Bench bench;
  for (unsigned index = 0; index <= 0xFFFF; ++index)
    for (unsigned sub = 0; sub <= (indices.count(index) != 0 ? 255u : 0u); ++sub) {
      const auto size = sizes.find({index, sub});
      // Texts, the empty entries of 1003h, and what the manager has of a node have their own tests.
      if (index == 0x300C || (index >= 0x1008 && index <= 0x100A && sub == 0) ||
          (index == 0x1003 && sub >= 1 && sub <= 8) || (index == 0x1F22 && sub >= 1 && sub <= 127) ||
          (index == 0x1F25 && sub >= 1 && sub <= 128) || (index == 0x300A && sub >= 1 && sub <= 16))
        continue;
      INFO(std::hex << index << " " << sub);
      bench.read(0, static_cast<std::uint16_t>(index), static_cast<std::uint16_t>(sub), 128);
      if (size != sizes.end()) {
        if (bench.reg(3700) != 0 || bench.reg(3705) != size->second) FAIL("size " << bench.reg(3705));
      } else if (bench.reg(3700) != 4 || bench.reg(3707) != (indices.count(index) != 0 ? 0x0609 : 0x0602)) {
        FAIL("there is one");
      }
    }
}

namespace {

/// Stores nothing.
struct PlainMemory final : ParameterMemory {
  AbortCode save(std::uint16_t, std::uint16_t) override { return AbortCode::kNone; }
  AbortCode forget(std::uint16_t, std::uint16_t) override { return AbortCode::kNone; }
};

}  // namespace

// CiA 305: 17h store (error 2: could not).
TEST_CASE("A memory that only saves and forgets keeps no node ID and restores nothing at a reset") {
  PlainMemory memory;
  Bench bench;
  bench.coprocessor.keep_in(memory);
  bench.arrive("7E5#0401000000000000", "7E5#1700000000000000").expect("7E4#1702000000000000");
  bench.arrive("7E5#0400000000000000", "000#817F").pass(0).expect("77F#00");
  bench.read(0, 0x1017, 0, 2).check_done();
}
