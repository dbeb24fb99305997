"""Play the course: type the commands of its pages into real terminals, and compare what they answer.

In: the pages of this folder. Out: `python docs/workshop/record.py` writes session.txt, the record of a whole course;
tests/test_course.py plays the same pages and fails where a page does not tell the truth.

What is played of a page, in its order:

- a block ```console. `$ command` is typed into terminal 1, `terminal 2$ command` into terminal 2. What follows is the
  output. `...` in a line matches any text, `...` alone for any lines; times may be other ones. A last line `...`
  says that the program still runs. `terminal 2:` shows what a running program prints next, `<Ctrl-C>` or `<q>` is a key.
- any other block behind a line that ends with a file's name (Save this as `~/name`:) is saved as that file.

Each page starts in new terminals; no program runs when it ends. Commands that only look (rosnode list) are typed again
until they show what the page shows: a node that was just started may not be there yet.
"""

from __future__ import annotations

import contextlib
import os
import pty
import random
import re
import select
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import psutil

__all__ = ["PAGES", "CourseError", "Player", "Step", "main", "steps"]

HERE = Path(__file__).parent
PAGES = (
    "setup.md",
    "packages.md",
    "nodes.md",
    "topics.md",
    "roslaunch.md",
    "network.md",
    "services.md",
    "messages.md",
    "actions.md",
    "parameters.md",
    "logging.md",
    "bags.md",
    "turtles.md",
    "frames.md",
    "pictures.md",
)
PATIENCE = 30.0
"""Seconds that a step may take; a busy machine needs its time."""

PLACES = {"laptop": "127.0.0.1", "192.168.65.50": "127.0.0.2", "192.168.65.60": "127.0.0.3"}
"""The computers of the pages, and who plays them."""

LOOKS = re.compile(
    r"(rosnode|rostopic|rosservice|rosparam) (list|info|type|find|get)\b"
    r"|rostopic echo -n\b|minirospy board (get|list)\b"
)
"""Commands that change nothing: each is typed again until it prints what the page shows, because other programs may need time."""
TIME = re.compile(r"\b1\d{9}\.\d+")
REDRAWN = re.compile(r"\r\x1b\[2K(?:\x1b\[1A\x1b\[2K)+")
"""How a program goes back to redraw its picture: in the record, the new one follows the old one."""
CONTROL = re.compile(r"\x1b\][^\x07\x1b]*(\x07|\x1b\\)|\x1b\[[0-?]*[ -/]*[@-~]|\x1b[=>()][B0]?|\r")
TAKE_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv("/bin/bash", ["bash", *sys.argv[1:]])
"""
"""What makes the terminal bash's own, so that Ctrl-C reaches what runs in it. (`pty.fork` is not for threaded programs.)"""

KEYS = {"Ctrl-C": "\x03"}


class CourseError(AssertionError):
    """A page shows what does not happen."""


@dataclass(frozen=True)
class Step:
    """A file to save (`path`), or something typed into a terminal and its answer."""

    place: str
    path: str = ""
    text: str = ""
    terminal: int = 1
    shown: str = ""
    typed: str = ""
    answer: tuple[str, ...] = ()
    goes_on: bool = False


def steps(page: Path) -> list[Step]:
    """Return the steps of a page, in its order."""
    found: list[Step] = []
    lines = iter(enumerate(page.read_text(encoding="utf-8").splitlines(), 1))
    before = ""

    for number, line in lines:
        if not line.startswith("```"):
            before = line.strip() or before
            continue
        block = []
        for _, inner in lines:
            if inner == "```":
                break
            block.append(inner)
        if line == "```console":
            found += _console(page.name, number, block)
        elif name := re.search(r"`(~/[^`]+)`:$", before):
            found.append(Step(f"{page.name}:{number}", path=name[1], text="\n".join(block) + "\n"))
        before = ""

    return found


def _console(page: str, number: int, block: list[str]) -> Iterator[Step]:
    """Return the steps of a ```console block that starts in this line."""
    terminal = 1
    open_steps: list[Step] = []

    for at, line in enumerate(block, number + 1):
        typed = shown = None

        if command := re.fullmatch(r"(?:terminal (\d))?\$ (.+)", line):
            terminal, shown = int(command[1] or 1), line
            typed = command[2] + "\n"
        elif look := re.fullmatch(r"terminal (\d):", line):
            terminal, shown, typed = int(look[1]), line, ""
        elif key := re.fullmatch(r"<(Ctrl-C|.)>", line):
            shown, typed = line, KEYS.get(key[1], key[1])

        if typed is None:
            if not open_steps:
                raise CourseError(f"{page}:{at}: a block starts with a command")
            last = open_steps[-1]
            open_steps[-1] = replace(last, answer=(*last.answer, line))
        else:
            assert shown is not None
            open_steps.append(Step(f"{page}:{at}", terminal=terminal, shown=shown, typed=typed))

    following: list[Step | None] = [*open_steps[1:], None]
    for step, after in zip(open_steps, following, strict=True):
        key_follows = after is not None and after.terminal == step.terminal and after.shown.startswith("<")
        yield replace(step, goes_on=step.answer[-1:] == ("...",) or key_follows)


def pattern(answer: tuple[str, ...], *, skip: bool) -> str:
    """Return the regular expression of an answer as a page shows it; `skip`: other lines may come first."""
    parts = ["(?:.*\n)*?"] if skip else []
    for line in answer:
        if line == "...":
            parts.append("(?:.*\n)*?")
        else:
            parts.append(".*?".join(map(re.escape, TIME.sub("<time>", line).split("..."))) + "[ ]*\n")
    return "".join(parts)


class Terminal:
    """A bash in its own terminal.

    It is asked not to repeat what is typed, and not to throw away with Ctrl-C what was printed and is not read yet.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._prompt = f"prompt-{os.urandom(6).hex()}>"
        start = Path(environment["HOME"], ".course_rc")
        start.write_text(
            f"[ -f ~/.bashrc ] && . ~/.bashrc\nstty -echo noflsh columns 120 rows 40\nPS1='{self._prompt}'\nPS2=\ncd\n"
        )
        self.fd, inside = pty.openpty()
        self._bash = subprocess.Popen(
            [sys.executable, "-IS", "-c", TAKE_TERMINAL, "--noediting", "--rcfile", str(start), "-i"],
            stdin=inside,
            stdout=inside,
            stderr=inside,
            env=dict(environment),
            start_new_session=True,
        )
        os.close(inside)
        self._bytes = b""
        self.seen = 0
        """Lines that a page has shown, of what was printed since the last prompt."""
        self.skips = False
        """The page showed `...` last: lines that it does not show may come."""
        self.is_busy = True
        """A program runs, as on the page."""

    def read(self) -> None:
        """Read what has arrived."""
        try:
            data = os.read(self.fd, 65536)
        except OSError:  # on Linux that is how a terminal ends
            data = b""
        if not data:
            raise CourseError("a terminal has ended")
        self._bytes += data

    def type(self, keys: str) -> None:
        os.write(self.fd, keys.encode())
        self.is_busy = True

    def printed(self) -> tuple[str, bool]:
        """Return what was printed since the last prompt, and whether the next one has come."""
        text, prompt, _ = self._bytes.decode(errors="replace").partition(self._prompt)
        text = CONTROL.sub("", REDRAWN.sub("\n", text))
        return text + ("\n" if prompt and text and not text.endswith("\n") else ""), bool(prompt)

    def finish(self) -> None:
        """Begins after the prompt that has come."""
        self._bytes = self._bytes.partition(self._prompt.encode())[2]
        self.seen = 0
        self.skips = self.is_busy = False

    def close(self) -> None:
        """End the shell and what runs in it."""
        left = psutil.Process(self._bash.pid).children(recursive=True)
        for process in left:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.terminate()
        os.close(self.fd)
        self._bash.kill()
        self._bash.wait()
        for process in psutil.wait_procs(left, timeout=5)[1]:
            process.kill()


def _free_port() -> int:
    """Return a port below the ephemeral range: between two pages no connection of another program gets it."""
    while True:
        port = random.randrange(20_000, 32_000)
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


class Player:
    """A student: a home folder, terminals, a port for the master. `environment` is added to that of the terminals."""

    def __init__(self, home: Path, environment: Mapping[str, str]) -> None:
        self.record: list[str] = []
        """The session so far, as text."""
        self._home = home.resolve()
        self._port = str(_free_port())
        self._environment = {
            "HOME": str(self._home),
            "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)]),
            "LANG": "C.UTF-8",
            "TERM": "xterm",
            "ROS_MASTER_URI": f"http://{PLACES['laptop']}:{self._port}",
            "ROS_IP": PLACES["laptop"],
            **environment,
        }
        self._terminals: dict[int, Terminal] = {}

    def play(self, page: Path) -> None:
        """Do what the page says. Raise CourseError if the answer is another one."""
        self.record.append(f"\n===== {page.name} =====\n")
        try:
            for step in steps(page):
                if step.path:
                    self._save(step)
                else:
                    self._do(step)
            busy = [number for number, terminal in self._terminals.items() if terminal.is_busy]
            if busy:
                raise CourseError(f"{page.name}: at its end a program still runs in the terminals {busy}")
        finally:
            for terminal in self._terminals.values():
                terminal.close()
            self._terminals.clear()

    def _save(self, step: Step) -> None:
        file = self._home / step.path.removeprefix("~/")
        if not file.parent.is_dir():
            raise CourseError(f"{step.place}: the folder of {step.path} does not exist")
        file.write_text(step.text, encoding="utf-8")
        self.record.append(f"({step.path} is saved)\n")

    def _do(self, step: Step) -> None:
        deadline = time.monotonic() + PATIENCE
        if step.terminal not in self._terminals:
            self._terminals[step.terminal] = Terminal(self._environment)
            self._wait(Step(step.place, terminal=step.terminal, shown="(a new terminal)"), deadline)
        terminal = self._terminals[step.terminal]

        if step.typed and terminal.is_busy:
            printed, has_ended = terminal.printed()
            if has_ended:
                raise self._error(step, "the program before has ended, and printed", self._shown(printed))
            if step.typed.endswith("\n"):
                raise CourseError(f"{step.place}: a program still runs in terminal {step.terminal}")

        looked: CourseError | None = None

        while True:
            terminal.type(self._real(step.typed))

            try:
                printed = self._wait(step, deadline)
                break
            except CourseError as error:
                if terminal.is_busy or not LOOKS.search(step.typed) or time.monotonic() > deadline:
                    raise (looked or error) from None
                looked = error

        self.record.append(f"{step.shown}\n{printed}" + ("...\n" if step.answer[-1:] == ("...",) else ""))

    def _wait(self, step: Step, deadline: float) -> str:
        """Return what the step printed, once it is what the page shows."""
        terminal = self._terminals[step.terminal]
        leaves = step.answer[-1:] == ("...",)
        expected = pattern(
            step.answer[:-1] if leaves else step.answer,
            skip=terminal.skips and not step.typed.endswith("\n"),
        )

        while True:
            printed, has_ended = terminal.printed()
            text = "".join(self._shown(printed).splitlines(keepends=True)[terminal.seen :])
            timeless = TIME.sub("<time>", text)
            found = re.match(expected, timeless) if step.goes_on else re.fullmatch(expected + "\n*", timeless)
            if has_ended:
                terminal.finish()
                if "Traceback (most recent call last)" in text and "Traceback" not in "".join(step.answer):
                    raise self._error(step, "prints a traceback", text)

            if found and (step.goes_on or has_ended):
                count = found[0].count("\n")
                terminal.seen += 0 if has_ended else count
                terminal.skips = leaves or (terminal.skips and not step.answer)
                return "".join(text.splitlines(keepends=True)[:count])

            if has_ended:
                raise self._error(step, "prints", text)
            if not self._read(deadline):
                raise self._error(step, f"has printed in {PATIENCE:.0f} s only", text)

    def _read(self, deadline: float) -> bool:
        """Wait until a terminal prints something."""
        by_fd = {terminal.fd: terminal for terminal in self._terminals.values()}
        ready, _, _ = select.select(list(by_fd), [], [], max(0.0, deadline - time.monotonic()))
        for fd in ready:
            by_fd[fd].read()
        return bool(ready)

    @staticmethod
    def _error(step: Step, what: str, text: str) -> CourseError:
        expected = "\n".join(step.answer)
        return CourseError(
            f"{step.place}: {step.shown}\n--- {what}\n{text}--- the page shows\n{expected}\n---"
        )

    def _real(self, typed: str) -> str:
        for name, address in PLACES.items():
            typed = typed.replace(name, address)
        return typed.replace("11311", self._port)

    def _shown(self, printed: str) -> str:
        for name, address in PLACES.items():
            printed = printed.replace(address, name)
        printed = printed.replace(f"roslaunch-{socket.gethostname()}-", "roslaunch-laptop-")
        printed = printed.replace(self._port, "11311").replace(str(self._home), "/home/student")
        return printed.replace(str(HERE.parents[1]), "/home/student/minirospy").expandtabs()


def main() -> int:
    """Write session.txt; 1 if a page is wrong."""
    home = Path(tempfile.mkdtemp(prefix="course-"))
    player = Player(home, {"MINIROSPY_RUNTIME_DIR": str(home / "board")})
    try:
        for name in PAGES:
            player.play(HERE / name)
    except CourseError as error:
        print(f"record.py: ERROR: {error}", file=sys.stderr)
        return 1
    finally:
        shutil.rmtree(home, ignore_errors=True)
    head = "The course, as docs/workshop/record.py typed it and as the terminals answered.\n"
    (HERE / "session.txt").write_text(head + "".join(player.record), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
