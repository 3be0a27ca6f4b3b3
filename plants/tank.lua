-- SPDX-License-Identifier: MIT
-- A tank with an inlet valve, an outlet valve and a leak. The outflow is proportional to the square root of the
-- level (Torricelli). The level is calculated exactly at each call, however long ago the last one was.
--
--   2001h  inlet, 0..100 % of full_inlet      2000h  level in mm
--   2002h  outlet, 0..100 % of its opening    2003h  bit 0: full, bit 1: empty
--   leak   incident: flows like an outlet of 10 %
local area <const> = 0.2            -- m2
local height <const> = 1.0          -- m
local full_inlet <const> = 0.010    -- m3/s
local opening <const> = 0.0008      -- m2, effective
local fall <const> = (2 * 9.81) ^ 0.5    -- root of 2 g
local e <const> = 2.718281828459045

incidents, alarms = { "leak" }, { "leak" }
device = { name = "Tank", product = 0x30, revision = 0x10000 }
objects = {
  { index = 0x2000, name = "level", type = "f32", access = "ro", pdo = "tx", unit = "mm", high = 1000, level = true, show = { "output", "curve" } },
  { index = 0x2001, name = "inlet", type = "u8", pdo = "rx", unit = "%", high = 100, show = "input" },
  { index = 0x2002, name = "outlet", type = "u8", pdo = "rx", unit = "%", high = 100, show = "input" },
  { index = 0x2003, name = "marks", type = "u8", access = "ro", pdo = "tx", bits = { "full", "empty" }, show = "output" },
}

local level, inflow, outlet, leak, since = 0, 0, 0, 0, 0
local marks

-- The level after t seconds. With q = sqrt(level): dq/dt = (inflow / q - k) / (2 area), k = outlet * sqrt(2 g).
-- Without inflow or outlet that has a simple solution; with both, the equation gives t for a known q.
local function after(t)
  local k = outlet * fall
  if k == 0 then return level + inflow * t / area end
  local q, lost = level ^ 0.5, k * t / (2 * area)
  if inflow == 0 then return q > lost and (q - lost) ^ 2 or 0 end
  local final = inflow / k
  if q - final < 1e-12 and final - q < 1e-12 then return final * final end
  -- x - q + final w + lost = 0 with x = final - (final - q) e^w: solved for w by Newton's method.
  local w, x = -lost / final
  for _ = 1, 50 do
    x = final - (final - q) * e ^ w
    local step = (x - q + final * w + lost) / x
    w = w - step
    if step < 1e-14 and step > -1e-14 then break end
  end
  return x * x
end

local function show()
  set(0x2000, 0, level * 1000)
  local now = (level >= height and 1 or 0) + (level <= 0 and 2 or 0)
  if now ~= marks then set(0x2003, 0, now) end
  marks = now
end

function reset(now)
  inflow, outlet, since, marks = 0, 0, now, nil
  show()
end

function update(now)
  if now > since then
    local reached = after(now - since)
    level = reached < 0 and 0 or reached > height and height or reached
    since = now
  end
  inflow = full_inlet * get(0x2001) / 100
  outlet = opening * (get(0x2002) + leak) / 100
  show()
  local still = inflow == 0 and (outlet == 0 or level == 0) or inflow > 0 and outlet == 0 and level == height
  return not still and ((now * 20 + 1e-6) // 1 + 1) / 20 or nil  -- every 50 ms while the level changes
end

function on_incident(_, present) leak = present and 10 or 0 end
