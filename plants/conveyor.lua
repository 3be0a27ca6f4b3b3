-- SPDX-License-Identifier: MIT
-- A belt with photo cells: pieces are placed at 0 mm and fall off at the end. The drive follows the wanted speed with
-- a ramp. Positions are exact at any time, and a cell changes at the microsecond at which an edge passes it.
--
--   2001h  wanted speed in mm/s, -2000..2000   2000h  speed in mm/s
--   2002h  0 to 1 places a piece, front at 0    2003h  cells: bit 0 at 200 mm, bit 1 at 1000 mm, bit 2 at 1900 mm
--   2004h  number of pieces fallen off          blocked  incident: the belt stops immediately
local length, piece = 2000, 150              -- mm
local cells = { 200, 1000, 1900 }            -- mm
local ramp = 1000                            -- mm/s2

incidents, alarms = { "blocked" }, { "blocked" }
device = { name = "Conveyor", product = 0x32, revision = 0x10000 }
objects = {
  { index = 0x2000, name = "speed", type = "f32", access = "ro", pdo = "tx", unit = "mm/s", low = -2000, high = 2000, show = { "output", "curve" } },
  { index = 0x2001, name = "wanted speed", type = "i16", pdo = "rx", unit = "mm/s", low = -2000, high = 2000, show = "input" },
  { index = 0x2002, name = "piece", type = "u8", pdo = "rx", bits = { "place" }, show = "input" },
  { index = 0x2003, name = "photo cells", type = "u8", access = "ro", pdo = "tx", bits = { "200 mm", "1000 mm", "1900 mm" }, show = "output" },
  { index = 0x2004, name = "fallen off", type = "u16", access = "ro", show = "output" },
}

local fronts = {}                            -- positions of the pieces' front edges, in mm
local speed, wanted, since, blocked, fallen, gate = 0, 0, 0, false, 0, false
local edge                                   -- the next time of an edge; false = never, nil = to be found

-- The distance moved in t seconds, and the speed after them.
local function motion(t)
  if blocked then return 0, 0 end
  local way = wanted - speed
  local ramped = math.min(t, math.abs(way) / ramp)
  local rate = way < 0 and -ramp or ramp
  return speed * ramped + rate * ramped ^ 2 / 2 + wanted * (t - ramped), ramped < t and wanted or speed + rate * ramped
end

-- The first time at which the belt has moved by a distance; nil = never with this motion.
local function time_of(distance)
  local way = wanted - speed
  local ramped, rate = math.abs(way) / ramp, way < 0 and -ramp or ramp
  local best
  if ramped > 0 then  -- distance = speed t + rate t^2 / 2
    local root = speed * speed + 2 * rate * distance
    for _, sign in ipairs({ -1, 1 }) do
      local t = root >= 0 and (-speed + sign * math.sqrt(root)) / rate or -1
      if t > 1e-7 and t <= ramped and (not best or t < best) then best = t end
    end
  end
  if best or wanted == 0 then return best end
  local t = ramped + (distance - motion(ramped)) / wanted
  return t >= ramped and t > 1e-7 and t or nil
end

local function seen()
  local bits = 0
  for i, at in ipairs(cells) do
    for _, front in ipairs(fronts) do
      if front >= at and front - piece < at then bits = bits | 1 << (i - 1) end
    end
  end
  return bits
end

local function pass(now)
  local way, reached = motion(now - since)
  since, speed = now, reached
  for i = #fronts, 1, -1 do
    fronts[i] = fronts[i] + way
    if fronts[i] - piece >= length - 1e-3 then
      table.remove(fronts, i)
      fallen = fallen + 1
    end
  end
end

-- The next time at which an edge passes a cell or a piece falls off.
local function next_edge(now)
  local first = nil
  for _, front in ipairs(fronts) do
    for _, at in ipairs({ cells[1], cells[2], cells[3], length + piece }) do
      for _, edge in ipairs({ at, at + piece }) do
        local way = edge - front
        local t = not blocked and time_of(way + (way >= 0 and 1e-4 or -1e-4))  -- just after the edge has passed
        if t and (not first or t < first) then first = t end
      end
    end
  end
  return first and now + first
end

function reset(now) speed, wanted, since, edge = 0, 0, now, nil end

function update(now)
  pass(now)
  local before, places = wanted, get(0x2002) ~= 0
  wanted = math.max(-2000, math.min(2000, get(0x2001)))
  if places and not gate then table.insert(fronts, 0) end
  if wanted ~= before or places ~= gate or edge and now >= edge then edge = nil end
  gate = places
  set(0x2000, 0, speed)
  set(0x2003, 0, seen())
  set(0x2004, 0, fallen)
  if edge == nil then edge = next_edge(now) or false end
  if speed == wanted or blocked then return edge or nil end
  return math.min(edge or math.huge, now + 0.01, now + math.abs(wanted - speed) / ramp)
end

function on_incident(_, present, now)
  pass(now)
  speed, blocked, edge = 0, present, nil
end
