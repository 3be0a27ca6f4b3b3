# SPDX-License-Identifier: MIT
# Writes object 2004h of node 20h of `cbcan-sim --demo`, reads it, its name, and an object that does not exist: pymodbus.
from pymodbus.client import ModbusTcpClient

UNIT = {"slave": 1}  # pymodbus 3.10 and newer: {"device_id": 1}
plc = ModbusTcpClient("127.0.0.1", port=1502)
plc.connect()


def checked(response):
    if response.isError():  # a Modbus exception, or no response
        raise OSError(str(response))
    return response


def transact(command, node, index, sub, size, data=b""):
    """One SDO transfer; data and the result are byte strings as on CAN, low byte first."""
    words = [int.from_bytes(data[i:i + 2], "little") for i in range(0, len(data), 2)]
    checked(plc.write_registers(3700, [0xCA0E, command, node, index, sub, size, *words], **UNIT))
    window = [0xCA0E]
    while window[0] == 0xCA0E:
        window = checked(plc.read_holding_registers(3700, count=70, **UNIT)).registers
    data = b"".join(word.to_bytes(2, "little") for word in window[6:])
    if window[0] == 4:
        raise OSError(f"abort {window[7]:04X} {window[6]:04X}h")
    if window[0] != 0:
        raise OSError(f"refused: R3700 = {window[0]}")
    return data[:window[5]]


def read(node, index, sub):
    return transact(5055, node, index, sub, 128)


def write(node, index, sub, data):
    transact(5066, node, index, sub, len(data), data)


write(0x20, 0x2004, 0, (123456789).to_bytes(4, "little"))
print("2004h =", int.from_bytes(read(0x20, 0x2004, 0), "little"))
print("1008h =", read(0x20, 0x1008, 0).decode())
try:
    read(0x20, 0x3333, 0)
except OSError as error:
    print(f"3333h: {error}")
