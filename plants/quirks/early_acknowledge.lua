-- SPDX-License-Identifier: MIT
-- A drive whose statusword has bit 12 (set-point acknowledge) from enabling until the first new set-point.
-- Report: github.com/canopen-python/canopen, issue 678
local enabled, early = false, false

function update(now)
  local status, was = get(0x6041), enabled
  enabled = status & 0x6F == 0x27
  early = enabled and (early or not was) and get(0x6040) & 0x10 == 0
  if early then set(0x6041, 0, status | 0x1000) end
end
