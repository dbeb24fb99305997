"""action_peer.py for asyncio programs: the same commands, implemented with minirospy.ros.actionlib.actionlib.aio."""

import asyncio
import itertools
import sys

from actionlib.msg import TestAction, TestGoal, TestResult
from actionlib_msgs.msg import GoalID

from minirospy import Node
from minirospy.core.graph.goals import GoalState
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer, GoalError

SECONDS = 200.0


def say(*words):
    print(*words, flush=True)


async def serve(node):
    async def wait_for(report, goal):
        while await node.get_param(report, 0) < goal.request.goal:
            await asyncio.sleep(0.01)

    async def execute(goal):
        kind = goal.request.goal % 10
        try:
            if kind == 1:
                await wait_for("/sent", goal)
                for number in (10, 11, 12):
                    await goal.publish_feedback(number)
                await wait_for("/heard", goal)
                goal.text = "reached"
                return {"result": 1}
            await (wait_for("/sent", goal) if kind == 2 else asyncio.sleep(SECONDS))
            raise GoalError("failed", TestResult(2))
        except asyncio.CancelledError:
            goal.text = "made way"
            return TestResult(3)

    async with ActionServer(node, "interop_action", TestAction, execute):
        say("ready")
        await asyncio.to_thread(sys.stdin.read)


async def ask(node):
    client = ActionClient(node, "interop_action", TestAction)
    await client.wait_for_server(SECONDS)
    say("server", True)

    tens = itertools.count(10, 10)

    async def send(kind):
        number = next(tens) + kind
        # Nothing that arrives while the goal is being sent is lost.
        await node.set_param("/sent", number)
        return client.send(TestGoal(number))

    async def tell(what, goal):
        feedback = []
        async for message in goal:
            feedback.append(message.feedback)
            if message.feedback == 12:
                await node.set_param("/heard", await node.get_param("/sent"))
        try:
            result = await goal
        except GoalError as error:
            result = error.result
        say(what, goal.done, goal.state.name, goal.text, result.result)
        say(what, "feedback", *feedback)

    async def until_active(goal):
        while goal.state != GoalState.ACTIVE:
            await asyncio.sleep(0.01)
        say("state", goal.state.name)

    await tell("succeeds", await send(1))
    await tell("aborts", await send(2))
    goal = await send(3)
    await until_active(goal)
    goal.cancel()
    await tell("cancelled", goal)
    await until_active(await send(3))
    await tell("after another", await send(1))
    goal = await send(3)
    await until_active(goal)
    client.cancel_all()
    await tell("all cancelled", goal)
    goal = await send(3)
    await until_active(goal)
    cancels = node.advertise("interop_action/cancel", GoalID)
    await cancels.publish(stamp=node.now())
    await tell("cancelled by time", goal)
    async with await send(3) as goal:
        await asyncio.wait([asyncio.ensure_future(goal._result())], timeout=0.3)
    try:
        await goal
    except GoalError as error:
        # The state is RECALLED if the cancel request, which uses another connection, overtakes the goal.
        say("out of time", error.state.name in ("PREEMPTED", "RECALLED"))
    try:
        await (await send(2))
    except GoalError as error:
        say("in time", error.state.name)
    await client.close()


async def main():
    async with Node("action_peer", anonymous=True) as node:
        await {"serve": serve, "ask": ask}[sys.argv[1]](node)


asyncio.run(main())
