"""States and servers of smach_ros. Runs under the real package, too; its output is ros_states.txt."""

import re
import threading

import actionlib
import rospy
import smach
from actionlib_msgs.msg import GoalStatus
from actionlib_tutorials.msg import FibonacciAction, FibonacciFeedback, FibonacciGoal, FibonacciResult
from rospy_tutorials.srv import AddTwoInts, AddTwoIntsRequest
from smach_msgs.msg import SmachContainerStatus, SmachContainerStructure
from smach_ros import (
    ActionServerWrapper,
    ConditionState,
    IntrospectionClient,
    IntrospectionServer,
    MonitorState,
    ServiceState,
    SimpleActionState,
)
from std_msgs.msg import Int32

rospy.init_node("smach_states", log_level=rospy.WARN)
pause = threading.Event()


def say(*words):
    print(*words, flush=True)


def logger(level):
    def log(text, *more):
        lines = [
            line for line in str(text).splitlines() if not line.startswith(("  File", "    ", "Traceback"))
        ]
        text = re.sub(r"KeyError.*", "KeyError", " / ".join(lines))
        text = re.sub(r"<function .*?>|<.*? at 0x\w+>", "<object>", text)
        text = re.sub(r"'[^\[\]()]*'(?=,?[\])])", lambda names: ", ".join(sorted(names[0].split(", "))), text)
        if "Still waiting for action server" not in text and "Connected to action server" not in text:
            say(f"[{level}]", text)

    return log


smach.set_loggers(logger("info"), logger("warn"), lambda text: None, logger("error"))


def run(state, **values):
    """Run a state in a state machine; return its outcome, and the userdata."""
    sm = smach.StateMachine(state.get_registered_outcomes())
    for key, value in values.items():
        sm.userdata[key] = value
    with sm:
        smach.StateMachine.add("S", state)
    outcome = sm.execute()
    return outcome, [(key, str(sm.userdata[key]).replace("\n", " ")) for key in sorted(sm.userdata.keys())]


def attempt(label, call):
    try:
        result = call()
    except Exception as error:  # noqa: BLE001 - any error is printed
        say(label, "raises", type(error).__name__)
    else:
        say(label, "gives", result)


# Services.
def add(request):
    if request.a < 0:
        raise rospy.ServiceException("negative")
    return request.a + request.b


service = rospy.Service("add", AddTwoInts, add)
say(run(ServiceState("add", AddTwoInts)))
say(run(ServiceState("add", AddTwoInts, AddTwoIntsRequest(2, 3), response_slots=["sum"])))
say(run(ServiceState("add", AddTwoInts, request_slots=["a", "b"], response_key="answer"), a=4, b=5))
say(
    run(
        ServiceState("add", AddTwoInts, request_key="req", response_slots=["sum"]),
        req=AddTwoIntsRequest(6, 7),
    )
)
say(run(ServiceState("add", AddTwoInts, AddTwoIntsRequest(-1, 0))))
say(run(ServiceState("add", AddTwoInts, request_slots=["a", "b"]), a=4))
say(run(ServiceState("add", AddTwoInts, request_key="req")))


@smach.cb_interface(input_keys=["first"], output_keys=["asked"])
def make_request(userdata, request, second):
    request.a, request.b = userdata.first, second
    userdata.asked = True


@smach.cb_interface(outcomes=["large"], output_keys=["sum"])
def take_response(userdata, response, limit=0):
    userdata.sum = response.sum
    return "large" if response.sum > limit else None


for limit in (10, 100):
    state = ServiceState(
        "add",
        AddTwoInts,
        request_cb=make_request,
        request_cb_args=[20],
        response_cb=take_response,
        response_cb_kwargs={"limit": limit},
    )
    say(
        sorted(state.get_registered_outcomes()),
        sorted(state.get_registered_input_keys()),
        run(state, first=5),
    )
say(run(ServiceState("add", AddTwoInts, response_cb=lambda userdata, response: "unknown")))
say(run(ServiceState("add", AddTwoInts, request_cb=lambda userdata, request: 1 / 0)))
say(run(ServiceState("add", AddTwoInts, response_cb=lambda userdata, response: 1 / 0)))
attempt("no callback", lambda: ServiceState("add", AddTwoInts, request_cb=5))
attempt("no callback", lambda: ServiceState("add", AddTwoInts, response_cb=5))


# Conditions.
class Counter:
    count = 0

    def reaches(self, number):
        def check(userdata):
            self.count += 1
            return self.count >= number

        return check


fast = rospy.Duration(0.01)
for number, checks in ((1, 1), (2, 1), (3, 1), (3, 4), (20, -1)):
    counter = Counter()
    say(
        "condition",
        run(ConditionState(counter.reaches(number), poll_rate=fast, max_checks=checks)),
        counter.count,
    )
say(run(ConditionState(lambda ud: ud.x == 3, ["x"]), x=3))
say(run(ConditionState(lambda ud: False, poll_rate=fast, timeout=rospy.Duration(0.1), max_checks=-1)))
attempt("condition raises", lambda: run(ConditionState(lambda ud: 1 / 0)))

# Topics.
numbers = rospy.Publisher("numbers", Int32, queue_size=50)


def count_up():
    number = 0
    while not pause.wait(0.02) and not rospy.is_shutdown():
        if numbers.get_num_connections():
            numbers.publish(number)
            number += 1


counting = threading.Thread(target=count_up, daemon=True)
counting.start()
say("monitor", run(MonitorState("numbers", Int32, lambda ud, msg: True, 3)))
say("monitor", run(MonitorState("numbers", Int32, lambda ud, msg: False)))
say(
    "monitor",
    run(
        MonitorState(
            "numbers", Int32, lambda ud, msg: ud.seen.append(1) or len(ud.seen) < 4, input_keys=["seen"]
        ),
        seen=[],
    )[0],
)
say("monitor", run(MonitorState("numbers", Int32, lambda ud, msg: 1 / 0, 1)))
monitor = MonitorState("numbers", Int32, lambda ud, msg: True)
threading.Timer(0.3, monitor.request_preempt).start()
say("monitor", run(monitor), monitor.preempt_requested())
condition = ConditionState(lambda ud: False)
condition.request_preempt()
say("condition", run(condition))


# Actions.
def fibonacci(goal):
    feedback = FibonacciFeedback(sequence=[0, 1])
    server.publish_feedback(feedback)
    if goal.order < 0:
        server.set_aborted(FibonacciResult([goal.order]))
        return
    waited = 0
    while goal.order > 50 and waited < 10_000:
        waited += 1
        if server.is_preempt_requested():
            server.set_preempted(FibonacciResult([99]))
            return
        threading.Event().wait(0.01)
    server.set_succeeded(FibonacciResult(list(range(goal.order))))


server = actionlib.SimpleActionServer("fibonacci", FibonacciAction, fibonacci, auto_start=False)
server.start()


def action(*args, **kwargs):
    return SimpleActionState("fibonacci", FibonacciAction, *args, **kwargs)


say(run(action()))
say(run(action(FibonacciGoal(3), result_slots=["sequence"])))
say(run(action(goal_key="goal", result_key="result"), goal=FibonacciGoal(2)))
say(run(action(goal_slots=["order"], result_slots=["sequence"]), order=4))
say(run(action(FibonacciGoal(-2), result_slots=["sequence"])))
say(run(action(goal_cb=lambda userdata, goal: FibonacciGoal(1), result_slots=["sequence"])))


@smach.cb_interface(outcomes=["short"], input_keys=["limit"], output_keys=["length"])
def take_result(userdata, status, result):
    say("result", status == GoalStatus.SUCCEEDED, result.sequence)
    userdata.length = len(result.sequence)
    return "short" if userdata.length < userdata.limit else None


class Both:
    length = 0


attempt("output key read", lambda: run(action(FibonacciGoal(2), result_cb=take_result), limit=5))
say(run(action(FibonacciGoal(2), result_cb=lambda userdata, status, result: "unknown")))
say(run(action(FibonacciGoal(2), result_cb=lambda userdata, status, result: 1 / 0)))
say(run(action(goal_cb=lambda userdata, goal: 1 / 0)))
say(run(action(FibonacciGoal(2), outcomes=["odd"], result_cb=lambda userdata, status, result: "odd")))
attempt("missing key", lambda: run(action(goal_key="goal")))
attempt("no goal", lambda: action(lambda: 5))
attempt("no callback", lambda: action(goal_cb=5))
attempt("no callback", lambda: action(result_cb=5))
attempt("no slot", lambda: action(goal_slots=["nothing"]))
attempt("no slot", lambda: action(result_slots=["nothing"]))
long = action(FibonacciGoal(60))
threading.Timer(0.5, long.request_preempt).start()
say(run(long), long.preempt_requested())
say(run(action(FibonacciGoal(60), exec_timeout=rospy.Duration(0.3))))
absent = SimpleActionState("absent", FibonacciAction, server_wait_timeout=rospy.Duration(0.5))
say(run(absent))

# A container as an action server.
wrapped = smach.StateMachine(
    ["done", "failed", "preempted"], ["action_goal", "order"], ["action_result", "sequence"]
)


works = threading.Event()


def work(ud):
    say("goal", ud.action_goal.order, ud.order)
    # The client must know its goal before the result arrives.
    while client.gh is None:
        threading.Event().wait(0.01)
    if ud.order > 50:
        works.set()
    ud.sequence = [ud.order]
    for _ in range(5000 if ud.order > 50 else 0):
        if worker.preempt_requested():
            worker.service_preempt()
            return "preempted"
        threading.Event().wait(0.02)
    if ud.order < -5:
        raise ValueError("much too low")
    return "done" if ud.order >= 0 else "failed"


worker = smach.CBState(
    work,
    outcomes=["done", "failed", "preempted"],
    input_keys=["action_goal", "order"],
    output_keys=["sequence"],
)
with wrapped:
    smach.StateMachine.add("WORK", worker)
wrapper = ActionServerWrapper(
    "wrapped",
    FibonacciAction,
    wrapped,
    ["done"],
    ["failed"],
    ["preempted"],
    expand_goal_slots=True,
    pack_result_slots=True,
)
wrapper.run_server()
client = actionlib.SimpleActionClient("wrapped", FibonacciAction)
say("wrapped", client.wait_for_server(rospy.Duration(60)))
for order in (5, -1, -9):
    state = client.send_goal_and_wait(FibonacciGoal(order), rospy.Duration(60))
    say("wrapped", order, state, client.get_result().sequence)
client.send_goal(FibonacciGoal(70))
works.wait(60)
# A goal that is canceled before it is acknowledged is lost if a list of statuses was sent before the goal arrived.
while client.get_state() != GoalStatus.ACTIVE:
    pause.wait(0.01)
client.cancel_goal()
say("wrapped", client.wait_for_result(rospy.Duration(60)), client.get_state(), client.get_result().sequence)

# Introspection: the published messages, and a container that is started at another state.
inner = smach.Concurrence(["both"], "both", outcome_map={"both": {"L": "ok"}})
with inner:
    smach.Concurrence.add("L", smach.CBState(lambda ud: "ok", outcomes=["ok"]))
sm = smach.StateMachine(["done"])
sm.userdata.number, sm.userdata.stamp = 7, rospy.Time(3, 4)
with sm:
    smach.StateMachine.add("FIRST", smach.CBState(lambda ud: "go", outcomes=["go"]), {"go": "INNER"})
    smach.StateMachine.add("INNER", inner, {"both": "LAST"})
    smach.StateMachine.add("LAST", smach.CBState(lambda ud: "done", outcomes=["done"]))
found = {}


def structure(message):
    found.setdefault("structure " + message.path, message)


def status(message):
    found[
        f"status {message.path} {message.info.split()[0]} {message.initial_states} {message.active_states}"
    ] = message


subscribers = [
    rospy.Subscriber("viewed/smach/container_structure", SmachContainerStructure, structure),
    rospy.Subscriber("viewed/smach/container_status", SmachContainerStatus, status),
]
viewed = IntrospectionServer("viewed", sm, "/SM_ROOT")
viewed.start()


def wait_for(*keys):
    for _ in range(1000):
        # Compare whole words: "/SM_ROOT" is not "/SM_ROOT/INNER".
        if all(any(f"{each} ".startswith(f"{key} ") for each in found) for key in keys):
            return True
        pause.wait(0.02)
    return sorted(found)


say(wait_for("structure /SM_ROOT", "structure /SM_ROOT/INNER", "status /SM_ROOT HEARTBEAT"))
for name in ("structure /SM_ROOT", "structure /SM_ROOT/INNER"):
    message = found[name]
    edges = sorted(zip(message.internal_outcomes, message.outcomes_from, message.outcomes_to, strict=True))
    say(name, message.children, edges, message.container_outcomes)
say(IntrospectionClient().get_servers(), sorted(smach.UserData().keys()))
values = smach.UserData()
values.number, values.more = 8, {"a": [1, 2.5, "x"]}
say(IntrospectionClient().set_initial_state("viewed", "/SM_ROOT", ["LAST"], values, rospy.Duration(15)))
say(sm.get_initial_states(), sm.userdata.number, sm.userdata.more, sm.userdata.stamp)
say(sm.execute())
viewed.stop()
pause.set()
rospy.signal_shutdown("done")
