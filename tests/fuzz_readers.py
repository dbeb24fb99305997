"""Fuzz the file readers with arbitrary bytes: they read or refuse with minirospy's errors, within limits of time and memory.

    make fuzz                                                    # ten minutes of this, too
    python tests/fuzz_readers.py --minutes 60 --only mcap --seed 7

Bags of both versions, MCAP files, XML (launch files, robot descriptions, manifests, test results), YAML (all of minirospy's
loaders), with mutations of lengths and brackets, among others. Each kind of finding is written to
``fuzz-reader-finding-N.bin`` once, with the name of its reader in the first line; ``python tests/fuzz_readers.py FILE``
runs it again. At the end, the number of inputs, the errors by type, the slowest input and the peak memory are printed.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import logging
import os
import random
import struct
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))

# Limit of the process's address space; a reader that allocates more gets a MemoryError, which counts as a finding.
MEMORY_BYTES = 3 << 30
MAX_SECONDS = 20.0  # CPU seconds for an input of some kilobytes; taking longer counts as a finding
MAX_INPUT = 50_000  # maximum size of an input in bytes


class Reader(NamedTuple):
    """A reader: seed texts or files, the function that reads them, and its documented errors."""

    seeds: Sequence[bytes]
    read: Callable[[bytes], object]
    errors: tuple[type[BaseException], ...]


# --- bags


def bag_readers() -> dict[str, Reader]:
    """Return the readers of bags."""
    from minirospy.base.errors import BagError
    from minirospy.core.bag.mcap_writer import McapWriter
    from tests.core.bag.bags import Given, make_bag
    from tests.core.bag.test_reader12 import MESSAGES, make_bag12

    source = random.Random(1)
    chunks = [
        [Given(number % 3, chunk * 5 + number, source.randbytes(9)) for number in range(8)]
        for chunk in range(4)
    ]
    bags = [
        make_bag(chunks, compression=name, layout=layout, closed=closed)
        for name in ("none", "bz2", "lz4")
        for layout, closed in ((0, True), (1, True), (0, False))
    ]
    old = [make_bag12(MESSAGES * 5), make_bag12(MESSAGES * 5, indexed=False)]

    header = {"type": "std_msgs/String", "md5sum": "992ce8a1687cec8c8bd883ec73ca41d1", "callerid": "/n"}
    mcaps = []
    for name in ("none", "lz4", "zstd"):
        stream = io.BytesIO()
        writer = McapWriter(stream, compression=name, chunk_size=100)
        number = writer.add_connection("/a", {**header, "topic": "/a", "message_definition": "string data\n"})
        for index in range(30):
            writer.write(number, index, source.randbytes(9))
        writer.close()
        mcaps += [stream.getvalue(), stream.getvalue()[:-200]]
    return {
        "bag": Reader(bags, _read_bag, (BagError,)),
        "bag12": Reader(old, _read_bag12, (BagError,)),
        "mcap": Reader(mcaps, _read_mcap, (BagError,)),
    }


def _read_all(stream: io.BytesIO) -> None:
    from minirospy.core.bag import info
    from minirospy.core.bag.mcap_reader import open_bag_or_mcap

    reader = open_bag_or_mcap(stream)
    try:
        with contextlib.suppress(_bag_error()):
            for message in reader.messages():
                if message.position:
                    reader.message_at(message.position)
        with contextlib.suppress(_bag_error()):
            reader.index(list(reader.connections))
        summary = info.summarize(reader, None, frequencies=True)
        info.as_text(summary)
        info.as_yaml(summary)
    finally:
        reader.close()


def _bag_error() -> type[Exception]:
    from minirospy.base.errors import BagError

    return BagError


def _read_bag(data: bytes) -> None:
    from minirospy.core.bag.repair import Repair

    with contextlib.suppress(_bag_error()):
        _read_all(io.BytesIO(data))
    repair = Repair(stream := io.BytesIO(data))
    for _ in repair.run():
        pass
    repair.apply()
    stream.seek(0)


def _read_bag12(data: bytes) -> None:
    from minirospy.core.bag.reader12 import unindexed_bag12

    with contextlib.suppress(_bag_error()):
        _read_all(io.BytesIO(data))
    reader = unindexed_bag12(io.BytesIO(data))
    for _ in reader.scan():
        pass
    list(reader.messages())


def _read_mcap(data: bytes) -> None:
    from minirospy.core.bag.mcap_repair import McapRepair

    with contextlib.suppress(_bag_error()):
        _read_all(io.BytesIO(data))
    repair = McapRepair(stream := io.BytesIO(data))
    for _ in repair.run():
        pass
    repair.apply()
    stream.seek(0)
    _read_all(stream)


# --- XML

LAUNCH = b"""<?xml version="1.0"?><!DOCTYPE launch><launch deprecated="x"><arg name="a" default="1" doc="d"/>
<arg name="b" value="$(arg a)2"/><param name="p" value="$(arg b)" type="double"/><param name="q" value="[1, {a: b}]" type="yaml"/>
<rosparam ns="r" subst_value="true">a: [1, 2.5, $(arg a)]
b: {c: d}</rosparam><rosparam command="delete" param="/x"/><env name="E" value="$(optenv HOME x)"/>
<group ns="g" if="$(arg a)"><remap from="x" to="y"/><node name="n" pkg="p" type="t" args="$(anon z)"
respawn="true" respawn_delay="2">
<param name="w" value="yes"/></node></group><include file="$(dirname)/none.launch" pass_all_args="true">
<arg name="c" value="3"/></include>
<machine name="m" address="h" timeout="3" default="true"/>
<test test-name="t" pkg="p" type="t" time-limit="3" retry="1"/></launch>"""
ROBOT = b"""<robot name="r"><material name="red"><color rgba="1 0 0 1"/><texture filename="a.png"/></material>
<link name="a"><inertial><origin xyz="0 0 1.5" rpy="0 1e-3 0"/><mass value="2"/><inertia ixx="1" ixy="0" ixz="0"
iyy="1" iyz="0" izz="1"/>
</inertial><visual name="v"><geometry><box size="1 2 3"/></geometry><material name="red"/></visual><collision><geometry>
<mesh filename="package://a/b.stl" scale="1 1 1"/></geometry></collision></link><link name="b"><visual><geometry>
<cylinder radius="1" length="2"/></geometry></visual></link><joint name="j" type="revolute"><parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/><limit effort="1" velocity="2" lower="-1" upper="1"/><mimic joint="j" multiplier="2"/><dynamics damping="1"/>
<safety_controller k_velocity="1"/><calibration rising="1"/></joint><transmission name="t"><type>x</type><joint name="j">
<hardwareInterface>y</hardwareInterface></joint><actuator name="m">
<mechanicalReduction>50</mechanicalReduction></actuator></transmission></robot>"""
MANIFEST = b"""<package format="3"><name>a</name><version>1.2.3</version><description>An <b>a</b> &amp; b &#97;</description>
<maintainer email="a@b.org">A</maintainer><license file="L">BSD</license><url type="website">http://a.b/</url>
<depend version_gte="1.0" condition="$ROS_VERSION == 1 and (x != y or a &lt; b)">b</depend><exec_depend>c</exec_depend>
<export><build_type>catkin</build_type><x y="z"/></export></package>"""
OLD_MANIFEST = b"""<package><description brief="b">d <i>e</i></description><author>a</author><license>BSD</license>
<review status="s" notes="n"/><depend package="x"/><rosdep name="y"/><export><cpp cflags="-I" lflags="-L"/></export></package>"""
RESULTS = b"""<?xml version="1.0"?><testsuites><testsuite name="s" tests="2" errors="0" failures="1" skipped="0" time="1.5">
<testcase classname="c" name="n" time="0.5"><failure type="t" message="m">text</failure></testcase>
<system-out>o</system-out></testsuite></testsuites>"""
UNFOLDING = b'<!DOCTYPE a [<!ENTITY b "cc"><!ATTLIST a b CDATA "c"><!ELEMENT a ANY>]>'


def xml_readers() -> dict[str, Reader]:
    """Return the readers of XML."""
    from xml.etree import ElementTree

    from minirospy.base.environment import Environment
    from minirospy.base.errors import LaunchError, ManifestError, UrdfError
    from minirospy.base.xml_text import XmlError, parse_xml
    from minirospy.core.urdf.describe import dot_graph, tree_lines
    from minirospy.core.urdf.read import parse_robot
    from minirospy.ros.roslaunch.launcher.load import load_text
    from minirospy.ros.roslib.roslib.manifest import ManifestException
    from minirospy.ros.roslib.roslib.manifest import parse as parse_old
    from minirospy.ros.rosunit.runner import junit
    from minirospy.ros.urdfdom_py.urdf_parser_py.urdf import URDF
    from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection import core
    from minirospy.workspace.manifest import parse_manifest
    from minirospy.workspace.packages import Packages

    packages = Packages(Environment.read({}))
    core.on_error = lambda _: None
    folder = tempfile.mkdtemp()

    def launch(data: bytes) -> None:
        text = data.decode("utf-8", "replace")
        # Do not evaluate the expressions in a mutated launch file.
        if "eval" not in text:
            load_text(text, {}, packages, {"HOME": "/h"})

    def robot(data: bytes) -> None:
        found = parse_robot(data)
        list(tree_lines(found))
        dot_graph(found)

    def results(data: bytes) -> None:
        file = Path(folder, "results.xml")
        file.write_bytes(data)
        with contextlib.redirect_stdout(io.StringIO()):
            junit.read(file, "t")

    def with_doctype(*texts: bytes) -> list[bytes]:
        return [*texts, *(UNFOLDING + text for text in texts)]

    def python_robot(data: bytes) -> None:
        try:
            URDF.from_xml_string(data)
        except Exception as error:
            # These are also the real parser's errors: for an invalid number, an unknown shape, and two shapes in one
            # <geometry>.
            if type(error) not in (Exception, AssertionError, ValueError):
                raise

    python_errors = (core.ParseError, ElementTree.ParseError)
    return {
        "launch": Reader(with_doctype(LAUNCH), launch, (LaunchError,)),
        "urdf": Reader(with_doctype(ROBOT), robot, (UrdfError,)),
        "urdf_parser_py": Reader(with_doctype(ROBOT), python_robot, python_errors),
        "package.xml": Reader(
            with_doctype(MANIFEST), lambda data: parse_manifest(data, Path("package.xml")), (ManifestError,)
        ),
        "manifest.xml": Reader(
            with_doctype(OLD_MANIFEST),
            lambda data: parse_old(data.decode("utf-8", "replace")),
            (ManifestException,),
        ),
        "test results": Reader(with_doctype(RESULTS), results, ()),
        "xml": Reader(with_doctype(LAUNCH, ROBOT, MANIFEST, RESULTS), parse_xml, (XmlError,)),
    }


# --- YAML

YAML_TEXTS = [
    b"a: 1\nb: [1, 2.5, true, null, ~, 'x', \"y\\n\"]\nc: {d: {e: [f, {g: h}]}}\n",
    b"- 0x1F\n- 0o17\n- 017\n- 1:59:59\n- 1:59:59.5\n"
    b"- 1_000\n- .inf\n- -.nan\n- 1e3\n- 2001-12-14t21:59:43.10-05:00\n- 2002-12-14\n",
    b"a: &a {x: 1}\nb: *a\nc: {<<: *a, y: 2}\nd: |\n  text\n  more\ne: >-\n  folded\n",
    b"a: deg(90)\nb: rad(pi/2 + 1)\nc: !degrees 90\nd: !!int '5'\n"
    b"e: !!binary aGVsbG8=\nf: !!timestamp 2001-01-01\ng: !!set {a, b}\n",
    b"%YAML 1.1\n---\na: 1\n---\n- !!omap [a: 1]\n- !!pairs [a: 1]\n...\n",
    b"image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: scale\n",
    b"image_width: 640\nimage_height: 480\ncamera_name: c\n"
    b"camera_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 2, 0, 1, 2, 0, 0, 1]\n"
    b"distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n",
    b"- ros1_package_name: a\n  ros1_message_name: B\n  ros2_package_name: c\n  ros2_message_name: D\n  fields_1_to_2: {x: y}\n",
    b"Panels:\n  - Class: rviz/Displays\nVisualization Manager:\n  Class: ''\n"
    b"  Displays:\n    - Alpha: 0.5\n      Name: Grid\n      Value: true\n",
    b"!!python/object/new:dynamic_reconfigure.encoding.Config\ndictitems:\n  a: 1\n  groups: {b: c}\nstate: []\n",
]


def yaml_readers() -> dict[str, Reader]:
    """Return the readers of YAML."""
    import yaml

    from minirospy.base.errors import BridgeError, MinirospyError, RvizFileError, ValueTextError
    from minirospy.base.yaml_text import safe_load
    from minirospy.introspect.configurations import parameter_values
    from minirospy.introspect.values import (
        check_parameter,
        format_pretty,
        format_value,
        parse_documents,
        parse_value,
    )
    from minirospy.ros.camera_calibration_parsers.camera_calibration_parsers.texts import (
        CalibrationError,
        parse_yaml,
    )
    from minirospy.ros.map_server.grid import MapError, read_settings
    from minirospy.ros.roslaunch.launcher.substitution import convert
    from minirospy.ros2.rules import parse_rules
    from minirospy.web.dashboard.rviz_file import format_rviz, parse_rviz

    def text(read: Callable[[str], object]) -> Callable[[bytes], object]:
        return lambda data: read(data.decode("utf-8", "replace"))

    def parameter(data: str) -> None:
        value = parse_value(data)
        check_parameter(value, "/n")
        format_value(value)
        format_pretty(value)

    def documents(data: str) -> None:
        for value in parse_documents(data, "f"):
            format_value(value)

    def rviz(data: str) -> None:
        format_rviz(parse_rviz(data))

    table: dict[str, tuple[Callable[[str], object], tuple[type[BaseException], ...]]] = {
        "parameters": (parameter, (ValueTextError,)),
        "yaml documents": (documents, (ValueTextError,)),
        "yaml": (safe_load, (yaml.YAMLError,)),
        "yaml of launch files": (lambda data: convert(data, "yaml"), (ValueError,)),
        "configurations": (parameter_values, (MinirospyError,)),
        "maps": (read_settings, (MapError,)),
        "calibrations": (parse_yaml, (CalibrationError,)),
        "rules": (lambda data: parse_rules(data, "f"), (BridgeError,)),
        "rviz": (rviz, (RvizFileError,)),
    }
    return {name: Reader(YAML_TEXTS, text(read), errors) for name, (read, errors) in table.items()}


# --- mutations

BORDERS = [
    0,
    1,
    2,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0xFFFF,
    0x7FFFFFFF,
    0x80000000,
    0xFFFFFFFF,
    1 << 40,
    1 << 63,
    (1 << 64) - 1,
]
TOKENS = [
    b"<", b">", b"/>", b"&a;", b"&#0;", b"&#x110000;", b"<!--", b"-->", b"<![CDATA[", b"]]>", b"<?a?>", b"<!DOCTYPE a [", b"]>",
    b'<!ENTITY a "b">', b"[", b"]", b"{", b"}", b": ", b"- ", b"&a ", b"*a", b"!!int ", b"!!float ", b"!!bool ",
    b"<<: ", b"? ", b"| ",
    b"$(arg a)", b"$(", b")", b":59", b"0x", b"1e999", b"-", b"nan", b"\xff", b"\x00", b"\xed\xa0\x80", b"\xef\xbb\xbf",
    b"\r\n", b"'", b'"',
    b"%", b"---\n", b"...\n", b"\t", b"BZh9", b"\x04\0\0\0op=\x05",
]  # fmt: skip


def mutated(source: random.Random, seeds: Sequence[bytes]) -> bytes:
    """Return one of ``seeds`` after some mutations."""
    data = bytearray(source.choice(seeds))

    def flip(at: int) -> None:
        if data:
            data[at % len(data)] ^= 1 << source.randrange(8)

    def number(at: int) -> None:
        form = source.choice("BHIQ")
        value = source.choice(BORDERS) + source.randrange(-3, 4)
        packed = struct.pack("<" + form, value % (1 << 8 * struct.calcsize(form)))
        data[at : at + len(packed)] = packed

    def nudge(at: int) -> None:
        if at + 4 <= len(data):
            (value,) = struct.unpack_from("<I", data, at)
            struct.pack_into("<I", data, at, (value + source.choice((-4, -1, 1, 4, 1 << 16))) % (1 << 32))

    def cut(at: int) -> None:
        del data[at : at + source.choice((1, 4, 30, 500))]

    def end(at: int) -> None:
        del data[at:]

    def insert(at: int) -> None:
        data[at:at] = source.choice(TOKENS)

    def repeat(at: int) -> None:
        piece = bytes(data[at : at + source.choice((1, 3, 10, 60, 500))])
        data[at:at] = piece * source.choice((1, 2, 50, 2_000, 20_000))

    def splice(at: int) -> None:
        other = source.choice(seeds)
        start = source.randrange(len(other) + 1)
        data[at:at] = other[start : start + source.choice((4, 40, 400))]

    accidents = [flip, flip, number, number, nudge, nudge, cut, end, insert, insert, repeat, splice]
    for _ in range(source.choice((1, 1, 1, 2, 3, 6))):
        source.choice(accidents)(source.randrange(len(data) + 1))
        del data[MAX_INPUT:]
    return bytes(data)


# --- the run


class NoProgram:
    """Replaces subprocess.Popen, because a launch file runs programs, and those of a mutation must not run."""

    def __init__(self, *_: object, **__: object) -> None:
        raise FileNotFoundError


class Run:
    """The inputs tried so far, and the findings."""

    def __init__(self) -> None:
        self.inputs: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self.findings: Counter[str] = Counter()
        self.slowest = (0.0, "")

    def take(self, name: str, reader: Reader, data: bytes) -> None:
        """Give one input to a reader, and record a finding."""
        self.inputs[name] += 1
        start = time.process_time()
        try:
            reader.read(data)
        except reader.errors as error:
            self.refused[f"{name}: {type(error).__name__}"] += 1
            if "\n" in str(error).rstrip("\n") and name not in ("yaml", "urdf_parser_py"):
                self._found(name, data, f"{type(error).__name__} of several lines", f"{error}\n")
        except Exception as error:  # noqa: BLE001 - that is what is looked for
            # Errors at the same location count as the same finding.
            frames = traceback.extract_tb(error.__traceback__)
            place = next(
                (
                    f"{each.filename}:{each.lineno}"
                    for each in reversed(frames)
                    if "minirospy/" in each.filename
                ),
                "",
            )
            self._found(name, data, f"{type(error).__name__} at {place}", traceback.format_exc())
        took = time.process_time() - start
        self.slowest = max(self.slowest, (took, name))
        if took > MAX_SECONDS:
            self._found(name, data, "slow", f"{took:.1f} s")

    def _found(self, name: str, data: bytes, what: str, details: str = "") -> None:
        key = f"{name}: {what}"
        self.findings[key] += 1
        if self.findings[key] == 1:
            file = Path(f"fuzz-reader-finding-{os.getpid()}-{len(self.findings)}.bin")
            file.write_bytes(name.encode() + b"\n" + data)
            print(f"FOUND {key}\n{details}see {file}", flush=True)


def all_readers() -> dict[str, dict[str, Reader]]:
    """Return the readers by group."""
    bags = bag_readers()
    mcap = {"mcap": bags.pop("mcap")}
    return {"bags": bags, "mcap": mcap, "xml": xml_readers(), "yaml": yaml_readers()}


def main() -> int:
    """Fuzz, or run one input again; return the exit status."""
    groups = all_readers()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="how long")
    parser.add_argument("--only", choices=groups, help="readers of this group alone")
    parser.add_argument("--seed", type=int, default=time.time_ns(), help="for the same inputs again")
    parser.add_argument("finding", nargs="?", type=Path, help="an input to run again")
    options = parser.parse_args()
    logging.disable()
    subprocess.Popen = NoProgram  # type: ignore[assignment,misc]
    limit_memory()
    if options.only:
        groups = {options.only: groups[options.only]}
    readers = {name: reader for group in groups.values() for name, reader in group.items()}
    if options.finding:
        name, _, data = options.finding.read_bytes().partition(b"\n")
        readers[name.decode()].read(data)
        return 0

    print(f"seed {options.seed}", flush=True)
    source, run = random.Random(options.seed), Run()
    for name, reader in readers.items():
        for data in reader.seeds:
            run.take(name, reader, data)
    end = time.monotonic() + 60 * options.minutes
    while time.monotonic() < end:
        name = source.choice(list(readers))
        run.take(name, readers[name], mutated(source, readers[name].seeds))

    print(f"{run.inputs.total():,} inputs: {dict(run.inputs)}")
    print(f"refused: {dict(run.refused)}")
    seconds, name = run.slowest
    print(f"slowest: {seconds:.2f} s of CPU time, {name}; peak of memory: {peak_megabytes()}")
    print(f"findings: {dict(run.findings) or 'none'}")
    return 1 if run.findings else 0


def limit_memory() -> None:
    """Limit the address space to MEMORY_BYTES, if the system can."""
    with contextlib.suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, resource.RLIM_INFINITY))


def peak_megabytes() -> str:
    """Return this process's peak memory in MB."""
    try:
        import resource
    except ImportError:
        return "unknown here"
    usage: Any = resource.getrusage(resource.RUSAGE_SELF)
    return f"{usage.ru_maxrss / 1000:.0f} MB"


if __name__ == "__main__":
    sys.exit(main())
