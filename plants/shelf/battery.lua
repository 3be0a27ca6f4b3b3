-- SPDX-License-Identifier: MIT
-- A lead-acid battery of CiA 418. Its input, at 2000h, is the current: what flows in counts up, a load is negative.
-- The voltage follows state of charge and current; the charge is exact, however often it is read.
--
--   overtemperature   incident: 65 degrees; no longer ready for charging, EMCY 4210h
device = { type = 0x000001A2, name = "Battery", product = 0x418 }
objects = {
  { index = 0x2000, name = "current", type = "f32", access = "ro", pdo = "optional", unit = "A", low = -400, high = 400, show = { "input", "curve" } },
  { index = 0x6000, name = "battery status", type = "u8", access = "ro", pdo = "tx", bits = { "ready for charging" }, show = "output" },
  { index = 0x6001, name = "charger status", type = "u8", pdo = "rx" },
  { index = 0x6010, name = "temperature in 0.125 °C", type = "i16", access = "ro", pdo = "tx", default = 200, show = "curve" },
  { index = 0x6020, sub = 1, name = "battery parameter: type", type = "u8", access = "ro", default = 1 },
  { index = 0x6020, sub = 2, name = "battery parameter: capacity in Ah", type = "u16", access = "ro", default = 100 },
  { index = 0x6020, sub = 3, name = "battery parameter: greatest charge current", type = "u16", access = "ro", default = 20 },
  { index = 0x6020, sub = 4, name = "battery parameter: number of cells", type = "u16", access = "ro", default = 12 },
  { index = 0x6051, name = "charge since the last charging in 0.125 Ah", type = "u16", access = "ro" },
  { index = 0x6052, name = "charge of the last charging in 0.125 Ah", type = "u16", access = "ro" },
  { index = 0x6060, name = "voltage in 1/1024 V", type = "u32", access = "ro", pdo = "tx", show = "curve" },
  { index = 0x6070, name = "charge current requested in 1/16 A", type = "u16", access = "ro", pdo = "tx" },
  { index = 0x6081, name = "state of charge", type = "u8", access = "ro", pdo = "tx", unit = "%", high = 100, level = true, show = { "output", "curve" } },
}
incidents, alarms = { "overtemperature" }, { "overtemperature" }

local resistance <const> = 0.01               -- ohms
local charge, current, since, hot = nil, 0, 0, false  -- Ah, A, s
local expended, returned = 0, 0               -- Ah

local function number(index, sub, otherwise) return has(index, sub) and get(index, sub) or otherwise end
local function show(index, value) if has(index) then set(index, 0, value) end end
local function capacity() return number(0x6020, 2, 100) end

local function flow(now)
  local amount = current * (now - since) / 3600
  charge = math.max(0, math.min(charge + amount, capacity()))
  if amount > 0 then returned = returned + amount else expended = expended - amount end
  since = now
end

function reset(now)
  charge, since = charge or capacity(), now
  update(now)
end

function update(now)
  flow(now)
  local part, cells = charge / capacity(), number(0x6020, 4, 12)
  local greatest = number(0x6020, 3, 20)
  show(0x2000, current)
  show(0x6000, hot and 0 or 1)
  show(0x6010, (hot and 65 or 25) * 8)
  show(0x6051, expended * 8)
  show(0x6052, returned * 8)
  show(0x6060, (cells * (1.95 + 0.18 * part) + resistance * current) * 1024)
  show(0x6070, (hot or part >= 1) and 0 or greatest * 16 * math.min(1, 10 * (1 - part)))
  show(0x6081, part * 100)
  return current ~= 0 and now + 1 or nil
end

-- A charging begins: its counters begin again.
function set_input(index, _, value, now)
  if index ~= 0x2000 then return false end
  flow(now)
  if value > 0 and current <= 0 then returned = 0 elseif value < 0 and current >= 0 then expended = 0 end
  current = value
  return true
end

function on_incident(_, present)
  hot = present
  if present then emcy(0x4210) else emcy_over(0x4210) end
end
