# SPDX-License-Identifier: MIT
"""Tests of a program that uses the registers, with `pytest` in this folder; the fixture `window` is the PLC."""

import pytest
from cbcan_plant import READ, WRITE, NotWithin, PlantError

IO_MODULE, DRIVE = 0x42, 0x10


def test_a_value_is_written_and_read_back(window):
    assert window.execute(WRITE, IO_MODULE, 0x6411, 1, 2, 300) == 0
    assert window.execute(READ, IO_MODULE, 0x6411, 1, 2) == 0
    assert window.data == bytes([0x2C, 0x01])


def test_an_object_that_does_not_exist(window):
    assert window.execute(READ, IO_MODULE, 0x3333, 0, 2) == 4
    assert window.abort == 0x06020000


def test_a_silent_node_costs_a_second_of_the_plants_time(plant, window):
    plant.power(IO_MODULE, False)
    assert window.execute(READ, IO_MODULE, 0x6411, 1, 2) == 4
    assert window.abort == 0x05040000
    assert plant.now == pytest.approx(1.0, abs=0.001)
    plant.power(IO_MODULE, True)
    plant.wait(f"state {IO_MODULE} pre-operational", within="5s")


def test_a_late_response(plant, window):
    plant.fault(IO_MODULE, "response-late", delay_ms=50)
    window.start(READ, IO_MODULE, 0x6411, 1, 2)
    assert plant.advance("49ms") == 0.049
    assert window.read(3700) == [0xCA0E]
    assert window.result() == 0
    assert plant.now == 0.050


def test_an_input_changes(plant, window):
    plant.set(IO_MODULE, 0x6401, 1, 1234)
    assert plant.get(IO_MODULE, 0x6401, 1) == 1234
    window.execute(READ, IO_MODULE, 0x6401, 1, 2)
    assert window.data == (1234).to_bytes(2, "little")


def test_a_motor_gets_hot(plant):
    plant.incident(DRIVE, "overtemperature")
    assert plant.get(DRIVE, 0x603F) == 0x4210


def test_what_the_plant_refuses(plant):
    with pytest.raises(PlantError, match="not in this plant"):
        plant.get(99, 0x1000)
    with pytest.raises(NotWithin):
        plant.wait(f"state {IO_MODULE} operational", within="1s")


@pytest.mark.plant("--demo", "--sdo-timeout", "20")
def test_options(plant, window):
    plant.power("all", False)
    assert window.execute(READ, 1, 0x1000, 0, 4) == 4
    assert plant.now == pytest.approx(0.020, abs=0.001)
