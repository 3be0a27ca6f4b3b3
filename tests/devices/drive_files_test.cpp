// SPDX-License-Identifier: MIT
// Inverters, interpolating drives and drives with several axes, each with the frames of its master. The
// dictionaries are written by hand.
#include "devices/drive/drive.hpp"
#include "tests/devices/vendor_plant.hpp"

namespace cbcan::test {

namespace {

/// RPDO 1 and TPDO 1 of node 5 with two objects of these indices and 16 or 32 bits; type of the RPDO.
std::string pdos(const std::string& received, const std::string& sent, const char* type) {
  return text_of({"1005", "7", "rw", "0x80"}) + pair_of("1400", "0x205", type, "7", "5") +
         pair_of("1600", "0x60400010", received) + pair_of("1800", "0x185", "1", "7", "5") +
         pair_of("1A00", "0x60410010", sent);
}

std::string inverter(const char* acceleration) {
  std::string text = pdos("0x60420010", "0x60440010", "255") + pair_of("6046", "0", "3600") +
                     pair_of("6048", acceleration, "10", "7", "6") + pair_of("6049", "1800", "10", "7", "6") +
                     text_of({"1000", "7", "ro", "0x00010192"}) + text_of({"6502", "7", "ro", "2"}) +
                     text_of({"6060", "2", "rw", "2"}) + text_of({"6061", "2", "ro", "2"}) +
                     text_of({"6040", "6", "rww", "0"}) + text_of({"6041", "6", "ro", "0"}) +
                     text_of({"6042", "3", "rww", "0"});
  for (const char* index : {"6043", "6044"})
    text += text_of({index, "3", "ro", "0"});
  return text;
}

/// The second axis of a drive: the template's objects, 800h further.
std::string second_axis() {
  std::string text;
  for (const Line& line : kTemplate) {
    const unsigned index = static_cast<unsigned>(std::stoul(line.index, nullptr, 16));
    char further[5];
    std::snprintf(further, sizeof further, "%04X", index + 0x800);
    if (index >= 0x6000) text += text_of({further, line.type, line.access, line.value});
  }
  return text;
}

}  // namespace

// From the manual of FRENIC-Ace, 9-37: controlword and speed, then statusword and speed.
TEST_CASE("An inverter's start-up by PDO, without ramp bits") {
  Plant plant(inverter("0"));
  const auto state = [&](const char* command, const char* frame) {
    plant.bench.send(command).send("080#");
    plant.bench.expect(frame);
  };
  plant.bench.send("000#0105");
  state("205#00000000", "185#50020000");
  state("205#06000807", "185#31020000");
  state("205#07000807", "185#33020000");
  state("205#0F000807", "185#37020807");
}

TEST_CASE("An inverter's ramps, and the speed that its master reads meanwhile") {
  Plant plant(inverter("1800"));
  plant.bench.send("000#0105").send("205#06000807").send("205#07000807").send("205#0F000807");
  plant.bench.pass(5 * kSecond).send("080#");
  plant.bench.expect("185#37028403");  // 900
  plant.bench.pass(5 * kSecond).send("080#");
  plant.bench.expect("185#37020807");
  plant.write("406000", "0B000000");  // the file has no 604Ah: it stops immediately
  plant.bench.send("080#");
  plant.bench.expect("185#50020000");
}

TEST_CASE("A drive that can only home and interpolate: 60C1h by RPDO with SYNC") {
  Plant plant(file_with({{"6502", "7", "ro", "0x60"}, {"607A", "-", "", ""}, {"60FF", "-", "", ""}}) +
              pdos("0x60C10120", "0x60640020", "1") + pair_of("60C1", "0", "0", "4") +
              pair_of("60C2", "50", "-3", "5", "2") + pair_of("60FE", "1", "0xF0001"));
  plant.enable("07");
  plant.bench.send("000#0105");
  // 1000 in 50 ms, with SYNCs of 10 ms; the RPDO counts at the SYNC.
  for (const auto& [point, answer] : {std::pair{"00000000", "371600000000"},
                                      {"E8030000", "371200000000"},
                                      {"E8030000", "3712C8000000"},
                                      {"E8030000", "371290010000"}}) {
    plant.bench.send("205#1F00" + std::string(point)).send("080#");
    plant.bench.expect("185#" + std::string(answer));
    plant.bench.pass(10'000);
  }
  plant.bench.pass(kSecond);
  CHECK(plant.get(0x6064) == 1000);
}

TEST_CASE("A file without modes has velocity and interpolated mode if it has their set-points") {
  for (const auto& [index, type, modes] : {std::tuple{"6042", "3", 0x3AF}, {"60C1", "4", 0x3ED}}) {
    const std::string set_point =
        std::string(index) == "60C1" ? pair_of(index, "0", "0", type) : text_of({index, type, "rw", "0"});
    CHECK(Plant(file_with({}) + set_point).get(0x6502) == modes);
  }
}

TEST_CASE("A file whose 6502h is 0: a master reads that, and the modes are there all the same") {
  Plant plant(file_with({{"6502", "7", "ro", "0"}}));
  CHECK(plant.get(0x6502) == 0);
  plant.write("606000", "03000000", "2F");
  CHECK(plant.get(0x6061) == 3);
}

TEST_CASE("A drive with two axes: each moves alone, by its own objects") {
  Plant plant(file_with({}) + second_axis());
  plant.write("606800", "01000000", "2F");
  for (const char* word : {"06000000", "07000000", "0F000000"})
    plant.write("406800", word);
  plant.write("7A6800", "F4010000", "23");
  plant.write("406800", "1F000000");
  plant.bench.pass(10 * kSecond);
  CHECK(plant.get(0x6864) == 500);
  CHECK(plant.get(0x6841) == 0x1637);
  CHECK(plant.get(0x6064) == 0);
  CHECK(plant.get(0x6041) == 0x0250);
  CHECK(plant.get(0x6D02) == 0x3AD);
  plant.bench.ask("605#2F60680021000000", "585#8060680030000906");
  plant.move_to("0CFEFFFF");
  CHECK(plant.get(0x6064) == -500);
  CHECK(plant.get(0x6864) == 500);
}

TEST_CASE("A drive with two axes: incidents name the axis, the EMCY too") {
  Plant plant(file_with({}) + second_axis() + text_of({"1001", "5", "ro", "0"}) +
              text_of({"1014", "7", "ro", "0x85"}) + text_of({"603F", "6", "ro", "0"}) +
              text_of({"683F", "6", "ro", "0"}));
  const auto incident = [&](const char* name, bool present) {
    const bool known = plant.node->set_incident(name, present, plant.bench.now);
    plant.bench.pass(1);
    return known;
  };
  const auto alarms = plant.node->behaviour().alarms();
  CHECK(alarms.size() == 16);
  CHECK(std::ranges::count(alarms, "axis-2-motor-blocked") == 1);
  CHECK(std::ranges::count(alarms, "limit-switch-positive") == 0);
  CHECK_FALSE(incident("axis-1-overvoltage", true));
  CHECK_FALSE(incident("axis-3-overvoltage", true));
  CHECK(incident("axis-2-overvoltage", true));
  plant.bench.expect_at(plant.bench.now - 1, "085#1032050200000000");
  CHECK(plant.get(0x6841) == 0x0218);
  CHECK(plant.get(0x683F) == 0x3210);
  CHECK(plant.get(0x6041) == 0x0250);
  CHECK(incident("overvoltage", true));  // the code is already reported
  CHECK(plant.get(0x603F) == 0x3210);
  CHECK(incident("axis-2-overvoltage", false));
  plant.write("406800", "80000000");
  CHECK(plant.get(0x6841) == 0x0250);
  CHECK(incident("overvoltage", false));
  plant.bench.expect_silence();
  plant.bench.send("605#2B40600080000000");
  plant.bench.expect("585#6040600000000000", "085#0000000000000000");
}

TEST_CASE("A drive with two axes: touch probes, events and refused values of the second") {
  Plant plant(file_with({}) + second_axis() + text_of({"68B8", "6", "rw", "0"}) +
              text_of({"68B9", "6", "ro", "0"}) + text_of({"68BA", "4", "ro", "0"}) +
              text_of({"6898", "2", "rw", "0"}) + pair_of("1800", "0x185", "255", "7", "5") +
              pair_of("1A00", "0x68410010", "0x68B90010"));
  plant.bench.send("000#0105");
  plant.bench.expect("185#50020000");
  plant.bench.send("605#2BB8680011000000");
  plant.bench.expect("585#60B8680000000000", "185#50020100");
  CHECK_FALSE(plant.node->set_input(0x60BA, 0, 1, plant.bench.now));
  CHECK(plant.node->set_input(0x68BA, 0, 1, plant.bench.now));
  plant.bench.pass(1).expect_at(plant.bench.now - 1, "185#50020300");
  plant.bench.ask("605#2F98680064000000", "585#8098680030000906");
}

TEST_CASE("A drive shows the modes that it has, of each axis, and the levels at its touch probes") {
  Plant plant(file_with({}) + second_axis() + text_of({"6042", "3", "rww", "0"}) +
              text_of({"6044", "3", "ro", "0"}) + text_of({"68B8", "6", "rw", "0"}) +
              text_of({"68BA", "4", "ro", "0"}));
  const std::vector<sim::Point> points = plant.node->behaviour().points();
  const auto of = [&](std::uint16_t index, sim::Point::Kind kind) {
    const auto found = std::ranges::find_if(
        points, [&](const sim::Point& point) { return point.index == index && point.kind == kind; });
    return found == points.end() ? "" : found->name + " " + found->unit;
  };
  using enum sim::Point::Kind;
  CHECK(of(0x6042, kOutput) == "axis 1 target speed 1/min");
  CHECK(of(0x6044, kCurve) == "axis 1 speed 1/min");
  CHECK(of(0x6864, kCurve) == "axis 2 position inc");
  CHECK(of(0x686C, kCurve) == "axis 2 velocity inc/s");
  CHECK(of(0x68BA, kInput) == "axis 2 touch probe 1 ");
  CHECK(of(0x60BA, kInput) == "");
  const sim::Terminal probe{0x68BA, 0, std::nullopt, true};
  CHECK(plant.node->number(probe) == 0);
  CHECK(plant.node->set_input(0x68BA, 0, 1, plant.bench.now));
  CHECK(plant.node->number(probe) == 1);
}

TEST_CASE("A drive with two axes: the second follows SYNC, NMT and the network, and has its own machine") {
  const std::vector<devices::AxisLayout> layouts{{}, {.positive_limit = 100}};
  Plant plant(file_with({}) + second_axis() + text_of({"1005", "7", "rw", "0x80"}) +
                  text_of({"68FD", "7", "ro", "0"}),
              [&](sim::DeviceNode& node, std::uint64_t) { return devices::make_drive(node, layouts); });
  const auto enable_second = [&] {
    plant.write("406800", "80000000");
    for (const char* word : {"06000000", "0F000000"})
      plant.write("406800", word);
    CHECK((plant.get(0x6841) & 0x6F) == 0x27);
  };
  plant.write("606800", "08000000", "2F");
  enable_second();
  plant.bench.send("000#0105");
  plant.write("7A6800", "96000000", "23");
  plant.bench.send("080#").pass(10'000);
  CHECK(plant.get(0x6864) == 150);
  CHECK(plant.get(0x68FD) == 2);
  CHECK(plant.get(0x6064) == 0);
  plant.bench.send("000#0205");  // stopped
  CHECK((plant.get(0x6841) & 0x6F) == 0x08);
  CHECK(plant.get(0x6041) == 0x0250);
  plant.bench.send("000#8005");
  enable_second();
  sim::Behaviour& drive = plant.node->behaviour();
  drive.on_network_failure(sim::NetworkFailure::kHeartbeat, plant.bench.now);
  plant.bench.pass(1);
  CHECK((plant.get(0x6841) & 0x6F) == 0x08);
  drive.delay_commands(5'000);
  plant.write("406800", "80000000");
  CHECK((plant.get(0x6841) & 0x6F) == 0x08);
  plant.bench.pass(5'000);
  CHECK((plant.get(0x6841) & 0x6F) == 0x40);
  for (const std::uint16_t index : std::initializer_list<std::uint16_t>{0x6040, 0x6840, 0x687A, 0x68C1})
    CHECK(drive.is_set_point(index));
  for (const std::uint16_t index : std::initializer_list<std::uint16_t>{0x6883, 0x7040})
    CHECK_FALSE(drive.is_set_point(index));
}

}  // namespace cbcan::test
