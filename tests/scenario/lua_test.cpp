// SPDX-License-Identifier: MIT
// Devices that are Lua scripts: what a script can do, and that it can harm nobody but its own node.
#include "scripts.hpp"

namespace cbcan::scenario::test {
namespace {

TEST_CASE("what a script can do") {
  const Files files{{"t.lua", R"(
incidents = { "leak", "frozen" }
set(0x2002, 0, 700)                       -- the power-on value
local syncs, states = 0, ""
function reset(now) set(0x2001, 0, 1) end
function update(now)
  if get(0x2003) == 5 then emcy(0xFF01, 0x80) elseif get(0x2003) == 6 then emcy_over(0xFF01) end
  set(0x2004, 0, now * 1000)
  return now < 2.0 and now + 0.5 or nil
end
function on_write(index, sub, value, now)
  if index == 0x2002 and value > 1000 then return 0x06090031 end
end
function on_sync(now) syncs = syncs + 1 set(0x2008, 0, syncs) end
function on_state(state) states = states .. state:sub(1, 1) if states == "pos" then set(0x2001, 0, 99) end end
function set_input(index, sub, value) if index == 0x2003 then set(index, sub, value) return true end end
function on_incident(name, present, now) if name == "leak" then set(0x2001, 0, present and 7 or 8) end end
)"}};
  const auto plant = plant_of(std::string(kScripted), files);
  CHECK(run(*plant, "get 20 0x2001") == "1");
  CHECK(run(*plant, "get 20 0x2002") == "700");
  CHECK(run(*plant, "pass 1200ms") == "at 1.200000");
  CHECK(run(*plant, "get 20 0x2004") == "1200");
  CHECK(run(*plant, "trigger write 20 0x2002 0 2 1001") == "");
  CHECK(run(*plant, "read 3706 2") == "49 1545");  // 0609 0031h
  CHECK(run(*plant, "get 20 0x2002") == "700");
  CHECK(run(*plant, "incident 20 leak on") == "");
  CHECK(run(*plant, "get 20 0x2001") == "7");
  CHECK(run(*plant, "incident 20 thaw on") ==
        "error: \"thaw\": node 20 has no such incident; it has leak, frozen");
  Frames frames(*plant);
  run(*plant, "set 20 0x2003 5");
  run(*plant, "set 20 0x2003 6");
  run(*plant, "nmt start 20");
  run(*plant, "send 080#");
  run(*plant, "send 080#");
  run(*plant, "nmt stop 20");
  CHECK(run(*plant, "get 20 0x2008") == "2");
  CHECK(run(*plant, "get 20 0x2001") == "99");
  CHECK(frames.seen == std::vector<std::string>{"094#01FF810000000000", "094#0000000000000000", "000#0114",
                                                "080#", "080#", "000#0214"});
}

TEST_CASE("the script of docs/devices.md is a valve that takes two seconds, and can get stuck") {
  const std::string page = *reader({})("docs/devices.md");
  const std::size_t begin = page.find("```lua\n") + 7;
  const Files files{{"t.lua", page.substr(begin, page.find("```", begin) - begin)}};
  const auto plant = plant_of("[[node]]\nid = 20\neds = \"plants/tank.eds\"\ndevice = \"t.lua\"\n", files);
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

TEST_CASE("a script injects faults of its own node") {
  const Files files{{"t.lua",
                     "function on_write(index) fault('response-late delay_ms=70 count=1') end\n"
                     "function on_sync() fault('no-such-fault') end\n"}};
  const auto plant = plant_of(std::string(kScripted), files);
  run(*plant, "trigger write 20 0x2001 0 1 5");
  CHECK(run(*plant, "wait transaction ended") == "0.070000");
  CHECK(run(*plant, "faults 20").starts_with("20 1 response-late delay_ms=70 count=1"));
  run(*plant, "nmt start 20");
  run(*plant, "send 080#");
  CHECK(run(*plant, "get 20 0x1001") == "1");
}

TEST_CASE("the same seed gives the same bytes, whatever a script looks at") {
  const Files files{{"t.lua", R"(
local function hash(text) local h = 5381 for i = 1, #text do h = (h * 33 + text:byte(i)) % 4294967296 end return h end
local t = { [3] = "c", x = 1, [1] = "a", y = 2, [true] = 3, [false] = 4, [2.5] = 5, aa = 6 }
local order = ""
for key, value in pairs(t) do order = order .. tostring(key) .. "=" .. tostring(value) .. " " end
local list = {}
for i = 1, 500 do list[i] = math.random(1000) end
table.sort(list, function(a, b) return a // 100 < b // 100 end)  -- many are equal
local text = order .. table.concat(list, ",") .. tostring({}) .. string.format("%s %s", {}, print) ..
             tostring(setmetatable({}, { __name = "x" })) .. tostring(math.random())
function update(now) set(0x2004, 0, hash(text)) set(0x2008, 0, hash(order)) end
)"}};
  const auto value = [&](std::string_view what, std::string_view seed) {
    const auto plant = plant_of(fmt::format("[random]\nseed = {}\n{}", seed, kScripted), files);
    return run(*plant, what);
  };
  const std::string known = value("get 20 0x2004", "1");
  CHECK(known == "4122810676");  // on every machine
  CHECK(value("get 20 0x2004", "1") == known);
  CHECK(value("get 20 0x2004", "2") != known);
  CHECK(value("get 20 0x2008", "2") == value("get 20 0x2008", "1"));
  const Files keys{{"t.lua", "for key in pairs({ [{}] = 1 }) do end"}};
  CHECK(build(std::string(kScripted), keys).build.lines ==
        std::vector<std::string>{
            "plant.toml:1: node 20: t.lua:1: pairs: a table as a key has no place in an order"});
}

struct Hostile {
  const char* script;  ///< of update, in line 2
  const char* why;
};
const std::vector<Hostile> kHostile{
    {"while true do end", "t.lua:2: more than 200000 instructions in one call"},
    {"while true do pcall(function() while true do end end) end",
     "t.lua:2: more than 200000 instructions in one call"},
    {"local function f() pcall(f) f() end f()", "t.lua:2: "},
    {"local function f() return 1 + f() end f()", "t.lua:2: "},
    {"local function f() return f() end f()", "t.lua:2: more than 200000 instructions in one call"},
    {"local t = {} for i = 1, 1e9 do t[i] = ('x'):rep(1000) .. i end",
     "t.lua:2: takes more memory than a script may have"},
    {"local t = {} while true do t = { t } end", "t.lua:2: "},
    {"local s = string.rep('x', 1 << 40)", "t.lua:2: "},
    {"local s = string.rep('', 1 << 60)", ""},
    {"local s = 'x' while true do s = s .. s end", "t.lua:2: takes more memory than a script may have"},
    {"while true do pcall(string.rep, 'x', 1 << 21) end",
     "t.lua:2: takes more memory than a script may have"},
    {"while true do pcall(string.rep, 'x', 1 << 30) end",
     "t.lua:2: takes more memory than a script may have"},
    {"table.insert(setmetatable({}, { __len = function() return 1 << 53 end }), 1, 1)", ""},
    {"table.concat(setmetatable({}, { __index = function() return '' end }), '', 1, 1 << 53)",
     "t.lua:2: more than 200000 instructions in one call"},
    {"setmetatable({}, { __gc = function() while true do end end })",
     "t.lua:2: setmetatable: there is no __gc"},
    {"setmetatable({}, { __mode = 'k' })", "t.lua:2: setmetatable: there is no __mode"},
    {"local x <close> = setmetatable({}, { __close = function() while true do end end }) error('a')",
     "t.lua:2: more than 200000 instructions in one call"},
    {"coroutine.wrap(function() while true do end end)()",
     "t.lua:2: attempt to index a nil value (global 'coroutine')"},
    {"xpcall(error, function() while true do end end)",
     "t.lua:2: attempt to call a nil value (global 'xpcall')"},
    {"error(setmetatable({}, { __tostring = error }))", "t.lua: an error that is no text"},
    {"print(setmetatable({}, { __tostring = function() while true do end end }))",
     "t.lua:2: more than 200000 instructions in one call"},
    {"os.exit()", "t.lua:2: attempt to index a nil value (global 'os')"},
    {"io.open('/etc/passwd')", "t.lua:2: attempt to index a nil value (global 'io')"},
    {"debug.sethook()", "t.lua:2: attempt to index a nil value (global 'debug')"},
    {"load('\\27Lua')", "t.lua:2: attempt to call a nil value (global 'load')"},
    {"require('x')", "t.lua:2: attempt to call a nil value (global 'require')"},
    {"string.find(string.rep('a', 1 << 16), '.-.-.-.-b')",
     "t.lua:2: attempt to call a nil value (field 'find')"},
    {"string.format('%p', {})", "t.lua:2: string.format: %p, or more than 1000 characters"},
    {"get(0x9999)", "t.lua:2: the node has no number at 9999h:00"},
    {"set(0x2001, 0, 'x')", "t.lua:2: bad argument #3 to 'set' (number expected, got string)"},
    {"return now + 1e-6", "t.lua: update wants to be called more than 500 times in a millisecond"},
    {"return now", "t.lua: update wants to be called more than 500 times in a millisecond"},
    {"for i = 1, 1e9 do print(i) end", "t.lua:2: more than 200000 instructions in one call"},
    {"setmetatable(_G, { __index = function() while true do end end }) update = nil", ""},
};

TEST_CASE("what a script cannot do: it ends with its line, and costs its own node only") {
  for (const Hostile& row : kHostile) {
    CAPTURE(row.script);
    const Files files{{"t.lua", fmt::format("function update(now)\n{}\nend", row.script)}};
    const auto plant = plant_of(std::string(kScripted), files);
    run(*plant, "pass 10ms");
    CHECK(run(*plant, "get 32 0x2001") == "0");
    run(*plant, "trigger read 20 0x2001 0 1");  // SDO goes on
    run(*plant, "wait transaction ended");
    CHECK(run(*plant, "read 3700") == "0");
    const auto said = plant->said();
    const bool failed = run(*plant, "get 20 0x1001") == "1";
    const std::string why = failed && !said.empty() ? said.back() : "";
    if (std::string(row.why).empty() && !failed) continue;
    CHECK(failed);
    CAPTURE(why);
    CHECK(why.find("node 20: " + std::string(row.why)) != std::string::npos);
  }
}

TEST_CASE("a script that fails tells its line by EMCY, and begins anew at a reset") {
  const Files files{
      {"t.lua", "count = (count or 0) + 1\nset(0x2001, 0, count)\n\nfunction on_sync()\n  nothing()\nend"}};
  const auto plant = plant_of(std::string(kScripted), files);
  run(*plant, "nmt start 20");
  Frames frames(*plant);
  run(*plant, "send 080#");
  run(*plant, "send 080#");
  run(*plant, "nmt reset-node 20");
  CHECK(frames.seen ==
        std::vector<std::string>{"080#", "094#0061010500000000", "080#", "000#8114", "714#00"});
  run(*plant, "nmt start 20");
  run(*plant, "send 080#");
  CHECK(frames.seen.back() == "094#0061010500000000");
}

TEST_CASE("a script is loaded again, and a wrong one is not") {
  Files files{{"t.lua", "function update() set(0x2001, 0, 5) end"}};
  const auto plant = plant_of(std::string(kScripted), files);
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
  CHECK(run(*plant, "reload 32") == "error: node 32: its device is none, which is no script");
}

TEST_CASE("a script that cannot be begun is told with its line, and bytecode is none") {
  const auto lines = [](const std::string& script) {
    const Files files{{"t.lua", script}};
    return build(std::string(kScripted), files).build.lines;
  };
  using Lines = std::vector<std::string>;
  CHECK(lines("x = = 1") == Lines{"plant.toml:1: node 20: t.lua:1: unexpected symbol near '='"});
  CHECK(lines("\nerror('no')") == Lines{"plant.toml:1: node 20: t.lua:2: no"});
  CHECK(lines("\x1BLua") ==
        Lines{"plant.toml:1: node 20: t.lua: attempt to load a binary chunk (mode is 't')"});
  CHECK(lines(std::string("x = ") + std::string(100'000, '('))
            .front()
            .starts_with("plant.toml:1: node 20: t.lua: C stack overflow"));
}

TEST_CASE("what goes round through scripts and wires does not stop time") {
  const Files files{{"t.lua", "function update() set(0x2004, 0, get(0x2002) + 1) end"}};
  const auto plant =
      plant_of(std::string(kScripted) + "[[wire]]\nfrom = \"20:0x2004\"\nto = \"20:0x2002\"\n", files);
  run(*plant, "pass 20ms");
  CHECK(plant->now() == 20 * kMillisecond);
  CHECK(std::stoi(run(*plant, "get 20 0x2002")) > 20);
}

}  // namespace
}  // namespace cbcan::scenario::test
