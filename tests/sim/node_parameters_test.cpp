// SPDX-License-Identifier: MIT
// 1010h and 1011h: what is stored, what is restored when, and the values at the next power-on.

#include "kept_parameters.hpp"
#include "node_rig.hpp"

namespace cbcan::test {

namespace {

using Values = std::vector<sim::StoredValue>;

sim::NodeParts stored_in(sim::ParameterStore* store) {
  sim::NodeParts parts;
  parts.parameters = store;
  return parts;
}

/// Node 5 with parameters that outlive it.
struct Keeper {
  explicit Keeper(sim::ParameterStore* store) : bench(stored_in(store)) {}
  /// Changes a communication, a manufacturer and a profile parameter, and an output.
  void change(const std::string& value) {
    for (const char* object : {"171000", "002000", "006100", "006201"})
      bench.write("605#2B" + (object + value) + "000000");
  }
  void save(const std::string& sub) { bench.write("605#231010" + sub + "73617665"); }
  void load(const std::string& sub) { bench.write("605#231110" + sub + "6C6F6164"); }
  void reset_node() { bench.ask("000#8105", "705#00"); }
  void reset_communication() { bench.ask("000#8205", "705#00"); }
  /// 1017h, 2000h, 6100h, 6200h:1.
  std::string values() {
    std::string text;
    for (const auto& [index, sub] : {std::pair{0x1017, 0}, {0x2000, 0}, {0x6100, 0}, {0x6200, 1}})
      text +=
          std::to_string(value_of(node, static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub))) +
          " ";
    return text;
  }

  NodeBench bench;
  sim::Node& node = bench.node;
};

}  // namespace

TEST_CASE("Node: what is not stored is gone with reset node; communication alone with reset communication") {
  Keeper keeper(nullptr);
  keeper.change("00");
  keeper.change("11");
  keeper.reset_communication();
  CHECK(keeper.values() == "0 17 17 17 ");
  keeper.reset_node();
  CHECK(keeper.values() == "0 7 8 0 ");
}

TEST_CASE("Node: 1010h:1 stores all parameters; outputs are none") {
  KeptParameters store;
  Keeper keeper(&store);
  keeper.change("11");
  keeper.save("01");
  CHECK(store.kept.values == Values{{0x1017, 0, {0x11, 0}}, {0x2000, 0, {0x11, 0}}, {0x6100, 0, {0x11, 0}}});
  CHECK(store.kept.lss == sim::StoredLss{});
  keeper.change("22");
  keeper.reset_communication();
  CHECK(keeper.values() == "17 34 34 34 ");
  keeper.reset_node();
  CHECK(keeper.values() == "17 17 17 0 ");
}

TEST_CASE("Node: 1010h:2, :3 and :4 store communication, the profile's, the manufacturer's") {
  const std::pair<const char*, const char*> kinds[] = {
      {"02", "17 7 8 0 "}, {"03", "0 7 17 0 "}, {"04", "0 17 8 0 "}};
  for (const auto& [sub, values] : kinds) {
    INFO(sub);
    KeptParameters store;
    Keeper keeper(&store);
    keeper.change("11");
    keeper.save(sub);
    CHECK(store.kept.values.size() == 1);
    keeper.reset_node();
    CHECK(keeper.values() == values);
  }
}

TEST_CASE("Node: 1011h restores the factory's values, from the next reset on") {
  KeptParameters store;
  Keeper keeper(&store);
  keeper.change("11");
  keeper.save("01");
  keeper.load("02");
  CHECK(store.kept.values == Values{{0x2000, 0, {0x11, 0}}, {0x6100, 0, {0x11, 0}}});
  CHECK(keeper.values() == "17 17 17 17 ");
  keeper.reset_communication();
  CHECK(keeper.values() == "0 17 17 17 ");
  keeper.load("01");
  CHECK(store.kept.values.empty());
  CHECK(keeper.values() == "0 17 17 17 ");
  keeper.reset_node();
  CHECK(keeper.values() == "0 7 8 0 ");
}

TEST_CASE("Node: the next power-on finds what was stored") {
  KeptParameters store;
  {
    Keeper keeper(&store);
    keeper.change("11");
    keeper.save("01");
    keeper.change("22");
  }
  Keeper keeper(&store);
  CHECK(keeper.values() == "17 17 17 0 ");
  keeper.bench.pass(17 * kMillisecond).expect("705#7F");
  keeper.load("01");
  keeper.reset_node();
  CHECK(keeper.values() == "0 7 8 0 ");
}

TEST_CASE("Node: 1010h and 1011h: other signatures are refused, and reading tells what the device can do") {
  KeptParameters store;
  Keeper keeper(&store);
  keeper.change("11");
  keeper.bench.ask("605#2310100101000000", "585#8010100120000008");  // 0800 0020h
  keeper.bench.ask("605#231010016C6F6164", "585#8010100120000008");  // "load"
  keeper.bench.ask("605#2311100173617665", "585#8011100120000008");  // "save"
  keeper.bench.ask("605#4010100100000000", "585#4310100101000000");
  keeper.save("01");
  keeper.bench.ask("605#4010100100000000", "585#4310100101000000");
  keeper.bench.ask("605#4011100400000000", "585#4311100401000000");
}

TEST_CASE("Node: a store that fails is 0606 0000h, and nothing has changed") {
  KeptParameters store;
  Keeper keeper(&store);
  keeper.change("11");
  keeper.save("01");
  store.works = false;
  keeper.change("22");
  keeper.bench.ask("605#2310100173617665", "585#8010100100000606");
  CHECK(store.kept.values.size() == 3);
  keeper.reset_node();
  CHECK(keeper.values() == "17 17 17 0 ");
  keeper.bench.ask("605#231110016C6F6164", "585#8011100100000606");
  keeper.reset_node();
  CHECK(keeper.values() == "17 17 17 0 ");
  store.works = true;
  keeper.load("01");
  keeper.reset_node();
  CHECK(keeper.values() == "0 7 8 0 ");
}

TEST_CASE("Node: stored values that do not fit the dictionary any more are left out") {
  KeptParameters store;
  store.kept.values = {{0x1017, 0, {0x11}},         // too short
                       {0x1018, 4, {9, 0, 0, 0}},   // read only
                       {0x2000, 0, {0x11, 0}},      // good
                       {0x2001, 0, {0x11, 0}},      // no such object
                       {0x6100, 0, {0x11, 0, 0}},   // too long
                       {0x6200, 1, {0x11, 0}},      // an output
                       {0x1010, 1, {9, 0, 0, 0}}};  // a command
  Keeper keeper(&store);
  CHECK(keeper.values() == "0 17 8 0 ");
  CHECK(value_of(keeper.node, 0x1018, 4) == 1);
  store.kept.values.erase(store.kept.values.begin() + 2);
  CHECK(store.left_out == store.kept.values);
  keeper.bench.ask("605#4010100100000000", "585#4310100101000000");
}

TEST_CASE("Node: FFFFh:FF, the last value there is, is stored like all others") {
  KeptParameters store;
  std::vector<ObjectRow> all = rows();
  all.push_back({0xFFFF, 0, 0xFF, DataType::kUnsigned8});
  NodeBench bench(stored_in(&store), all);
  bench.write("605#2FFFFFFF11000000", "605#2310100173617665");
  CHECK(store.kept.values == Values{{0xFFFF, 0xFF, {0x11}}});
}

TEST_CASE("Node: objects for PDOs are stored too, but what the file maps by default, and 1003h") {
  KeptParameters store;
  std::vector<ObjectRow> all = rows();
  using enum DataType;
  constexpr std::uint16_t kRwr = ObjectFlags::kReadWrite | ObjectFlags::kMapTpdo;
  all.insert(all.begin() + 2, {0x1003, 0, 0, kUnsigned8});
  all.push_back({0x6300, 0, 0, kUnsigned8, 0, kRwr});
  all.push_back({0x6301, 0, 0, kUnsigned8, 0, kOutput});
  NodeBench bench(stored_in(&store), all);
  bench.write("605#2F00630011000000", "605#2F01630012000000", "605#2F00620213000000");
  bench.ask("605#2B00620114000000", "585#6000620100000000");  // 1600h:1
  bench.ask("605#2310100173617665", "585#6010100100000000");
  CHECK(store.kept.values == Values{{0x6200, 2, {0x13}}, {0x6300, 0, {0x11}}, {0x6301, 0, {0x12}}});
}

TEST_CASE("Node: what its device calls a set point is not stored, mapped or not") {
  struct Device final : sim::Behaviour {
    explicit Device(sim::DeviceNode& /*node*/) {}
    bool is_set_point(std::uint16_t index) const override { return index == 0x2000; }
  };
  KeptParameters store;
  sim::NodeParts parts = stored_in(&store);
  parts.behaviour = behaves_as<Device>;
  NodeBench bench(parts);
  bench.write("605#2B00200011000000", "605#2B00620112000000", "605#2310100173617665");
  CHECK(store.kept.values == Values{{0x6200, 1, {0x12, 0}}});
}

}  // namespace cbcan::test
