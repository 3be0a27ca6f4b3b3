# SPDX-License-Identifier: MIT
"""Fills the tank to 500 mm, as a ladder program would: one request, one result. It has a bug."""

from cbcan_plant import READ, WRITE, Plant, Window, gave_up

plant = Plant.around()
window = Window(plant)


def set_valve(position):
    return window.execute(WRITE, 66, 0x6200, 1, 1, position) == 0


def level():
    for _ in range(3):
        if window.execute(READ, 66, 0x6401, 1, 2) == 0:
            return int.from_bytes(window.data, "little") / 16
        set_valve(0)  # without a level the inlet does not stay open
    gave_up("the level cannot be read")


while level() < 500:
    set_valve(1)
    plant.advance("250ms")
set_valve(0)
