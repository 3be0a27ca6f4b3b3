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
  { index = 0x6004, name = "position", type = "u32", access = "ro", pdo = "tx", sync = true, unit = "rev", show = { "input", "curve" } },
  { index = 0x6030, sub = 1, name = "speed in steps/s", type = "i16", access = "ro", pdo = "optional", show = "curve" },
  { index = 0x6200, name = "cyclic timer", type = "u16", unit = "ms" },
  { index = 0x6500, name = "operating status", type = "u16", access = "ro" },
  { index = 0x6501, name = "steps of a revolution", type = "u32", access = "ro", default = 4096 },
  { index = 0x6502, name = "revolutions", type = "u16", access = "ro", default = 4096 },
  { index = 0x6503, name = "alarms", type = "u16", access = "ro", pdo = "optional", bits = { "position" }, alarm = { "position" }, show = "output" },
  { index = 0x6504, name = "supported alarms", type = "u16", access = "ro", default = 1 },
  { index = 0x6505, name = "warnings", type = "u16", access = "ro" },
  { index = 0x6506, name = "supported warnings", type = "u16", access = "ro" },
  { index = 0x6507, name = "profile and software version", type = "u32", access = "ro", default = 0x01000302 },
  { index = 0x6508, name = "operating time", type = "u32", access = "ro", unit = "0.1 h" },
  { index = 0x6509, name = "offset", type = "i32", access = "ro" },
  { index = 0x650A, sub = 1, name = "module: offset of the manufacturer", type = "i32", access = "ro" },
  { index = 0x650A, sub = 2, name = "module: lowest position", type = "i32", access = "ro" },
  { index = 0x650A, sub = 3, name = "module: highest position", type = "i32", access = "ro", default = 16777215 },
  { index = 0x650B, name = "serial number", type = "u32", access = "ro" },
}
incidents, alarms = { "sensor-break" }, { "sensor-break" }

local at_rest <const> = 0.2                   -- s without a new position
local shaft, speed, moved_at = 0, 0, nil      -- revolutions, revolutions per s, s
local offset, broken, next_cycle = 0, false, nil
local timer, has_timer, next_tenth = 0, false, 0  -- 6200h, which is 1800h:05 where a file has that
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
  local own = read(0x6200) or 0
  period = has_timer and 0 or own / 1000
  if has_timer and own ~= timer then
    timer = own
    set(0x1800, 5, own)
  end
end

-- 1010h stores the offset of a preset.
function is_kept(index) return index == 0x6509 end

-- Files have an INTEGER32 or an UNSIGNED32 there.
local function show_offset()
  if not is_there(0x6509, 0) then return end
  set(0x6509, 0, offset)
  if offset < 0 and get(0x6509) == 0 then set(0x6509, 0, offset + (1 << 32)) end
end

function reset(now)
  speed, moved_at, next_cycle, shown, steps, shown_position, shown_rate = 0, nil, nil, {}
  offset = read(0x6509) or 0
  if offset >= 1 << 31 then offset = offset - (1 << 32) end
  has_timer, next_tenth = is_there(0x1800, 5) and is_there(0x6200, 0), 0
  timer = has_timer and get(0x1800, 5) or 0
  if timer ~= 0 then show(0x6200, 0, timer) end
  show(0x650B, 0, has(0x1018, 4) and get(0x1018, 4) or 0)
  update(now)
end

function update(now)
  if moved_at and now >= moved_at + at_rest then speed, moved_at = 0, nil end
  if not steps then read_parameters() end
  if not broken then
    position = ((shaft * steps + 1e-6) // 1 + offset) % range
    local rate = speed * steps
    if rate ~= shown_rate and has_rate then set(0x6030, 1, rate) shown_rate = rate end
  end
  if position ~= shown_position and has_position then set(0x6004, 0, position) shown_position = position end
  if not status_shown then
    show(0x6500, 0, parameters)
    show(0x6503, 0, broken and 1 or 0)
    show_offset()
    status_shown = true
  end
  if now >= next_tenth then                   -- 0.1 h
    show(0x6508, 0, now // 360)
    next_tenth = (now // 360 + 1) * 360
  end
  if has_timer and get(0x1800, 5) ~= timer then  -- 6200h and 1800h:05 are one value
    timer = get(0x1800, 5)
    set(0x6200, 0, timer)
  end
  if period == 0 then next_cycle = nil return moved_at and moved_at + at_rest end
  if next_cycle and now >= next_cycle then event(0x6004) next_cycle = nil end
  next_cycle = math.min(next_cycle or math.huge, now + period)
  return moved_at and math.min(next_cycle, moved_at + at_rest) or next_cycle
end

function on_write(index, _, value)
  if index == 0x6003 then
    if not steps then read_parameters() end
    local count = (shaft * steps + 1e-6) // 1 % range
    if value < 0 or value >= range then return 0x06090030 end  -- value out of range
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
