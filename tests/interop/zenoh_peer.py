"""A ROS 2 node over Zenoh, based on pyzeros or zenoh-ros2-sdk: executes JSON lines from stdin, and prints the results.

Run as `zenoh_peer.py pyzeros tcp/127.0.0.1:7447` or `zenoh_peer.py sdk ...`, by a Python that has them. The operations are
those of ros2_peer.py: subscribe, publish, serve, call, close. The implementation's own code decodes and encodes the messages.
"""

import asyncio
import importlib
import json
import os
import sys
import threading
import time

SAYING = threading.Lock()


def say(op, **fields):
    with SAYING:
        print(json.dumps({"op": op, **fields}), flush=True)


class Pyzeros:
    """A node that converts messages with ros2_pyterfaces and cyclonedds-idl."""

    def __init__(self, endpoint):
        import pyzeros
        import zenoh

        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([endpoint]))
        self.pyzeros = pyzeros
        self.qos = importlib.import_module("pyzeros.qos").QosProfile
        self.raw = importlib.import_module("pyzeros.sub").RawSub
        self.node = pyzeros.Node(name="peer", session=zenoh.open(config))
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        self.clients = {}

    def close(self):
        self.node.session.close()

    @staticmethod
    def class_of(name, kind="msgs"):
        package, _, short = name.partition("/")
        found = getattr(importlib.import_module(f"ros2_pyterfaces.cyclone.all_{kind}"), short)
        assert found.get_type_name() == f"{package}/{kind[:3]}/{short}"
        return found

    def quality(self, command):
        reliability = "reliable" if command.get("reliable", True) else "best_effort"
        return self.qos(depth=command.get("depth", 100), reliability=reliability)

    def subscribe(self, topic, command):
        class_ = self.class_of(command["type"])

        def came(sample):
            message = class_.deserialize(sample.payload.to_bytes())
            say("message", topic=topic, data=bytes(message.serialize()).hex())

        return self.raw(class_, topic, came, qos_profile=self.quality(command), session=self.node, scope=None)

    def publish(self, topic, command):
        class_ = self.class_of(command["type"])
        publisher = self.pyzeros.Pub(
            class_, topic, qos_profile=self.quality(command), session=self.node, scope=None
        )
        message = class_.deserialize(bytes.fromhex(command["data"]))

        def publish():
            while not publisher.zenoh_pub.matching_status.matching:
                time.sleep(0.02)
            for _ in range(command.get("count", 1)):
                publisher.publish(message)

        threading.Thread(target=publish, daemon=True).start()
        return publisher

    def serve(self, topic, command):
        return self.on_loop(self._serve(topic, command))

    async def _serve(self, topic, command):
        class_ = self.class_of(command["type"], "srvs")
        server = self.pyzeros.Server(class_, topic, session=self.node, scope=None)

        async def answer():
            async for each in server.listen_reliable():
                if command.get("silent"):
                    continue
                for name, value in command["fields"].items():
                    first = vars(each.request)[next(iter(vars(each.request)))]
                    setattr(each.response, name, value.format(first) if isinstance(value, str) else value)
                each.send()

        server.answering = asyncio.ensure_future(answer())
        return server

    def call(self, topic, command):
        return self.on_loop(self._call(topic, command))

    async def _call(self, topic, command):
        class_ = self.class_of(command["type"], "srvs")
        client = self.pyzeros.Client(class_, topic, session=self.node, scope=None)

        async def call():
            await client.wait_for_service()
            for fields in command["fields"]:
                try:
                    response = await client.call_async(class_.Request(**fields))
                except RuntimeError as error:
                    say("answer", topic=topic, fields={"error": str(error)})
                    continue
                say("answer", topic=topic, fields=dict(vars(response)))

        client.calling = asyncio.ensure_future(call())
        return client

    def on_loop(self, work):
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(60)


class Sdk:
    """A node that converts messages with rosbags. It connects as a peer, as rmw_zenoh does."""

    TEXTS = {
        "std_msgs/String": "string data\n",
        "std_msgs/Int64": "int64 data\n",
        "std_srvs/SetBool": ("bool data\n", "bool success\nstring message\n"),
    }

    def __init__(self, endpoint):
        import zenoh_ros2_sdk

        self.sdk = zenoh_ros2_sdk
        host, _, port = endpoint.removeprefix("tcp/").rpartition(":")
        self.router = {"router_ip": host, "router_port": int(port), "node_name": "peer"}

    def close(self):
        pass

    def quality(self, command):
        qos = importlib.import_module("zenoh_ros2_sdk.qos")
        return qos.QosProfile(
            durability=qos.QosDurability.TRANSIENT_LOCAL
            if command.get("latched")
            else qos.QosDurability.VOLATILE,
            history_depth=command.get("depth", 10),
        )

    def subscribe(self, topic, command):
        type_ = command["type"]

        def came(message):
            say("message", topic=topic, value=message.data)

        return self.sdk.ROS2Subscriber(
            topic,
            type_.replace("/", "/msg/"),
            came,
            msg_definition=self.TEXTS[type_],
            qos=self.quality(command),
            **self.router,
        )

    def publish(self, topic, command):
        type_ = command["type"]
        publisher = self.sdk.ROS2Publisher(
            topic,
            type_.replace("/", "/msg/"),
            msg_definition=self.TEXTS[type_],
            qos=self.quality(command),
            **self.router,
        )

        def publish():
            while not publisher.pub.matching_status.matching:
                time.sleep(0.02)
            publisher.publish(data=command["value"])

        threading.Thread(target=publish, daemon=True).start()
        return publisher

    def serve(self, topic, command):
        request, response = self.TEXTS[command["type"]]

        def answer(asked):
            made = server.response_msg_class
            fields = command["fields"]
            return made(**{k: v.format(asked.data) if isinstance(v, str) else v for k, v in fields.items()})

        server = self.sdk.ROS2ServiceServer(
            topic,
            command["type"].replace("/", "/srv/"),
            answer,
            request_definition=request,
            response_definition=response,
            **self.router,
        )
        return server

    def call(self, topic, command):
        request, response = self.TEXTS[command["type"]]
        client = self.sdk.ROS2ServiceClient(
            topic,
            command["type"].replace("/", "/srv/"),
            request_definition=request,
            response_definition=response,
            timeout=60.0,
            **self.router,
        )

        def call():
            # The client does not wait for the service: it would wait its whole timeout for a response that no server
            # sends.
            while not client.querier.matching_status.matching:
                time.sleep(0.02)
            for fields in command["fields"]:
                found = client.call(**fields)
                say("answer", topic=topic, fields={"success": found.success, "message": found.message})

        threading.Thread(target=call, daemon=True).start()
        return client


def main():
    kind, endpoint = sys.argv[1:]
    peer = {"pyzeros": Pyzeros, "sdk": Sdk}[kind](endpoint)
    ends = {}
    say("ready")
    for line in sys.stdin:
        command = json.loads(line)
        op, topic = command["op"], command["topic"]
        if op == "close":
            for end in ends.pop(topic, []):
                end.close()
        else:
            ends.setdefault(topic, []).append(getattr(peer, op)(topic, command))
        say("done", of=op, topic=topic)
    peer.close()
    # Exit without waiting for the libraries' threads, which may still run.
    os._exit(0)


if __name__ == "__main__":
    main()
