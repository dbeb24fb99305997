"""Actions for asyncio programs: the counterparts of SimpleActionClient and SimpleActionServer, on a `minirospy.Node`.

::

    async with ActionClient(node, "run_led", runningLedAction) as client:
        goal = client.send(runningLedGoal(numberOfRuns=3))
        async for feedback in goal:
            print(feedback.currentRun)
        print((await goal).finalRun)

::

    async def execute(goal):
        for run in range(goal.request.numberOfRuns):
            await goal.publish_feedback(currentRun=run)
            await node.sleep(0.5)
        return {"finalRun": goal.request.numberOfRuns}

    async with ActionServer(node, "run_led", runningLedAction, execute):
        await node.spin()

Both are wire-compatible with actionlib. The state transitions are in `minirospy.core.graph.goals`. Source:
http://wiki.ros.org/actionlib/DetailedDescription. Examples: docs/actions.md.
"""

from __future__ import annotations

from minirospy.ros.actionlib.actionlib.aio.client import ActionClient, ClientGoal
from minirospy.ros.actionlib.actionlib.aio.common import ActionClass, GoalError
from minirospy.ros.actionlib.actionlib.aio.server import ActionServer, ServerGoal

__all__ = ["ActionClass", "ActionClient", "ActionServer", "ClientGoal", "GoalError", "ServerGoal"]
