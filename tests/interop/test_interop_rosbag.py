"""Debian's rosbag and roslz4 compared with minirospy's in both directions: each reads the other's files and prints the same."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from minirospy.core.bag.compression import compress, decompress
from tests.core.bag.bags import Given, connection, make_bag

from .conftest import HERE, OUR_BIN, PATIENCE, REAL_BIN, REAL_PYTHON

PEER = HERE / "bag_peer.py"
PYTHONS = {"ours": sys.executable, "real": REAL_PYTHON}
BINS = {"ours": OUR_BIN, "real": REAL_BIN}

pytestmark = pytest.mark.skipif(
    not Path("/usr/lib/python3/dist-packages/rosbag").exists(), reason="python3-rosbag is not installed"
)


def peer(stack: str, verb: str, folder: Path) -> str:
    """Run bag_peer.py with the Python of a stack; return its output."""
    done = subprocess.run(
        [PYTHONS[stack], "-W", "ignore", str(PEER), verb, folder.name],
        cwd=folder.parent, capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def rosbag(stack: str, folder: Path, *words: str) -> tuple[int, str, str]:
    """Run a stack's rosbag in a folder; return exit status, stdout and ROS's errors."""
    done = subprocess.run(
        [str(BINS[stack] / "rosbag"), *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    err = "".join(
        each for each in done.stderr.splitlines(True) if not each.startswith(("rosbag: ERROR:", "WARNING: "))
    )
    return done.returncode, done.stdout, err


def as_read(stack: str, folder: Path) -> dict[str, dict[str, Any]]:
    return {found["name"]: found for found in map(json.loads, peer(stack, "read", folder).splitlines())}


@pytest.fixture(params=["ours", "real"])
def bags(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Return a folder of bags, written by either stack."""
    folder = tmp_path / "bags"
    folder.mkdir()
    peer(request.param, "write", folder)
    return folder


def test_both_read_the_same_from_what_either_writes(bags: Path) -> None:
    ours, real = as_read("ours", bags), as_read("real", bags)

    assert ours == real
    assert real["unindexed.bag"]["error"] == "ROSBagUnindexedException: Unindexed bag"
    assert "messages" in real["lz4.bag"]


@pytest.mark.parametrize("bags", ["real"], indirect=True)
def test_both_write_the_same_bytes(bags: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(bags, other)
    peer("ours", "copy", bags)
    peer("real", "copy", other)

    for name in ("copy_none.bag", "copy_bz2.bag"):
        assert (bags / name).read_bytes() == (other / name).read_bytes()
    # LZ4 allows many valid encodings.
    for folder in (bags, other):
        assert rosbag("real", folder, "decompress", "-q", "copy_lz4.bag")[0] == 0
    assert (bags / "copy_lz4.bag").read_bytes() == (other / "copy_lz4.bag").read_bytes()


def test_cpp_bags_and_several_publishers_are_read_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "bags"
    folder.mkdir()
    connections = [
        connection(0, "/chatter", callerid="/a", latching="1"),
        connection(1, "/chatter", callerid="/b", latching="0"),
        connection(2, "/chatter", type="std_msgs/Int32", message_definition="int32 data\n",
                   md5sum="da5909fbe378aeaf85e547e830cc1bb7"),
    ]  # fmt: skip
    text = (3).to_bytes(4, "little") + b"abc"
    chunks = [
        [Given(each % 3, chunk * 10**9 + each, text if each % 3 < 2 else bytes(4)) for each in range(12)]
        for chunk in range(5)
    ]
    for compression in ("none", "bz2", "lz4"):
        for layout in (0, 1):
            data = make_bag(chunks, connections, compression=compression, layout=layout)
            (folder / f"{compression}{layout}.bag").write_bytes(data)

    assert as_read("ours", folder) == as_read("real", folder)
    for words in (
        ["info", "bags/lz41.bag"],
        ["info", "--freq", "bags/bz20.bag"],
        ["info", "-y", "bags/none1.bag"],
    ):
        assert rosbag("ours", tmp_path, *words) == rosbag("real", tmp_path, *words)


@pytest.mark.parametrize(
    "words",
    [
        "info none.bag bz2.bag lz4.bag empty.bag shuffled.bag appended.bag",
        "info --freq none.bag bz2.bag lz4.bag empty.bag shuffled.bag",
        "info -y none.bag lz4.bag empty.bag",
        "info -y -k topics lz4.bag none.bag",
        "info -y -k types[0].md5 lz4.bag none.bag",
        "info -y -k nope lz4.bag none.bag",
        "info unindexed.bag none.bag",
        "info none.bag missing.bag",
        "info .",
        "info",
        "info -k start none.bag",
        "check none.bag",
        "check -n lz4.bag",
        "fix none.bag",
        "fix none.bag o.txt",
        "filter missing.bag o.bag True",
        "filter none.bag none.bag True",
        "filter none.bag",
        "compress missing.bag unindexed.bag",
        "decompress",
        "reindex",
    ],
)
@pytest.mark.parametrize("bags", ["real"], indirect=True)
def test_commands_print_the_same(bags: Path, words: str) -> None:
    assert rosbag("ours", bags, *words.split()) == rosbag("real", bags, *words.split())


@pytest.mark.parametrize("words", [[], ["-h"], ["help"], ["bogus"]])
def test_verbs_are_listed_the_same(tmp_path: Path, words: list[str]) -> None:
    (status, *ours), real = rosbag("ours", tmp_path, *words), rosbag("real", tmp_path, *words)
    own = ("   convert  ", "   export  ")
    assert (
        status,
        *("".join(line for line in text.splitlines(True) if not line.startswith(own)) for text in ours),
    ) == real


@pytest.mark.parametrize(
    "words",
    [
        "rostopic list -b none.bag",
        "rostopic list -b none.bag /chatter",
        "rostopic list -b none.bag /camera",
        "rostopic list -b none.bag -p",
        "rostopic list -b missing.bag",
        "rostopic echo -b lz4.bag /chatter -n 3",
        "rostopic echo -b lz4.bag /count/data -n 3",
        "rostopic echo -b bz2.bag -p /joint_states",
        "rostopic echo -b bz2.bag -p /pose/pose --nostr",
        "rostopic echo -b none.bag /camera/image_raw --noarr -n 2",
        "rostopic echo -b none.bag /camera/image_raw/data --noarr -n 1",
        "rostopic echo -b none.bag -p --nostr --noarr /joint_states/name -n 2",
        "rostopic echo -b none.bag -a -n 12",
        "rostopic echo -b none.bag",
        "rostopic echo -b none.bag --offset /count",
        "rosmsg show -b none.bag sensor_msgs/Image",
        "rosmsg show -r -b none.bag sensor_msgs/JointState",
        "rosmsg show -b missing.bag sensor_msgs/Image",
    ],
)
@pytest.mark.parametrize("bags", ["real"], indirect=True)
def test_bags_in_other_commands_print_the_same(bags: Path, words: str) -> None:
    command, *others = words.split()
    found = {
        stack: subprocess.run(
            [str(folder / command), *others],
            cwd=bags,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        for stack, folder in BINS.items()
    }
    ours, real = found["ours"], found["real"]
    assert (ours.returncode, ours.stdout) == (real.returncode, real.stdout)
    assert ours.stderr.startswith(real.stderr)


@pytest.mark.parametrize(
    ("words", "target"),
    [
        (["compress", "none.bag"], "none.bag"),
        (["decompress", "bz2.bag"], "bz2.bag"),
        (["decompress", "lz4.bag"], "lz4.bag"),
        (["decompress", "--output-dir", "out", "lz4.bag"], "out/lz4.bag"),
        (["reindex", "none.bag"], "none.bag"),
        (["filter", "none.bag", "o.bag", "topic == '/count' and m.data < -50"], "o.bag"),
        (["filter", "lz4.bag", "o.bag", "t.secs > 150 or m._type == 'sensor_msgs/Image'"], "o.bag"),
    ],
)
@pytest.mark.parametrize("bags", ["real"], indirect=True)
def test_rewritten_bags_have_the_same_bytes(
    bags: Path, tmp_path: Path, words: list[str], target: str
) -> None:
    (bags / "out").mkdir()
    other = tmp_path / "other"
    shutil.copytree(bags, other)

    ours, real = rosbag("ours", bags, *words), rosbag("real", other, *words)
    assert ours[::2] == real[::2]
    assert ours[1].splitlines()[:2] == real[1].splitlines()[:2]
    assert (bags / target).read_bytes() == (other / target).read_bytes()
    assert sorted(path.name for path in bags.rglob("*")) == sorted(path.name for path in other.rglob("*"))


@pytest.mark.parametrize("bags", ["real"], indirect=True)
def test_reindexed_bag_is_read_by_the_real_one(bags: Path) -> None:
    expected = as_read("real", bags)["none.bag"]["messages"]
    data = (bags / "bz2.bag").read_bytes()
    (bags / "cut.bag").write_bytes(data[: len(data) * 2 // 3])
    assert rosbag("ours", bags, "reindex", "-q", "unindexed.bag", "cut.bag") == (0, "", "")

    found = as_read("real", bags)
    assert found["unindexed.bag"]["messages"] == expected
    assert 100 < len(found["cut.bag"]["entries"]) < len(found["bz2.bag"]["entries"])


ROSLZ4 = """
import sys, roslz4
data = sys.stdin.buffer.read()
sys.stdout.buffer.write(getattr(roslz4, sys.argv[1])(data))
"""


@pytest.mark.parametrize("size", [0, 1, 1000, 3_000_000])
def test_roslz4_reads_our_frames_and_we_its(size: int) -> None:
    data = (bytes(range(256)) * (size // 256 + 1))[:size]

    def roslz4(verb: str, given: bytes) -> bytes:
        return subprocess.run(
            [REAL_PYTHON, "-c", ROSLZ4, verb], input=given, capture_output=True, timeout=PATIENCE, check=True
        ).stdout

    assert roslz4("decompress", compress("lz4", data)) == data
    assert decompress("lz4", roslz4("compress", data), size) == data
