"""Cells in a notebook: the kernel's event loop runs in the main thread, and an interrupt ends a cell, not the kernel.

The tests need no IPython kernel, because they imitate its handling of signals and of the loop.
"""

from __future__ import annotations

import subprocess
import sys

KERNEL = """
import asyncio, os, signal, sys, threading, time

def interrupt(function):
    "Press Ctrl-C while the cell waits in this function of minirospy: spin() takes no interrupt that comes before."
    names = set()
    while not (names & {"threading.wait", "minirospy.base.clock.wait"} and function in names):
        time.sleep(0.01)
        frame, names = sys._current_frames()[threading.main_thread().ident], set()
        while frame:
            names.add(frame.f_globals["__name__"] + "." + frame.f_code.co_name)
            frame = frame.f_back
    os.kill(os.getpid(), signal.SIGINT)

def cell(code, interrupted=None):
    "Blocking code in the loop's thread, with Python's own handler for Ctrl-C, as ipykernel runs a cell."
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        if interrupted:
            threading.Thread(target=interrupt, args=[interrupted]).start()
        print(eval(code, globals()), flush=True)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
    finally:
        signal.signal(signal.SIGINT, before)

async def kernel():
    import rospy
    from minirospy import Node
    from std_msgs.msg import String
    globals().update(rospy=rospy, String=String, got=[])
    cell("rospy.init_node('notebook')")
    cell("rospy.Subscriber('/t', String, lambda message: got.append(message.data)) and None")
    cell("globals().update(p=rospy.Publisher('/t', String, queue_size=1)) or p.wait_for_subscribers(timeout=30)")
    cell("rospy.sleep(30)", interrupted="minirospy.client.time.sleep")
    cell("rospy.wait_for_message('/none', String)", interrupted="minirospy.client.subscriber.wait_for_message")
    cell("rospy.wait_for_service('/none')", interrupted="minirospy.client.service_proxy.wait_for_service")
    cell("rospy.Rate(0.01).sleep()", interrupted="minirospy.client.time.sleep")
    cell("rospy.is_shutdown(), p.publish('still here')")
    async with Node("cells") as node:
        publisher = await node.advertise("/async", String, latch=True)
        await publisher.publish("from a cell")
        async with Node("others") as others:
            print((await others.wait_for_message("/async", String, timeout=30)).data)
    while not got:
        await asyncio.sleep(0.01)
    cell("rospy.spin()", interrupted="minirospy.base.clock.wait_for_event")
    cell("rospy.is_shutdown(), got")
    await asyncio.sleep(0.01)
    print("the kernel goes on")

asyncio.run(kernel())
"""


def test_interrupts_end_cells_and_not_the_kernel(master: str) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", KERNEL], capture_output=True, text=True, timeout=200, check=False
    )
    assert ended.stdout.splitlines() == [
        "None",
        "None",
        "True",
        *["interrupted"] * 4,
        "(False, None)",
        "from a cell",
        # Real rospy's spin also handles the interrupt, and shuts down.
        "None",
        "(True, ['still here'])",
        "the kernel goes on",
    ], ended.stderr
