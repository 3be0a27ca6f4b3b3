// SPDX-License-Identifier: MIT
// Devices without an EDS file, from the declarations of their scripts; blocks in scripts and on wires; the
// shelf.

#include "descriptions/eds_reader.hpp"
#include "devices/lua/lua_device.hpp"
#include "scripts.hpp"
#include "support/case_file.hpp"

namespace cbcan::plant::test {
namespace {

using namespace cbcan::test;

constexpr std::string_view kAlone = "[[node]]\nid = 20\ndevice = \"t.lua\"\n";

descriptions::Result read_declared(const std::string& script) {
  return descriptions::read(devices::eds_of_script("t.lua", script), "t.eds", std::uint8_t{20});
}

/// Little-endian, of the object there.
std::vector<std::uint8_t> value(const descriptions::Result& result, std::uint16_t index,
                                std::uint8_t sub = 0) {
  const descriptions::Object* const object = result.device.find(index, sub);
  REQUIRE(object != nullptr);
  return object->value;
}

std::string what_is_wrong(const std::string& script) {
  const Built built = build(kAlone, plant::test::script(script));
  CHECK_FALSE(built.build.good);
  return built.build.lines.empty() ? "" : built.build.lines.front();
}

using Value = std::vector<std::uint8_t>;

TEST_CASE("a script's declarations are a whole EDS file, without a remark of the reader") {
  const descriptions::Result result = read_declared(R"(
device = { type = 0x12345678, name = "Thing", vendor = 0x99, product = 2, revision = 3, heartbeat_ms = 500 }
objects = {
  { index = 0x2000, name = "a", type = "f32", access = "ro", default = 1.5, pdo = "tx" },
  { index = 0x2001, name = "b", type = "i16", default = -2, low = -100, high = 300, pdo = "rx" },
  { index = 0x2002, sub = 1, name = "c: first", type = "u8", pdo = "tx" },
  { index = 0x2002, sub = 3, name = "c: third", type = "u32", access = "ro", default = 0xFFFFFFFF, pdo = "tx" },
  { index = 0x6000, name = "d", type = "text", default = "abc" },
  { index = 0x6001, name = "e", type = "bool", default = 1, pdo = "rx" },
  { index = 0x6002, name = "f", type = "i64", default = 9223372036854775807 },
}
)");
  CHECK(result.diagnostics.empty());
  CHECK(value(result, 0x1000) == Value{0x78, 0x56, 0x34, 0x12});
  CHECK(value(result, 0x1001) == Value{0});
  CHECK(value(result, 0x1008) == Value{'T', 'h', 'i', 'n', 'g'});
  CHECK(value(result, 0x1014) == Value{0x94, 0, 0, 0});
  CHECK(value(result, 0x1017) == Value{0xF4, 0x01});
  CHECK(value(result, 0x1018) == Value{4});
  CHECK(value(result, 0x1018, 1) == Value{0x99, 0, 0, 0});
  CHECK(value(result, 0x1018, 3) == Value{3, 0, 0, 0});
  // 2000h and 2002h:01 take 5 bytes; 4 more are another TPDO.
  CHECK(value(result, 0x1800, 1) == Value{0x94, 0x01, 0, 0});
  CHECK(value(result, 0x1801, 1) == Value{0x94, 0x02, 0, 0});
  CHECK(value(result, 0x1A00) == Value{2});
  CHECK(value(result, 0x1A00, 1) == Value{0x20, 0x00, 0x00, 0x20});
  CHECK(value(result, 0x1A00, 2) == Value{0x08, 0x01, 0x02, 0x20});
  CHECK(value(result, 0x1A01, 1) == Value{0x20, 0x03, 0x02, 0x20});
  CHECK(value(result, 0x1400, 1) == Value{0x14, 0x02, 0, 0});
  CHECK(value(result, 0x1600, 1) == Value{0x10, 0x00, 0x01, 0x20});
  CHECK(value(result, 0x1600, 2) == Value{0x01, 0x00, 0x01, 0x60});
  CHECK(value(result, 0x2000) == Value{0, 0, 0xC0, 0x3F});
  CHECK(value(result, 0x2001) == Value{0xFE, 0xFF});
  CHECK(result.device.find(0x2001, 0)->low == -100);
  CHECK(result.device.find(0x2001, 0)->high == 300);
  CHECK(value(result, 0x2002) == Value{3});
  CHECK(result.device.find(0x2002, 3)->access == descriptions::Access::kReadOnly);
  CHECK(value(result, 0x6000) == Value{'a', 'b', 'c'});
  CHECK(value(result, 0x6001) == Value{1});
  CHECK(value(result, 0x6002) == Value{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F});
  CHECK(result.device.find(0x2002, 2) == nullptr);
}

TEST_CASE("each mistake of a script has its message") {
  for (const FileCase& each : cases_of("tests/plant/script_mistakes.txt")) {
    std::string script = each.text();
    if (script.starts_with("@u8"))
      script.replace(0, 3, "objects = { { index = 0x2000, sub = 1, type = \"u8\"");
    each.check(without("plant.toml:1: node 20: ", {what_is_wrong(script)}));
  }
}

TEST_CASE("a script names the bits and the incidents that report something wrong") {
  const auto plant = plant_of(kAlone, script(R"(
objects = { { index = 0x2000, name = "lamps", type = "u8", bits = { "ready", "hot", "dry" }, alarm = { "dry", "hot" }, show = "output" } }
incidents = { "door-open", "leak" }
alarms = { "leak" }
)"));
  const sim::Behaviour& device = node_of(plant->view(), "20").behaviour();
  CHECK(device.points().front().alarm == 6);
  CHECK(device.alarms() == std::vector<std::string_view>{"leak"});
  CHECK(what_is_wrong("objects = { { index = 0x2000, type = 'u8', bits = { 'on' }, alarm = { 'off' }, show = "
                      "'output' } }") ==
        "plant.toml:1: node 20: t.lua: objects: 2000h: alarm: \"off\" is none; write on");
  CHECK(what_is_wrong(
            "objects = { { index = 0x2000, type = 'u8' } } incidents = { 'leak' } alarms = { 'leek' }") ==
        "plant.toml:1: node 20: t.lua: alarms: \"leek\" is none of its incidents; did you mean leak?");
}

TEST_CASE("what a script declares counts in its memory") {
  constexpr std::string_view kTooMuch =
      "plant.toml:1: node 20: t.lua: takes more memory than a script may have";
  const auto declare = [](const std::string& letters) {
    return "local text, show, bits = ('x'):rep(" + letters +
           "), { 'input', 'input' }, {} for i = 1, 64 do bits[i] = text end objects = {} for i = 1, 250 do "
           "objects[i] = { index = 0x2000 + i, type = 'u8', show = show, bits = bits } end";
  };
  CHECK(what_is_wrong(declare("40000")) ==
        "plant.toml:1: node 20: t.lua: objects: 2001h: bits: a text has more than 200 letters");
  CHECK(what_is_wrong(declare("200")) == kTooMuch);
  CHECK(what_is_wrong("local t = { index = 1 } for i = 1, 3000 do t['k' .. i] = i end "
                      "objects = {} for i = 1, 250 do objects[i] = t end") == kTooMuch);
  const auto plant = plant_of(kAlone, script(declare("20")));
  CHECK(std::ranges::count(run(*plant, "points 20"), '\n') == 250);
}

TEST_CASE("blocks that keep changes count in a script's memory until they are gone") {
  const auto said = [](const std::string& text) {
    const auto plant = plant_of(kAlone, script("objects = { { index = 0x2000, type = 'u8' } } " + text));
    run(*plant, "pass 10s");
    return plant->said().empty() ? "" : plant->said().front();
  };
  CHECK(said("local all = {} for i = 1, 300 do all[i] = block('dead-time time=99') end\n"
             "function update(now) for i = 1, 300 do all[i](now) end return now + 0.01 end")
            .find("t.lua:2: takes more memory than a script may have") != std::string::npos);
  CHECK(said("function update(now) block('dead-time time=99')(now) return now + 0.001 end").empty());
}

TEST_CASE("a condition is no command: within is not part of it") {
  const auto plant = demo();
  CHECK_THROWS_WITH(
      make_condition("object 32 0x2001 >= 5 within 3600s", plant->view()),
      "object 32 0x2001 >= 5 within 3600s: within is a key of its own; write within = \"3600s\"");
}

TEST_CASE("a parameter file is copied: its values apply, and 1010h stores as long as the plant lasts") {
  const auto plant =
      plant_of("[module]\nnode_id = 127\nparameters = \"m.txt\"\n", reader({{"m.txt", "1017:00 = F401\n"}}));
  Frames frames(*plant);
  plant->execute("send 67F#4017100000000000");
  CHECK(frames.seen.back() == "5FF#4B171000F4010000");
  plant->execute("send 67F#2B171000E8030000");
  plant->execute("send 67F#2310100173617665");
  CHECK(frames.seen.back() == "5FF#6010100100000000");
  plant->execute("nmt reset-node 127");
  plant->execute("pass 100ms");
  plant->execute("send 67F#4017100000000000");
  CHECK(frames.seen.back() == "5FF#4B171000E8030000");
}

TEST_CASE("an object of bytes is compared with bytes") {
  const auto plant = demo("[[node]]\nid = 5\neds = \"demo:/generic.eds\"\n");
  const auto condition = [&](const std::string& rest) {
    return make_condition("object 5 0x200E " + rest, plant->view())->holds(plant->view());
  };
  const std::string shown = run(*plant, "get 5 0x200E");
  REQUIRE(shown.starts_with("\"hex:"));
  CHECK(condition("= " + shown));
  CHECK(condition("= " + shown.substr(1, shown.size() - 2)));
  CHECK(!condition("!= " + shown));
  CHECK(condition("!= hex:0102 03"));
  CHECK_THROWS_AS(condition("!= 0102"), Refused);
}

TEST_CASE("blocks in a script: the same as by themselves, and an error for what is none") {
  const auto plant = plant_of(kAlone, script(R"(
objects = { { index = 0x2000, name = "level", type = "f32" }, { index = 0x2001, name = "in", type = "i16" } }
local level = block("integrator gain=2 high=7")
function update(now)
  local value, moves = level(get(0x2001))
  set(0x2000, 0, value)
  return moves and math.min(now + 0.3, moves)
end
function on_sync() block("pt3") end
)"));
  run(*plant, "set 20 0x2001 1");
  run(*plant, "pass 1700ms");
  CHECK(std::stod(run(*plant, "get 20 0x2000")) == Approx(3.4).epsilon(1e-6));
  CHECK(run(*plant, "wait object 20 0x2000 >= 7") == "3.500000");
  run(*plant, "nmt start 20");
  run(*plant, "send 080#");
  REQUIRE(plant->said().size() == 1);
  CHECK(plant->said()[0].find("t.lua:9: block \"pt3\": no such kind; there are pt1, ") != std::string::npos);
}

/// A node of the shelf, with lines of the plant file.
std::unique_ptr<VirtualPlant> of_shelf(std::string_view device, std::string_view more = "") {
  return plant_of(fmt::format("[[node]]\nid = 20\ndevice = \"{}\"\n{}", device, more));
}

TEST_CASE("shelf: the devices are taken for their profile in a file's 1000h, with what the file has") {
  const auto of_file = [](const std::string& type, const std::string& object) {
    return plant_of("[[node]]\nid = 20\neds = \"e.eds\"\n",
                    reader({{"e.eds", "[1000]\nDataType=7\nDefaultValue=" + type + "\n[1001]\nDataType=5\n" +
                                          object + "\nAccessType=ro\n"}}));
  };
  const auto plant = of_file("0x00010196", "[6004]\nDataType=7");
  CHECK(run(*plant, "nodes").starts_with("#1 20 pre-operational cia406"));
  run(*plant, "set 20 0x6004 0.25");
  CHECK(run(*plant, "get 20 0x6004") == "1024");  // of 4096 steps
  const auto named = of_shelf("cia406");
  run(*named, "set 20 position 0.25");
  CHECK(run(*named, "get 20 position") == "1024");  // the curve, not the input
  const auto unsigned_offset =
      of_file("0x00010196", "[6004]\nDataType=7\n[6003]\nDataType=7\n[6509]\nDataType=7");
  run(*unsigned_offset, "set 20 0x6004 0.25");
  run(*unsigned_offset, "trigger write 20 0x6003 0 4 24 0");
  CHECK(run(*unsigned_offset, "get 20 0x6509") == "4294966296");  // -1000
  CHECK(run(*unsigned_offset, "get 20 0x6004") == "24");
  const auto wide = of_file("0x0000019A", "[6110]\nDataType=4");
  run(*wide, "set 20 0x6110 -45.5");
  CHECK(run(*wide, "get 20 0x6110") == "-4550");
}

TEST_CASE("shelf: an incident outlasts reset and power-off, with its EMCY after the boot-up message") {
  struct Shelf {
    const char *device, *incident, *emcy, *set, *shown, *value;
  };
  for (const Shelf& row :
       {Shelf{"cia406", "sensor-break", "094#0050010000000000", "0x6004 1.5", "0x6004", "6144"},
        {"cia408", "spool-stuck", "094#0070010000000000", "0x6300:1 5", "0x6041", "1"},
        {"cia410", "sensor-break", "094#0050010000000000", "0x6010 45", "0x6010", "4500"},
        {"cia418", "overtemperature", "094#1042010000000000", "0x2000 -5", "0x6010", "520"}}) {
    const auto plant = of_shelf(row.device);
    Frames frames(*plant);
    const auto runs = [&](const std::vector<std::string>& lines) {
      frames.seen.clear();
      for (const std::string& line : lines)
        run(*plant, line);
      CHECK(run(*plant, "get 20 0x1001") == "1");
      CHECK(run(*plant, fmt::format("get 20 {}", row.shown)) == row.value);
      return frames.seen;
    };
    run(*plant, fmt::format("set 20 {}", row.set));
    run(*plant, "get 20 0x1001");
    CHECK(runs({fmt::format("incident 20 {} on", row.incident)}) == std::vector<std::string>{row.emcy});
    CHECK(runs({"nmt reset-node 20"}) == std::vector<std::string>{"000#8114", "714#00", row.emcy});
    CHECK(runs({"power 20 off", "power 20 on"}) == std::vector<std::string>{"714#00", row.emcy});
    run(*plant, fmt::format("incident 20 {} off", row.incident));
    frames.seen.clear();
    run(*plant, "nmt reset-node 20");
    CHECK(frames.seen == std::vector<std::string>{"000#8114", "714#00"});
  }
}

TEST_CASE("timing: a node needs time to boot and to answer, the same with each seed") {
  const auto times = [](std::string_view seed) {
    const auto plant = of_shelf("cia406", fmt::format("timing = \"typical\"\n[random]\nseed = {}\n", seed));
    Frames frames(*plant);
    std::string all = run(*plant, "wait frame 714#00 within 5s");
    for (int i = 0; i < 20; ++i) {
      const double before = std::stod(run(*plant, "time"));
      run(*plant, "trigger read 20 0x1000 0 4");
      const double took = std::stod(run(*plant, "wait transaction ended")) - before;
      all += fmt::format(" {:.6f}", took);
      CHECK(run(*plant, "read 3700") == "0");
      CHECK((took >= 0.001 && took <= 0.0081));
    }
    return all;
  };
  const std::string one = times("1");
  CHECK(std::stod(one) >= 0.3);
  CHECK(std::stod(one) <= 2);
  CHECK(times("1") == one);
  CHECK(times("2") != one);
}

TEST_CASE("timing: before its boot-up message a node hears nothing; heartbeats drift by at most 10 ms") {
  const auto plant = of_shelf("cia406", "timing = \"typical\"\nheartbeat_ms = 1000\n");
  CHECK(run(*plant, "nodes").starts_with("#1 20 initialising "));
  run(*plant, "nmt start 20");
  run(*plant, "trigger read 20 0x1000 0 4");
  CHECK(std::stod(run(*plant, "wait transaction ended")) > 0.3);
  CHECK(run(*plant, "nodes").starts_with("#1 20 pre-operational "));
  CHECK(run(*plant, "read 3706 2") == "34 2048");  // 0800 0022h: ended by the boot-up message
  run(*plant, "pass 2s");
  std::vector<Time> late;
  for (int i = 0; i < 200; ++i) {
    run(*plant, "wait frame 714#7F");
    late.push_back(plant->now());
  }
  const auto offset = [&](std::size_t i) { return (late[i] - late[0] + 10'000'000'000 - i * kSecond); };
  std::vector<Time> offsets;
  for (std::size_t i = 0; i < late.size(); ++i)
    offsets.push_back(offset(i));
  const auto [least, most] = std::ranges::minmax(offsets);
  CHECK(most - least > 5'000);
  CHECK(most - least < 10'000);
}

TEST_CASE("timing: a drive acts on a controlword 2 to 8 ms later, and misses one that is replaced before") {
  const auto plant = plant_of("[[node]]\nid = 16\neds = \"plants/demo/drive.eds\"\ntiming = \"typical\"\n");
  run(*plant, "wait frame 710#00 within 5s");
  const auto delay_of = [&](std::string_view word, std::string_view status) {
    const Time before = plant->now();
    run(*plant, fmt::format("set 16 0x6040 {}", word));
    run(*plant, fmt::format("wait object 16 0x6041 = {} within 1s", status));
    return plant->now() - before;
  };
  CHECK(run(*plant, "get 16 0x6041") == "592");
  const Time delay = delay_of("6", "561");
  CHECK((delay >= 2'000 && delay <= 8'000));
  CHECK(delay_of("7", "563") == delay);
  CHECK(delay_of("0", "592") == delay);
  run(*plant, "set 16 0x6040 6");
  run(*plant, "set 16 0x6040 7");  // Switch on alone does nothing in Switch on disabled
  run(*plant, "pass 100ms");
  CHECK(run(*plant, "get 16 0x6041") == "592");
}

}  // namespace
}  // namespace cbcan::plant::test
