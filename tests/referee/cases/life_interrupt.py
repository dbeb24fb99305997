"""A shutdown ends the blocking calls of all threads."""

import threading

import rospy
from referee import show
from std_msgs.msg import Bool
from std_srvs.srv import Empty

rospy.init_node("case", argv=[])
results = {}
CALLS = {
    "spin": rospy.spin,
    "wait_for_service": lambda: rospy.wait_for_service("/nobody"),
    "wait_for_service, timeout": lambda: rospy.wait_for_service("/nobody", timeout=60),
    "proxy.wait_for_service": lambda: rospy.ServiceProxy("/nobody", Empty).wait_for_service(),
    "proxy.wait_for_service, timeout": lambda: rospy.ServiceProxy("/nobody", Empty).wait_for_service(60),
    "wait_for_message": lambda: rospy.wait_for_message("/nobody", Bool),
    "wait_for_message, timeout": lambda: rospy.wait_for_message("/nobody", Bool, timeout=60),
    "service.spin": rospy.Service("mine", Empty, lambda _: None).spin,
}


def work(label, call):
    begun.release()
    try:
        results[label] = ("gives", call())
    except rospy.ROSInterruptException as error:
        results[label] = ("raises", type(error).__name__, str(error))


begun = threading.Semaphore(0)
threads = [threading.Thread(target=work, args=item, daemon=True) for item in CALLS.items()]
for thread in threads:
    thread.start()
    begun.acquire()
rospy.sleep(0.3)
rospy.signal_shutdown("x")
for thread in threads:
    thread.join(60)
for label in CALLS:
    show(label, results.get(label))
