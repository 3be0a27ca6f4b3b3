# SPDX-License-Identifier: MIT
"""A PLC that owns its registers, for tests that check every byte."""

import contextlib
import socket
import struct
import threading


class OwnedRegisters:
    """The Modbus TCP server of a PLC for holding registers, FC 3, 6 and 16; the PLC's program is in the test."""

    def __init__(self):
        self.registers = {}
        self.changed = threading.Condition()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.client = None  # the last one
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            try:
                with self.listener.accept()[0] as self.client:
                    while self.respond(self.client):
                        pass
            except ConnectionError:
                pass
            except OSError:
                return

    def stop(self):
        with contextlib.suppress(OSError):  # it has been stopped
            self.listener.shutdown(socket.SHUT_RDWR)
            self.listener.close()
            if self.client:
                self.client.shutdown(socket.SHUT_RDWR)

    def respond(self, client):
        header = client.recv(7, socket.MSG_WAITALL)
        if len(header) < 7:
            return False
        pdu = client.recv(int.from_bytes(header[4:6], "big") - 1, socket.MSG_WAITALL)
        address, count = struct.unpack(">HH", pdu[1:5])
        with self.changed:
            if pdu[0] == 3:
                response = struct.pack(">BB", 3, 2 * count) + struct.pack(f">{count}H", *self.read(address, count))
            else:
                self.write(address, [count] if pdu[0] == 6 else struct.unpack(f">{count}H", pdu[6:6 + 2 * count]))
                response = pdu[:5]
        client.sendall(header[:4] + struct.pack(">H", len(response) + 1) + header[6:] + response)
        return True

    def read(self, first, count):
        return [self.registers.get(address, 0) for address in range(first, first + count)]

    def write(self, first, words):
        self.registers.update(enumerate(words, first))
        self.changed.notify_all()
