"""Actions in asyncio programs: each final state of a goal, with minirospy's client and server and with the rospy API's."""

from __future__ import annotations

import asyncio
import struct
import subprocess
import sys
from collections.abc import Awaitable, Callable
from types import SimpleNamespace
from typing import Any

import pytest
from actionlib import msg
from actionlib_msgs.msg import GoalID, GoalStatus

from minirospy import Node
from minirospy.base.errors import ROSException, ROSInterruptException
from minirospy.core.graph.goals import GoalState
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer, GoalError, ServerGoal
from minirospy.ros.actionlib.actionlib.aio import client as client_module
from minirospy.ros.actionlib.actionlib.aio import server as server_module
from minirospy.ros.actionlib.actionlib.spec import ActionException
from minirospy.ros.actionlib.actionlib.statuses import StatusList, status_bytes
from tests.waiting import until

pytestmark = pytest.mark.usefixtures("master")

SECONDS = 100.0
Client = ActionClient[msg.TestGoal, msg.TestResult, msg.TestFeedback]
Server = ActionServer[msg.TestGoal, msg.TestResult, msg.TestFeedback]
Goal = ServerGoal[msg.TestGoal, msg.TestFeedback]


async def execute(goal: Goal) -> Any:
    """Execute a goal: 1 succeeds with feedback, 2 raises an exception, 3 runs until it is cancelled, 4 aborts with a result."""
    if goal.request.goal == 3:
        await asyncio.sleep(SECONDS)
    if goal.request.goal == 2:
        raise ValueError("goal 2 is too hard")
    if goal.request.goal == 4:
        raise GoalError("half way", msg.TestResult(4))
    for number in (10, 11, 12):
        await goal.publish_feedback(number)
    await asyncio.sleep(0.05)
    return goal.request.goal


def run(
    main: Callable[[Client, Server], Awaitable[None]],
    work: Callable[[Goal], Awaitable[Any]] = execute,
    **options: Any,
) -> None:
    """Run a test's coroutine with a client and a server on two nodes."""

    async def bounded() -> None:
        async with (
            Node("server", rosout=False) as one,
            Node("client", rosout=False) as two,
            ActionServer(one, "act", msg.TestAction, work, **options) as server,
            ActionClient(two, "act", msg.TestAction) as client,
        ):
            await asyncio.wait_for(_done(main(client, server)), SECONDS)

    asyncio.run(bounded(), debug=True)


async def _done(work: Awaitable[None]) -> None:
    await work


async def started(goal: Any) -> None:
    """Wait until the server executes the goal."""
    await until(lambda: goal.state is GoalState.ACTIVE)


def test_feedback_and_result() -> None:
    async def main(client: Client, _: Server) -> None:
        goal = client.send(msg.TestGoal(1))
        assert [feedback.feedback async for feedback in goal] == [10, 11, 12]
        assert (await goal).result == 1
        assert goal.done
        assert goal.state is GoalState.SUCCEEDED
        # A finished goal can be awaited again.
        assert (await goal).result == 1

    run(main)


def test_exception_in_execute_aborts_the_goal(caplog: pytest.LogCaptureFixture) -> None:
    async def main(client: Client, _: Server) -> None:
        with pytest.raises(GoalError, match=r"the goal was aborted: .*goal 2 is too hard") as caught:
            await client.send(msg.TestGoal(2))
        assert caught.value.state is GoalState.ABORTED
        with pytest.raises(GoalError, match="half way") as caught:
            await client.send(msg.TestGoal(4))
        assert caught.value.result.result == 4
        assert (await client.send(msg.TestGoal(1))).result == 1

    run(main)
    assert caplog.text.count("Exception in your execute callback") == 1


@pytest.mark.parametrize(
    ("bad_result", "why"),
    [
        ((1, 2, 3), "wrong number of values"),
        (msg.TestResult("one"), "result"),
        (GoalError("half way", {"results": 1}), "results"),
    ],
    ids=str,
)
def test_a_result_that_does_not_fit_aborts_the_goal(bad_result: Any, why: str) -> None:
    async def bad(goal: Goal) -> Any:
        if isinstance(bad_result, Exception):
            raise bad_result
        return bad_result

    async def main(client: Client, _: Server) -> None:
        with pytest.raises(GoalError, match=f"the goal was aborted: the result does not fit: .*{why}"):
            await client.send(msg.TestGoal(1))

    run(main, bad)


def test_cancel() -> None:
    async def main(client: Client, _: Server) -> None:
        goal = client.send(msg.TestGoal(3))
        await started(goal)
        goal.cancel()
        with pytest.raises(GoalError) as caught:
            await goal
        assert caught.value.state is GoalState.PREEMPTED
        goal.cancel()  # has no effect
        async with client.send(msg.TestGoal(3)) as goal:
            await started(goal)
        with pytest.raises(GoalError, match="preempted"):
            await goal

    run(main)


def test_execute_may_clean_up_and_return_a_result() -> None:
    async def careful(goal: Goal) -> Any:
        try:
            await asyncio.sleep(SECONDS)
        except asyncio.CancelledError:
            assert goal.is_cancel_requested
            await asyncio.sleep(0.01)
            goal.text = "stopped half way"
            return msg.TestResult(50)

    async def main(client: Client, _: Server) -> None:
        goal = client.send(msg.TestGoal(3))
        await started(goal)
        goal.cancel()
        with pytest.raises(GoalError, match="stopped half way") as caught:
            await goal
        assert (caught.value.state, caught.value.result.result) == (GoalState.PREEMPTED, 50)

    run(main, careful)


def test_a_newer_goal_takes_the_place_of_the_one_that_runs() -> None:
    async def main(client: Client, _: Server) -> None:
        old = client.send(msg.TestGoal(3))
        await started(old)
        assert (await client.send(msg.TestGoal(1))).result == 1
        with pytest.raises(GoalError, match="preempted"):
            await old

    run(main)


def test_concurrent_goals_each_end() -> None:
    """One of the goals is preempted before its execution starts."""

    async def main(client: Client, server: Server) -> None:
        await client.wait_for_server()
        await client.send(msg.TestGoal(1))
        goals = [client.send(msg.TestGoal(1)) for _ in range(5)]
        ends = await asyncio.wait_for(asyncio.gather(*goals, return_exceptions=True), SECONDS)
        assert ends[-1].result == 1  # type: ignore[union-attr]
        assert {goal.state for goal in goals[:-1]} <= {GoalState.PREEMPTED, GoalState.RECALLED}

    run(main)


def test_goals_side_by_side() -> None:
    async def main(client: Client, _: Server) -> None:
        long = client.send(msg.TestGoal(3))
        await started(long)
        results = await asyncio.gather(*(client.send(msg.TestGoal(number)) for number in (5, 6, 7)))
        assert [result.result for result in results] == [5, 6, 7]
        assert long.state is GoalState.ACTIVE
        client.cancel_all()
        with pytest.raises(GoalError, match="preempted"):
            await long

    run(main, concurrent=True)


def test_goals_that_the_server_refuses() -> None:
    async def main(client: Client, _: Server) -> None:
        with pytest.raises(GoalError, match="rejected") as caught:
            await client.send(msg.TestGoal(7))
        assert caught.value.state is GoalState.REJECTED
        assert (await client.send(msg.TestGoal(1))).result == 1

    run(main, accepts=lambda goal: goal.goal != 7)


def test_a_goal_is_aborted_with_a_result_in_any_form() -> None:
    async def half_way(goal: Goal) -> Any:
        raise GoalError("half way", {"result": 4})

    async def main(client: Client, _: Server) -> None:
        with pytest.raises(GoalError, match="half way") as caught:
            await client.send(msg.TestGoal(1))
        assert caught.value.result.result == 4

    run(main, half_way)


def test_a_server_whose_accepts_raises_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    def accepts(goal: msg.TestGoal) -> bool:
        if goal.goal == 7:
            raise ValueError("no sevens")
        return True

    async def main(client: Client, _: Server) -> None:
        with pytest.raises(GoalError, match=r"the goal was rejected: .*no sevens"):
            await client.send(msg.TestGoal(7))
        assert (await client.send(msg.TestGoal(1))).result == 1

    run(main, accepts=accepts)
    assert caplog.text.count("Exception in your accepts callback") == 1


def test_cancel_with_an_observer() -> None:
    async def main() -> None:
        async with (
            Node("onlooker", rosout=False) as one,
            Node("client", rosout=False) as two,
            ActionClient(two, "act", msg.TestAction) as client,
        ):
            looks_on = one.subscribe("act/goal", msg.TestActionGoal)
            await looks_on.wait_for_publishers(timeout=SECONDS)
            await client._goal.wait_for_subscribers(timeout=SECONDS)
            goal = client.send(msg.TestGoal(1))
            goal.cancel()
            with pytest.raises(GoalError, match="the goal was recalled"):
                await asyncio.wait_for(goal, SECONDS)

    asyncio.run(main(), debug=True)


def test_a_cancel_that_comes_before_its_goal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros.actionlib.actionlib.aio.server.CANCEL_SECONDS", 0)

    async def main(client: Client, server: Server) -> None:
        await client.wait_for_server()
        goal = client.send(msg.TestGoal(3))
        await server.take_cancel(GoalID(id=goal.id))
        with pytest.raises(GoalError, match="recalled: it was cancelled before it came"):
            await goal

    run(main)


def test_a_cancel_of_all_does_not_overtake_a_goal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A goal from a third-party client is accepted after a short delay; a cancel request is delayed longer."""

    async def main(_: Client, server: Server) -> None:
        pauses: list[float] = []

        async def sleep(seconds: float) -> None:
            # Both have arrived by now. The one with the shorter pause is processed before the other.
            pauses.append(seconds)
            await until(
                lambda: not (len(pauses) < 2 or (seconds == max(pauses) and "other-1" not in server.goals))
            )

        monkeypatch.setattr(server_module, "asyncio", SimpleNamespace(**{**vars(asyncio), "sleep": sleep}))
        async with (
            Node("other", rosout=False) as other,
            other.advertise("act/goal", msg.TestActionGoal) as goals,
        ):
            await goals.wait_for_subscribers()
            await goals.publish(goal_id=GoalID(id="other-1"), goal=msg.TestGoal(3))
            await server.take_cancel(GoalID())
            assert server.goals["other-1"].is_cancel_requested
            monkeypatch.undo()

    run(main)


def test_a_cancel_of_all_up_to_a_time() -> None:
    async def main(client: Client, server: Server) -> None:
        goal = client.send(msg.TestGoal(3))
        await started(goal)
        await server.take_cancel(GoalID(stamp=server._node.now()))
        with pytest.raises(GoalError, match="preempted"):
            await goal
        assert (await client.send(msg.TestGoal(1))).result == 1

    run(main)


def test_a_server_that_ends_aborts_and_one_that_forgot_loses() -> None:
    async def main(client: Client, server: Server) -> None:
        goal = client.send(msg.TestGoal(3))
        await started(goal)
        await server.close()
        with pytest.raises(GoalError, match="aborted: the server ends"):
            await goal

    run(main)

    async def forgetful(client: Client, server: Server) -> None:
        goal = client.send(msg.TestGoal(3))
        await started(goal)
        server.goals.clear()
        with pytest.raises(GoalError, match="lost"):
            await goal

    run(forgetful)


def test_wrong_messages_do_not_stop_the_client(caplog: pytest.LogCaptureFixture) -> None:
    async def main(client: Client, server: Server) -> None:
        goal = client.send(msg.TestGoal(3))
        await started(goal)
        async with (
            Node("other", rosout=False) as other,
            other.advertise("act/status", StatusList) as statuses,
            other.advertise("act/result", msg.TestActionResult) as results,
        ):
            await statuses.wait_for_subscribers()
            await results.wait_for_subscribers()
            # A list that ends after the goal's id.
            await statuses.publish(StatusList([struct.pack("<3I", 0, 0, len(goal.id)) + goal.id.encode()]))
            unknown = GoalStatus(goal_id=GoalID(id=goal.id), status=200)
            await statuses.publish(StatusList([status_bytes(unknown)]))
            await results.publish(status=unknown)
            await until(
                lambda: caplog.messages.count("Got an unknown status from the ActionServer: 200") == 2
            )
        assert any("a message on /act/status is ignored: " in line for line in caplog.messages)
        server.goals.clear()
        with pytest.raises(GoalError, match="lost"):
            await goal

    run(main)


SERVER = """
import asyncio
import minirospy
from actionlib import msg
from minirospy.ros.actionlib.actionlib.aio import ActionServer

async def execute(goal):
    print("got", goal.request.goal, flush=True)
    await asyncio.sleep(1000)

async def main():
    async with minirospy.Node("other") as node, ActionServer(node, "other", msg.TestAction, execute):
        print("ready", flush=True)
        await node.spin()

asyncio.run(main())
"""


def test_goal_is_lost_when_its_server_dies(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(client_module, "SERVER_SECONDS", 0.2)

    async def main() -> None:
        server = await asyncio.create_subprocess_exec(
            sys.executable, "-c", SERVER, stdout=asyncio.subprocess.PIPE
        )
        assert server.stdout
        async with (
            Node("client", rosout=False) as node,
            ActionClient(node, "other", msg.TestAction) as client,
        ):
            assert await server.stdout.readline() == b"ready\n"
            goal = client.send(msg.TestGoal(3))
            assert await server.stdout.readline() == b"got 3\n"
            server.kill()
            with pytest.raises(GoalError, match="lost: the server has died or is unreachable"):
                await goal
            await server.wait()
            assert goal.state is GoalState.LOST
            # A goal that was not sent yet waits for the next server.
            waiting = client.send(msg.TestGoal(1))
            await asyncio.sleep(0.5)
            assert not waiting.done
        text = f"The action server [/other] has died or is unreachable: goal {goal.id} is LOST"
        assert caplog.messages.count(text) == 1

    asyncio.run(asyncio.wait_for(main(), SECONDS))


def test_a_goal_waits_for_its_server() -> None:
    async def main() -> None:
        async with Node("one", rosout=False) as node, ActionClient(node, "late", msg.TestAction) as client:
            with pytest.raises(TimeoutError, match="waiting for the action server /late"):
                await client.wait_for_server(0.05)
            goal = client.send(msg.TestGoal(1))
            given_up = client.send(msg.TestGoal(1))
            given_up.cancel()
            with pytest.raises(GoalError, match="recalled: cancelled before a server was there"):
                await given_up
            async with ActionServer(node, "late", msg.TestAction, execute):
                assert (await asyncio.wait_for(goal, SECONDS)).result == 1

    asyncio.run(main(), debug=True)


def test_the_end_of_client_and_node() -> None:
    async def main() -> None:
        async with Node("one", rosout=False) as node:
            client = ActionClient(node, "nobody", msg.TestAction)
            goal = client.send(msg.TestGoal(1))
            await client.close()
            with pytest.raises(ROSInterruptException):
                await goal
            with pytest.raises(ROSException, match="closed action client of /nobody"):
                client.send(msg.TestGoal(1))
            other = ActionClient(node, "nobody", msg.TestAction)
            await other
            goal = other.send(msg.TestGoal(1))
            node.shutdown()
            with pytest.raises(ROSInterruptException):
                await goal
            await other.close()

    asyncio.run(main(), debug=True)


def test_no_action() -> None:
    with pytest.raises(ActionException, match="Type is not an action spec"):
        ActionClient(Node("one"), "act", msg.TestGoal)  # type: ignore[arg-type]


PEER = """
import sys, rospy, actionlib
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
rospy.init_node("peer", argv=[], disable_rosout=True)
def execute(goal):
    server.publish_feedback(TestFeedback(goal.goal))
    rospy.sleep(0.05)
    server.set_succeeded(TestResult(goal.goal), "by rospy")
server = actionlib.SimpleActionServer("theirs", TestAction, execute, False)
server.start()
client = actionlib.SimpleActionClient("ours", TestAction)
client.wait_for_server()
client.send_goal_and_wait(TestGoal(1))
print(client.get_state(), client.get_result().result, flush=True)
sys.stdin.read()
rospy.signal_shutdown("")
"""


def test_with_the_rospy_api() -> None:
    async def main() -> None:
        async with (
            Node("one", rosout=False) as node,
            ActionServer(node, "ours", msg.TestAction, execute),
            ActionClient(node, "theirs", msg.TestAction) as client,
        ):
            peer = await asyncio.create_subprocess_exec(
                sys.executable, "-c", PEER, stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
            goal = client.send(msg.TestGoal(9))
            assert [feedback.feedback async for feedback in goal] == [9]
            assert ((await goal).result, goal.text) == (9, "by rospy")
            assert peer.stdout
            assert await peer.stdout.readline() == b"3 1\n"
            assert peer.stdin
            peer.stdin.close()
            await peer.wait()

    asyncio.run(asyncio.wait_for(main(), SECONDS))
