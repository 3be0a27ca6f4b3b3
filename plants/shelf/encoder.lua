-- SPDX-License-Identifier: MIT
-- An absolute multi-turn encoder of CiA 406. Its input, at 6004h, is the position of the shaft in revolutions. Each
-- value is calculated from the shaft's position alone, so nothing depends on how often it is read.
--
--   sensor-break   incident: the position no longer changes; alarm in 6503h and EMCY 5000h
device = { type = 0x00020196, name = "Encoder", product = 0x406 }
objects = {
  { index = 0x6000, name = "operating parameters", type = "u16", bits = { "counter-clockwise", "", "scaling" } },
  { index = 0x6001, name = "steps per revolution", type = "u32", default = 4096, low = 1 },
  { index = 0x6002, name = "total measuring range", type = "u32", default = 16777216, low = 1 },
  { index = 0x6003, name = "preset", type = "u32" },
  { index = 0x6004, name = "position", type = "u32", access = "ro", pdo = "tx", unit = "rev", show = { "input", "curve" } },
  { index = 0x6030, sub = 1, name = "speed in steps/s", type = "i16", access = "ro", pdo = "tx", show = "curve" },
  { index = 0x6200, name = "cyclic timer", type = "u16", unit = "ms" },
  { index = 0x6500, name = "operating status", type = "u16", access = "ro" },
  { index = 0x6501, name = "steps of a revolution", type = "u32", access = "ro", default = 4096 },
  { index = 0x6502, name = "revolutions", type = "u16", access = "ro", default = 4096 },
  { index = 0x6503, name = "alarms", type = "u16", access = "ro", pdo = "tx", bits = { "position" }, alarm = { "position" }, show = "output" },
  { index = 0x6504, name = "supported alarms", type = "u16", access = "ro", default = 1 },
  { index = 0x6505, name = "warnings", type = "u16", access = "ro" },
  { index = 0x6506, name = "supported warnings", type = "u16", access = "ro" },
  { index = 0x6507, name = "profile and software version", type = "u32", access = "ro", default = 0x01000302 },
  { index = 0x6509, name = "offset", type = "i32", access = "ro" },
}
incidents, alarms = { "sensor-break" }, { "sensor-break" }

local at_rest <const> = 0.2                   -- s without a new position
local shaft, speed, moved_at = 0, 0, nil      -- revolutions, revolutions per s, s
local offset, broken, next_cycle = 0, false, nil
local position, shown_position, shown_rate, has_position, has_rate = 0  -- values as shown

-- Objects of the file, by index * 256 + sub, and values that are shown: asked for and set once.
local exists, shown = {}, {}
local function is_there(index, sub)
  local place = index * 256 + sub
  local there = exists[place]
  if there == nil then
    there = has(index, sub)
    exists[place] = there
  end
  return there
end

-- A value of an object; nil where a file has no such object, or 0.
local function read(index)
  local value = is_there(index, 0) and get(index)
  return value and value ~= 0 and value or nil
end

local function show(index, sub, value)
  if value == shown[index] or not is_there(index, sub) then return end
  shown[index] = value
  set(index, sub, value)
end

-- Steps of a revolution, less than 0 when counter-clockwise, and of the whole range, and s between cycles;
-- steps = nil: to be read again.
local steps, range, period, parameters
local status_shown = false

local function read_parameters()
  status_shown = false
  has_position, has_rate = is_there(0x6004, 0), is_there(0x6030, 1)
  parameters = read(0x6000) or 0
  steps, range = nil, nil
  if parameters & 4 ~= 0 then steps, range = read(0x6001), read(0x6002) end
  local whole = read(0x6501) or 4096
  steps, range = steps or whole, range or whole * (read(0x6502) or 4096)
  if parameters & 1 ~= 0 then steps = -steps end
  period = (read(0x6200) or 0) / 1000
end

-- Between 0 and the range.
local function wrapped(count) return count - count // range * range end

-- Without preset.
local function raw()
  if not steps then read_parameters() end
  return wrapped((shaft * steps + 1e-6) // 1)
end

function reset(now)
  speed, moved_at, next_cycle, offset, shown, steps, shown_position, shown_rate = 0, nil, nil, 0, {}
  update(now)
end

function update(now)
  if moved_at and now >= moved_at + at_rest then speed, moved_at = 0, nil end
  if not steps then read_parameters() end
  if not broken then
    position = raw()
    if offset ~= 0 then position = wrapped(position + offset) end
    local rate = speed * steps
    if rate ~= shown_rate and has_rate then set(0x6030, 1, rate) shown_rate = rate end
  end
  if position ~= shown_position and has_position then set(0x6004, 0, position) shown_position = position end
  if not status_shown then
    show(0x6500, 0, parameters)
    show(0x6503, 0, broken and 1 or 0)
    show(0x6509, 0, offset)
    status_shown = true
  end
  if period == 0 then next_cycle = nil return moved_at and moved_at + at_rest end
  if next_cycle and now >= next_cycle then event(0x6004) next_cycle = nil end
  next_cycle = math.min(next_cycle or math.huge, now + period)
  return moved_at and math.min(next_cycle, moved_at + at_rest) or next_cycle
end

function on_write(index, _, value)
  if index == 0x6003 then
    local count = raw()
    if value >= range then return 0x06090030 end  -- value out of range
    offset = value - count
  end
  steps = nil
end

function set_input(index, _, value, now)
  if index ~= 0x6004 then steps = nil return false end
  if moved_at and now > moved_at then speed = (value - shaft) / (now - moved_at) end
  if value ~= shaft or not moved_at then moved_at = now end
  shaft = value
  return true
end

function on_incident(_, present)
  broken, status_shown = present, false
  if present then emcy(0x5000) else emcy_over(0x5000) end
end
