-- SPDX-License-Identifier: MIT
-- A drive without 6502h, supported drive modes.
-- Report: github.com/ros-industrial/ros2_canopen, issue 299
objects = {
  { index = 0x6502, access = "none" },
}
