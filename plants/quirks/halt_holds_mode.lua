-- SPDX-License-Identifier: MIT
-- A drive that changes its mode only without HALT, bit 8 of the controlword: refused by SDO, ignored by RPDO.
-- Report: github.com/ros-industrial/ros2_canopen, issue 234 (ENGEL HBI)
local mode = 0
local function is_halted() return get(0x6040) & 0x100 ~= 0 end

function on_write(index, sub, value, now)
  if index == 0x6060 and value ~= mode and is_halted() then return 0x08000022 end
end

function before_update(now)
  if is_halted() then set(0x6060, 0, mode) end
  mode = get(0x6060)
end
