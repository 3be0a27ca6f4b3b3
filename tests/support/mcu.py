# SPDX-License-Identifier: MIT
"""Runs an image for the MPS2 board in QEMU, and talks Modbus RTU to it."""

import ctypes
import signal
import socket
import struct
import subprocess
import tempfile

LIMIT = 60  # seconds; for what takes milliseconds on an idle machine


def die_with_parent():
    """For a child process: a killed test must not leave an emulator running (prctl PR_SET_PDEATHSIG)."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)


def receive(connection, count):
    """Exactly `count` bytes from a socket."""
    data = b""
    while len(data) < count:
        part = connection.recv(count - len(data))
        if not part:
            raise ConnectionError("closed by the other side")
        data += part
    return data


def crc(data):
    """MODBUS over Serial Line V1.02, 6.2.2."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ 0xA001 if value & 1 else value >> 1
    return struct.pack("<H", value)


def with_crc(frame):
    """The frame, of bytes or hexadecimal digits, and its CRC."""
    data = bytes.fromhex(frame) if isinstance(frame, str) else frame
    return data + crc(data)


class Line:
    """One end of a serial line of the emulator: a socket to which the emulator connects."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(LIMIT)

    def option(self):
        return f"tcp:127.0.0.1:{self.listener.getsockname()[1]},nodelay=on"

    def accept(self):
        self.socket = self.listener.accept()[0]
        self.socket.settimeout(LIMIT)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.listener.close()

    def close(self):
        self.listener.close()
        if hasattr(self, "socket"):
            self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def receive(self, count):
        return receive(self.socket, count)


class Mcu:
    """The image `image` on `machine`. `can` is QEMU's option for UART1; None = self.can, a Line."""

    def __init__(self, image, machine="mps2-an385", can=None, options=()):
        self.modbus = Line()
        self.can = Line() if can is None else None
        self.error = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            ["qemu-system-arm", "-M", machine, "-kernel", image, "-display", "none", "-monitor", "none",
             "-semihosting-config", "enable=on,target=native",
             "-serial", self.modbus.option(), "-serial", can or self.can.option(), *options],
            stdin=subprocess.DEVNULL, stderr=self.error, preexec_fn=die_with_parent)
        try:
            for line in filter(None, (self.modbus, self.can)):
                line.accept()
        except BaseException:
            self.stop()
            raise

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        error = self.stop()
        if kind is None and error:
            raise AssertionError(f"the emulator said: {error}")

    def stop(self):
        """Ends the emulator; returns its standard error."""
        self.process.kill()
        self.process.wait()
        for line in filter(None, (self.modbus, self.can)):
            line.close()
        with self.error:
            self.error.seek(0)
            return self.error.read()

    def request(self, pdu, response_size, station=1):
        """One request and its response, of `response_size` bytes without station and CRC; there is no second try."""
        frame = bytes([station]) + pdu
        self.modbus.send(frame + crc(frame))
        response = self.modbus.receive(response_size + 3)
        assert response[-2:] == crc(response[:-2]), f"wrong CRC: {response.hex()}"
        assert response[0] == station, response.hex()
        return response[1:-2]

    def write(self, address, words):
        pdu = struct.pack(">BHHB", 16, address, len(words), 2 * len(words)) + struct.pack(f">{len(words)}H", *words)
        response = self.request(pdu, 5)
        assert response == pdu[:5], response.hex()

    def read(self, address, count):
        response = self.request(struct.pack(">BHH", 3, address, count), 2 + 2 * count)
        assert response[:2] == bytes([3, 2 * count]), response.hex()
        return list(struct.unpack(f">{count}H", response[2:]))

    def execute(self, *words, seen=1):
        """R3701.. = words and CA0Eh in one request; when it is done, returns `seen` registers from R3700."""
        self.write(3700, [0xCA0E, *words])
        while (registers := self.read(3700, seen))[0] == 0xCA0E:
            pass
        return registers

    def diagnostics(self):
        """R4100..R4132 by name, see docs/reference/registers.md."""
        words = self.read(4100, 33)
        names = {"uptime": 2, "modbus_requests": 8, "modbus_crc_errors": 10, "modbus_exceptions": 12, "modbus_lost": 14,
                 "can_received": 16, "can_sent": 18, "can_refused": 20, "can_lost": 22, "can_errors": 24,
                 "transactions": 26, "transactions_failed": 28, "transactions_cancelled": 30}
        values = {name: words[at] | words[at + 1] << 16 for name, at in names.items()}
        return values | {"version": words[0], "patch_level": words[1], "reset_cause": words[4], "stack_size": words[5],
                         "stack_used": words[6], "can_state": words[7], "clock_source": words[32]}
