#!/usr/bin/env python3
"""Writes a wall 5 m away to a sensor port, 30 times a second: feed_wall.py NAME. Layout: ../roborun_port.h."""
import array, fcntl, os, struct, sys, time

WIDTH, HEIGHT, SLOTS = 160, 120, 4
DEPTH = struct.Struct("<qII III f ffff fff 3f 4f I 4x")  # struct roborun_port_depth
SLOT_BYTES = (16 + DEPTH.size + WIDTH * HEIGHT * 4 + 63) // 64 * 64
path = "/dev/shm/roborun-" + (sys.argv[1] if len(sys.argv) == 2 else sys.exit(__doc__))
part = f"{path}.{os.getpid()}.part"
port = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o640)
fcntl.flock(port, fcntl.LOCK_EX)  # held while this process lives: it is the port's writer
os.ftruncate(port, 128 + SLOTS * SLOT_BYTES)
os.pwrite(port, struct.pack("<8sIIIIIIQ", b"roborunP", 1, 1, SLOTS, SLOT_BYTES, DEPTH.size, 0, os.getpid()), 0)
os.rename(part, path)  # readers of an older port see that this one took its place
pixels = array.array("f", [5.0] * (WIDTH * HEIGHT)).tobytes()
for number in range(1 << 62):
    image = DEPTH.pack(time.monotonic_ns(), number & 0xFFFFFFFF, 0, WIDTH, HEIGHT, 1, 0.0, 80.0, 80.0, 79.5, 59.5,
                       0.2, 10.0, 0.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0)
    slot = 128 + number % SLOTS * SLOT_BYTES
    # Each write is a call of the system, so that they are seen in this order.
    os.pwrite(port, struct.pack("<Q", 2 * number + 1), slot)
    os.pwrite(port, struct.pack("<I4x", len(pixels)) + image + pixels, slot + 8)
    os.pwrite(port, struct.pack("<Q", 2 * number + 2), slot)
    os.pwrite(port, struct.pack("<Q", number + 1), 40)
    time.sleep(1 / 30)
