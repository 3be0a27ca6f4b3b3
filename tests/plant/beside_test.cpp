// SPDX-License-Identifier: MIT
// What a plant file says of a device besides its EDS file: a script beside it, a drive's units.
#include "scripts.hpp"

namespace cbcan::plant::test {
namespace {

constexpr std::string_view kModule = "[[node]]\nid = 66\neds = \"demo:/io_module.eds\"\nscript = \"t.lua\"\n";
constexpr std::string_view kDrive = "[[node]]\nid = 66\neds = \"demo:/drive.eds\"\nscript = \"t.lua\"\n";

std::string written(VirtualPlant& plant, std::string_view object_size_and_words) {
  run(plant, fmt::format("trigger write 66 {}", object_size_and_words));
  return run(plant, "read 3700") == "0" ? "" : run(plant, "read 3706 2");
}

TEST_CASE("what is written by SDO and RPDO is seen before the device, what it has done after it") {
  const auto plant = plant_of(kModule, script(R"(
function on_write(index, sub, value) if index == 0x6200 and value == 0x99 then return 0x06090030 end end
function before_update() if get(0x6200, 1) & 0x80 ~= 0 then set(0x6200, 1, 0x01) end end
function update() set(0x6000, 1, get(0x6000, 1) | 0x80) end
)"));
  run(*plant, "nmt start all");
  CHECK(written(*plant, "0x6200 1 1 0x99") == "48 1545");
  CHECK(written(*plant, "0x6200 1 1 0x06").empty());
  CHECK(run(*plant, "get 66 output:2") == "1");
  run(*plant, "send 242#88");  // by PDO
  CHECK(run(*plant, "get 66 0x6200:1") == "1");
  CHECK(run(*plant, "get 66 output:1") == "1");
  CHECK(run(*plant, "get 66 output:4") == "0");
  CHECK(run(*plant, "get 66 0x6000:1") == "128");
  run(*plant, "set 66 input:1 1");
  CHECK(run(*plant, "get 66 0x6000:1") == "129");
  run(*plant, "set 66 input:1 0");
  CHECK(run(*plant, "get 66 0x6000:1") == "128");
}

TEST_CASE("an event is a change of what the script leaves, not of what the device sets each time") {
  const auto plant = plant_of(kDrive, script("function update() set(0x6041, 0, get(0x6041) | 0x4000) end\n"));
  Frames frames(*plant);
  const auto of_first_pdo = [&] {
    std::erase_if(frames.seen, [](const std::string& frame) { return !frame.starts_with("1C2"); });
    return std::exchange(frames.seen, {});
  };
  using Seen = std::vector<std::string>;
  run(*plant, "nmt start all");
  CHECK(of_first_pdo() == Seen{"1C2#5042"});
  run(*plant, "send 242#0600");
  CHECK(of_first_pdo() == Seen{"1C2#3142"});
  for (const std::string speed : {"1", "2", "3"})  // changes nothing of 6041h
    CHECK(written(*plant, "0x6081 0 4 " + speed + " 0").empty());
  CHECK(of_first_pdo().empty());
}

TEST_CASE("objects are added and removed; those of the file stay as they are there") {
  const auto plant = plant_of(kDrive, script(R"(
objects = {
  { index = 0x3101, sub = 1, name = "Temperature: stage", type = "i16", access = "ro", default = -40, unit = "K", show = "curve" },
  { index = 0x3101, sub = 2, name = "Temperature: limit", type = "i16", default = 80, low = 0, high = 90 },
  { index = 0x6502, access = "none" },
  { index = 0x607A, type = "u8", default = 9, name = "Target", show = "curve" },
}
function update(now) set(0x3101, 1, math.floor(now * 1000)) if now < 0.5 then return 0.5 end end
)"));
  CHECK(run(*plant, "get 66 0x3101:1") == "0");
  run(*plant, "pass 1s");
  CHECK(run(*plant, "get 66 0x3101:1") == "1000");
  CHECK(run(*plant, "get 66 0x3101:2") == "80");
  CHECK(written(*plant, "0x3101 2 2 91") == "49 1545");
  CHECK(written(*plant, "0x3101 1 2 1") == "2 1537");
  CHECK(written(*plant, "0x6502 0 4 1 0") == "0 1538");
  CHECK(written(*plant, "0x607A 0 4 9 0").empty());
  CHECK(run(*plant, "points 66").find("0x3101:1") != std::string::npos);
  CHECK(run(*plant, "points 66").find("0x6064") != std::string::npos);
}

TEST_CASE("incidents and EMCY are of both") {
  const auto plant = plant_of(kDrive, script(R"(
incidents = { "fan" } alarms = { "fan" }
function on_incident(name, present) if present then emcy(0xFF02) else emcy_over(0xFF02) end end
)"));
  Frames frames(*plant);
  run(*plant, "incident 66 fan on");
  CHECK(frames.seen == std::vector<std::string>{"0C2#02FF010000000000"});
  CHECK(run(*plant, "get 66 0x6041") == "592");
  run(*plant, "incident 66 overtemperature on");
  CHECK(run(*plant, "get 66 0x6041") == "536");
}

TEST_CASE("a fault refuses what clients write, not what a script sets") {
  const auto plant = plant_of(
      kModule,
      script("function on_write(index, _, value) if index == 0x6200 then set(0x1800, 5, value) end end"));
  run(*plant, "fault 66 refuse index=0x1800 sub=5");
  CHECK(written(*plant, "0x6200 1 1 20").empty());
  CHECK(run(*plant, "get 66 0x1800:5") == "20");
  CHECK(written(*plant, "0x1800 5 2 30") == "32 2048");  // 0800 0020h
  CHECK(run(*plant, "get 66 0x1800:5") == "20");
}

TEST_CASE("a script that fails leaves the device") {
  const auto plant = plant_of(
      kModule, script("function before_update() if get(0x6200, 1) == 7 then error('seven') end end\n"));
  CHECK(written(*plant, "0x6200 1 1 7").empty());
  CHECK(plant->said().back().find("t.lua:1: seven") != std::string::npos);
  CHECK(run(*plant, "get 66 0x1001") == "1");
  CHECK(written(*plant, "0x6200 1 1 3").empty());
  CHECK(run(*plant, "get 66 output:2") == "1");
}

TEST_CASE("a script that is not there, or is none") {
  const auto line = [](const base::FileReader& files) { return build(kModule, files).build.lines.at(0); };
  CHECK(line(reader()) == "plant.toml:1: node 66: cannot read t.lua; paths are relative to the plant file");
  CHECK(line(script("objects = { { index = 0x3101, type = 'u7' } }")) ==
        "plant.toml:1: node 66: t.lua: objects: 3101h: type: \"u7\" is none; write bool, i8, i16, i32, i64, "
        "u8, u16, u32, u64, f32, f64 or text");
  CHECK(line(script("x = ")) == "plant.toml:1: node 66: t.lua:1: unexpected symbol near <eof>");
}

TEST_CASE("units of a drive whose file names none: 60 1/min is a revolution a second, 360 degrees") {
  const auto plant = plant_of(
      "[[node]]\nid = 66\neds = \"demo:/drive.eds\"\n"
      "axis = { position_unit = \"degree\", velocity_unit = \"1/min\" }\n"
      "objects = [{ index = 0x6092, sub = 1, value = 1 }]\n");
  for (const std::string object : {"0x6060 0 1 3", "0x60FF 0 4 60 0", "0x6040 0 2 6", "0x6040 0 2 15"})
    CHECK(written(*plant, object).empty());
  run(*plant, "pass 1s");
  CHECK(run(*plant, "get 66 0x6064") == "360");
  CHECK(run(*plant, "get 66 0x606C") == "60");
  CHECK(run(*plant, "get 66 0x6063") == "10000");  // 608Fh
}

}  // namespace
}  // namespace cbcan::plant::test
