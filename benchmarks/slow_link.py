"""`python benchmarks/slow_link.py NAMESPACE NAMESPACE`: a link with delay and loss between two network namespaces of Linux.

For kernels without netem: each namespace gets a TAP device, and this program forwards the frames from one to the other,
delayed, or drops them. It prints "ready", and exits when stdin is closed. Needs root, `ip` and /dev/net/tun.
"""

import argparse
import heapq
import itertools
import os
import random
import selectors
import struct
import subprocess
import sys
import time

DEVICE = "veth0"  # name of the TAP device in each namespace
LONGEST_FRAME = 65_536

# From linux/if_tun.h.
TUNSETIFF = 0x400454CA
IFF_TAP, IFF_NO_PI = 0x0002, 0x1000


def open_tap(namespace, number):
    """Return the file of a new TAP device in a namespace."""
    import fcntl

    name = f"tap{number}-{os.getpid()}"
    tap = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tap, TUNSETIFF, struct.pack("16sH14x", name.encode(), IFF_TAP | IFF_NO_PI))
    subprocess.run(["ip", "link", "set", name, "netns", namespace, "name", DEVICE], check=True)
    return tap


def pass_frames(taps, delay, jitter, loss):
    """Forward frames until stdin is closed.

    ``delay`` and ``jitter`` are in seconds, ``loss`` is a fraction, all for one direction.
    """
    there = {taps[0]: taps[1], taps[1]: taps[0]}
    waiting = []
    order = itertools.count()
    selector = selectors.DefaultSelector()
    for file in (*taps, sys.stdin):
        selector.register(file, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select(max(0.0, waiting[0][0] - time.monotonic()) if waiting else None):
            if key.fileobj is sys.stdin:
                return
            try:
                while frame := os.read(key.fd, LONGEST_FRAME):
                    if random.random() >= loss:
                        due = time.monotonic() + random.normalvariate(delay, jitter)
                        heapq.heappush(waiting, (due, next(order), there[key.fd], frame))
            except BlockingIOError:
                pass
        now = time.monotonic()
        while waiting and waiting[0][0] <= now:
            _, _, tap, frame = heapq.heappop(waiting)
            try:
                os.write(tap, frame)
            except OSError:
                pass  # that device is down, so the link is cut


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("namespaces", nargs=2, metavar="NAMESPACE")
    parser.add_argument("--delay", type=float, default=20.0, help="milliseconds, one way")
    parser.add_argument("--jitter", type=float, default=5.0, help="its standard deviation in milliseconds")
    parser.add_argument("--loss", type=float, default=1.0, help="percent of the frames, one way")
    options = parser.parse_args()
    taps = [open_tap(namespace, number) for number, namespace in enumerate(options.namespaces)]
    print("ready", flush=True)
    pass_frames(taps, options.delay / 1000, options.jitter / 1000, options.loss / 100)


if __name__ == "__main__":
    main()
