-- SPDX-License-Identifier: MIT
-- A heated body: a heater with a first-order lag, a body that stores heat, losses to the surroundings. All of it is
-- linear, so the temperature is exact at each call, however long ago the last one was.
--
--   2001h  heater, 0..100 % of full_power     2000h  temperature in degrees C
--   2002h  surroundings in degrees C     2003h  heating power in W
--   heater-broken   incident: no heating power    door-open   incident: three times the loss
local full_power <const> = 2000   -- W
local heater_lag <const> = 5      -- s
local capacity <const> = 10000    -- J/K
local loss <const> = 20           -- W/K

incidents, alarms = { "heater-broken", "door-open" }, { "heater-broken" }
device = { name = "Heated body", product = 0x31, revision = 0x10000 }
objects = {
  { index = 0x2000, name = "temperature", type = "f32", access = "ro", pdo = "tx", default = 20, unit = "°C", high = 150, show = { "output", "curve" } },
  { index = 0x2001, name = "heater", type = "u8", pdo = "rx", unit = "%", low = 0, high = 100, show = "input" },
  { index = 0x2002, name = "surroundings", type = "f32", default = 20, unit = "°C", low = -50, high = 50, show = "input" },
  { index = 0x2003, name = "power", type = "f32", access = "ro", pdo = "tx", unit = "W", high = 2000, show = { "output", "curve" } },
}

local exp = math.exp
local here = {}           -- present incidents
local temperature = 20.0  -- degrees C
local power, wanted, around, since = 0, 0, 20.0, 0

-- C dT/dt = power(t) - loss (T - around), power(t) = wanted + (power - wanted) exp(-t / lag).
local function pass(t)
  local lost = here["door-open"] and 3 * loss or loss
  local slow, fast = capacity / lost, heater_lag
  local final = around + wanted / lost
  local extra = (power - wanted) / lost * fast / (fast - slow)  -- effect of the heater's lag; slow ~= fast
  local faded = exp(-t / fast)
  temperature = final + (temperature - final - extra) * exp(-t / slow) + extra * faded
  power = wanted + (power - wanted) * faded
end

local function show()
  set(0x2000, 0, temperature)
  set(0x2003, 0, power)
end

function reset(now)
  since, wanted = now, 0
  show()
end

function update(now)
  pass(now - since)
  since = now
  wanted = here["heater-broken"] and 0 or full_power * get(0x2001) / 100
  around = get(0x2002)
  show()
  local missing, gain = power - wanted, power - loss * (temperature - around)
  local still = missing < 0.01 and missing > -0.01 and gain < 0.01 and gain > -0.01
  return not still and ((now * 10 + 1e-6) // 1 + 1) / 10 or nil  -- every 100 ms until the temperature is steady
end

-- First calculates up to now with the old state.
function on_incident(name, present, now)
  pass(now - since)
  since, here[name] = now, present
end
