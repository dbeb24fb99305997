"""Outcomes and log lines of smach's containers, without ROS. Runs under the real package, too; its output is containers.txt."""

import re
import threading

import smach


def say(*words):
    print(*words, flush=True)


def logger(level):
    def log(text):
        lines = [
            line for line in str(text).splitlines() if not line.startswith(("  File", "    ", "Traceback"))
        ]
        text = re.sub(r"<[\w.]+\.(\w+ object) at 0x\w+>", r"<\1>", " / ".join(lines))
        # Sets have no order.
        text = re.sub(r"'[^\[\]()]*'(?=,?[\])])", lambda names: ", ".join(sorted(names[0].split(", "))), text)
        say(f"[{level}]", text.replace("\t", " "))

    return log


smach.set_loggers(logger("info"), logger("warn"), lambda text: None, logger("error"))


def attempt(label, call):
    try:
        result = call()
    except Exception as error:  # noqa: BLE001 - any error is printed
        say(label, "raises", type(error).__name__)
    else:
        say(label, "gives", result)


class Step(smach.State):
    """Returns its outcomes one after the other, and adds its name to the userdata."""

    def __init__(self, name, *results, preempts=False):
        smach.State.__init__(self, sorted({*results, "preempted"}), ["trace"], ["trace"])
        self.name, self.results, self.preempts = name, list(results), preempts

    def __str__(self):
        return f"Step {self.name}"

    def execute(self, ud):
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        ud.trace = [*ud.trace, self.name]
        return self.results.pop(0)


def machine(outcomes=("done", "failed", "preempted"), **kwargs):
    made = smach.StateMachine(list(outcomes), **kwargs)
    made.userdata.trace = []
    return made


# A state machine with a loop and an outcome that is passed through.
sm = machine()
with sm:
    smach.StateMachine.add("A", Step("a", "next", "next", "next"), {"next": "B", "preempted": "preempted"})
    smach.StateMachine.add("B", Step("b", "again", "again", "done"), {"again": "A"})
say(
    sm.get_initial_states(),
    sm.get_active_states(),
    sorted(sm.get_internal_edges(), key=str),
    list(sm.get_children()),
)
say(sm.execute(), sm.userdata.trace, sm.is_running(), sm.get_active_states())
attempt("no such state", lambda: sm["C"])
say(sm["A"])

# Callbacks.
sm = machine()
with sm:
    smach.StateMachine.add("A", Step("a", "next"), {"next": "B"})
    smach.StateMachine.add("B", Step("b", "done"))
sm.register_start_cb(lambda ud, states, more: say("start", ud.trace, states, more), [5])
sm.register_transition_cb(lambda ud, states: say("transition", ud.trace, states))
sm.register_termination_cb(lambda ud, states, outcome: say("end", ud.trace, states, outcome))
sm.register_termination_cb(lambda *arguments: 1 / 0)
say(sm.execute())


# Userdata: remapped, read-only, not declared.
class Thing:
    value = 1


def reads(ud):
    say("sees", ud.number, ud["number"], "number" in ud, "other" in ud, ud.keys())
    ud.result = ud.number + 1
    ud.other = 7
    ud["another"] = 8
    return "ok"


def undeclared(ud):
    return ud.secret


sm = smach.StateMachine(["ok"], ["first"], ["last", "absent"])
with sm:
    smach.StateMachine.add(
        "READ",
        smach.CBState(reads, outcomes=["ok"], input_keys=["number"], output_keys=["result"]),
        {"ok": "CONSTANT"},
        {"number": "first", "result": "last"},
    )
    smach.StateMachine.add(
        "CONSTANT",
        smach.CBState(lambda ud: say("constant", ud.number) or "ok", outcomes=["ok"], input_keys=["number"]),
        constants={"number": 12},
    )
parent = smach.UserData()
parent.first = 41
say(sm.execute(parent), parent.last, sorted(parent.keys()))
parent = smach.UserData()
attempt("nothing to read", lambda: sm.execute(parent))

sm = smach.StateMachine(["ok"])
with sm:
    smach.StateMachine.add("X", smach.CBState(undeclared, outcomes=["ok"]))
attempt("undeclared key", sm.execute)

data = smach.UserData()
data.thing, data.list = Thing(), [1, 2]
seen = smach.Remapper(data, ["thing", "list"], [], {})
say(seen.thing.value, seen.list is data.list, type(seen.thing).__name__, isinstance(seen.thing, Thing))
writable = smach.Remapper(data, ["thing"], ["thing"], {})
say(writable.thing is data.thing)
attempt("missing key", lambda: data.nothing)
attempt("missing item", lambda: data["nothing"])
other = smach.UserData()
other.update(data)
say(sorted(other.keys()), "list" in other)
taken = data.extract(["list"], {"mine": "list"})
say(taken.keys(), taken.mine == data.list, taken.mine is data.list)
other.merge(taken, ["mine"], {"mine": "back"})
say(sorted(other.keys()))


@smach.cb_interface(outcomes=["odd"], input_keys=["x"], output_keys=["y"])
def declared(ud, add):
    ud.y = ud.x + add
    return "odd"


state = smach.CBState(declared, [4])
say(state.get_registered_outcomes(), state.get_registered_input_keys(), state.get_registered_output_keys())
say(smach.has_smach_interface(declared), smach.has_smach_interface(len), smach.has_smach_interface(state))
sm = smach.StateMachine(["odd"])
sm.userdata.x = 3
with sm:
    smach.StateMachine.add("D", state)
say(sm.execute(), sm.userdata.y)


# Invalid containers.
def construct(build, outcomes=("done",)):
    def call():
        made = machine(outcomes)
        with made:
            build()
        return made.execute()

    return call


add = smach.StateMachine.add
attempt("closed", lambda: add("A", Step("a", "done")))
attempt("empty", construct(lambda: None))
attempt("unknown target", construct(lambda: add("A", smach.CBState(len, outcomes=["x"]), {"x": "NOWHERE"})))
attempt("unknown outcome of the machine", construct(lambda: add("A", smach.CBState(len, outcomes=["x"]))))
attempt("twice", construct(lambda: [add("A", smach.CBState(len, outcomes=["done"])) for _ in range(2)]))
attempt(
    "transition of nothing", construct(lambda: add("A", smach.CBState(len, outcomes=["x"]), {"y": "done"}))
)
attempt("outcome of nothing", construct(lambda: add("A", smach.CBState(lambda ud: "z", outcomes=["done"]))))
attempt("raises", construct(lambda: add("A", smach.CBState(lambda ud: 1 / 0, outcomes=["done"]))))
attempt("base class", construct(lambda: add("A", smach.State(outcomes=["done"]))))

# Sequences.
sq = smach.Sequence(["ok", "no"], "ok")
sq.userdata.trace = []
with sq:
    smach.Sequence.add("ONE", smach.CBState(lambda ud: "ok", outcomes=["ok", "no"]))
    smach.Sequence.add(
        "TWO", smach.CBState(lambda ud: "ok", outcomes=["ok", "skip"]), {"ok": "FOUR", "skip": "no"}
    )
    smach.Sequence.add("THREE", smach.CBState(lambda ud: "no", outcomes=["ok", "no"]))
    smach.Sequence.add("FOUR", smach.CBState(lambda ud: "ok", outcomes=["ok"]))
say(sorted(sq.get_internal_edges(), key=str))
say(sq.execute())

sm = machine(["done"])
with sm:
    smach.StateMachine.add_auto("A", smach.CBState(lambda ud: "x", outcomes=["x"]), ["x"])
    smach.StateMachine.add("B", smach.CBState(lambda ud: "done", outcomes=["done"]))
    attempt(
        "connector", lambda: smach.StateMachine.add_auto("C", smach.CBState(len, outcomes=["done"]), ["y"])
    )
say(sm.execute())

# Iterators in a state machine.
it = smach.Iterator(["broken", "exhausted"], ["limit"], ["seen"], lambda: range(1, 5), "number", "exhausted")
it.userdata.seen = []


def look(ud):
    ud.seen = [*ud.seen, ud.number]
    return "big" if ud.number > ud.limit else "small"


with it:
    smach.Iterator.set_contained_state(
        "LOOK",
        smach.CBState(
            look, outcomes=["big", "small"], input_keys=["number", "seen", "limit"], output_keys=["seen"]
        ),
        loop_outcomes=["small"],
        final_outcome_map={"big": "broken"},
    )
say(
    list(it.get_children()),
    it.get_initial_states(),
    it.get_active_states(),
    [tuple(e) for e in it.get_internal_edges()],
)
for limit in (2, 9):
    parent = smach.UserData()
    parent.limit = limit
    it.userdata.seen = []
    it._items = [1, 2, 3, 4]
    say(it.execute(parent), parent.seen)
attempt("other state", lambda: it["NONE"])
attempt("other start", lambda: it.set_initial_state(["NONE"], smach.UserData()))


# Concurrences. The states wait for each other with events, so that their order is deterministic.
def concurrence(results, **kwargs):
    """Return a container whose states finish in order."""
    cc = smach.Concurrence(["done", "both", "left", "preempted"], "done", **kwargs)
    turns = [threading.Event() for _ in range(len(results) + 1)]
    turns[0].set()

    def runner(number, result):
        def run(ud):
            turns[number].wait(60)
            ud.out = number
            return result

        return run

    def after(outcomes):
        turns[sum(value is not None for value in outcomes.values())].set()
        return False

    kwargs.setdefault("child_termination_cb", after)
    cc._child_termination_cb = kwargs["child_termination_cb"]
    with cc:
        for number, (label, result) in enumerate(results):
            smach.Concurrence.add(
                label,
                smach.CBState(runner(number, result), outcomes=["yes", "no"], output_keys=["out"]),
                {"out": f"out_{label}"},
            )
    return cc


maps = {"left": {"L": "yes"}, "both": {"L": "yes", "R": "yes"}}
for left, right in (("yes", "yes"), ("yes", "no"), ("no", "yes")):
    cc = concurrence([("L", left), ("R", right)], outcome_map=maps)
    say(cc.execute())
    keys = sorted(cc.userdata.keys())
    say(keys, [cc.userdata[key] for key in keys], cc.get_active_states())
say(sorted(cc.get_internal_edges()), cc.get_initial_states(), list(cc.get_children()))
for chosen in ("left", None):
    cc = concurrence(
        [("L", "yes"), ("R", "no")], outcome_cb=lambda outcomes, chosen=chosen: say(outcomes) or chosen
    )
    say(cc.execute())


slow_runs = threading.Event()


def waits(state):
    def run(ud):
        slow_runs.set()
        for _ in range(500):
            if state[0].preempt_requested():
                state[0].service_preempt()
                return "stopped"
            threading.Event().wait(0.02)
        return "late"

    return run


def waiting():
    holder = []
    holder.append(smach.CBState(waits(holder), outcomes=["stopped", "late"]))
    return holder[0]


cc = smach.Concurrence(["done"], "done", child_termination_cb=lambda outcomes: True)
with cc:
    smach.Concurrence.add("QUICK", smach.CBState(lambda ud: "x", outcomes=["x"]))
    smach.Concurrence.add("SLOW", waiting())
say(cc.execute())
attempt("no states", smach.Concurrence(["a"], "a").execute)
attempt("no policy", lambda: smach.Concurrence(["a"], None))
attempt("wrong policy", lambda: smach.Concurrence(["a"], "b", outcome_map={"c": {}}, outcome_cb=5))

# Preempt a nested state machine while its state executes.
inner, outer = smach.StateMachine(["stopped", "late"]), smach.StateMachine(["stopped", "late"])
slow = waiting()
with inner:
    smach.StateMachine.add("SLOW", slow)
with outer:
    smach.StateMachine.add("INNER", inner)
results = []
thread = threading.Thread(target=lambda: results.append(outer.execute()))
slow_runs.clear()
thread.start()
slow_runs.wait()
outer.request_preempt()
thread.join()
say(results, outer.preempt_requested(), inner.preempt_requested(), slow.preempt_requested())

# A preempt request before the start reaches the first state.
sm = machine(["done", "preempted"])
with sm:
    smach.StateMachine.add("A", Step("a", "done"))
sm.request_preempt()
say(sm.execute(), sm.preempt_requested())

# Start at another state.
sm = machine(["done", "preempted"])
with sm:
    smach.StateMachine.add("A", Step("a", "done"))
    smach.StateMachine.add("B", Step("b", "done"))
more = smach.UserData()
more.extra = 1
sm.set_initial_state(["B", "A"], more)
say(sm.execute(), sm.userdata.trace, sm.userdata.extra)
