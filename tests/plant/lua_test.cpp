// SPDX-License-Identifier: MIT
// Devices that are Lua scripts: what a script can do, and that it can disturb only its own node.
#include "hostile_scripts.hpp"
#include "scripts.hpp"

namespace cbcan::plant::test {
namespace {

TEST_CASE("the script of docs/how-to/lua-device.md is a valve that takes two seconds, and can get stuck") {
  const std::string page = *reader()("docs/how-to/lua-device.md");
  const std::size_t begin = page.find("```lua\n") + 7;
  const auto plant = plant_of("[[node]]\nid = 20\ndevice = \"t.lua\"\n",
                              script(page.substr(begin, page.find("```", begin) - begin)));
  run(*plant, "set 20 0x2001 100");
  run(*plant, "pass 1234ms");
  CHECK(std::stod(run(*plant, "get 20 0x2000")) == Approx(61.7));
  run(*plant, "incident 20 stuck on");
  run(*plant, "pass 10s");
  CHECK(std::stod(run(*plant, "get 20 0x2000")) == Approx(61.7));
  run(*plant, "incident 20 stuck off");
  CHECK(run(*plant, "wait object 20 0x2000 = 100") == "12.000000");
  run(*plant, "trigger write 20 0x2001 0 1 101");
  run(*plant, "wait transaction ended");
  CHECK(run(*plant, "read 3706 2") == "49 1545");
}

TEST_CASE("the same seed gives the same bytes, whatever a script looks at") {
  const base::FileReader files = script(R"(
local function hash(text) local h = 5381 for i = 1, #text do h = (h * 33 + text:byte(i)) & 0xFFFFFFFF end return h end
local t = { [3] = "c", x = 1, [1] = "a", y = 2, [true] = 3, [false] = 4, [2.5] = 5, aa = 6 }
local order = ""
for key, value in pairs(t) do order = order .. tostring(key) .. "=" .. tostring(value) .. " " end
local list = {}
for i = 1, 500 do list[i] = math.random(1000) end
table.sort(list, function(a, b) return a // 100 < b // 100 end)  -- many are equal
local text = order .. table.concat(list, ",") .. tostring({}) .. string.format("%s %s", {}, print) ..
             tostring(setmetatable({}, { __name = "x" })) .. tostring(math.random())
local of_text, of_order = hash(text), hash(order)
function update(now) set(0x2004, 0, of_text) set(0x2008, 0, of_order) end
)");
  const auto value = [&](std::string_view what, std::string_view seed) {
    const auto plant = plant_of(fmt::format("[random]\nseed = {}\n{}", seed, kScripted), files);
    return run(*plant, what);
  };
  const std::string known = value("get 20 0x2004", "1");
  CHECK(known == "4122810676");  // on every machine
  CHECK(value("get 20 0x2004", "1") == known);
  CHECK(value("get 20 0x2004", "2") != known);
  CHECK(value("get 20 0x2008", "2") == value("get 20 0x2008", "1"));
}

TEST_CASE("what a script cannot do: it ends with its line, and costs its own node only") {
  for (const cbcan::test::Hostile& row : cbcan::test::kHostile) {
    CAPTURE(row.script);
    const auto plant = plant_of(kScripted, script(text_of(row)));
    run(*plant, "pass 10ms");
    CHECK(run(*plant, "get 32 0x2001") == "0");
    run(*plant, "trigger read 20 0x2001 0 1");  // SDO goes on
    run(*plant, "wait transaction ended");
    CHECK(run(*plant, "read 3700") == "0");
    const bool failed = run(*plant, "get 20 0x1001") == "1";
    if (row.why.empty() && !failed) continue;
    CHECK(failed);
    std::string said;
    for (const std::string& line : plant->said())
      said += line + "\n";
    CAPTURE(said);
    CHECK(said.find("node 20: " + row.why) != std::string::npos);
  }
}

std::vector<std::string> lines(std::string text) {
  return build(kScripted, script(std::move(text))).build.lines;
}

TEST_CASE("no text of a script has the character 0, which Lua compares piece by piece") {
  for (const std::string text : {"'\\0'", "'a\\00'", "'\\0001'", "'\\x00'", "'\\u{0}'", "'\\u{000}'"})
    CHECK(lines("local text = " + text) ==
          std::vector<std::string>{"plant.toml:1: node 20: t.lua: a text cannot have the character 0"});
  for (const std::string text :
       {"'\\\\0'", "'\\10'", "'\\065'", "'\\x10'", "'\\u{41}'", "'\\u{041}'", "'\\n0'"})
    CHECK(lines("local text = " + text).empty());
}

TEST_CASE("numbers of a script are checked where they become others") {
  const base::FileReader files = script(R"(
local wrong = { 1e300, 0 / 0, -1, 4294967296, [6] = 1.5, [7] = true, [8] = "x", [9] = {} }
function on_write(index, sub, value) return wrong[value] or value == 5 and 0xFFFFFFFF or nil end
)");
  for (const int value : {1, 2, 3, 4, 5, 6, 7, 8, 9}) {
    const auto plant = plant_of(kScripted, files);
    run(*plant, fmt::format("trigger write 20 0x2001 0 1 {}", value));
    run(*plant, "wait transaction ended");
    CHECK(run(*plant, "read 3700") == (value == 5 ? "4" : "0"));
    CHECK((run(*plant, "read 3706 2") == "65535 65535") == (value == 5));
    CHECK(run(*plant, "get 20 0x1001") == (value == 5 ? "0" : "1"));
    const std::string why = value == 8 ? "a string" : value == 9 ? "a table" : "what is no SDO abort code";
    CHECK((plant->said().empty() || plant->said().back().ends_with("t.lua: on_write has returned " + why)));
  }
}

TEST_CASE("the number of a script that stands for a later answer is 0800 0000h, and nothing waits for it") {
  const auto plant =
      plant_of(kScripted, script("function on_write(index, sub, value) return 0xFFFFFFFE end"));
  run(*plant, "trigger write 20 0x2001 0 1 7");
  run(*plant, "wait transaction ended");
  CHECK(run(*plant, "read 3706 2") == "0 2048");
}

TEST_CASE("what does not fit an object, or an argument") {
  const base::FileReader files =
      reader({{"t.lua", R"(
set(0x2008, 0, 1e300)
local large = get(0x2008) == 2.0 ^ 64 and "large" or "wrong"
local all = ""
for _, call in ipairs({ function() get(0x12001) end, function() get(0x2001, 256) end, function() emcy(65536) end,
                        function() emcy(0xFF01, -1) end, function() emcy_over(65536) end }) do
  local good, message = pcall(call)
  all = all .. (good and "good " or "") .. (message or "") .. "\n"
end
function on_sync() print(large) print(all) end
)"},
              {"r.lua", "function update() set(0x2000, 0, get(0x2001) * 1e300) end"}});
  const auto plant = plant_of(std::string(kScripted) + R"([[node]]
id = 21
eds = "plants/tank.lua"
device = "r.lua"
)",
                              files);
  run(*plant, "nmt start 20");
  run(*plant, "send 080#");
  const auto said = plant->said();
  REQUIRE(said.size() == 2);
  CHECK(said[0].ends_with("large"));
  for (const char* problem :
       {"bad argument #1 to 'get' (is out of range)", "bad argument #2 to 'get' (is out of range)",
        "bad argument #1 to 'emcy' (is out of range)"})
    CHECK(said[1].find(problem) != std::string::npos);
  CHECK(said[1].find("good") == std::string::npos);
  const auto exact = plant_of("[[node]]\nid = 20\ndevice = \"t.lua\"\n", script(R"(
objects = { { index = 0x2000, type = "i64" }, { index = 0x2001, type = "u64" }, { index = 0x2002, type = "i8" } }
function on_sync()
  set(0x2000, 0, 9007199254740993) set(0x2001, 0, math.maxinteger) set(0x2002, 0, math.mininteger)
  print(get(0x2000), get(0x2001), get(0x2002))
  set(0x2000, 0, math.mininteger) set(0x2001, 0, -1) set(0x2002, 0, 300)
  print(get(0x2000), get(0x2001), get(0x2002))
end)"));
  run(*exact, "nmt start 20");
  run(*exact, "send 080#");
  REQUIRE(exact->said().size() == 2);
  CHECK(exact->said()[0].ends_with(" 9007199254740993 9223372036854775807 -128"));
  CHECK(exact->said()[1].ends_with(" -9223372036854775808 0 127"));
  run(*plant, "set 21 0x2001 100");
  CHECK(std::stod(run(*plant, "get 21 0x2000")) == Approx(3.4028235e38));
  run(*plant, "set 21 0x2001 0");
  CHECK(std::stod(run(*plant, "get 21 0x2000")) == 0);
}

TEST_CASE("a script is loaded again, and a wrong one is not") {
  Files files{{"t.lua", "function update() set(0x2001, 0, 5) end"}};
  const auto plant = plant_of(kScripted, [&files](const std::string& path) { return reader(files)(path); });
  CHECK(run(*plant, "get 20 0x2001") == "5");
  files["t.lua"] = "function update() set(0x2001, 0, 6)\n\nfinish";
  CHECK(run(*plant, "reload 20") == "error: t.lua:3: syntax error near <eof>");
  run(*plant, "pass 1s");
  CHECK(run(*plant, "get 20 0x2001") == "5");
  files["t.lua"] = "function update() set(0x2001, 0, 6) end";
  CHECK(run(*plant, "reload 20") == "");
  CHECK(run(*plant, "get 20 0x2001") == "6");
  files.clear();
  CHECK(run(*plant, "reload 20") == "error: cannot read t.lua; paths are relative to the plant file");
  const auto shelf = plant_of("[[node]]\nid = 5\ndevice = \"cia406\"\n");
  for (const char* line : {"set 5 0x6004 1", "reload 5"})
    CHECK(run(*shelf, line) == "");
  CHECK(run(*shelf, "get 5 0x6004") == "4096");
  CHECK(run(*plant, "reload 32") == "error: node 32: its device is none, which is no script");
}

TEST_CASE("a script that cannot start is reported with its line; bytecode is rejected") {
  using Lines = std::vector<std::string>;
  CHECK(lines("\x1BLua") ==
        Lines{"plant.toml:1: node 20: t.lua: attempt to load a binary chunk (mode is 't')"});
  CHECK(lines(std::string("x = ") + std::string(100'000, '('))
            .front()
            .starts_with("plant.toml:1: node 20: t.lua: C stack overflow"));
}

TEST_CASE("what goes round through scripts and wires does not stop time") {
  const auto plant = plant_of(std::string(kScripted) + "[[wire]]\nfrom = \"20:0x2004\"\nto = \"20:0x2002\"\n",
                              script("function update() set(0x2004, 0, get(0x2002) + 1) end"));
  run(*plant, "pass 20ms");
  CHECK(plant->now() == 20 * kMillisecond);
  CHECK(std::stoi(run(*plant, "get 20 0x2002")) > 20);
}

}  // namespace
}  // namespace cbcan::plant::test
