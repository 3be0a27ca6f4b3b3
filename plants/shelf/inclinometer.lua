-- SPDX-License-Identifier: MIT
-- An inclinometer of CiA 410 with two axes. Its inputs, at 6010h and 6020h, are the slopes in degrees. A file with
-- the 32-bit objects from 6110h and 6120h on has those too.
--
--   sensor-break   incident: the slopes no longer change; EMCY 5000h
device = { type = 0x0000019A, name = "Inclinometer", product = 0x410 }

local axes = { { first = 0x6010, name = "slope long" }, { first = 0x6020, name = "slope lateral" } }
objects = { { index = 0x6000, name = "resolution in 0.001 degrees", type = "u16", default = 10, low = 1, high = 1000 } }
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

-- The axis and the first object of its group; nil = it is none.
local function axis_of(index)
  local group = index & 0xFFF0
  local number = (group & 0xFF) // 16
  if (group & 0xFE00) ~= 0x6000 or number < 1 or number > 2 then return nil end
  return number, group
end

-- The slope as the sensor measures it, in units of the resolution.
local function measured(axis, group)
  local resolution = has(0x6000) and get(0x6000) or 0
  local steps = slopes[axis] * 1000 / (resolution ~= 0 and resolution or 10)
  local inverted = has(group + 1) and get(group + 1) & 1 ~= 0
  return math.floor((inverted and -steps or steps) + 0.5)
end

local function offsets(group)
  if not has(group + 1) or get(group + 1) & 2 == 0 then return 0 end
  return (has(group + 3) and get(group + 3) or 0) + (has(group + 4) and get(group + 4) or 0)
end

function update()
  for axis = 1, 2 do
    for _, group in ipairs({ 0x6000 + 16 * axis, 0x6100 + 16 * axis }) do
      if has(group) then
        if not broken then shown[group] = measured(axis, group) + offsets(group) end
        set(group, 0, shown[group] or 0)
      end
    end
  end
end

-- A preset: from now on the slope has this value.
function on_write(index, _, value)
  local axis, group = axis_of(index)
  if not axis or index ~= group + 2 or not has(group + 3) then return end
  set(group + 3, 0, value - measured(axis, group) - (has(group + 4) and get(group + 4) or 0))
end

function set_input(index, _, value)
  local axis, group = axis_of(index)
  if not axis or index ~= group then return false end
  slopes[axis] = value
  return true
end

function on_incident(_, present)
  broken = present
  if present then emcy(0x5000) else emcy_over(0x5000) end
end
