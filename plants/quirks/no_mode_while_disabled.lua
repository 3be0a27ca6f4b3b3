-- SPDX-License-Identifier: MIT
-- A drive whose 6061h is 0 unless operation is enabled.
-- Report: github.com/ros-industrial/ros2_canopen, issue 444 (Kinco iSWV)
function update(now)
  if get(0x6041) & 0x6F ~= 0x27 then set(0x6061, 0, 0) end
end
