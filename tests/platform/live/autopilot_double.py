"""The autopilot's side of a simulator link, scripted: takes the vehicle `paper` up to 3 m and down again, and misbehaves on the way.
usage: autopilot_double.py arducopter|px4 PORT flight|restart. Prints what is wrong; nothing: all was as written."""
import json
import math
import socket
import struct
import sys
import time

HOVER = 4.5 * 9.81 / (4 * 24.5)
wrong = []


def check(what, ok, seen=""):
    if not ok:
        wrong.append(f"{what}: {seen}")


def clamp(x, most):
    return max(-most, min(most, x))


class Pilot:
    """Holds north and east, and a height; throttles front right, rear left, front left, rear right, as shares of the full thrust."""

    def __init__(self):
        self.home = None

    def motors(self, s, height):
        w, x, y, z = s["quaternion"]
        roll, pitch = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), math.asin(clamp(2 * (w * y - z * x), 1))
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        if self.home is None:
            self.home = s["position"][:2] + [yaw]
        goal = [self.home[0], self.home[1], -height]
        limits = [1.5, 1.5, 1.0]
        v = [clamp(1.0 * (g - p), m) for g, p, m in zip(goal, s["position"], limits)]
        a = [2.0 * (wanted - now) for wanted, now in zip(v, s["velocity"])]
        forward, right = a[0] * math.cos(yaw) + a[1] * math.sin(yaw), a[1] * math.cos(yaw) - a[0] * math.sin(yaw)
        turn = (self.home[2] - yaw + math.pi) % (2 * math.pi) - math.pi
        errors = [clamp(right / 9.81, 0.3) - roll, clamp(-forward / 9.81, 0.3) - pitch]
        p, q, r = s["imu"]["gyro"]
        to_roll, to_pitch = 14 * (7 * errors[0] - p) / 367, 14 * (7 * errors[1] - q) / 367
        to_yaw = clamp(4 * (1.5 * turn - r) / 12.6, 0.1)
        up = HOVER * (1 - a[2] / 9.81) / (math.cos(roll) * math.cos(pitch))
        return [up - to_roll + to_pitch + to_yaw, up + to_roll - to_pitch + to_yaw,
                up + to_roll + to_pitch - to_yaw, up - to_roll - to_pitch - to_yaw]


class ArduPilot:
    RATE_HZ = 400

    def __init__(self, port):
        self.link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.link.connect(("127.0.0.1", port))
        self.link.settimeout(0.1)
        for _ in range(600):  # until the plant is there
            try:
                self.link.send(b"hello")
                self.answer()
            except TimeoutError:
                break
            except ConnectionRefusedError:
                time.sleep(0.1)
        self.link.settimeout(60)
        self.frame, self.clock, self.rate = 7, 0.0, self.RATE_HZ

    def packet(self, motors, magic=18458, rate=None):
        thrust = [max(0.0, min(1.0, m)) for m in motors]
        pwm = [round(1000 + 1000 * (math.sqrt(0.1225 + 2.6 * t) - 0.35) / 1.3) for t in thrust]
        return struct.pack("<HHI16H", magic, self.rate if rate is None else rate, self.frame, *pwm, *[1500] * 12)

    def answer(self):
        return self.link.recv(4096).decode()

    def step(self, motors):
        """The next packet, and the vehicle after it."""
        self.frame += 1
        self.link.send(self.packet(motors))
        self.text = self.answer()
        check("compact, one line", self.text.count("\n") == 2 and " " not in self.text, self.text)
        s = json.loads(self.text)
        passed = s["timestamp"] - self.clock
        check("one step of the clock, from zero on", abs(passed - 1 / self.RATE_HZ) < 1e-6, passed)
        self.clock = s["timestamp"]
        # As the real one does: the rate is what the stamps say, the first one counted from zero (32-bit float, then cut).
        if 0 < passed < 0.1:
            self.rate = int(struct.unpack("f", struct.pack("f", 1 / passed))[0])
        return s

    def boot(self):
        s = self.step([0] * 4)
        for name, got, wanted in (("force at rest", s["imu"]["accel_body"], [0, 0, -9.81]), ("rate at rest", s["imu"]["gyro"], [0, 0, 0]),
                                  ("place", s["position"], [0, 0, 0]), ("speed", s["velocity"], [0, 0, 0]),
                                  ("faces east, in either sign", [abs(x) for x in s["quaternion"]], [0.5 ** 0.5, 0, 0, 0.5 ** 0.5]),
                                  ("faces east and not west", [s["quaternion"][0] * s["quaternion"][3]], [0.5])):
            check(name, all(abs(g - w) < 1e-6 for g, w in zip(got, wanted)), got)
        return s

    def restart(self):
        self.frame, self.clock = 0, 0.0
        self.link.settimeout(10)

    def misbehave(self, motors):
        """Garbage has no answer, the same number the same one; missing numbers are one step."""
        for bytes_ in (b"x" * 40, self.packet(motors, magic=18459), self.packet(motors)[:39], self.packet(motors, rate=0), b""):
            self.link.send(bytes_)
        stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        stranger.sendto(self.packet([1] * 4), ("127.0.0.1", self.link.getpeername()[1]))
        self.link.send(self.packet(motors))
        check("answered again", self.answer() == self.text)
        self.frame += 5
        return self.step(motors)


class Px4:
    """Knows what its sensors say alone: the attitude is the sum of the rates, place and speed are sums of forces, led by the fixes."""
    RATE_HZ = 250

    def __init__(self, port):
        self.port = port
        for _ in range(600):
            try:
                self.link = socket.create_connection(("127.0.0.1", port), 60)
                break
            except OSError:
                time.sleep(0.1)
        self.rest, self.seq, self.home, self.clock = b"", 0, None, None
        self.q, self.v, self.p = [0.5 ** 0.5, 0, 0, 0.5 ** 0.5], [0.0] * 3, [0.0] * 3

    def crc(self, bytes_, extra):
        crc = 0xFFFF
        for byte in bytes_ + bytes([extra]):
            x = (byte ^ crc) & 0xFF
            x = (x ^ (x << 4)) & 0xFF
            crc = (crc >> 8) ^ (x << 8) ^ (x << 3) ^ (x >> 4)
        return struct.pack("<H", crc & 0xFFFF)

    def frame(self, motors, mode=129):
        controls = [max(0.0, min(1.0, m)) for m in motors] + [0.0] * 12
        payload = struct.pack("<QQ16fB", 0, 1, *controls, mode)
        head = struct.pack("<BBBBBBB", len(payload), 0, 0, self.seq % 256, 1, 1, 93) + b"\0\0"
        self.seq += 1
        return b"\xfd" + head + payload + self.crc(head + payload, 47)

    def messages(self):
        while True:
            while len(self.rest) < 12 or len(self.rest) < 12 + self.rest[1]:
                more = self.link.recv(4096)
                if not more:
                    raise OSError("closed")
                self.rest += more
            size = self.rest[1]
            head, payload, crc, self.rest = self.rest[1:10], self.rest[10:10 + size], self.rest[10 + size:12 + size], self.rest[12 + size:]
            msgid = head[6]
            check("frame", crc == self.crc(head + payload, {107: 108, 113: 124}[msgid]), msgid)
            yield msgid, payload + bytes(80)

    def feel(self):
        """The next HIL_SENSOR, with the fixes before it."""
        for msgid, payload in self.messages():
            if msgid == 113:
                self.on_fix(*struct.unpack_from("<QiiiHHHhhhHBB", payload))
                continue
            t, *m = struct.unpack_from("<Q13fIB", payload)
            passed = 0 if self.clock is None else t - self.clock
            check("4 ms", passed == 4000 or self.clock is None, passed)
            self.clock, self.m = t, m
            self.integrate(m, passed * 1e-6)
            return {"timestamp": t * 1e-6, "quaternion": self.q, "position": self.p, "velocity": self.v, "imu": {"gyro": m[3:6]}}

    def on_fix(self, t, lat, lon, alt, eph, epv, vel, vn, ve, vd, cog, fix, satellites):
        check("fix", fix == 3 and satellites > 5 and 0 < eph < 100)
        if self.home is None:
            self.home = (lat, lon, alt)
            check("begins at the origin", abs(lat - 473977420) < 20 and abs(lon - 85455940) < 20 and abs(alt - 488000) < 500, self.home)
        place = [(lat - self.home[0]) * 0.0111, (lon - self.home[1]) * 0.0111 * math.cos(math.radians(lat * 1e-7)), (self.home[2] - alt) * 1e-3]
        for i, (p, v) in enumerate(zip(place, (vn, ve, vd))):
            self.p[i] += 0.3 * (p + 0.1 * self.v[i] - self.p[i])
            self.v[i] += 0.3 * (0.01 * v - self.v[i])

    def turned(self, v):
        w, x, y, z = self.q
        return [(1 - 2 * (y * y + z * z)) * v[0] + 2 * (x * y - w * z) * v[1] + 2 * (x * z + w * y) * v[2],
                2 * (x * y + w * z) * v[0] + (1 - 2 * (x * x + z * z)) * v[1] + 2 * (y * z - w * x) * v[2],
                2 * (x * z - w * y) * v[0] + 2 * (y * z + w * x) * v[1] + (1 - 2 * (x * x + y * y)) * v[2]]

    def integrate(self, m, dt):
        w, x, y, z = self.q
        a, b, c = (0.5 * dt * g for g in m[3:6])
        q = [w - a * x - b * y - c * z, x + a * w + c * y - b * z, y + b * w + a * z - c * x, z + c * w + b * x - a * y]
        self.q = [i / math.sqrt(sum(j * j for j in q)) for i in q]
        force = self.turned(m[0:3])
        for i in range(3):
            self.v[i] += dt * (force[i] + (9.81 if i == 2 else 0))
            self.p[i] += dt * self.v[i]

    def step(self, motors):
        self.link.sendall(self.frame(motors))
        return self.feel()

    def boot(self):
        """Does not answer yet, and is told what its sensors feel all the same."""
        for _ in range(250):
            s = self.feel()
            self.v, self.p = [0.0] * 3, [0.0] * 3
        check("force at rest", abs(self.m[2] + 9.81) < 0.3 and math.hypot(*self.m[0:2]) < 0.3, self.m)
        check("faces east", self.m[7] < 0 < self.m[8] and 0.4 < math.hypot(*self.m[6:9]) < 0.55, self.m)
        return s

    def restart(self):
        self.link.close()
        home = self.home
        self.__init__(self.port)
        self.home = home

    def misbehave(self, motors):
        self.link.sendall(b"\xfd\x01garbage")
        damaged = bytearray(self.frame(motors))
        damaged[20] ^= 1
        self.link.sendall(damaged)
        self.link.sendall(self.frame(motors[:3] + [math.nan], mode=129))
        s = self.feel()
        s = self.feel()  # nobody answered for a second
        return self.step(motors)


def fly(autopilot, mode):
    pilot, s, highest = Pilot(), autopilot.boot(), 0.0
    for i in range(1, 20 * autopilot.RATE_HZ):
        time_s = i / autopilot.RATE_HZ
        motors = pilot.motors(s, 3.0 if time_s < 6 else 3.0 - 0.7 * (time_s - 6))
        s = autopilot.misbehave(motors) if i == 4 * autopilot.RATE_HZ else autopilot.step(motors)
        highest = max(highest, -s["position"][2])
        if mode == "restart" and time_s > 5:
            autopilot.restart()
            break
        if time_s > 12:
            break
    check("went up", 2.6 < highest < 3.4, highest)
    check("stayed over its place", math.hypot(*s["position"][:2]) < 1.5, s["position"])
    for _ in range(5 * autopilot.RATE_HZ):  # switched off; the plant ends when it has seen enough
        try:
            autopilot.step([0] * 4)
        except OSError:
            return


fly({"arducopter": ArduPilot, "px4": Px4}[sys.argv[1]](int(sys.argv[2])), sys.argv[3])
print("\n".join(wrong[:20]))
sys.exit(bool(wrong))
