// SPDX-License-Identifier: MIT
#pragma once

/// What runs before a script.

#include <string_view>

namespace cbcan::devices {

/// Removes or replaces functions that differ from run to run (addresses, the order of a table), could run
/// without limit while no instruction is counted, or reach outside. cost(bytes) counts what a function is
/// about to read, see CostModel.
inline constexpr std::string_view kPrelude = R"(
local cost, type, next, error, select, ipairs = cost, type, next, error, select, ipairs
local tonumber, tostring, rawlen, rawget = tonumber, tostring, rawlen, rawget
local find, format, rep, unpack, concat = string.find, string.format, string.rep, table.unpack, table.concat
local rank = { boolean = 1, number = 2, string = 3 }

local function before(a, b)
  local of_a, of_b = rank[type(a)], rank[type(b)]
  if of_a ~= of_b then return of_a < of_b end
  if of_a == 1 then return not a and b end
  return a < b
end

local function merge(from, to, first, middle, last, less)
  local left, right = first, middle
  for i = first, last - 1 do
    if left < middle and (right >= last or not less(from[right], from[left])) then
      to[i], left = from[left], left + 1
    else
      to[i], right = from[right], right + 1
    end
  end
end

function table.sort(list, less)
  less = less or function(a, b) return a < b end
  local count, width, from, to = rawlen(list), 1, list, {}
  while width < count do
    for first = 1, count, 2 * width do
      local middle, last = first + width, first + 2 * width
      if middle > count + 1 then middle = count + 1 end
      if last > count + 1 then last = count + 1 end
      merge(from, to, first, middle, last, less)
    end
    from, to, width = to, from, 2 * width
  end
  if from ~= list then for i = 1, count do list[i] = from[i] end end
end

local sort = table.sort
function pairs(t)
  local keys, place = {}, 0
  for key in next, t do
    if not rank[type(key)] then error("pairs: a " .. type(key) .. " as a key has no place in an order", 2) end
    keys[#keys + 1] = key
  end
  sort(keys, before)
  return function()
    local key, value
    repeat
      place = place + 1
      key = keys[place]
      value = key ~= nil and rawget(t, key)
    until key == nil or value ~= nil
    return key, value
  end, t
end

function table.insert(list, ...)
  local count, place, value = rawlen(list), ...
  if select("#", ...) == 1 then place, value = count + 1, place end
  for i = count, place, -1 do list[i + 1] = list[i] end
  list[place] = value
end

function table.remove(list, place)
  local count = rawlen(list)
  place = place or count
  local value = list[place]
  for i = place, count do list[i] = list[i + 1] end
  return value
end

function table.unpack(list, first, last)
  cost(2 * ((last or #list) - (first or 1)))
  return unpack(list, first, last)
end

function table.concat(list, between, first, last)
  cost(160 * ((last or #list) - (first or 1)))
  return concat(list, between, first, last)
end

function string.rep(text, count, between)
  between = between or ""
  cost(count)
  return #text + #between == 0 and "" or rep(text, count, between)
end

function string.format(form, ...)
  cost(#form)
  if #form > 1000 or find(form, "%%[^%a%%]*[cp]") then error("string.format: %c, %p, or more than 1000 characters", 2) end
  local values = { ... }
  for i = 1, select("#", ...) do
    local kind = type(values[i])
    if kind == "table" or kind == "function" then values[i] = tostring(values[i]) end
    cost(kind == "string" and #values[i] or 400)
  end
  return format(form, unpack(values, 1, select("#", ...)))
end

table.move, string.dump, string.find, string.match, string.gmatch, string.gsub = nil
string.pack, string.unpack, string.packsize = nil
local char = string.char
function string.char(...)
  for _, code in ipairs({ ... }) do
    if tonumber(code) == 0 then error("string.char: a text cannot have the character 0", 2) end
  end
  return char(...)
end

local fmod = math.fmod
function math.fmod(a, b)
  cost(256)
  return fmod(a, b)
end

math.randomseed, _G.next, _G.cost, load, loadfile, dofile, collectgarbage, xpcall, warn = nil
)";

}  // namespace cbcan::devices
