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

local at_rest = 0.2                           -- s without a new position
local shaft, speed, moved_at = 0, 0, nil      -- revolutions, revolutions per s, s
local offset, broken, next_cycle = 0, false, nil
local position = 0                            -- that is shown

-- A value of an object; the standard one where a file has no such object, or 0.
local function read(index, standard)
  local value = has(index) and get(index) or 0
  return value ~= 0 and value or standard
end

local function show(index, sub, value)
  if has(index, sub) then set(index, sub, value) end
end

-- Steps of a revolution, and of the whole range.
local function scale()
  local steps = read(0x6501, 4096)
  if read(0x6000, 0) & 4 == 0 then return steps, steps * read(0x6502, 4096) end
  return read(0x6001, steps), read(0x6002, steps * read(0x6502, 4096))
end

local function direction() return read(0x6000, 0) & 1 == 0 and 1 or -1 end

-- Between 0 and the range.
local function wrapped(steps, range) return steps - math.floor(steps / range) * range end

-- Without preset.
local function raw()
  local steps, range = scale()
  return wrapped(math.floor(direction() * shaft * steps + 1e-6), range), range
end

function reset(now)
  speed, moved_at, next_cycle, offset = 0, nil, nil, 0
  update(now)
end

function update(now)
  if moved_at and now >= moved_at + at_rest then speed, moved_at = 0, nil end
  if not broken then
    local steps, range = raw()
    position = wrapped(steps + offset, range)
  end
  show(0x6004, 0, position)
  if not broken then show(0x6030, 1, direction() * speed * scale()) end
  show(0x6500, 0, read(0x6000, 0))
  show(0x6503, 0, broken and 1 or 0)
  show(0x6509, 0, offset)
  local period = read(0x6200, 0) / 1000
  if period == 0 then next_cycle = nil return moved_at and moved_at + at_rest end
  if next_cycle and now >= next_cycle then event(0x6004) next_cycle = nil end
  next_cycle = math.min(next_cycle or math.huge, now + period)
  return moved_at and math.min(next_cycle, moved_at + at_rest) or next_cycle
end

function on_write(index, _, value)
  if index ~= 0x6003 then return end
  local steps, range = raw()
  if value >= range then return 0x06090030 end  -- value out of range
  offset = value - steps
end

function set_input(index, _, value, now)
  if index ~= 0x6004 then return false end
  if moved_at and now > moved_at then speed = (value - shaft) / (now - moved_at) end
  if value ~= shaft or not moved_at then moved_at = now end
  shaft = value
  return true
end

function on_incident(_, present)
  broken = present
  if present then emcy(0x5000) else emcy_over(0x5000) end
end
