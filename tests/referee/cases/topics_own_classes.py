"""A program's own subclasses of rospy's classes."""

import threading

import rospy
from referee import outcome, show
from std_msgs.msg import Int32
from std_srvs.srv import SetBool, SetBoolResponse


class Rate(rospy.Rate):
    def sleep(self):
        left = self._remaining(rospy.rostime.get_rostime())
        show(type(left).__name__, left.to_sec() <= 0.05)
        rospy.sleep(left)
        self.last_time = self.last_time + self.sleep_dur


class Timer(rospy.Timer):
    def __init__(self, name, period, callback, oneshot=False, reset=False):
        self.label = name
        super().__init__(period, callback, oneshot=oneshot, reset=reset)

    def run(self):
        rate = rospy.Rate(1.0 / self._period.to_sec(), reset=self._reset)
        expected = rospy.rostime.get_rostime() + self._period
        while not rospy.core.is_shutdown() and not self._shutdown:
            rate.sleep()
            if self._shutdown:
                break
            self._callback(rospy.timer.TimerEvent(None, None, expected, rospy.get_rostime(), None))
            if self._oneshot:
                break
            expected += self._period
        show(self.label, "is over")


class Subscriber(rospy.Subscriber):
    def __init__(self, topic):
        rospy.Subscriber.__init__(self, topic, Int32, self.take, queue_size=1)
        self.got = threading.Event()

    def take(self, message):
        show("got", message.data, self.name)
        self.got.set()


class Publisher(rospy.Publisher):
    def __init__(self, name, latch=False, headers=None, queue_size=None):
        rospy.Publisher.__init__(self, name, Int32, None, False, latch, headers, queue_size)

    def publish(self, *args, **kwds):
        show("publish", args, kwds)
        super().publish(*args, **kwds)


class Toggle(rospy.Service):
    def __init__(self, name, on, off, buff_size=65536, error_handler=None):
        super().__init__(name, SetBool, self.toggle, buff_size, error_handler)
        self.on, self.off = on, off

    def toggle(self, request):
        return SetBoolResponse((self.on if request.data else self.off)(), "done")


class Proxy(rospy.ServiceProxy):
    def __call__(self, *args, **kwds):
        show("calling", args, kwds)
        return super().__call__(*args, **kwds)


rospy.init_node("case", argv=[], disable_rosout=True)
rate = Rate(20)
for _ in range(2):
    rate.sleep()
ticked = threading.Event()
timer = Timer("first", rospy.Duration(0.05), lambda event: ticked.set())
show(ticked.wait(60))
timer.shutdown()
timer.join(60)
show(timer.is_alive(), timer._shutdown)
once = Timer("second", rospy.Duration(0.01), lambda event: show(type(event).__name__), oneshot=True)
once.join(60)
show(once._shutdown)
plain = rospy.Timer(rospy.Duration(0.01), lambda event: None)
show(plain._shutdown, plain._oneshot, plain._period, plain._reset)
plain._shutdown = True
plain.join(60)
show(plain.is_alive(), plain._shutdown)
subscriber, publisher = Subscriber("c"), Publisher("c", queue_size=1, latch=True)
publisher.publish(3)
show(subscriber.got.wait(60))
subscriber.got.clear()
publisher.publish(data=4)
show(subscriber.got.wait(60))
service = Toggle("toggle", lambda: True, lambda: False)
proxy = Proxy("toggle", SetBool)
show(proxy(True).success, proxy(data=False).success)
outcome("wrong", lambda: proxy(1, 2, 3))
