#!/usr/bin/env python3
"""Looks at a flight through `roborun run --live PORT`, as Foxglove does.

usage: viewer.py PORT TOPIC...    one line per message: topic, seconds of flight, JSON; until the server ends, or nobody reads
"""
import base64
import json
import os
import socket
import struct
import sys
import time


def connected(port):
    until = time.monotonic() + 60
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), 60)
        except OSError:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)


class Viewer:
    def __init__(self, port):
        self.socket = connected(port)
        self.socket.settimeout(300)  # before a flight there is nothing to say
        self.rest = b""
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
                            "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n".encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.bytes(1)
        assert head.startswith(b"HTTP/1.1 101 "), head

    def bytes(self, count):
        while len(self.rest) < count:
            more = self.socket.recv(1 << 16)
            if not more:
                raise EOFError
            self.rest += more
        taken, self.rest = self.rest[:count], self.rest[count:]
        return taken

    def message(self):
        first, length = self.bytes(2)
        if length == 126:
            length, = struct.unpack(">H", self.bytes(2))
        elif length == 127:
            length, = struct.unpack(">Q", self.bytes(8))
        payload = self.bytes(length)
        if first & 0x0F == 8:
            raise EOFError
        return payload if first & 0x0F == 2 else json.loads(payload)

    def say(self, message):
        payload, mask = json.dumps(message).encode(), os.urandom(4)
        assert len(payload) < 65536
        head = bytes([0x81, 0x80 | len(payload)]) if len(payload) < 126 else bytes([0x81, 0xFE]) + struct.pack(">H", len(payload))
        self.socket.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))


def main():
    wanted, topics = sys.argv[2:], {}
    viewer = Viewer(int(sys.argv[1]))
    try:
        while True:
            message = viewer.message()
            if isinstance(message, dict):
                for channel in message.get("channels", []):
                    if channel["topic"] in wanted:
                        topics[channel["id"]] = channel["topic"]
                        viewer.say({"op": "subscribe", "subscriptions": [{"id": channel["id"], "channelId": channel["id"]}]})
                continue
            opcode, subscription, time_ns = struct.unpack("<BIQ", message[:13])
            assert opcode == 1
            print(topics[subscription], f"{1e-9 * time_ns:.3f}", message[13:].decode(), flush=True)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass


main()
