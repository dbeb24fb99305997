"""A node of real ROS 2, run by a Python that has rclpy: executes JSON lines from stdin, and prints the results.

The argument is the node's name.

{"op": "subscribe", "topic": ..., "type": "std_msgs/String", "reliable": true, "latched": false}
{"op": "publish", "topic": ..., "type": ..., "data": hex of the CDR, "count": 1, "latched": false}: once a subscriber exists
{"op": "serve", "topic": ..., "type": ..., "fields": {...}}: a service that answers with these fields; {} in a string is
replaced by the request's first field; with "silent" it never answers
{"op": "call", "topic": ..., "type": ..., "fields": [{...}, ...]}: once the service exists; prints the answers in any order
{"op": "call_raw", "topic": ..., "type": ..., "data": hex of the CDR}: the same, with all fields
{"op": "declare", "topic": name of a parameter, "value": ...}
{"op": "act", "topic": ..., "type": ..., "waits": false}: a Fibonacci action server: rejects a negative order, aborts 13;
with "waits" each goal runs until it is cancelled
{"op": "goal", "topic": ..., "type": ..., "fields": {...}}: once the server exists; prints its feedback and result
{"op": "cancel", "topic": ...}: cancels the last goal
{"op": "close", "topic": ...}: closes its publisher, subscription, service, action and clients
"""

import concurrent.futures
import importlib
import json
import sys
import threading
import time
import traceback

import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future

SAYING = threading.Lock()


def profile(command):
    return QoSProfile(
        depth=command.get("depth", 100),
        reliability=ReliabilityPolicy.RELIABLE
        if command.get("reliable", True)
        else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if command.get("latched") else DurabilityPolicy.VOLATILE,
    )


def class_of(name, kind="msg"):
    package, _, short = name.partition("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), short)


def made(class_, fields):
    found = class_()
    types = class_.get_fields_and_field_types()
    for name, value in fields.items():
        base = types[name].removeprefix("sequence<").removesuffix(">")
        if isinstance(value, dict):
            setattr(found, name, made(class_of(base), value))
        elif isinstance(value, list) and "/" in base:
            setattr(found, name, [made(class_of(base), each) for each in value])
        else:
            setattr(found, name, value)
    return found


def fields_of(message):
    return {name: str(getattr(message, name)) for name in message.get_fields_and_field_types()}


def say(**fields):
    # Use a single write, because two threads print.
    with SAYING:
        print(json.dumps(fields), flush=True)


class Peer:
    """The node, with one method per operation, which receives the command."""

    def __init__(self):
        self.node = rclpy.create_node(*(sys.argv[1:] or ["peer"]), enable_rosout=False)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self.spin)
        self.thread.start()
        self.publishers, self.subscriptions, self.services, self.clients = {}, {}, {}, {}
        self.action_servers, self.action_clients, self.goals = {}, {}, {}

    def spin(self):
        try:
            self.executor.spin()
        except ExternalShutdownException:
            pass
        except Exception:  # noqa: BLE001 - whatever rclpy raises
            # Make a test that is waiting for a message fail now, not at its timeout.
            traceback.print_exc()
            say(op="ended")

    def in_executor(self, work):
        """Run a function in the executor's thread and return its result.

        The entities for which the executor waits are then not added or removed at the same time. rclpy shows an action to
        the executor before it is complete, and destroys it while the executor uses it.
        """
        done = concurrent.futures.Future()

        def run():
            try:
                done.set_result(work())
            except Exception as error:  # noqa: BLE001 - raised where it is waited for
                done.set_exception(error)

        self.executor.create_task(run)
        return done.result()

    def end(self):
        self.executor.shutdown()
        self.thread.join()
        self.node.destroy_node()

    def subscribe(self, topic, command):
        self.subscriptions[topic] = self.node.create_subscription(
            class_of(command["type"]),
            topic,
            lambda data: say(op="message", topic=topic, data=data.hex()),
            profile(command),
            raw=True,
        )

    def publish(self, topic, command):
        publisher = self.publishers.get(topic)
        if publisher is None:
            publisher = self.publishers[topic] = self.node.create_publisher(
                class_of(command["type"]), topic, profile(command)
            )
        while not command.get("latched") and not publisher.get_subscription_count():
            time.sleep(0.02)
        for _ in range(command.get("count", 1)):
            publisher.publish(bytes.fromhex(command["data"]))

    def serve(self, topic, command):
        async def answer(request, response):
            fields = fields_of(request)
            say(op="request", topic=topic, fields=fields)
            if command.get("silent"):
                await Future(executor=self.executor)
            for name, value in command["fields"].items():
                first = next(iter(fields.values()), "")
                setattr(response, name, value.format(first) if isinstance(value, str) else value)
            return response

        self.services[topic] = self.node.create_service(
            class_of(command["type"], "srv"), topic, answer, callback_group=ReentrantCallbackGroup()
        )

    def call(self, topic, command):
        class_ = class_of(command["type"], "srv").Request
        self.send(topic, command, [made(class_, each) for each in command["fields"]])

    def call_raw(self, topic, command):
        class_ = class_of(command["type"], "srv").Request
        self.send(topic, command, [deserialize_message(bytes.fromhex(command["data"]), class_)])

    def send(self, topic, command, requests):
        if topic not in self.clients:
            self.clients[topic] = self.node.create_client(
                class_of(command["type"], "srv"), topic, qos_profile=QoSProfile(depth=1000)
            )
        self.clients[topic].wait_for_service()

        def answered(future):
            response = future.result()
            say(op="answer", topic=topic, fields=fields_of(response), data=serialize_message(response).hex())

        for request in requests:
            self.clients[topic].call_async(request).add_done_callback(answered)

    def declare(self, name, command):
        self.node.declare_parameter(name, command["value"])

    async def pause(self):
        passed = Future(executor=self.executor)
        timer = self.node.create_timer(0.05, lambda: passed.set_result(None))
        await passed
        self.node.destroy_timer(timer)

    def act(self, topic, command):
        class_ = class_of(command["type"], "action")

        async def execute(handle):
            order = handle.request.order
            say(op="request", topic=topic, fields={"order": str(order)})
            result, feedback = class_.Result(), class_.Feedback()
            for number in range(order):
                result.sequence = [*result.sequence, number]
                feedback.sequence = result.sequence
                handle.publish_feedback(feedback)
            while command.get("waits") and not handle.is_cancel_requested:
                await self.pause()
            if handle.is_cancel_requested:
                handle.canceled()
            elif order == 13:
                handle.abort()
            else:
                handle.succeed()
            return result

        self.action_servers[topic] = self.in_executor(
            lambda: ActionServer(
                self.node,
                class_,
                topic,
                execute,
                goal_callback=lambda goal: GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT,
                cancel_callback=lambda _: CancelResponse.ACCEPT,
                callback_group=ReentrantCallbackGroup(),
            )
        )

    def goal(self, topic, command):
        class_ = class_of(command["type"], "action")
        if topic not in self.action_clients:
            self.action_clients[topic] = self.in_executor(lambda: ActionClient(self.node, class_, topic))
        client = self.action_clients[topic]
        client.wait_for_server()

        def feedback(message):
            say(op="feedback", topic=topic, data=list(message.feedback.sequence))

        def ended(future):
            response = future.result()
            say(op="end", topic=topic, status=response.status, data=list(response.result.sequence))

        def accepted(future):
            handle = self.goals[topic] = future.result()
            say(op="accepted", topic=topic, is_accepted=handle.accepted)
            if handle.accepted:
                handle.get_result_async().add_done_callback(ended)

        goal = made(class_.Goal, command["fields"])

        def send():
            client.send_goal_async(goal, feedback_callback=feedback).add_done_callback(accepted)

        # rclpy 9.1.2 records a goal twice, the second time after it has sent the goal. A response that the executor's
        # thread reads before that belongs to a future that nothing refers to, and the goal is never accepted.
        self.in_executor(send)

    def cancel(self, topic, _):
        self.in_executor(self.goals[topic].cancel_goal_async)

    def close(self, topic, _):
        self.in_executor(lambda: self.destroy(topic))

    def destroy(self, topic):
        for parts in (self.action_servers, self.action_clients):
            if topic in parts:
                parts.pop(topic).destroy()
        for parts, destroy in (
            (self.publishers, self.node.destroy_publisher),
            (self.subscriptions, self.node.destroy_subscription),
            (self.services, self.node.destroy_service),
            (self.clients, self.node.destroy_client),
        ):
            if topic in parts:
                destroy(parts.pop(topic))


def main():
    rclpy.init(args=[])
    peer = Peer()
    say(op="ready")
    for line in sys.stdin:
        command = json.loads(line)
        getattr(peer, command["op"])(command["topic"], command)
        say(op="done", of=command["op"], topic=command["topic"])
    peer.end()
    rclpy.try_shutdown()


main()
