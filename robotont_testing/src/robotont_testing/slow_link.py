"""A slow, lossy network between two network namespaces: packets pass through this program, from one TUN to the other.

    slow_link.py SETTINGS SEED PID PID...

Makes a device eth0 in the network namespace of each process, and hands each packet that comes out of one to the
others: later, or not at all, as the file SETTINGS says: "delay [s] loss [share]" of each direction. Linux's own way,
netem, is a kernel module that many machines lack.
"""

import contextlib
import ctypes
import fcntl
import heapq
import os
import random
import select
import struct
import sys
import time

CLONE_NEWNET = 0x40000000
TUNSETIFF = 0x400454CA
IFF_TUN, IFF_NO_PI = 0x0001, 0x1000
LARGEST = 65536      # [bytes] of a packet
LOOK_PERIOD = 0.02   # [s] between two looks at the settings


def open_tun(pid):
    """Descriptor of a new device eth0 in the network namespace of a process."""
    with open(f"/proc/{pid}/ns/net") as namespace:
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.setns(namespace.fileno(), CLONE_NEWNET):
            raise OSError(ctypes.get_errno(), "setns")
    tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH22s", b"eth0", IFF_TUN | IFF_NO_PI, b""))
    return tun


def forward(settings, chance, tuns):
    """Hand on packets for ever."""
    delay = loss = 0.0
    looked = 0.0
    waiting, count = [], 0  # (when it arrives [s], number, tun, packet): a heap
    while True:
        now = time.monotonic()
        if now - looked >= LOOK_PERIOD:
            looked = now
            with open(settings) as file:
                words = file.read().split()
            if len(words) == 2:  # else it is being written
                delay, loss = map(float, words)
        while waiting and waiting[0][0] <= now:
            _, _, tun, packet = heapq.heappop(waiting)
            write(tun, packet)
        left = waiting[0][0] - now if waiting else LOOK_PERIOD
        ready, _, _ = select.select(tuns, [], [], max(0.0, min(left, LOOK_PERIOD)))
        for tun in ready:
            packet = os.read(tun, LARGEST)
            if chance.random() >= loss:
                count += 1
                for other in tuns:
                    if other != tun:
                        heapq.heappush(waiting, (time.monotonic() + delay, count, other, packet))


def write(tun, packet):
    """Put a packet into a device; one that is down takes none."""
    with contextlib.suppress(OSError):
        os.write(tun, packet)


def main():
    """Run the link."""
    settings, *pids = sys.argv[1:]
    tuns = [open_tun(pid) for pid in pids]
    print("ready", flush=True)
    forward(settings, random.Random(1), tuns)


if __name__ == "__main__":
    main()
