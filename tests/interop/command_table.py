"""Every command and option of rostopic, rosnode, rosservice, rosparam, rosmsg and rossrv, run with real ROS and minirospy.

`WRITE=1 pytest tests/interop/test_interop_tools.py -k table` writes the output of both to docs/compatibility/commands.md.
Stdout and the exit status are compared. An error on stderr starts with ROS's text, if ROS has one, followed by
minirospy's; OTHER_WORDS lists the lines for which it does not.

Each line below is a command line, then optionally ` <<< text` for stdin and ` ## reason` if minirospy differs on purpose.
"""

from __future__ import annotations

import html
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from tests.interop.conftest import PATIENCE
from tests.interop.forked_commands import MODULES, ForkedCommand, Server, can_fork

PAGE = Path(__file__).parents[2] / "docs" / "compatibility" / "commands.md"
REAL = Path("/usr/bin")
OURS = Path(sys.executable).parent

_STATUS = "the same text; exit {} in place of 0, since it is an error"
_UNKNOWN = _STATUS.format(1)
_TRACEBACK = "real ROS ends with a traceback"
_PIPE = "real ROS waits for a name in the terminal or from a pipe that brings none"

ASKING = f"""
rostopic
rostopic -h
rostopic lsit
rostopic list
rostopic list -v
rostopic list -p
rostopic list -s
rostopic list -vp
rostopic list -v -s
rostopic list -p -s
rostopic list /ns
rostopic list ns
rostopic list /nope
rostopic list -v /ns
rostopic list --host
rostopic list -v --host -p
rostopic list -b nope.bag
rostopic list a b
rostopic list --verbos
rostopic list --hots
rostopic info /button_state
rostopic info listen
rostopic info /any
rostopic info /button_stat
rostopic info
rostopic type /button_state
rostopic type /poly/polygon/points
rostopic type /poly/header/stamp
rostopic type /poly/polygon/points[0]/x ## {_TRACEBACK}
rostopic type /poly/heder
rostopic type /nope
rostopic type /poly/polygon/points/foo
rostopic type /duration/data/secs
rostopic type /scan /poly
rostopic info '!!'
rostopic list -p /ns
rostopic list --host /ns
rostopic find LaserScan
rostopic list __name:=x a:=b
rostopic type chatter __ns:=ns
rosservice call empty __ns:=ns
rostopic find std_msgs/Bool
rostopic find std_msgs/Nope
rostopic find
rosnode
rosnode lits
rosnode list
rosnode list -u
rosnode list -a
rosnode list -a -u
rosnode list /scene
rosnode list a b
rosnode info /scene
rosnode info -q scene
rosnode info scene /scene -q
rosnode info nope -q scene
rosnode info nope
rosnode info
rosnode info ~x -q
rosnode list -ua
rosnode machine
rosnode machine localhost
rosnode machine nope
rosnode ping -c 1 scene
rosnode ping -c 2 scene
rosnode ping -a
rosnode ping -a -c 2
rosnode ping nope
rosnode ping -c 1 nope
rosnode ping -c x scene
rosnode ping scene -c1
rosnode kill -a scene
rosnode kill nope nope2
rosnode kill <<< x\\n9\\n ## {_TRACEBACK}
rosnode cleanup
rosservice
rosservice lits
rosservice list
rosservice list -n
rosservice list /ns
rosservice list -n /nope
rosservice list --nodes /ns
rosservice info /set_led_state
rosservice info /nope
rosservice type ns/empty
rosservice type /set_led_stat
rosservice args /set_led_state
rosservice args /ns/empty
rosservice args /nope
rosservice uri /set_led_state
rosservice uri /nope
rosservice node /set_led_state
rosservice node /nope
rosservice find std_srvs/SetBool
rosservice find nope
rosservice call /set_led_state True
rosservice call /set_led_state 1 --wait
rosservice call -v /set_led_state 'data: False'
rosservice call /set_led_state {{}}
rosservice call /set_led_state "{{data: true}}"
rosservice call /set_led_state 'data: maybe'
rosservice call /scene/set_logger_level rosout info
rosservice call /scene/set_logger_level rosout
rosservice call /ns/empty
rosservice call /ns/empty {{}}
rosservice call /ns/empty 5
rosservice call /set_led_state -v <<< data: true\\n---\\ndata: false\\n---\\n
rosservice call /set_led_state <<< data: true\\n ## real ROS forgets a document that has no --- behind it
rosservice call /set_led_state ## no values, neither typed nor piped: an error, exit 2; real ROS calls nothing, exit 0
rosservice call /set_led_state 1 2
rosservice call /set_led_state 'dta: 1'
rosservice call /set_led_state nope
rosservice call /set_led_state '[1'
rosservice call /fail
rosservice call /nope
rosservice call
rosparam
rosparam gt ## {_STATUS.format(64)}
rosparam list
rosparam list /p/d
rosparam list /nope
rosparam list a b
rosparam get /p
rosparam get -p /p
rosparam get /p/i
rosparam get /p/f
rosparam get /p/b
rosparam get /p/s
rosparam get -p /p/s
rosparam get /p/n
rosparam get -p /p/n
rosparam get /p/e
rosparam get /p/u
rosparam get -p /p/u
rosparam get /p/ml
rosparam get -p /p/ml
rosparam get /p/l
rosparam get -p /p/l
rosparam get -v /p/big
rosparam get /p/nope
rosparam get
rosparam get ''
rosparam get '!!'
rosparam get /p/l[0]
rosparam get /p /p/i
rosparam list /p/
rosparam dump
rosparam dump -v dumped.yaml /p/d
rosparam dump /no/such/folder/x.yaml
rosparam dump dumped.yaml /nope
rosparam dump - /p/d ## to standard output; real ROS writes a file called -
rosparam load nope.yaml
rosparam load /etc/os-release
rosmsg
rosmsg shwo
rosmsg show std_msgs/Bool
rosmsg show Bool
rosmsg show PoseStamped
rosmsg show TwistStamped
rosmsg show actionlib/TestAction
rosmsg show <<< std_msgs/Header\\n
rosmsg show std_msgs/Bol
rosmsg show unknown/X
rosmsg show -b nope.bag std_msgs/Bool
rosmsg show -r std_msgs/Header ## the comments of the definitions are our own
rosmsg show ''
rosmsg show std_msgs/msg/Bool
rosmsg show std_srvs/SetBool
rosmsg info std_msgs/Header
rosmsg md5 Bool
rosmsg md5 <<< std_msgs/Header\\n
rosmsg md5 std_msgs/Nope ## {_UNKNOWN}
rosmsg package std_msgs
rosmsg package -s std_msgs
rosmsg package nope
rosmsg users std_msgs/Bool
rossrv
rossrv show SetBool
rossrv show Empty
rossrv show <<< std_srvs/SetBool\\n
rossrv show nope
rossrv show std_srvs/Nope
rossrv show unknown/X
rossrv show -b nope.bag std_srvs/Empty
rossrv info std_srvs/Trigger
rossrv md5 std_srvs/SetBool
rossrv package std_srvs
rossrv package -s std_srvs
rosmsg-proto msg std_msgs/Header
rosmsg-proto msg geometry_msgs/PoseStamped
rosmsg-proto msg geometry_msgs/PoseStamped -f 0
rosmsg-proto msg geometry_msgs/PoseStamped -f 1
rosmsg-proto msg geometry_msgs/PoseStamped -H -p ab
rosmsg-proto msg geometry_msgs/PolygonStamped -e
rosmsg-proto msg geometry_msgs/PoseStamped -x header,orientation
rosmsg-proto msg geometry_msgs/PoseWithCovarianceStamped
rosmsg-proto msg nav_msgs/OccupancyGrid
rosmsg-proto msg sensor_msgs/Image
rosmsg-proto msg sensor_msgs/Image -f 1 -e
rosmsg-proto srv nav_msgs/SetMap
rosmsg-proto srv std_srvs/SetBool
rosmsg-proto msg nope
rosmsg-proto msg a/b
rosmsg-proto srv nope
rosmsg-proto
"""

HELP = """
rostopic bw -h
rostopic delay -h
rostopic echo -h
rostopic find -h
rostopic hz -h
rostopic info -h
rostopic list -h
rostopic pub -h
rostopic type -h
rosnode ping -h
rosnode list -h
rosnode info -h
rosnode machine -h
rosnode kill -h
rosservice args -h
rosservice call -h
rosservice find -h
rosservice info -h
rosservice list -h
rosservice type -h
rosservice node -h
rosservice uri -h
rosparam set -h
rosparam get -h
rosparam load -h
rosparam dump -h
rosparam delete -h
rosparam list -h
rosmsg show -h
rosmsg info -h
rosmsg list -h
rosmsg md5 -h
rosmsg package -h
rosmsg packages -h
rossrv show -h
rossrv list -h
rossrv md5 -h
rossrv package -h
rossrv packages -h
roslaunch -h
roscore -h
roslaunch-deps -h
roslaunch-logs -h
rosgraph -h
roswtf -h
rosrun -h
rosunit -h
rosversion -h
"""
"""Commands for which minirospy prints ROS's help, followed by its own additions."""

WRONG = f"""
rostopic bw --nonsense
rostopic echo --nonsense
rostopic find --nonsense
rostopic hz --nonsense
rostopic info --nonsense
rostopic list --nonsense
rostopic pub --nonsense
rosnode ping --nonsense
rosnode list --nonsense
rosnode info --nonsense
rosnode machine --nonsense
rosnode kill --nonsense
rosnode cleanup --nonsense
rosservice args --nonsense
rosservice call --nonsense
rosservice find --nonsense
rosservice info --nonsense
rosservice list --nonsense
rosservice type --nonsense
rosservice uri --nonsense
rosservice node --nonsense
rosparam set --nonsense
rosparam get --nonsense
rosparam load --nonsense
rosparam dump --nonsense
rosparam delete --nonsense
rosparam list --nonsense
rosmsg show --nonsense
rosmsg info --nonsense
rosmsg list --nonsense
rosmsg md5 --nonsense
rosmsg package --nonsense
rosmsg packages --nonsense
rossrv show --nonsense
rossrv list --nonsense
rossrv md5 --nonsense
rossrv package --nonsense
rossrv packages --nonsense
rostopic bw
rostopic find a b
rostopic info a b
rostopic bw -w
rostopic bw -w x /t
rostopic echo -n
rostopic echo -n x /t
rostopic echo -w x /t
rostopic pub
rostopic pub /t
rostopic pub -r x /t std_msgs/Bool 1
rosnode ping
rosnode ping a b
rosnode ping -a x
rosnode machine a b
rosservice find
rosservice find a b
rosservice info
rosservice type
rosservice node
rosservice node a b
rosservice list a b
rosparam load
rosparam set
rosparam delete a b
roslaunch
roslaunch --nonsense
roslaunch nope nope.launch
roslaunch nope.launch
roscore --nonsense
roslaunch-deps
roslaunch-deps --nonsense
roslaunch-logs --nonsense
rosrun ## {_STATUS.format(2)}
rosrun nope nope
rosrun std_msgs nope
rosversion nope
rosversion
rosversion a b
rosgraph x
rosgraph --nonsense
rostopic type
rostopic type --nonsense /a
rostopic delay a b
rostopic delay -w x /a
rostopic delay --nonsense /a
rosunit
"""

_TOPICS = """
button_state ns/chatter poly scan joints image duration time bytes int8s signed_bytes char tiny empty
poly/polygon poly/polygon/points poly/polygon/points[0] poly/polygon/points[0]/x poly/polygon/points[:]/x
poly/polygon/points[1:] poly/polygon/points[::-1] poly/header/stamp ns/chatter/data scan/ranges scan/ranges[1:3]
joints/name joints/name[1] joints/name[-1] joints/name[0:2] duration/data duration/data/secs time/data/nsecs
scan/header scan/ranges[-1] scan/ranges[::2] scan/ranges[:2] poly/polygon/points[0:1]/y bytes/layout
ns/chatter/data[0] ns/chatter/data[0:2] ns/chatter/data[::-1] poly/header/frame_id[0:2] poly/header/frame_id[-1]
"""

ECHOING = (
    "\n".join(f"rostopic echo -n1 /{topic}" for topic in _TOPICS.split())
    + "\n"
    + "\n".join(
        f"rostopic echo -n1 {option} /{topic}"
        for option in ("-p", "--nostr", "--noarr", "-w 6")
        for topic in ("poly", "scan", "joints", "image", "ns/chatter")
    )
    + """
rostopic echo -n1 -p /scan/ranges[0]
rostopic echo -n1 -p /poly/header/stamp
rostopic echo -n1 -p /poly/polygon/points[:]/x
rostopic echo -n1 -p /bytes
rostopic echo -n1 -p /duration
rostopic echo -n1 -p --nostr --noarr /joints
rostopic echo -n1 --filter 'len(m.ranges)>3' /scan
rostopic echo -n1 --filter "topic=='/poly'" /poly ## the topic has its name in the expression; real ROS prints tracebacks
rostopic echo -n1 -w 8 /poly/polygon/points[0]
rostopic echo /button_state -n1
rostopic echo /tiny /scan
rostopic echo -n1 -c /button_state
rostopic echo -n1 -c -p /button_state
rostopic echo -n1 --nostr /joints/name
rostopic echo -n1 --nostr /ns/chatter/data[0:3]
rostopic echo -n1 --nostr /poly/header/frame_id[0]
rostopic echo -n1 --noarr /poly/polygon/points[:]/x
rostopic echo -n1 -p --nostr /ns/chatter/data
rostopic echo -n1 -p --nostr /joints/name
rostopic echo -n1 -p --noarr /poly/polygon/points[:]/x
rostopic echo -n1 -p /ns/chatter/data[1:3]
rostopic echo -n1 -p /joints/name[0:2]
rostopic echo -n1 --noarr /poly/polygon/points
rostopic echo -n1 --filter 'm.data==True' /button_state
rostopic echo -n1 --offset /duration
rostopic echo -n 0 /button_state
rostopic echo -w 1 /tiny
rostopic echo -a /tiny
rostopic echo -b nope.bag /tiny
rostopic echo --fliter m.data /tiny
rostopic echo
rostopic echo -n1 /button_state/nope ## a field that is not there is an error: exit 1; real ROS waits for ever
rostopic echo -n1 /poly/polygon/points/x ## an array is not a message: exit 1; real ROS waits for ever
rostopic echo -n1 --filter 'm.(' /button_state ## what is not Python is an error: exit 2; real ROS prints tracebacks
rostopic echo -n1 /image/data ## real ROS ends with a traceback
rostopic hz
rostopic hz -w x /t
rostopic bw -w x /t
rostopic delay
rostopic pub -1 /out std_msgs/String hello
rostopic pub -1 -v /out std_msgs/String 'data: hello'
rostopic pub -1 -v /out geometry_msgs/Point 1 2 3
rostopic pub -1 -v /out geometry_msgs/Point -- -1 -2 -3
rostopic pub -1 -v /out geometry_msgs/Point 1 -2.5 -3 ## negative numbers are values: real ROS takes -2 for an option
rostopic pub -1 -v /out geometry_msgs/Point '{x: 1}'
rostopic pub -1 -v /out geometry_msgs/Twist -- '[2.0, 0.0, 0.0]' '[0.0, 0.0, 1.8]'
rostopic pub --once /out geometry_msgs/Twist -v '{linear: {x: 0.2}, angular: [0, 0, -1]}'
rostopic pub -1 -v /out std_msgs/Int16 -- -1000
rostopic pub -1 -v /out std_msgs/Float64 .inf
rostopic pub -1 -v /out std_msgs/Float64 1e-3 ## YAML reads a text there, which is refused: exit 1; real ROS sends nothing, exit 0
rostopic pub -1 -v /out std_msgs/String "data: 'use:10:1'"
rostopic pub -1 -v /out std_msgs/String 5 ## YAML reads a number there, which is refused: exit 1; real ROS sends nothing, exit 0
rostopic pub -1 -v /out std_msgs/UInt8MultiArray '{data: !!binary "AQID"}'
rostopic pub -1 -v /out sensor_msgs/JointState '{name: [a, b], position: [1, -0.5]}'
rostopic pub -1 /out std_msgs/Duration 1.5
rostopic pub -1 -v /out geometry_msgs/Point 1 2
rostopic pub -1 -v /out geometry_msgs/PointStamped '{header: auto, point: {x: 1}}'
rostopic pub -1 -v /out std_msgs/Time now
rostopic pub -1 -l /out std_msgs/Empty
rostopic pub -1 -v /out std_msgs/String <<< data: one\\n---\\ndata: two\\n---\\n
rostopic pub -1 --use-rostime /out std_msgs/String x
rostopic pub -1 /out std_msgs/Bool nope ## a value that does not fit is refused: exit 1; real ROS sends nothing, exit 0
rostopic pub -1 -r 5 /out std_msgs/Bool 1
rostopic pub -r 0 /out std_msgs/Bool 1
rostopic pub -r -5 /out std_msgs/Bool 1
rostopic pub -r -1 /out std_msgs/Bool 1
rostopic pub -f nope.yaml /out std_msgs/Bool
rostopic pub -f nope.yaml /out std_msgs/Bool 1
rostopic pub -1 /out std_msgs/Bool 'data: [1'
rostopic pub -1 /out std_msgs/Bool '{dta: 1}'
rostopic pub -1 /out std_msgs/Header 1 2 3 4 5
rostopic pub -1 /out std_msgs/Bol 1
rostopic pub /out
"""
)

STREAMING = """
4 rostopic echo -p /fast
3 rostopic hz /fast
5 rostopic hz /fast /slow
3 rostopic hz -w 5 --wall-time --tcpnodelay /fast
3 rostopic hz --filter "m.data=='hello'" /slow
3 rostopic hz /fast/header
3 rostopic bw /fast
3 rostopic bw -w 5 /slow
3 rostopic delay /fast
3 rostopic delay -w 5 --tcpnodelay /fast
1 rostopic pub /out std_msgs/String hello
1 rostopic pub -v -l /out std_msgs/String hello
3 rostopic pub -v -r 5 /out std_msgs/String hello
3 rostopic pub -v -r 5 -s /out geometry_msgs/PointStamped '{header: auto}'
4 rosnode ping scene
"""
"""Each line contains the number of output lines after which Ctrl-C is sent. Numbers in the output are not compared."""

CHANGING = """
rosparam set -v /q 5
rosparam set -v /q/x -1.5
rosparam set -v /q/x deg(90)
rosparam set -v /q/y '{a: 1, b: [2, 3]}'
rosparam get /q
rosparam set /q/s ''
rosparam set /q/s -t text.txt
rosparam get /q/s
rosparam set /q/s -b text.txt
rosparam set -t nope.txt /q/s
rosparam set -t text.txt -b text.txt /q/s
rosparam set /q/s '[1'
rosparam set /q/s null
rosparam set /q/s 99999999999
rosparam set /q/s
rosparam set / 5
rosparam set joy/dev /dev/input/js0
rosparam get /joy
rosparam set /n 010
rosparam get /n
rosparam set /n 12:30:45
rosparam get /n
rosparam set /n nan
rosparam get /n
rosparam set /n '#x'
rosparam set /n "'1'"
rosparam get /n
rosparam set /x-y 1
rosparam load -v values.yaml /q/l
rosparam load values.yaml
rosparam load -v - /q/l <<< d: 4\\n
rosparam load - /q/l <<< [1
rosparam get /q/l
rosparam dump -v dumped.yaml /q/l
rosparam delete -v /q
rosparam delete /q
rosparam delete -v /a
rosparam delete /inner
rosparam delete /
rosparam delete /
rosparam list
rosparam delete
"""

UNREACHABLE = """
rosnode info dead
rosnode info unresolved
rosnode ping -c 1 dead
rosnode ping -c 1 unresolved
rosnode cleanup <<< n\\n
rosservice type /dead/srv
rosservice info /dead/srv
rosservice args /dead/srv
rosservice call /dead/srv
rosservice call /unresolved/srv 1
rosservice uri /dead/srv
rosservice node /dead/srv
rostopic info /t/dead
rostopic type /t/dead
rosnode machine
rosnode list -a
rosnode kill dead
rosnode cleanup <<< y\\n
rosnode list
"""

WITHOUT_MASTER = """
rostopic list
rostopic info /a
rostopic type /a
rostopic find std_msgs/Bool
rostopic echo /a
rostopic hz /a
rostopic pub -1 /a std_msgs/Bool 1
rosnode list
rosnode info /a
rosnode ping /a
rosnode cleanup
rosnode machine
rosnode machine nope
rosnode machine localhost
rosnode kill /a
rosservice list
rosservice call /a
rosservice node /a
rosservice uri /a
rosgraph
rosparam list
rosparam dump
rosparam delete /a
rosparam get /a
rosparam set /a 1
rosparam load values.yaml
rosrun topic_tools relay
rosrun topic_tools throttle messages
rosrun topic_tools drop a 1
rosrun topic_tools drop a 1 0
rosrun topic_tools mux a
rosrun topic_tools mux_select a
"""

OTHER_WORDS = {"rostopic pub -1 -v /out geometry_msgs/Point 1 -2.5 -3"}
"""Lines for which ROS prints an error that minirospy does not print first, because minirospy accepts the arguments."""

_ENDLESS = {
    """rostopic echo -n1 --filter "topic=='/poly'" /poly""",
    "rostopic echo -n1 /button_state/nope",
    "rostopic echo -n1 /poly/polygon/points/x",
    "rostopic echo -n1 --filter 'm.(' /button_state",
}
"""Lines that never finish in real ROS: they are interrupted."""
_ENDLESS_SECONDS = 25.0
# Attempts for a line whose output depends on the moment: a stalled node or machine makes the two outputs differ.
_TRIES = 5

_STREAM_NUMBERS = re.compile(r"-?\d[\d.]*(?:e[+-]?\d+)?")
_CHANGING = [
    # Message counts, times, process ids and ports differ between runs.
    (re.compile(r"(?<=seq:)\s+\d+"), " 0"),
    (re.compile(r"(?<=time=)[\d.]+(?=ms)|(?<=ping average: )[\d.]+(?=ms)"), "0.0"),
    (re.compile(r"^\d{18,},|^(?:0|1000000002),\d+,", re.MULTILINE), "0,"),
    (re.compile(r"(?<=secs: )1[789]\d{8}\n\s+nsecs:\s+\d+"), "1700000000\n nsecs: 0"),
    (re.compile(r"(?<=://localhost:)\d+|(?<=://127.0.0.1:)\d+"), "40000"),
    (re.compile(r"\(\d+ - (\S+?):\d+\) \[\d+\]"), r"(40000 - \1:50000) [9]"),
    (re.compile(r"(?<=Pid: )\d+"), "4711"),
    # Paths of installed packages.
    (re.compile(r"\[\['\S*/(?=\w+/(?:msg|srv)'\]\])"), "[['SHARE/"),
    (re.compile(r"(?<=named nope below )\S*/"), "SHARE/"),
    (re.compile(r"(?<=package \[std_msgs\] in )\S*/"), "SHARE/"),
    (re.compile(r"(?<=on search path \[)\{.*?\}(?=\]$)", re.MULTILINE), "SHARE"),
    (re.compile(r"^(ROS path \[\d+\]=)\S+$", re.MULTILINE), r"\1SHARE"),
    # roslaunch colours its errors even in a file, and writes tracebacks, which minirospy does not.
    (re.compile(r"\033\[31m(.*?)\033\[0m", re.DOTALL), r"\1"),
    (re.compile(r"^The traceback for the exception was written to the log file\n", re.MULTILINE), ""),
]


class Ended(NamedTuple):
    """The exit status of a command, and its output."""

    status: int | str
    out: str
    err: str


class Row(NamedTuple):
    """A row of the table."""

    typed: str
    real: Ended
    ours: Ended
    why: str

    @property
    def equal(self) -> bool:
        """Return whether stdout and exit status are equal; for help, whether minirospy's text starts with ROS's."""
        if self.typed.endswith(" -h") and self.real.out != self.ours.out:
            return self.real.status == self.ours.status and self.ours.out.startswith(self.real.out)
        return self.real[:2] == self.ours[:2]

    @property
    def has_ros_words(self) -> bool:
        """Return whether ROS prints an error message, not counting tracebacks and warnings."""
        return bool(self.real.err.strip()) and not re.search("^(Traceback|WARNING)", self.real.err, re.M)

    @property
    def same_words(self) -> bool:
        """Return whether minirospy prints ROS's error before its own."""
        return self.ours.err.startswith(self.real.err)


def compare(
    text: str,
    uri: str,
    folder: Path,
    *,
    streaming: bool = False,
    prepare: Callable[[], object] | None = None,
) -> list[Row]:
    """Run each line of ``text`` with both tools in parallel.

    With ``prepare``, run all lines with one tool, then with the other, and call ``prepare()`` before each of the two runs.
    """
    lines = [line for line in text.strip().splitlines() if line]
    with ExitStack() as running:
        forked = {
            name: running.enter_context(Server(REAL / name)) for name in MODULES if name in text.split()
        }
        return _compare(lines, uri, folder, forked, streaming, prepare)


def _compare(
    lines: list[str],
    uri: str,
    folder: Path,
    forked: dict[str, Server],
    streaming: bool,
    prepare: Callable[[], object] | None,
) -> list[Row]:
    if prepare:
        sides: list[list[Ended]] = [[], []]
        for side, tools in zip(sides, (REAL, OURS), strict=True):
            for line in lines:
                prepare()
                side.append(_run(line, tools, uri, folder, forked, streaming))
        real, ours = sides
    else:
        with ThreadPoolExecutor(6) as pool:
            jobs = [
                [pool.submit(_run, line, tools, uri, folder, forked, streaming) for tools in (REAL, OURS)]
                for line in lines
            ]
            real, ours = ([job[side].result() for job in jobs] for side in (0, 1))
    rows = [
        Row(_typed(line, streaming), *both, line.partition(" ## ")[2])
        for line, both in zip(lines, zip(real, ours, strict=True), strict=True)
    ]

    for index, line in enumerate(lines):
        of_the_moment = not prepare and (streaming or line.startswith("rosnode ping"))
        for _ in range(_TRIES - 1 if of_the_moment else 0):
            row = rows[index]
            if row.equal != bool(row.why):
                break
            both = [_run(line, tools, uri, folder, forked, streaming) for tools in (REAL, OURS)]
            rows[index] = row._replace(real=both[0], ours=both[1])
    return rows


def unexpected(rows: Iterable[Row]) -> str:
    """Return the rows that differ without a reason, and those that have a reason but do not differ."""
    return "\n".join(
        f"$ {row.typed}   ({row.why or 'no reason known'})\n--- real {row.real}\n--- ours {row.ours}"
        for row in rows
        if row.equal == bool(row.why)
    )


def other_words(rows: Iterable[Row]) -> set[str]:
    """Return the command lines for which ROS has an error message that minirospy does not print first."""
    return {row.typed for row in rows if row.has_ros_words and not row.same_words}


def more_words(rows: Iterable[Row]) -> set[str]:
    """Return the command lines for which ROS prints an error, and minirospy more than that."""
    return {row.typed for row in rows if row.has_ros_words and row.ours.err != row.real.err}


def page(sections: dict[str, list[Row]]) -> str:
    """Return the table as Markdown."""
    rows = [row for section in sections.values() for row in section]
    equal = sum(row.equal for row in rows)
    same_text = sum(row.real.out == row.ours.out for row in rows if not row.equal)
    worded = [row for row in rows if row.has_ros_words]
    same = sum(row.same_words for row in worded)
    lines = [
        "# The commands compared with those of real ROS",
        "",
        "Written by `tests/interop/command_table.py` (`WRITE=1 make interop`) from what Debian's ROS 1 and minirospy print on",
        "the same graph; do not edit. Compared are standard output, byte for byte, and the exit status: of "
        f"{len(rows)} lines {equal} are equal,",
        f"{same_text} print the same and have another exit status, {len(rows) - equal - same_text} differ on purpose, with the "
        "reason in bold. Help starts with ROS's text.",
        f"Of {len(worded)} lines where ROS prints an error (not a traceback), ours prints the same text first in {same}, then "
        "its own line. Long",
        "output is cut here, not in the comparison; numbers and folders that change from run to run are replaced.",
    ]

    for title, section in sections.items():
        lines += ["", f"## {title}", "", "| typed | real ROS | minirospy |", "|---|---|---|"]
        for row in section:
            ours = f"**{_cell(row.why)}**<br>{_shown(row.ours)}" if row.why else _same(row)
            lines.append(f"| `{_cell(row.typed)}` | {_shown(row.real)} | {ours} |")

    return "\n".join(lines) + "\n"


def verdicts(text: str) -> set[tuple[str, bool]]:
    """Return the command lines on a page, with whether the outputs are equal."""
    rows = re.findall(r"^\| `(.*)` \| .*? \| (equal|\*\*)", text, re.MULTILINE)
    return {(typed, verdict == "equal") for typed, verdict in rows}


def _same(row: Row) -> str:
    return "equal" + (f"<br>{_error(row.ours)}" if row.ours.err.strip() else "")


def _shown(ended: Ended) -> str:
    parts = [f"exit {ended.status}"] if ended.status != 0 else []
    lines = ended.out.splitlines()
    if any(lines):
        shown = [line[:70] + ("…" if len(line) > 70 else "") for line in lines[:5]]
        rest = [f"… ({len(lines)} lines)"] if len(lines) > 5 else []
        parts.append("<pre>" + "<br>".join(_cell(line) for line in shown + rest) + "</pre>")
    if ended.err.strip():
        parts.append(_error(ended))
    return "<br>".join(parts) or "nothing"


def _error(ended: Ended) -> str:
    return "<i>" + _cell(ended.err.strip().splitlines()[-1][:200]) + "</i>"


def _cell(text: str) -> str:
    return html.escape(text, quote=False).replace("|", "&#124;").replace("\033", "ESC")


def _typed(line: str, streaming: bool) -> str:
    typed = line.partition(" ## ")[0]
    return typed.partition(" ")[2] + " (then Ctrl-C)" if streaming else typed


def _run(line: str, tools: Path, uri: str, folder: Path, forked: dict[str, Server], streaming: bool) -> Ended:
    typed = line.partition(" ## ")[0]
    count = 0
    if streaming:
        number, _, typed = typed.partition(" ")
        count = int(number)
    typed, _, text = typed.partition(" <<< ")
    program = _started(shlex.split(typed), tools, uri, folder, forked)
    if streaming:
        return _interrupted(program, count)

    is_endless = tools == REAL and typed in _ENDLESS
    try:
        given = text.replace("\\n", "\n")
        out, err = program.communicate(given, timeout=_ENDLESS_SECONDS if is_endless else PATIENCE)
        status: int | str = program.returncode
    except subprocess.TimeoutExpired:
        program.send_signal(signal.SIGINT)
        out, err = program.communicate(timeout=PATIENCE)
        status = "never"

    if typed.startswith(("rosnode cleanup", "rosnode ping -a")):
        # Real ROS lists nodes in arbitrary order.
        out = "".join(sorted(out.splitlines(keepends=True)))
        if "Usage: " not in err:
            err = "".join(sorted(err.splitlines(keepends=True)))

    return Ended(status, *(_steady(part, folder) for part in (out, err)))


def _started(
    words: list[str], tools: Path, uri: str, folder: Path, forked: dict[str, Server]
) -> subprocess.Popen[str] | ForkedCommand:
    environment = {**os.environ, "ROS_MASTER_URI": uri, "PYTHONUNBUFFERED": "1"}
    if tools == REAL and words[0] in forked and can_fork(words):
        return forked[words[0]].start(words[1:], environment, folder)
    return subprocess.Popen(
        [str(tools / words[0]), *words[1:]],
        env=environment,
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _interrupted(program: subprocess.Popen[str] | ForkedCommand, count: int) -> Ended:
    assert program.stdout
    lines = "".join(_until_filled(program.stdout, count))
    program.send_signal(signal.SIGINT)
    _, err = program.communicate(timeout=PATIENCE)
    # Numbers, their units and the column widths vary between runs.
    text = re.sub(r"(?<=0)[KM]B", "B", _STREAM_NUMBERS.sub("0", lines))
    text = re.sub(r" {2,}", "  ", re.sub(r"={3,}", "===", text))
    return Ended(program.returncode, text, err)


def _until_filled(stream: Iterable[str], count: int) -> Iterator[str]:
    """Yield ``count`` lines; skip lines that report that there are no messages yet."""
    for line in stream:
        if line != "no new messages\n":
            yield line
            count -= 1
        if not count:
            return


def _steady(text: str, folder: Path) -> str:
    text = text.replace(str(folder), "FOLDER")
    for pattern, by in _CHANGING:
        text = pattern.sub(by, text)
    return text
