-- SPDX-License-Identifier: MIT
-- An inclinometer of CiA 410 with two axes. Its inputs, at 6010h and 6020h, are the slopes in degrees. A file with
-- the 32-bit objects from 6110h and 6120h on has those too.
--
--   sensor-break   incident: the slopes no longer change; EMCY 5000h
device = { type = 0x0002019A, name = "Inclinometer", product = 0x410 }

local axes = { { first = 0x6010, name = "slope long" }, { first = 0x6020, name = "slope lateral" } }
objects = { { index = 0x6000, name = "resolution in 0.001 degrees", type = "u16", default = 10 } }
for i, axis in ipairs(axes) do
  local function object(place, name, fields)
    fields.index, fields.name = axis.first + place, axis.name .. name
    table.insert(objects, fields)
  end
  object(0, "", { type = "i16", access = "ro", pdo = "tx", unit = "°", low = -180, high = 180, show = { "input", "curve" } })
  object(1, " operating parameter", { type = "u8", high = 3, bits = { "inverted", "scaled" } })
  object(2, " preset", { type = "i16" })
  object(3, " offset", { type = "i16", access = "ro" })
  object(4, " differential offset", { type = "i16" })
end
incidents, alarms = { "sensor-break" }, { "sensor-break" }

local slopes, broken = { 0, 0 }, false        -- degrees
local shown = {}                              -- by object
local axis_at = { [0x6010] = 1, [0x6020] = 2, [0x6110] = 1, [0x6120] = 2 }

-- The groups of objects in the file with their parameters; nil = to be read again.
local groups

local function number(index) return has(index) and get(index) or 0 end

local function read_parameters()
  groups = {}
  local resolution = number(0x6000)
  for _, group in ipairs({ 0x6010, 0x6110, 0x6020, 0x6120 }) do
    if has(group) then
      local parameter, differential = number(group + 1), number(group + 4)
      local unit = (parameter & 1 ~= 0 and -1 or 1) * (resolution ~= 0 and resolution or 10)
      local offset = parameter & 2 ~= 0 and number(group + 3) + differential or 0
      table.insert(groups, { first = group, axis = axis_at[group], unit = unit, offset = offset, differential = differential })
    end
  end
end

function reset() groups = nil end

-- The slope as the sensor measures it, in units of the resolution, and the offset.
function update()
  if not groups then read_parameters() end
  for i = 1, #groups do
    local group = groups[i]
    local first = group.first
    local value = broken and (shown[first] or 0) or (slopes[group.axis] * 1000 / group.unit + 0.5) // 1 + group.offset
    if value ~= group.value then set(first, 0, value) shown[first], group.value = value, value end
  end
end

-- A preset: from now on the slope has this value.
function on_write(index, _, value)
  if index == 0x6000 and value ~= 1 and value ~= 10 and value ~= 100 and value ~= 1000 then return 0x06090030 end
  read_parameters()
  for _, group in ipairs(groups) do
    local place, measured = group.first + 3, (slopes[group.axis] * 1000 / group.unit + 0.5) // 1
    if index == place - 1 and has(place) then set(place, 0, value - measured - group.differential) end
  end
  groups = nil
end

function set_input(index, _, value)
  local axis = axis_at[index]
  if not axis then groups = nil return false end
  slopes[axis] = value
  return true
end

function on_incident(_, present)
  broken = present
  if present then emcy(0x5000) else emcy_over(0x5000) end
end
