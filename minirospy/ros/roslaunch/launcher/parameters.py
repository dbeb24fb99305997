"""Evaluates ``<param>`` and ``<rosparam>``: reads files, and runs the commands in ``<param command=...>``.

Source: http://wiki.ros.org/roslaunch/XML/param, http://wiki.ros.org/roslaunch/XML/rosparam.
"""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from minirospy.base import names
from minirospy.base.errors import LaunchError, ValueTextError
from minirospy.base.tinyxml import decode_xml
from minirospy.introspect.parameters import flatten
from minirospy.introspect.values import check_parameter, parse_value
from minirospy.ros.roslaunch.launcher.document import Tag
from minirospy.ros.roslaunch.launcher.files import read_bytes
from minirospy.ros.roslaunch.launcher.substitution import convert
from minirospy.workspace.packages import Packages, built_in_roots, is_python

__all__ = ["param_value", "rosparam_values"]

_XACRO = ("xacro", "xacro.py")
_STYLE = re.compile(r"\x1b\[[0-9;]*m")  # matches terminal colours
_ERROR = re.compile(r"\berror: ", re.IGNORECASE)
# Bytes at the end of a command's stderr to search for the reason of a failure.
_ERRORS_KEPT = 65_536
_ERRORS_SECONDS = 1.0
# Maximum bytes of a file or a command's output; the master rejects larger requests.
_MAX_VALUE = 64 * 1024 * 1024
_WAYS = ("value", "textfile", "binfile", "command")


def param_value(tag: Tag, warn: Callable[[LaunchError], object]) -> object:
    """Return a ``<param>``'s value; call ``warn`` about a fault that does not prevent reading the value.

    Raise LaunchError if the tag is invalid, or its file or command fails.
    """
    ways = [way for way in _WAYS if tag.has(way)]
    if len(ways) != 1:
        raise tag.error(f"<param> tag must have one and only one of {'/'.join(_WAYS)}")
    text = tag.required(ways[0], may_be_empty=True)
    if ways[0] == "binfile":
        return _read(tag, text)
    if ways[0] == "value":
        text = text.strip()
    elif ways[0] == "textfile":
        text = _description(tag, text, _read(tag, text), warn)
    else:
        text = _description(tag, text, _output_of(tag, text), warn)

    name = tag.element.attributes["name"]
    try:
        value = convert(text, tag.optional("type") or "auto")
        check_parameter(value, name)
    except ValueError as error:
        raise tag.error(f"param [{name}]: {error}") from None
    except ValueTextError as error:
        raise tag.error(f"param [{name}]: {error.why}") from None
    return value


def rosparam_values(tag: Tag, namespace: str, param: str) -> Iterator[tuple[str, object]]:
    """Yield each parameter and value that a ``<rosparam>`` loads. Raise LaunchError if the YAML or the file is invalid."""
    file = tag.optional("file")
    text = tag.element.text if file is None else _decoded(tag, file, _read(tag, file))
    if tag.flag("subst_value"):
        text = tag.resolve(text)
    where = file or "the text"

    try:
        value = parse_value(text) if text.strip() else None
        if value is None:
            return
        if not param and not isinstance(value, dict) and not tag.optional("ns"):
            raise tag.error(f"<rosparam> {where}: 'param' attribute must be set for non-dictionary values")
        name = names.join(namespace, param) if param else namespace
        if not isinstance(value, dict) and not name.strip("/"):
            raise tag.error(f"<rosparam> {where}: Cannot load non-dictionary types into global namespace '/'")
        check_parameter(value, name)
    except ValueTextError as error:
        why = error.why if len(text) > 60 or file else str(error)
        raise tag.error(f"<rosparam> {where}: {why}") from None

    for single, single_value in flatten(name, value):
        yield names.canonicalize(single), single_value


def _read(tag: Tag, file: str) -> bytes:
    try:
        return read_bytes(file, _MAX_VALUE)
    except FileNotFoundError:
        raise tag.error(f"file does not exist [{file}]") from None
    except (OSError, ValueError) as error:
        raise tag.error(f"cannot read [{file}]: {getattr(error, 'strerror', None) or error}") from None


def _decoded(tag: Tag, file: str, data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise tag.error(f"[{file}] is not UTF-8 text: {error.reason} at byte {error.start}") from None


def _description(tag: Tag, origin: str, data: bytes, warn: Callable[[LaunchError], object]) -> str:
    """Decode a file or a command's output. XML, such as a robot description, may have an encoding other than UTF-8."""
    if not data.lstrip().startswith(b"<"):
        return _decoded(tag, origin, data)
    text, encoding = decode_xml(data)
    if encoding != "UTF-8":
        warn(tag.error(f"[{origin}] is not UTF-8 text: it was read as {encoding}"))
    return text


def _output_of(tag: Tag, command: str) -> bytes:
    """Run a command without a shell; return its output. Raise LaunchError if the command fails."""
    try:
        status, output, reason = _run(_command_words(shlex.split(command)))
    except ValueError as error:
        raise tag.error(f"command [{command}]: {error}") from None
    except (OSError, IndexError):
        raise tag.error(f"no such command [{command}]") from None
    if len(output) > _MAX_VALUE:
        raise tag.error(f"command [{command}] has written more than {_MAX_VALUE} bytes, and was stopped")
    if status:
        why = f": {reason}" if reason else ""
        raise tag.error(f"command [{command}] returned with code [{status}]{why}")
    return output


def _run(words: list[str]) -> tuple[int, bytes, str]:
    """Run a command; return its exit status, its output, and the stderr line that gives the reason for a failure.

    The command's stderr is copied to the terminal as it arrives. A command that writes more than _MAX_VALUE bytes is killed.
    """
    end = bytearray()
    reading, writing = os.pipe()
    reader = threading.Thread(target=_pass_on, args=(reading, end), daemon=True)
    reader.start()

    try:
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=writing)
        assert process.stdout
        try:
            output = process.stdout.read(_MAX_VALUE + 1)
            if len(output) > _MAX_VALUE:
                process.kill()
            status = process.wait()
        except BaseException:
            # Kill the command, because it may ignore Ctrl-C.
            process.kill()
            process.wait()
            raise
        finally:
            # Close the pipe, so that processes left behind by the command get a broken pipe.
            process.stdout.close()
    finally:
        os.close(writing)
        # Wait only briefly: processes left behind by the command may hold the pipe open.
        reader.join(_ERRORS_SECONDS)
    return status, output, _reason(_STYLE.sub("", bytes(end).decode("utf-8", "replace")))


def _reason(errors: str) -> str:
    """Return the first line that contains "error", as in xacro's output, else the last line, as in a traceback."""
    lines = [line.strip() for line in errors.splitlines() if line.strip()]
    return next((line for line in lines if _ERROR.search(line)), lines[-1] if lines else "")


def _pass_on(reading: int, end: bytearray) -> None:
    """Copy the pipe to stderr until it is closed; keep its last bytes in ``end``."""
    with open(reading, "rb", buffering=0) as pipe:
        while chunk := pipe.read(_ERRORS_KEPT):
            end += chunk
            del end[:-_ERRORS_KEPT]
            # If the program has no stderr, descriptor 2 may belong to another file.
            if sys.__stderr__ is not None:
                with contextlib.suppress(OSError), open(2, "wb", closefd=False) as errors:
                    errors.write(chunk)


def _command_words(words: list[str]) -> list[str]:
    """Return the command to run. Python programs run with this interpreter, as nodes do; `xacro` means minirospy's xacro.

    Thus, launch files find xacro even if no virtual environment is active, and never use ROS 2's xacro.
    """
    if not words:
        return words
    program, *rest = words
    if program in _XACRO:
        program = str(Packages.below(*built_in_roots()).find("xacro") / program)
    if "/" in program.replace(os.sep, "/") and is_python(Path(program)):
        return [sys.executable, program, *rest]
    return words
