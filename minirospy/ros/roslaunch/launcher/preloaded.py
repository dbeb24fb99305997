"""A script that imports rospy once and then forks Python nodes for roslaunch. Linux only.

``python preloaded.py FD`` answers requests on the Unix socket ``FD``; its client is ``preload.py``. A forked node runs its
program as ``python PROGRAM ARGUMENTS`` would: Python's own C function compiles and runs the file in a new ``__main__``, and
prints tracebacks. The node sets the kernel's pointers to its command line and environment, so that ``ps``, ``pgrep -f`` and /proc
show the same as for a started process. PR_SET_MM_MAP of prctl(2) does this without privileges. The node is a child of roslaunch,
because roslaunch is the subreaper when the intermediate process exits.

The script has one thread, and exits when its socket is closed. It imports only rospy and the modules that a node needs. Importing
them starts no threads, reads no arguments and opens no files.
"""

from __future__ import annotations

import sys

# Remove this script's folder from the module search path; a node has its program's folder there instead.
if __name__ == "__main__" and not getattr(sys.flags, "safe_path", False):
    del sys.path[0]

import contextlib
import ctypes
import gc
import io
import logging
import marshal
import mmap
import os
import socket
import threading
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, NamedTuple, TextIO

PRELOADED = (
    "rospy",
    "encodings.ascii",
    "std_msgs.msg",
    "minirospy.runtime.master.log_file",
    "minirospy.runtime.node.node",
    "minirospy.runtime.node.publication",
    "minirospy.runtime.node.service_client",
    "minirospy.runtime.node.services",
    "minirospy.runtime.node.subscription",
    "minirospy.runtime.transport.loop",
    "minirospy.runtime.transport.readers",
)
"""The modules that are loaded in a node after it has created publishers, subscribers and services."""

LENGTH_SIZE = 8  # bytes of a request's length prefix
FDS = 4  # file descriptors per request: stdin, stdout, stderr, and a pipe that signals the node to start
READY, REFUSED = b"ready", b"refused"  # replies other than a process id

_SUFFIXES = (".py", ".pyc", ".so")  # suffixes of importable files
_PR_SET_MM, _PR_SET_MM_MAP = 35, 14


class Order(NamedTuple):
    """A node to fork: its command line, ROS_NAMESPACE (None: unset) and the complete environment ``environ``."""

    arguments: list[str]
    environ: dict[str, str]

    @property
    def program(self) -> str:
        """Return the path of the node's program."""
        return self.arguments[1]


class _MemoryMap(ctypes.Structure):
    """The kernel's struct prctl_mm_map; the fields up to ``env_end`` are addresses."""

    _fields_ = [
        *((name, ctypes.c_uint64) for name in ("start_code", "end_code", "start_data", "end_data")),
        *((name, ctypes.c_uint64) for name in ("start_brk", "brk", "start_stack")),
        *((name, ctypes.c_uint64) for name in ("arg_start", "arg_end", "env_start", "env_end")),
        ("auxv", ctypes.c_void_p),
        ("auxv_size", ctypes.c_uint32),
        ("exe_fd", ctypes.c_uint32),
    ]


_kept: list[mmap.mmap] = []
"""The memory of this process's command line and environment, which the kernel may read at any time."""


def set_command_line(arguments: list[str], environ: dict[str, str]) -> None:
    """Change this process's command line and environment in /proc. Raise OSError if the kernel refuses."""
    words = b"".join(os.fsencode(word) + b"\0" for word in arguments)
    variables = b"".join(os.fsencode(f"{name}={value}") + b"\0" for name, value in environ.items())
    area = mmap.mmap(-1, len(words) + len(variables) + 1, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    area.write(words + variables)
    start = ctypes.addressof(ctypes.c_char.from_buffer(area))

    with open("/proc/self/stat", "rb") as file:
        fields = [b"", b"", *file.read().rpartition(b")")[2].split()]
    library = ctypes.CDLL(None, use_errno=True)
    library.sbrk.restype = ctypes.c_void_p
    library.sbrk.argtypes = [ctypes.c_ssize_t]
    # proc(5) numbers fields from 1.
    code_start, code_end, stack, data_start, data_end, heap = (
        int(fields[n - 1]) for n in (26, 27, 28, 45, 46, 47)
    )
    new = _MemoryMap(
        *(code_start, code_end, data_start, data_end, heap, library.sbrk(0), stack),
        *(start, start + len(words), start + len(words), start + len(words) + len(variables)),
        None,
        0,
        0xFFFFFFFF,
    )
    library.prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    if library.prctl(_PR_SET_MM, _PR_SET_MM_MAP, ctypes.addressof(new), ctypes.sizeof(new), 0):
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_MM_MAP)")
    _kept.append(area)


def read_response() -> None:
    """Read a response like the master's, in order to compile the regular expressions that a usual response needs.

    Otherwise each node would compile them again, which takes some milliseconds.
    """
    from minirospy.core.wire import http, xmlrpc

    (message,) = http.HttpReader().feed(http.serialize_response(xmlrpc.serialize_response([1, "", 0])))
    assert message.status == 200
    xmlrpc.parse_response(message.body)


def hides_module(folder: str, loaded: set[str]) -> bool:
    """Return whether an import of a top-level module in ``loaded`` could find a file in ``folder`` first."""
    with os.scandir(folder) as entries:
        for entry in entries:
            stem, _, suffix = entry.name.partition(".")
            if stem in loaded and (
                f".{suffix}".endswith(_SUFFIXES) or os.path.exists(os.path.join(entry.path, "__init__.py"))
            ):
                return True
    return False


def serve(control: socket.socket) -> Order | None:
    """Fork nodes until the socket is closed, then return None. In a forked node, return its Order once the node may start."""
    while True:
        head, fds, _, _ = socket.recv_fds(control, LENGTH_SIZE, FDS)
        if not head:
            return None
        try:
            size = int.from_bytes(head, "little")
            body = bytearray()
            while len(body) < size:
                body += control.recv(size - len(body)) or sys.exit(1)
            order = Order(*marshal.loads(bytes(body)))
            loaded = {name for name in sys.modules if "." not in name}
            if hides_module(folder_of(order.program), loaded):
                control.sendall(REFUSED)
                continue
            pid = _fork(order, control, fds)
        except OSError:
            control.sendall(REFUSED)
            continue
        finally:
            for fd in fds:
                os.close(fd)
        if pid == 0:
            return order
        control.sendall(str(pid).encode())


def _fork(order: Order, control: socket.socket, fds: list[int]) -> int:
    """Fork a node; return its process id, or 0 inside the node. Raise OSError if the fork fails."""
    reader, writer = os.pipe()
    with open(reader, "rb") as report:
        middle = os.fork()
        if middle == 0:
            # The intermediate process exits, making roslaunch the node's parent.
            try:
                pid = os.fork()
            except OSError:
                os._exit(1)
            if pid:
                os._exit(0)
            report.close()
            control.close()
            _prepare(order, fds, writer)
            return 0
        os.close(writer)
        os.waitpid(middle, 0)
        reported = report.read()
    if not reported:
        raise ChildProcessError("the node exited before it started")
    return int(reported)


def _prepare(order: Order, fds: list[int], report: int) -> None:
    """Set up the node's kernel attributes, report its process id, and wait until roslaunch lets it start."""
    try:
        os.setsid()
        for number, fd in enumerate(fds[:3]):
            os.dup2(fd, number)
        set_command_line(order.arguments, order.environ)
        os.write(report, str(os.getpid()).encode())
        os.close(report)
        # If roslaunch has given up or was killed, the pipe is closed without data.
        if os.read(fds[3], 1):
            return
    except OSError:
        pass
    os._exit(1)


def folder_of(program: str) -> str:
    """Return the program's folder, which Python searches first."""
    return os.path.dirname(os.path.realpath(program))


def become(order: Order, main: dict[str, Any]) -> None:
    """Set up the node's interpreter. ``main`` holds a ``__main__`` module's initial attributes."""
    namespace = order.environ.get("ROS_NAMESPACE")
    if namespace is None:
        os.environ.pop("ROS_NAMESPACE", None)
    else:
        os.environ["ROS_NAMESPACE"] = namespace
    sys.argv = order.arguments[1:]
    sys.orig_argv[:] = order.arguments
    sys.path.insert(0, folder_of(order.program))
    # Python up to 3.13 keeps the thread id from before the fork.
    threading.main_thread()._set_native_id()  # type: ignore[attr-defined]

    sys.stdin = sys.__stdin__ = _stream(0, "<stdin>", "r", sys.stdin)  # type: ignore[misc]
    sys.stdout = sys.__stdout__ = _stream(1, "<stdout>", "w", sys.stdout)  # type: ignore[misc]
    sys.stderr = sys.__stderr__ = _stream(2, "<stderr>", "w", sys.stderr)  # type: ignore[misc]

    module = ModuleType("__main__")
    module.__dict__.update(main)
    sys.modules["__main__"] = module
    # Call find_packages_named_like_scripts() for this node: in a normally started one, importing rospy calls it.
    from minirospy.base.script_names import find_packages_named_like_scripts

    module.__file__ = order.program
    find_packages_named_like_scripts()
    del module.__file__
    sys.meta_path.insert(0, _FirstImport())


class _FirstImport:
    """Hides the preloaded rospy until the program imports it, then enables the loggers of the preloaded modules.

    A program that configures logging earlier disables all existing loggers. In a started node, these loggers would not exist yet.
    The class is a finder and a loader, but without the base classes, because importlib.abc imports large modules.
    """

    def __init__(self) -> None:
        self._modules = {
            name: module
            for name, module in sys.modules.items()
            if name == "rospy" or name.startswith("rospy.")
        }
        spec = self._modules["rospy"].__spec__
        assert spec is not None
        self._spec = spec
        self._loggers = [
            each for each in logging.root.manager.loggerDict.values() if isinstance(each, logging.Logger)
        ]
        for name in self._modules:
            del sys.modules[name]

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a spec for rospy that uses this loader."""
        if fullname != "rospy":
            return None
        loader: Any = self
        spec = ModuleSpec(fullname, loader, origin=self._spec.origin)
        spec.submodule_search_locations = self._spec.submodule_search_locations
        return spec

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the preloaded module."""
        return self._modules["rospy"]

    def exec_module(self, module: ModuleType) -> None:
        """Make the modules visible, as after a normal import, and enable their loggers."""
        module.__spec__ = self._spec
        sys.modules.update(self._modules)
        sys.meta_path.remove(self)
        for logger in self._loggers:
            logger.disabled = False


def _stream(fd: int, name: str, mode: str, like: TextIO) -> io.TextIOWrapper:
    """Return a standard stream like those that Python creates at start-up, with the encoding of ``like``."""
    assert isinstance(like, io.TextIOWrapper)
    unbuffered = sys.stdout.write_through  # type: ignore[union-attr]
    buffer: Any = open(fd, f"{mode}b", 0 if unbuffered and mode == "w" else -1, closefd=False)  # noqa: SIM115
    raw = getattr(buffer, "raw", buffer)
    raw.name = name
    stream = io.TextIOWrapper(
        buffer,
        like.encoding,
        like.errors,
        "\n",
        line_buffering=not unbuffered and (raw.isatty() or fd == 2),
        write_through=unbuffered,
    )
    stream.mode = mode  # type: ignore[misc]
    return stream


def open_program(path: str) -> int | None:
    """Open a file for C code; return its FILE*, or None on failure."""
    library = ctypes.CDLL(None)
    library.fopen.restype = ctypes.c_void_p
    file: int | None = library.fopen(os.fsencode(path), b"rbe")
    return file


def main(fd: int) -> Order | None:
    """Import the modules and serve the socket ``fd`` until it is closed. In a forked node, return its Order."""
    control = socket.socket(fileno=fd)
    # If the kernel does not allow changing command lines, fail now, before any node is requested.
    set_command_line(sys.orig_argv, dict(os.environ))
    for name in PRELOADED:
        import_module(name)
    if len(os.listdir("/proc/self/task")) > 1 or "minirospy.client" not in sys.modules:
        # A module has started a thread, which would make forking unsafe, or the imported rospy is the real one.
        return None
    read_response()
    gc.collect()
    gc.freeze()
    with contextlib.suppress(OSError):
        control.sendall(READY)
        return serve(control)
    return None


if __name__ == "__main__":
    _first = {
        _name: globals()[_name]
        for _name in ("__name__", "__package__", "__loader__", "__spec__", "__builtins__")
    }
    _order = main(int(sys.argv[1]))
    if _order is None:
        os._exit(0)
    if sys.version_info < (3, 14):
        _first["__annotations__"] = {}
    become(_order, {"__doc__": None, **_first})
    _file = open_program(_order.program)
    _run = ctypes.pythonapi.PyRun_SimpleFileExFlags
    _run.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p]
    # Call this at module level, so that only one frame is below the program's frames.
    _has_failed = _file is None or _run(_file, os.fsencode(_order.program), 1, None)
    # After Ctrl-C, Python itself ends this process with SIGINT when the script ends.
    if _has_failed and getattr(sys, "last_type", None) is not KeyboardInterrupt:
        sys.exit(1)
