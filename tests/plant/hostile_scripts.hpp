// SPDX-License-Identifier: MIT
#pragma once

/// Scripts that would stop the plant, and their errors. tests/plant checks the messages, bench/instructions the
/// duration of the calls.

#include <string>
#include <vector>

namespace cbcan::test {

struct Hostile {
  std::string script;       ///< body of update, in line 2
  std::string why;          ///< beginning of the message; empty = there may be none
  std::string before = "";  ///< in line 1, at the start
};

inline std::string text_of(const Hostile& row) {
  return row.before + " function update(now)\n" + row.script + "\nend";
}

inline const std::string kTooLong = "t.lua:2: more than 100000 instructions in one call";
inline const std::string kTooLarge = "t.lua:2: takes more memory than a script may have";
inline const std::string kLong = "local long = string.rep('0', 250000) ";
inline const std::string kTwins = "local a, b = string.rep('0', 250000), string.rep('0', 249999) .. '0' ";
inline const std::string kMany = "local many = {} for i = 1, 4000 do many[i] = '' end ";

/// The same many times, without a jump.
inline std::string often(const std::string& statement) {
  std::string text;
  for (int i = 0; i < 200; ++i)
    text += "do " + statement + " end ";
  return "while true do " + text + "end";
}

inline std::string joined(int count) {
  std::string text;
  for (int i = 0; i < count; ++i)
    text += " .. a";
  return text;
}

/// Functions that share this many variables, again and again.
inline std::string shared(int count, const std::string& begin) {
  std::string names = "a0";
  for (int i = 1; i < count; ++i)
    names += ", a" + std::to_string(i);
  return "local " + names + " = now " + often(begin + names + " end");
}

inline const std::vector<Hostile> kHostile{
    {"while true do end", kTooLong},
    {often("local x = 0.1 .. 0.2 .. 0.3 .. 0.4 .. 0.5 .. 0.6 .. 0.7 .. 0.8 .. 0.9 .. 1e-7"), kTooLong},
    {"while true do pcall(function() while true do end end) end", kTooLong},
    {"local function f() pcall(f) f() end f()", "t.lua:2: "},
    {"local function f() return 1 + f() end f()", "t.lua:2: "},
    {"local function f() return f() end f()", kTooLong},
    {"local t = {} for i = 1, 1e9 do t[i] = ('x'):rep(1000) .. i end", "t.lua:2: "},
    {"local t = {} while true do t = { t } end", "t.lua:2: "},
    {"local s = string.rep('x', 1 << 40)", "t.lua:2: "},
    {"local s = string.rep('', 1 << 60)", ""},
    {"local s = 'x' while true do s = s .. s end", kTooLarge},
    {"while true do pcall(string.rep, 'x', 1 << 21) end", kTooLong},
    {"while true do pcall(string.rep, 'x', 1 << 30) end", kTooLong},
    {"table.insert(setmetatable({}, { __len = function() return 1 << 53 end }), 1, 1)", ""},
    {"table.concat(setmetatable({}, { __index = function() return '' end }), '', 1, 1 << 53)", kTooLong},
    {"setmetatable({}, { __gc = function() while true do end end })",
     "t.lua:2: setmetatable: there is no __gc"},
    {"setmetatable({}, { __mode = 'k' })", "t.lua:2: setmetatable: there is no __mode"},
    {"local x <close> = setmetatable({}, { __close = function() while true do end end }) error('a')",
     kTooLong},
    {"coroutine.wrap(function() while true do end end)()",
     "t.lua:2: attempt to index a nil value (global 'coroutine')"},
    {"xpcall(error, function() while true do end end)",
     "t.lua:2: attempt to call a nil value (global 'xpcall')"},
    {"error(setmetatable({}, { __tostring = error }))", "t.lua: an error that is no text"},
    {"print(setmetatable({}, { __tostring = function() while true do end end }))", kTooLong},
    {"os.exit()", "t.lua:2: attempt to index a nil value (global 'os')"},
    {"io.open('/etc/passwd')", "t.lua:2: attempt to index a nil value (global 'io')"},
    {"debug.sethook()", "t.lua:2: attempt to index a nil value (global 'debug')"},
    {"load('\\27Lua')", "t.lua:2: attempt to call a nil value (global 'load')"},
    {"require('x')", "t.lua:2: attempt to call a nil value (global 'require')"},
    {"string.find(string.rep('a', 1 << 16), '.-.-.-.-b')",
     "t.lua:2: attempt to call a nil value (field 'find')"},
    {"string.format('%p', {})", "t.lua:2: string.format: %c, %p, or more than 1000 characters"},
    {"get(0x9999)", "t.lua:2: the node has no number at 9999h:00"},
    {"set(0x2001, 0, 'x')", "t.lua:2: bad argument #3 to 'set' (number expected, got string)"},
    {"return now + 1e-6", "t.lua: update wants to be called more than 500 times in a millisecond"},
    {"return now", "t.lua: update wants to be called more than 500 times in a millisecond"},
    {"for i = 1, 1e9 do print(i) end", kTooLong},
    {"setmetatable(_G, { __index = function() while true do end end }) update = nil", ""},
    // Texts.
    {often("local x = tonumber(long)"), kTooLong, kLong},
    {often("local x = tonumber(long, 10)"), kTooLong, kLong},
    {often("local x = long + long"), kTooLong, kLong},
    {often("local x = long % 3"), kTooLong, kLong},
    {often("local x = -long"), kTooLong, kLong},
    {often("local x = math.floor(long)"), kTooLong, kLong},
    {often("local x = math.abs(long)"), kTooLong, kLong},
    {often("local x = get(8193, long)"), kTooLong, kLong},
    {often("local x = string.format('%d', long)"), kTooLong, kLong},
    {often("local x = string.format('%.3s', long)"), kTooLong, kLong},
    {often("local x = string.char(long .. '65')"), "t.lua:2: ", kLong},
    {often("local x = select(long .. '1', 1)"), "t.lua:2: ", kLong},
    {often("for i = 1, long do end"), kTooLong, kLong},
    {often("local x = a == b"), kTooLong, kTwins},
    {often("local x = a < b"), kTooLong, kTwins},
    {often("local x = rawequal(a, b)"), kTooLong, kTwins},
    {"string.char(65, 0)", "t.lua:2: string.char: a text cannot have the character 0"},
    {"string.char(0)", "t.lua:2: string.char: a text cannot have the character 0",
     "tonumber, ipairs = function() return 1 end, function() return function() end end "},
    {"string.char('0x0')", "t.lua:2: string.char: a text cannot have the character 0"},
    {"string.format('%c', 0)", "t.lua:2: string.format: %c, %p, or more than 1000 characters"},
    {"local a, b = a, b " + often("if a < b then end"), kTooLong, kTwins},
    {often("local x = t[b]"), kTooLong, kTwins + "local t = { [a] = 1 }"},
    {often("local x = rawget(t, b)"), kTooLong, kTwins + "local t = { [a] = 1 }"},
    {often("local x = string.upper(long)"), "t.lua:2: ", kLong},
    {often("local x = string.rep('x', 200000)"), "t.lua:2: "},
    {often("local x = string.byte(long, 1, 10000)"), "t.lua:2: ", kLong},
    {often("local x = #long"), kTooLong, kLong},
    {"local s = '' while true do s = s .. 'x' end", kTooLong},
    {"string.packsize(string.rep('b', 250000))", "t.lua:2: attempt to call a nil value (field 'packsize')"},
    {"string.pack('b', 1)", "t.lua:2: attempt to call a nil value (field 'pack')"},
    {"string.unpack('b', 'x')", "t.lua:2: attempt to call a nil value (field 'unpack')"},
    {"utf8.len('x')", "t.lua:2: attempt to index a nil value (global 'utf8')"},
    {"collectgarbage()", "t.lua:2: attempt to call a nil value (global 'collectgarbage')"},
    // Numbers as texts, and remainders.
    {often("local x = 1e300 % 5e-324"), kTooLong},
    {often("local x = a % b"), kTooLong, "local a, b = 1.7e308, 3.5e-310"},
    {"local a, b = 1.7e308, 3.5e-310 " + often("local x = a % b"), kTooLong},
    {"-- a comment that a carriage return ends\r local a, b = 1.7e308, 3.5e-310 " + often("local x = a % b"),
     "t.lua:3: more than 100000 instructions in one call"},
    {"local a = -2.2250738585072011e-308 " + often("local x = a .. a"), kTooLong},
    {"local a = -2.2250738585072011e-308 " + often("local x = a" + joined(59)), kTooLong},
    {"local a = -2.2250738585072011e-308 " + often("local x = a" + joined(9)), kTooLong},
    {"local a = -1.7976931348623e308 " + often("local x = a" + joined(9)), kTooLong},
    {often("local x = string.format(f)"), kTooLong, "local f = '" + std::string(990, '%') + "'"},
    {often("local x = f(a, b)"), kTooLong, "local a, b, f = 1.7e308, 3.5e-310, math.fmod"},
    {often("local x = tostring(1e300)"), kTooLong},
    {often("local x = string.format('%.99f', 1e300)"), kTooLong},
    {often("local x = table.concat(t)"), kTooLong, "local t = {} for i = 1, 500 do t[i] = 1e300 end"},
    // Lists, and many values at once.
    {often("local x = table.concat(many)"), kTooLong, kMany},
    {often("local x = table.unpack(many)"), kTooLong, kMany},
    {often("local x = select('#', table.unpack(many))"), kTooLong, kMany},
    {often("local x = { table.unpack(many) }"), "t.lua:2: ", kMany},
    {often("local x = pairs(t)"), kTooLong,
     "local t = {} for i = 1, 2000 do t[i] = 1 end for i = 1, 2000 do t[i] = nil end"},
    {"local function f(...) return f(...) end f(table.unpack(many))", kTooLong, kMany},
    {"local function f(...) return f(1, ...) end f()", "t.lua:2: "},
    {"local function f(...) select('#', ...) select('#', ...) select('#', ...) return f(...) end "
     "f(table.unpack(many))",
     kTooLong, kMany},
    {"for i = 1, 1e9 do many.a = nil many.b = 1 many.b = nil many.c = 1 many.c = nil many.a = 1 end",
     kTooLong, kMany},
    {often("local x = t[2047 * 5000]"), kTooLong, "local t = {} for i = 1, 2000 do t[2047 * i] = i end"},
    {often("local x = chain.x"), kTooLong,
     "local chain = {} for i = 1, 8 do chain = setmetatable({}, { __index = chain }) end"},
    {"for i = 1, 9 do setmetatable({}, {}) end",
     "t.lua:2: setmetatable: more than 8 metatables; give tables one together"},
    {"table.sort(many, function() return true end)", kTooLong, kMany},
    {"while true do table.insert(many, 1, '') table.remove(many, 1) end", kTooLong, kMany},
    {"while true do local x = {} end", kTooLong},
    {"while true do local x = function() return now end end", kTooLong},
    {shared(180, "local x = function() return "), kTooLong},
    {shared(20, "local x = function() return "), kTooLong},
    // Errors.
    {"while true do pcall(error) end", kTooLong},
    {"while true do pcall(error, long) end", kTooLong, kLong},
    {"while true do pcall(string.rep) end", kTooLong},
    {"local t = setmetatable({}, {}) getmetatable(t).__index = t while true do pcall(function() return t.x "
     "end) end",
     kTooLong},
    {"::a:: goto a", kTooLong},
    {"error(long)", "t.lua:2: 0000", kLong},
    // Calls of the node.
    {"while true do set(0x2001, 0, 0) set(0x2001, 0, 1) end", kTooLong},
    {"while true do get(0x2001) end", kTooLong},
    {"while true do emcy(0xFF01) emcy_over(0xFF01) end", kTooLong},
    {"while true do print(long) end", "t.lua:2: ", kLong},
    {"while true do fault('response-late delay_ms=50 after=1000') end",
     "t.lua:2: fault: the node has 100 faults already; give them an end, or a count"},
    {"while true do pcall(fault, 'response-late delay_ms=50 after=1000') end", kTooLong},
    {"return 0 / 0", ""},
};

}  // namespace cbcan::test
