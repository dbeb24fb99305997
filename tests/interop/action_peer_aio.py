"""action_peer.py for asyncio programs: the same words, by minirospy.actionlib.aio."""

import asyncio
import sys

from actionlib.msg import TestAction, TestGoal, TestResult
from actionlib_msgs.msg import GoalID

from minirospy import Node
from minirospy.actionlib.aio import ActionClient, ActionServer, GoalError
from minirospy.graph.goals import GoalState

SECONDS = 40.0


def say(*words):
    print(*words, flush=True)


async def serve(node):
    async def execute(goal):
        number = goal.request.goal
        try:
            if number == 1:
                for number in (10, 11, 12):
                    await goal.publish_feedback(number)
                await asyncio.sleep(0.2)
                goal.text = "reached"
                return {"result": 1}
            await asyncio.sleep(0.1 if number == 2 else SECONDS)
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

    async def tell(what, goal):
        feedback = [message.feedback async for message in goal]
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

    await tell("succeeds", client.send(TestGoal(1)))
    await tell("aborts", client.send(TestGoal(2)))
    goal = client.send(TestGoal(3))
    await until_active(goal)
    goal.cancel()
    await tell("cancelled", goal)
    await until_active(client.send(TestGoal(3)))
    await tell("after another", client.send(TestGoal(1)))
    goal = client.send(TestGoal(3))
    await until_active(goal)
    client.cancel_all()
    await tell("all cancelled", goal)
    goal = client.send(TestGoal(3))
    await until_active(goal)
    cancels = node.advertise("interop_action/cancel", GoalID)
    await cancels.publish(stamp=node.now())
    await tell("cancelled by time", goal)
    async with client.send(TestGoal(3)) as goal:
        await asyncio.wait([asyncio.ensure_future(goal._result())], timeout=0.3)
    try:
        await goal
    except GoalError as error:
        say("out of time", error.state.name)
    try:
        await client.send(TestGoal(2))
    except GoalError as error:
        say("in time", error.state.name)
    await client.close()


async def main():
    async with Node("action_peer", anonymous=True) as node:
        await {"serve": serve, "ask": ask}[sys.argv[1]](node)


asyncio.run(main())
