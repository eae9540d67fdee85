#!/usr/bin/env python3
"""A bad network between two ends that speak UDP: relay.py PORT TO_PORT DELAY_ms LOSS [SEED]
Who speaks to PORT speaks to 127.0.0.1:TO_PORT, and the other way round. Each datagram comes DELAY_ms later, or up to half of that more (so their order
changes), or never (a share LOSS of them), or twice (one in a hundred)."""
import heapq, random, select, socket, sys, time

port, to_port, delay_s, loss = int(sys.argv[1]), int(sys.argv[2]), 1e-3 * float(sys.argv[3]), float(sys.argv[4])
chance = random.Random(int(sys.argv[5]) if len(sys.argv) > 5 else 1)
near, far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
near.bind(("127.0.0.1", port))
for end in (near, far):
    end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    end.setblocking(False)
near_peer, far_peer = None, ("127.0.0.1", to_port)
waiting, count = [], 0
while True:
    now = time.monotonic()
    while waiting and waiting[0][0] <= now:
        _, _, end, peer, datagram = heapq.heappop(waiting)
        try:
            end.sendto(datagram, peer)
        except OSError:
            pass  # nobody is there yet
    left = waiting[0][0] - now if waiting else 1.0
    for end in select.select([near, far], [], [], max(left, 0.0))[0]:
        for _ in range(64):
            try:
                datagram, sender = end.recvfrom(2048)
            except OSError:
                break
            if end is near:
                near_peer = sender
            out, peer = (far, far_peer) if end is near else (near, near_peer)
            for _ in range(2 if chance.random() < 0.01 else 1):
                if peer and chance.random() >= loss:
                    count += 1
                    due = time.monotonic() + delay_s * (1.0 + 0.5 * chance.random())
                    heapq.heappush(waiting, (due, count, out, peer, datagram))
