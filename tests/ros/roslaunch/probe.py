"""A node's program for test_preload.py: prints its state as JSON, for a comparison of forked and started processes."""

import gc
import json
import os
import resource
import signal
import sys
import threading
import warnings

import rospy  # noqa: F401 - it adds to sys.meta_path

main = sys.modules["__main__"]


def stream(name):
    text = getattr(sys, name)
    raw = getattr(text.buffer, "raw", text.buffer)
    return [
        *(text.name, text.mode, text.encoding, text.errors, text.line_buffering, text.write_through),
        *(text.fileno(), text.isatty(), repr(text.newlines), type(text.buffer).__name__, raw.name, raw.mode),
        *(raw.closefd, getattr(sys, f"__{name}__") is text),
    ]


def status():
    wanted = ("SigBlk", "SigIgn", "SigCgt", "Threads", "NoNewPrivs", "Umask", "Name", "Uid", "Groups")
    with open("/proc/self/status") as file:
        return [line.strip() for line in file if line.startswith(wanted)]


def read(path):
    with open(path, "rb") as file:
        return file.read().decode(errors="surrogateescape")


fds = sorted(int(name) for name in os.listdir("/proc/self/fd"))
found = {
    "argv": sys.argv,
    "orig_argv": sys.orig_argv,
    "path": sys.path,
    "flags": list(sys.flags),
    "executable": [sys.executable, sys.prefix, os.readlink("/proc/self/exe")],
    "cwd": os.getcwd(),
    "environ": list(os.environ.items()),
    "fds": fds,
    "parent": os.getppid(),
    "leads": [
        os.getpgrp() == os.getpid(),
        os.getsid(0) == os.getpid(),
        threading.main_thread().native_id == os.getpid(),
    ],
    "umask": os.umask(0o22),
    "limits": [resource.getrlimit(each) for each in range(16)],
    "signals": [str(signal.getsignal(each)) for each in sorted(signal.valid_signals())],
    "status": status(),
    "cmdline": read("/proc/self/cmdline"),
    "environ of /proc": read("/proc/self/environ"),
    "streams": [stream(name) for name in ("stdin", "stdout", "stderr")],
    "stdin": sys.stdin.read(),
    "main": sorted(
        (name, repr(value).partition(" at 0x")[0])
        for name, value in vars(main).items()
        if name.startswith("__")
    ),
    "is main": [vars(main) is globals(), __name__],
    "warnings": [str(each) for each in warnings.filters],
    "hooks": [repr(sys.excepthook), repr(threading.excepthook), len(sys.path_hooks), len(sys.meta_path)],
    "collector": [gc.get_threshold(), gc.isenabled()],
    "threads": [(each.name, each.ident == threading.get_ident()) for each in threading.enumerate()],
    "nice": os.nice(0),
    "affinity": sorted(os.sched_getaffinity(0)),
    "trace": [sys.gettrace(), sys.getprofile(), sys.getswitchinterval(), sys.getrecursionlimit()],
}
print(json.dumps(found, indent=1, default=repr))
