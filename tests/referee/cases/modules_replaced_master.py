# ruff: noqa: BLE001
"""rosgraph.Master's handle: every call goes through the object that a program puts there, and the values come back unchanged."""

import inspect

import rosgraph
from referee import outcome, show


class Handle:
    """Records each call, and answers with one response."""

    def __init__(self, response):
        self.response = response

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)

        def method(*args):
            show("called", name, args)
            if isinstance(self.response, Exception):
                raise self.response
            return self.response

        return method


master = rosgraph.Master("/tester/")
show(type(master.handle).__name__, master.caller_id)
show(repr(master.hasParam("/run_id")), repr(type(master.getPid())), repr(master.getTopicTypes() is not None))
master.handle = Handle([1, "", ("value", 1)])
for name, method in inspect.getmembers(rosgraph.Master, callable):
    if not name.startswith("_"):
        arguments = [f"/a{at}" for at in range(len(inspect.signature(method).parameters) - 1)]
        outcome(name, lambda n=name, a=arguments: getattr(master, n)(*a))

master.caller_id = "/other"
for response in (
    (0, "failed", 5),
    (-1, "wrong", 5),
    (2, "odd", 5),
    (True, "", "yes"),
    (1, None, None),
    (0, None, None),
    None,
    (1, "short"),
    "abc",
    OSError("no socket"),
    KeyError("odd"),
):
    master.handle = Handle(response)
    show("# response", repr(response))
    try:
        show(repr(master.getPid()))
    except Exception as error:
        show(type(error).__name__, str(error).replace(", got 2", ""))
    show(master.is_online())

show("# one method")
master = rosgraph.Master("/tester")
master.handle.getPid = lambda caller_id: (1, "", [caller_id])
show(master.getPid(), master.is_online())
outcome("another uri", lambda: master._reinit("nonsense"))
master._reinit("http://localhost:1")
show(master.master_uri, master.is_online())
outcome("succeed", lambda: master._succeed((1, "", 5)))
