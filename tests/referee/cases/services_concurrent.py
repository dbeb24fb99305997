"""Concurrent calls: each connection has a separate thread; slow handlers do not block others."""

import threading

import rospy
from referee import outcome, show
from std_srvs.srv import SetBool, SetBoolResponse, Trigger

rospy.init_node("case", argv=[])
gate = threading.Event()
inside = threading.Barrier(5)


def together(request):
    inside.wait(30)
    return SetBoolResponse(True, "all five were in")


service = rospy.Service("together", SetBool, together)
answers = []


def call():
    answers.append(rospy.ServiceProxy("together", SetBool)(True).message)


threads = [threading.Thread(target=call) for _ in range(5)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
show(answers)

one = rospy.ServiceProxy("together", SetBool)
answers.clear()
threads = [threading.Thread(target=lambda: answers.append(one(True).message)) for _ in range(5)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
show("one proxy, five threads", answers)


def slow(request):
    if request.data:
        gate.wait(30)
    return SetBoolResponse(request.data, "slow")


slow_service = rospy.Service("slow", SetBool, slow)
slow_answers = []
waiting = threading.Thread(
    target=lambda: slow_answers.append(rospy.ServiceProxy("slow", SetBool)(True).success)
)
waiting.start()
outcome("beside a slow call", lambda: rospy.ServiceProxy("slow", SetBool)(False))
show("the slow one waits", slow_answers)
gate.set()
waiting.join()
show("the slow one is done", slow_answers)


def nested(request):
    return SetBoolResponse(True, "nested: " + rospy.ServiceProxy("slow", SetBool)(False).message)


nested_service = rospy.Service("nested", SetBool, nested)
outcome("a handler that calls", lambda: rospy.ServiceProxy("nested", SetBool)(True))


def itself(request):
    if request.data:
        return SetBoolResponse(True, "inner: " + rospy.ServiceProxy("itself", SetBool)(False).message)
    return SetBoolResponse(False, "the end")


recursive = rospy.Service("itself", SetBool, itself)
outcome("a handler that calls its own service", lambda: rospy.ServiceProxy("itself", SetBool)(True))

handler_threads = []


def which(request):
    handler_threads.append(threading.current_thread())
    return [True, ""]


who = rospy.Service("who", Trigger, which)
persistent = rospy.ServiceProxy("who", Trigger, persistent=True)
for _ in range(3):
    persistent()
show("a persistent connection keeps its thread", len(set(handler_threads)) == 1)
show(
    "and it is not the main one", handler_threads[0] is not threading.main_thread(), handler_threads[0].daemon
)
many = [rospy.ServiceProxy("who", Trigger, persistent=True) for _ in range(20)]
show("many persistent ones", all(proxy().success for proxy in many))
for proxy in many:
    proxy.close()


class Offered:
    def __init__(self):
        self.count = 0
        self.service = rospy.Service("~count", Trigger, self.handle)

    def handle(self, request):
        self.count += 1
        return True, str(self.count)


offered = Offered()
proxy = rospy.ServiceProxy("~count", Trigger)
show([proxy().message for _ in range(3)])
big = rospy.Service("big", Trigger, lambda request: (True, "x" * 3000000))
show("a large response", len(rospy.ServiceProxy("big", Trigger)().message))
