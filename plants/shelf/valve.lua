-- SPDX-License-Identifier: MIT
-- A proportional valve of CiA 408 with control of the spool position: 16384 is 100 %. The spool follows the set point
-- with a lag.
--
--   spool-stuck   incident: the spool no longer moves; fault with EMCY 7000h
device = { type = 0x00000198, name = "Proportional valve", product = 0x408 }
objects = {
  { index = 0x6040, name = "control word", type = "u16", pdo = "rx" },
  { index = 0x6041, name = "status word", type = "u16", access = "ro", pdo = "tx", default = 8, bits = { "disabled", "hold", "active", "ready" }, show = "output" },
  { index = 0x6042, name = "device mode", type = "i8", default = 1, low = 1, high = 1 },
  { index = 0x6043, name = "control mode", type = "i8", default = 1, low = 1, high = 2 },
  { index = 0x6300, sub = 1, name = "set point: value", type = "i16", pdo = "rx", show = "curve" },
  { index = 0x6300, sub = 2, name = "set point: unit", type = "u8", access = "ro" },
  { index = 0x6300, sub = 3, name = "set point: prefix", type = "i8", access = "ro" },
  { index = 0x6301, sub = 1, name = "actual value: value", type = "i16", access = "ro", pdo = "tx", low = -16384, high = 16384, show = { "output", "curve" } },
  { index = 0x6301, sub = 2, name = "actual value: unit", type = "u8", access = "ro" },
  { index = 0x6301, sub = 3, name = "actual value: prefix", type = "i8", access = "ro" },
  { index = 0x6314, sub = 1, name = "hold set point: value", type = "i16" },
}
incidents, alarms = { "spool-stuck" }, { "spool-stuck" }

-- Status word (bits 0 to 3) of each state.
local init <const>, disabled <const>, hold <const>, active <const> = 8, 9, 11, 15
local fault_disabled <const>, fault_hold <const> = 1, 3
local lag <const> = 0.02                      -- time constant in s
local state, word, stuck, spool = init, 0, false, 0
local follow, shows_spool

-- The next state towards that of the lowest bits of the control word: each transition is between neighbours.
local function requested(command)
  local bits = command & 7
  if bits == 7 then return active end
  if bits & 3 == 3 then return hold end
  return bits & 1 == 1 and disabled or init
end

local function transition(command)
  local resets = command & 8 ~= 0 and word & 8 == 0
  word = command
  if state == fault_disabled or state == fault_hold then
    if not resets or stuck then return end
    emcy_over(0x7000)
  end
  state = requested(command)
end

local function limited(value) return value > 16384 and 16384 or value < -16384 and -16384 or value end

local function set_point()
  if state == active then return limited(get(0x6300, 1)) end
  if state == hold or state == fault_hold then return has(0x6314, 1) and limited(get(0x6314, 1)) or 0 end
  return 0                                    -- the spring moves the spool to its middle
end

-- Other modes, and what else the profile has, in the file of a real valve.
local served <const> = { [0x6040] = true, [0x6300] = true, [0x6314] = true }
function on_write(index, _, value)
  if index == 0x6042 and value == 1 or index == 0x6043 and (value == 1 or value == 2) then return end
  if index == 0x6042 or index == 0x6043 then return 0x06090030 end
  if index >= 0x6000 and index < 0x6800 and not served[index] then return 0x08000020 end
end

function reset(now)
  follow, shows_spool = block("pt1 start=0 time=" .. lag), has(0x6301, 1)
  state, word = init, 0
  update(now)
end

function update(now)
  local command = get(0x6040)
  if command ~= word then transition(command) end
  local place, moves = follow(set_point())
  if not stuck then spool = place end
  set(0x6041, 0, state)
  if shows_spool then set(0x6301, 1, spool) end
  return moves and ((now * 100 + 1e-6) // 1 + 1) / 100 or nil  -- every 10 ms while it moves
end

function on_incident(_, present)
  stuck = present
  if not present then return end
  state = (state == hold or state == active) and fault_hold or fault_disabled
  emcy(0x7000)
end
