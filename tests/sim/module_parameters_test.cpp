// SPDX-License-Identifier: MIT
// What 1010h of the coprocessor's own node stores in cbcan-sim.

#include "kept_parameters.hpp"
#include "support/storing_coprocessor.hpp"
#include "support/world_bench.hpp"

namespace cbcan::test {

namespace {

using Values = std::vector<sim::StoredValue>;

/// on() switches it off and on.
struct Module : StoringCoprocessor {
  Module() { on(); }
  void on(std::uint8_t node_id = 127) {
    memory.emplace(&store);
    start(*memory, node_id);
  }
  KeptParameters store;
  std::optional<sim::ModuleParameters> memory;
};

}  // namespace

TEST_CASE("Module: each parameter is what it was after power has been off, and a line of its own") {
  Module module;
  module.put_all();
  module.save();
  CHECK(module.store.kept.values.size() == std::size(kParameters));
  module.put(0x1017, 0, 2, 1).check_done();  // not saved
  module.on();
  module.check_all();
  module.bench->write(0, 0x1F82, 127, 1, {1}).expect("1FF#00000000");
  module.bench->arrive("185#3412");
  CHECK(module.bench->reg(3800) == 0x1234);
}

TEST_CASE(
    "Module: a sub-index is a range, the others keep what is stored; 1011h counts from the next reset on") {
  Module module;
  const auto change = [&](std::uint16_t number) {
    module.put(0x1017, 0, 2, number);
    module.put(0x3003, 0, 2, number);
  };
  change(0x1F4);
  module.save(4);
  CHECK(module.store.kept.values == Values{{0x3003, 0, {0xF4, 1}}});
  change(0x258);
  module.save(2);
  CHECK(module.store.kept.values == Values{{0x1017, 0, {0x58, 2}}, {0x3003, 0, {0xF4, 1}}});
  module.save(3);  // the application has none
  module.bench->write(0, 0x1F82, 127, 1, {129}).expect("77F#00");
  CHECK(module.get(0x1017, 0) == 0x258);
  CHECK(module.get(0x3003, 0) == 0x1F4);
  module.command(0x1011, 1, kLoad).check_done();
  CHECK(module.store.kept.values.empty());
  CHECK(module.get(0x1017, 0) == 0x258);
  module.bench->write(0, 0x1F82, 127, 1, {130}).expect("77F#00");
  CHECK(module.get(0x1017, 0) == 0);
  CHECK(module.get(0x3003, 0) == 0x1F4);
}

TEST_CASE("Module: a store that fails is 0606 0000h, and nothing has changed") {
  Module module;
  module.put(0x1017, 0, 2, 500);
  module.save();
  module.put(0x1017, 0, 2, 600);
  module.store.works = false;
  module.command(0x1010, 1, kSave).check_failed(0x06060000);
  module.command(0x1011, 1, kLoad).check_failed(0x06060000);
  module.bench->write(0, 0x1F82, 127, 1, {129}).expect("77F#00");
  CHECK(module.get(0x1017, 0) == 500);
}

TEST_CASE("Module: stored values that do not fit are left out, which is reported once; the others count") {
  Module module;
  module.put(0x1017, 0, 2, 500);
  module.save();  // 1014h follows the node ID: no part of it
  const sim::StoredValue long_one{0x1015, 0, {1, 2, 3, 4}}, read_only{0x3002, 0, {9}},
      unknown{0x5FFF, 0, {1}}, process{0xA000, 1, {1}};
  for (const sim::StoredValue& value : {long_one, read_only, unknown, process})
    module.store.kept.values.push_back(value);
  module.on(42);
  CHECK(module.store.left_out == Values{long_one, read_only, unknown, process});
  module.store.left_out.clear();
  CHECK(module.get(0x1014, 0) == 0xAA);
  CHECK(module.get(0x1017, 0) == 500);
  CHECK(module.get(0x1015, 0) == 0);
  CHECK(module.bench->reg(3800) == 0);
  module.bench->write(0, 0x1F82, 42, 1, {129}).expect("72A#00");
  CHECK(module.store.left_out.empty());
}

TEST_CASE(
    "Module: what LSS stores counts from the next start on; on a bus with another bit rate it is bus-off") {
  struct Row {
    std::uint32_t bus_rate;
    const char* boots;
  };
  KeptParameters store;
  RegisterFile registers;
  for (const Row& row : {Row{0, "77F#00"}, Row{0, "72A#00"}, Row{250'000, "72A#00"}, Row{500'000, ""}}) {
    INFO(row.bus_rate << " " << row.boots);
    WorldBench bench(row.bus_rate);
    sim::CoprocessorModule& module = bench.world.add_module(registers.window(), registers.process(), {},
                                                            std::array<ScannerWindow, 1>{}, &store);
    bench.start().pass(10 * kMillisecond);
    CHECK(bench.heard() ==
          (*row.boots != 0 ? std::vector<std::string>{row.boots} : std::vector<std::string>{}));
    CHECK(module.port().state() == (*row.boots != 0 ? BusState::kActive : BusState::kBusOff));
    for (const char* const fault : {"module-bus-off until_ms=1", "error-passive until_ms=1"}) {
      INFO(fault);
      if (*row.boots != 0) break;
      bench.world.faults().add(sim::parse_fault(fault, sim::FaultPlace::kBus).fault, bench.now);
      CHECK(module.port().state() == BusState::kBusOff);
      bench.pass(10 * kMillisecond);
      CHECK(module.port().state() == BusState::kBusOff);
      bench.heard();  // the states of the master's controller
    }
    if (store.kept.lss.node_id != 0) continue;
    bench.send("7E5#0401000000000000");
    bench.ask("7E5#112A000000000000", "7E4#1100000000000000");
    bench.ask("7E5#1300030000000000", "7E4#1300000000000000");
    store.works = false;
    bench.ask("7E5#1700000000000000", "7E4#1702000000000000");
    store.works = true;
    bench.ask("7E5#1700000000000000", "7E4#1700000000000000");
    CHECK(store.kept.lss == sim::StoredLss{42, 250'000});
    bench.ask("67F#4001300000000000", "5FF#4F0130007F000000");
  }
}

TEST_CASE("Module: node ID FFh, stored by LSS, restores that of the settings") {
  KeptParameters store;
  RegisterFile registers;
  store.kept.lss = {42, 0};
  for (const char* const boots : {"72A#00", "77F#00"}) {
    WorldBench bench;
    bench.world.add_module(registers.window(), registers.process(), {}, std::array<ScannerWindow, 1>{},
                           &store);
    bench.start().expect(boots);
    bench.send("7E5#0401000000000000");
    bench.ask("7E5#11FF000000000000", "7E4#1100000000000000");
    bench.ask("7E5#1700000000000000", "7E4#1700000000000000");
  }
}

}  // namespace cbcan::test
