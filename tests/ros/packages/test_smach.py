"""smach and smach_ros behave as the real packages, but raise errors in cases in which those hang or stay locked.

The programs in smach_programs/ ran under the real packages (2.5.2); the .txt files are their output.
"""

from __future__ import annotations

import base64
import pickle
import subprocess
import sys
import threading
import tracemalloc
from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import genpy
import pytest
import rospy
import smach
from geometry_msgs.msg import Point
from smach.util import CBInterface
from std_msgs.msg import String
from std_srvs.srv import SetBoolRequest, SetBoolResponse

from minirospy.base.clock import SignalSafeCondition
from minirospy.ros.smach_ros.smach_ros.pickled import pickle_userdata, unpickle_userdata

PROGRAMS = Path(__file__).parent / "smach_programs"


@pytest.fixture(autouse=True)
def logged() -> Iterator[list[str]]:
    texts: list[str] = []
    smach.set_loggers(texts.append, texts.append, lambda text: None, texts.append)
    yield texts
    smach.set_loggers(print, print, print, print)


def run_program(name: str) -> None:
    done = subprocess.run(
        [sys.executable, str(PROGRAMS / f"{name}.py")],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.stdout == (PROGRAMS / f"{name}.txt").read_text(encoding="utf-8"), done.stderr
    assert done.returncode == 0


def test_containers_behave_as_real_ones() -> None:
    run_program("containers")


def test_states_of_smach_ros_behave_as_real_ones(master: str) -> None:
    run_program("ros_states")


@pytest.mark.parametrize("arguments", [[], ["another thread"]])
def test_machine_ends_with_its_node(arguments: list[str], master: str) -> None:
    done = subprocess.run(
        [sys.executable, str(PROGRAMS / "preempted.py"), *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.stdout, done.returncode) == ("end\n", 0), done.stderr


def state_of(function: Callable[[Any], Any], *outcomes: str) -> smach.State:
    return smach.CBState(function, outcomes=outcomes)


def concurrence_of(function: Callable[[Any], Any], **kwargs: Any) -> smach.Concurrence:
    made = smach.Concurrence(["done"], "done", **kwargs)
    with made:
        smach.Concurrence.add("CHILD", state_of(function, "done"))
    return made


def raises(*_arguments: object) -> str:
    raise ValueError("broken")


@pytest.mark.parametrize(
    ("container", "text"),
    [
        (lambda: concurrence_of(lambda ud: None), "Concurrent state 'CHILD' returned no outcome"),
        (lambda: concurrence_of(raises), "Could not execute child state 'CHILD': Traceback"),
        (
            lambda: concurrence_of(lambda ud: "done", child_termination_cb=raises),
            "Could not execute child termination callback",
        ),
    ],
)
def test_concurrence_whose_child_fails_ends(
    container: Callable[[], smach.Concurrence], text: str, logged: list[str]
) -> None:
    with pytest.raises(smach.InvalidStateError, match="A concurrent state raised an exception"):
        container().execute()
    assert any(text in each for each in logged)


def test_concurrence_that_is_to_end_before_it_starts_ends_its_states() -> None:
    child = state_of(lambda ud: "done", "done")
    ended = threading.Event()
    child.execute = lambda ud: ended.wait(60) and "done"  # type: ignore[method-assign]
    child.request_preempt = ended.set  # type: ignore[method-assign,assignment]
    made = smach.Concurrence(["done"], "done")
    with made:
        smach.Concurrence.add("CHILD", child)
    made.request_preempt()
    assert made.execute() == "preempted"


def test_concurrence_does_not_wait_after_a_shutdown(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = threading.Event()
    child = state_of(lambda ud: ended.wait(60) and "done", "done")
    child.request_preempt = ended.set  # type: ignore[method-assign,assignment]
    made = smach.Concurrence(["done"], "done")
    with made:
        smach.Concurrence.add("CHILD", child)
    monkeypatch.setattr("minirospy.ros.smach.smach.concurrence.is_shutdown", lambda: True)
    monkeypatch.setattr(SignalSafeCondition, "wait_for", lambda *args: pytest.fail("it waits"))
    assert made.execute() == "done"
    assert ended.is_set()


def test_outcome_map_of_a_state_that_is_not_there_is_logged(logged: list[str]) -> None:
    with smach.Concurrence(["done"], "done", outcome_map={"done": {"NONE": "x"}}):
        pass
    assert any("references a state that does not exist: 'NONE'" in text for text in logged)


def test_construction_that_raises_leaves_nothing_open(logged: list[str]) -> None:
    with pytest.raises(ZeroDivisionError), smach.StateMachine(["done"]):
        raise ZeroDivisionError
    assert "Error raised during SMACH container construction" in logged[0]
    with pytest.raises(smach.InvalidStateError, match="no container is opened"):
        smach.StateMachine.add("A", state_of(lambda ud: "done", "done"))
    # Another thread can open a container, because no lock is held.
    thread = threading.Thread(target=lambda: smach.StateMachine(["done"]).open())
    thread.start()
    thread.join(30)
    assert not thread.is_alive()
    smach.Container._construction_stack.clear()
    smach.container.Container._construction_lock = threading.RLock()


def test_iterator_whose_items_fail_raises() -> None:
    def items() -> Iterator[int]:
        yield 1
        raise OSError("no more")

    made = smach.Iterator(["done"], [], [], items)
    with made:
        smach.Iterator.set_contained_state("S", state_of(lambda ud: "done", "done"), loop_outcomes=["done"])
    with pytest.raises(OSError, match="no more"):
        made.execute()
    assert not made.is_running()


def test_iterator_without_a_state_is_refused() -> None:
    with pytest.raises(smach.InvalidStateError, match="No contained state"):
        smach.Iterator(["done"], [], [], [1]).execute()


def test_setting_a_member_of_an_input_is_logged(logged: list[str]) -> None:
    class Thing:
        value = 1

    data = smach.UserData()
    data.thing = Thing()
    seen = smach.Remapper(data, ["thing"])
    seen.thing.value = 2
    assert data.thing.value == 1
    assert "Attempting to set 'value' but this member is read-only." in logged
    with pytest.raises(TypeError, match="read-only"):
        del seen.thing.value


def test_transitions_that_two_states_share_stay_apart() -> None:
    shared = {"done": "finished"}
    machine = smach.StateMachine(["finished", "odd"])
    with machine:
        smach.StateMachine.add("A", state_of(lambda ud: "done", "done", "odd"), shared)
        smach.StateMachine.add("B", state_of(lambda ud: "done", "done"), shared)
    assert shared == {"done": "finished"}
    assert machine.execute() == "finished"


def test_io_keys_of_a_callback_count() -> None:
    callback = CBInterface(len, io_keys=["both"])
    assert callback.get_registered_input_keys() == callback.get_registered_output_keys() == ("both",)


def test_userdata_with_values_is_pickled() -> None:
    data = {"a": [1, 2.5, {"x"}], "b": b"bytes", "time": rospy.Time(1, 2), "point": Point(1, 2, 3)}
    text, left_out = pickle_userdata({**data, "lock": threading.Lock()})
    assert left_out == ["lock"]
    assert unpickle_userdata(text) == data
    others: dict[str, list[object]] = {
        "plain": [bytearray(b"x"), bytearray(), b"", frozenset({1}), range(3), slice(1, 2), 1j, set()],
        "collections": [OrderedDict(a=1), defaultdict(None, a=[1]), deque([1, 2], 3)],
        "messages": [SetBoolRequest(True), SetBoolResponse(True, "x"), genpy.Time(1, 2), genpy.Duration(3)],
    }
    text, left_out = pickle_userdata(others)
    again: dict[str, Any] = unpickle_userdata(text)
    assert (again, left_out) == (others, [])
    assert list(map(type, again["messages"])) == list(map(type, others["messages"]))


def test_arrays_are_pickled() -> None:
    numpy = pytest.importorskip("numpy")
    text, _ = pickle_userdata({"array": numpy.arange(3), "number": numpy.float64(1.5)})
    found: dict[str, Any] = unpickle_userdata(text)
    assert found["array"].tolist() == [0, 1, 2]
    assert found["number"] == 1.5
    for array in (
        numpy.array([[1.5, 2], [3, 4]], ">f4", order="F"),
        numpy.array(["ab", "c"]),
        numpy.array([b"ab"]),
        numpy.array([True, False]),
        numpy.zeros((0, 3), "c16"),
        numpy.array(["a", None], object),
    ):
        for protocol in (2, 5):
            data = pickle.dumps({"a": array}, protocol)
            text = base64.b64encode(data).decode()
            if array.dtype == object:
                with pytest.raises(ValueError, match="not userdata: an array of"):
                    unpickle_userdata(text)
                continue
            copied: Any = unpickle_userdata(text)["a"]
            expected = pickle.loads(data)["a"]
            assert (type(copied), copied.dtype) == (type(expected), expected.dtype)
            assert copied.tolist() == array.tolist()


class Runs:
    def __reduce__(self) -> tuple[Any, ...]:
        return print, ("run",)


@pytest.mark.parametrize(
    ("values", "name"),
    [({"x": Runs()}, "print"), ({"x": Fraction(1, 2)}, "fractions.Fraction"), ({"x": eval}, "eval")],
)
def test_userdata_of_other_nodes_runs_no_code(
    values: dict[str, Any], name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text, _ = pickle_userdata(values)
    with pytest.raises(ValueError, match=f"{name} is not a plain value or a message"):
        unpickle_userdata(text)
    assert capsys.readouterr().out == ""


HOSTILE = {
    "a module that is not one of messages": b"cthis.msg._x\nX\n",
    "the state of a class": b"cstd_msgs.msg._String\nString\nN}(U\x07_md5sumU\x01xu\x86b",
    "a size instead of a content": b"c__builtin__\nbytearray\nJ\x00\x00\x00\x70\x85R",
    "a range without end": b"c__builtin__\nset\nc__builtin__\nrange\nJ\xff\xff\xff\x7f\x85R\x85R",
    "another codec": b"c_codecs\nencode\nU\x01aU\x04idna\x86R",
    "an object on a set": b"ccopy_reg\n_reconstructor\n(c__builtin__\nobject\nc__builtin__\nset\nNtR",
    "an array of objects": b"cnumpy\ndtype\n(U\x02O8\x89\x88tR",
    "an array without a size": b"cnumpy\nndarray\nJ\xff\xff\xff\x7f\x85R",
}


@pytest.mark.parametrize("what", HOSTILE)
def test_userdata_makes_plain_values_alone(what: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = base64.b64encode(b"\x80\x02}U\x01a" + HOSTILE[what] + b"s.").decode()
    with pytest.raises(ValueError, match="not userdata"):
        unpickle_userdata(text)
    assert (capsys.readouterr().out, String._md5sum) == ("", "992ce8a1687cec8c8bd883ec73ca41d1")


def test_userdata_takes_no_more_memory_than_it_has_bytes() -> None:
    data = b"\x80\x05}U\x01a" + pickle.BYTEARRAY8 + (1 << 28).to_bytes(8, "little") + b"xs."
    text = base64.b64encode(data).decode()
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="not userdata"):
            unpickle_userdata(text)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_array_whose_bytes_would_be_pointers_is_refused() -> None:
    numpy = pytest.importorskip("numpy")
    # The state clears the object flag; numpy would then interpret the array's bytes as pointers and follow them.
    state = (3, "|", None, ("a",), {"a": (numpy.dtype("O"), 0)}, 8, 1, 0)
    dtype = b"cnumpy\ndtype\n(U\x02V8\x89\x88tR" + pickle.dumps(state, 2)[2:-1] + b"b"
    array = b"cnumpy.core.numeric\n_frombuffer\n(U\x08AAAAAAAA" + dtype + b"K\x01\x85U\x01CtR"
    with pytest.raises(ValueError, match="not userdata: an array of"):
        unpickle_userdata(base64.b64encode(b"\x80\x02}U\x01a" + array + b"s.").decode())
    # A state must not make an array larger than its memory or its size negative.
    for size in (800, -1):
        other = (3, "|", None, None, None, size, 1, 0)
        dtype = b"cnumpy\ndtype\n(U\x02S8\x89\x88tR" + pickle.dumps(other, 2)[2:-1] + b"b"
        with pytest.raises(ValueError, match="not userdata: an array of"):
            unpickle_userdata(base64.b64encode(b"\x80\x02}U\x01a" + dtype + b"s.").decode())


def test_array_in_the_memory_of_another_is_refused() -> None:
    numpy = pytest.importorskip("numpy")
    # Setting the state of the other array a second time would free its memory.
    one = pickle.dumps(numpy.zeros(100), 2)[2:-1]
    dtype = b"cnumpy\ndtype\n(U\x02f8\x89\x88tR"
    array = b"cnumpy.core.numeric\n_frombuffer\n(" + one + dtype + b"Kd\x85U\x01CtR"
    with pytest.raises(ValueError, match="not userdata: an array in ndarray"):
        unpickle_userdata(base64.b64encode(b"\x80\x02}U\x01a" + array + b"s.").decode())


@pytest.mark.parametrize("text", ["", "?", "AAAA", "gAJLBS4="])
def test_text_that_is_not_userdata_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not userdata"):
        unpickle_userdata(text)


def test_machines_can_be_pickled() -> None:
    machine = smach.StateMachine(["done"])
    with machine:
        smach.StateMachine.add("A", smach.State(["done"]))
    copied = pickle.loads(pickle.dumps(machine))
    assert copied.get_internal_edges() == [("done", "A", None)]
    copied.request_preempt()
    assert copied.preempt_requested()
