"""What is not ours on the other side of the example `foxglove_rover`: a client of `websockets`, and ROS's own reader of messages.

`judge.py ROVER LAYOUT`, with the program and the layout beside it. Each test starts a rover of its own, on a port that the system
chooses. Ends with 1 if something is not as it is to be."""

import asyncio
import contextlib
import importlib
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import time

import websockets
from judging import Program, check, end, free_port, python
from rclpy.serialization import deserialize_message

ROVER, LAYOUT = sys.argv[1], sys.argv[2]
RATE, SECONDS = 200, 8
PATIENCE = 20


class Rover(Program):
    def __init__(self, rights="parameters commands arm"):
        self.port = free_port()
        super().__init__(ROVER, "--port", str(self.port), "--rights", rights)

    def cpu_s(self):
        """Seconds of processor time so far."""
        with open(f"/proc/{self.process.pid}/stat") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Client:
    """A client, what is announced to it, and what comes."""

    async def open(self, rover, **more):
        url, end = f"ws://127.0.0.1:{rover.port}", time.monotonic() + PATIENCE
        while True:
            try:
                self.socket = await websockets.connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None, max_queue=None, **more)
                break
            except OSError:
                # It has not started yet.
                if time.monotonic() > end or rover.process.poll() is not None:
                    raise
                await asyncio.sleep(0.02)
        self.channels, self.services, self.messages, self.texts, self.results = {}, {}, [], [], []
        self.info = await self.text("serverInfo")
        await self.until(lambda: "/robot_description" in self.channels and "/sensor/base/imu" in self.channels)
        return self

    async def read(self):
        """The next message, into the list where it belongs."""
        message = await asyncio.wait_for(self.socket.recv(), PATIENCE)
        if isinstance(message, str):
            text = json.loads(message)
            for channel in text.get("channels", []):
                self.channels[channel["topic"]] = channel
            for service in text.get("services", []):
                self.services[service["name"]] = service
            self.texts.append(text)
        elif message[0] == 1:
            subscription, log_time = struct.unpack("<IQ", message[1:13])
            self.messages.append((subscription, log_time, message[13:]))
        else:
            length = struct.unpack("<I", message[9:13])[0]
            self.results.append(json.loads(message[13 + length:]))

    async def until(self, is_so):
        end = time.monotonic() + PATIENCE
        while not is_so() and time.monotonic() < end:
            await self.read()
        if not is_so():
            raise TimeoutError

    async def text(self, op):
        """The next text of that kind; those before it are forgotten."""
        while True:
            while self.texts:
                text = self.texts.pop(0)
                if text["op"] == op:
                    return text
            await self.read()

    async def send(self, **message):
        await self.socket.send(json.dumps(message))

    async def subscribe(self, topic, number):
        await self.until(lambda: topic in self.channels)
        await self.send(op="subscribe", subscriptions=[{"id": number, "channelId": self.channels[topic]["id"]}])

    async def set(self, name, value, number):
        """Sets a parameter, and returns the value that is answered, and the text of a status if there is one before."""
        await self.send(op="setParameters", parameters=[{"name": name, "type": "float64", "value": value}], id=number)
        status = ""
        while True:
            while not self.texts:
                await self.read()
            text = self.texts.pop(0)
            if text["op"] == "status":
                status = text["message"]
            if text["op"] == "parameterValues" and text.get("id") == number:
                return text["parameters"][0]["value"], status

    async def call(self, name, arguments):
        """The result of a service, or the text of its refusal."""
        request = struct.pack("<BIII", 2, self.services[name]["id"], 1, 4) + b"json" + arguments.encode()
        await self.socket.send(request)
        while not self.results:
            for text in self.texts:
                if text["op"] == "serviceCallFailure":
                    self.texts.remove(text)
                    return text["message"]
            await self.read()
        return self.results.pop()


def class_of(schema):
    """The class of ROS's message, `sensor_msgs/msg/Imu`."""
    package, _, name = schema.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


async def messages_arrive():
    with Rover() as rover:
        client = await Client().open(rover)
        topics = ["/sensor/base/imu", "/estimator/base/heading"]
        for number, topic in enumerate(topics):
            await client.subscribe(topic, number)
        count = RATE * SECONDS
        while sum(of == 0 for of, *_ in client.messages) < count:
            await client.read()
        kinds = [class_of(client.channels[topic]["schemaName"]) for topic in topics]
        read = [[(log, deserialize_message(data, kind)) for of, log, data in client.messages if of == number]
                for number, kind in enumerate(kinds)]
        counted = [imu.linear_acceleration.x for _, imu in read[0][:count]]
        check(f"{count} of {count} messages at {RATE} Hz, read by ROS", counted == [counted[0] + n for n in range(count)])
        stamps = [imu.header.stamp.sec * 10**9 + imu.header.stamp.nanosec == log for log, imu in read[0]]
        check("times are those of the headers, and of now", all(stamps) and abs(time.time_ns() - read[0][-1][0]) < 10**10)
        check("an estimate, read by ROS", len(read[1]) >= count - 1 and read[1][-1][1].header.frame_id == "world",
              read[1][-1][1].header.frame_id)


async def parameters_are_set_or_refused():
    with Rover() as rover:
        client = await Client().open(rover)
        check("capabilities", {"parameters", "services"} <= set(client.info["capabilities"]), client.info["capabilities"])
        value, status = await client.set("param/speed", 1.25, "a")
        check("a parameter is set", (value, status) == (1.25, ""), (value, status))
        value, status = await client.set("param/speed", 7.0, "b")
        check("a refused one echoes the old value and says why", value == 1.25 and "0.0..=1.5 m/s" in status, (value, status))


async def services_answer():
    with Rover() as rover:
        client = await Client().open(rover)
        await client.until(lambda: client.services)
        check("services", set(client.services) == {"/command/drive", "/arm", "/disarm"}, sorted(client.services))
        refused = await client.call("/command/drive", '{"distance": 2}')
        check("a command is refused while disarmed, with the reason", "disarmed" in str(refused), refused)
        await client.call("/arm", "")
        check("its result", await client.call("/command/drive", '{"distance": 2}') == 2.0)


async def nothing_is_writable_by_default():
    with Rover("") as rover:
        client = await Client().open(rover)
        await client.subscribe("/sensor/base/imu", 1)
        await client.until(lambda: len(client.messages) > 10)
        check("no parameters, and no service but to disarm, unless opted in", set(client.services) == {"/disarm"}
              and client.info["capabilities"] == ["services"], client.info["capabilities"])
        await client.send(op="setParameters", parameters=[{"name": "param/speed", "value": 1.0}], id="a")
        status = await client.text("status")
        check("a set is refused", status["level"] == 2, status["message"])


async def others_are_refused():
    with Rover() as rover:
        await Client().open(rover, origin="https://app.foxglove.dev")
        try:
            await Client().open(rover, origin="https://evil.example")
            check("a page of another site is refused", False)
        except websockets.InvalidStatus as refused:
            check("a page of another site is refused", refused.response.status_code == 403, refused.response.status_code)
        with socket.create_connection(("127.0.0.1", rover.port), PATIENCE) as plain:
            head = ["GET / HTTP/1.1", "Host: evil.example", "Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
                    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol: foxglove.sdk.v1", "", ""]
            plain.sendall("\r\n".join(head).encode())
            answer = plain.recv(1000).decode().splitlines()[0]
            check("another host name is refused", answer.startswith("HTTP/1.1 403 "), answer)


STOPPED = """
import json, sys, websockets.sync.client
with websockets.sync.client.connect(sys.argv[1], subprotocols=["foxglove.sdk.v1"], max_size=None) as client:
    seen = []
    while "/sensor/base/imu" not in seen:
        channels = json.loads(client.recv()).get("channels", [])
        seen += [channel["topic"] for channel in channels]
        found = [channel["id"] for channel in channels if channel["topic"] == "/sensor/base/imu"]
        if found:
            client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": found[0]}]}))
    print("subscribed", flush=True)
    while True:
        client.recv()
"""


async def a_stopped_and_a_killed_client_cost_nothing():
    with Rover() as rover:
        client = await Client().open(rover)
        await client.subscribe("/sensor/base/imu", 1)
        with contextlib.ExitStack() as stack:
            url = f"ws://127.0.0.1:{rover.port}"
            others = [stack.enter_context(python(STOPPED, url, stdout=subprocess.PIPE)).process for _ in range(4)]
            for other in others:
                other.stdout.readline()
            for other, kind in zip(others, [signal.SIGSTOP, signal.SIGSTOP, signal.SIGKILL, signal.SIGKILL]):
                other.send_signal(kind)
            client.messages.clear()
            while len(client.messages) < 3 * RATE:
                await client.read()
            imu = class_of("sensor_msgs/msg/Imu")
            counted = [deserialize_message(data, imu).linear_acceleration.x for _, _, data in client.messages]
            check("beside two stopped and two killed clients, another loses nothing", counted == [counted[0] + n for n in range(len(counted))])


def idle_costs_nothing():
    with Rover() as rover:
        time.sleep(1)
        before = rover.cpu_s()
        time.sleep(2)
        check("without a client, the rover takes less than a tenth of a core", rover.cpu_s() - before < 0.2, f"{rover.cpu_s() - before:.2f} s in 2 s")


async def the_layout_shows_what_is_there():
    """Every topic, parameter and service that the layout names is announced."""
    with open(LAYOUT) as file:
        layout = json.load(file)
    panels = layout["configById"]

    def named(place):
        return [place] if isinstance(place, str) else named(place["first"]) + named(place["second"])

    check("the layout places its panels", sorted(named(layout["layout"])) == sorted(panels))
    with Rover() as rover:
        client = await Client().open(rover)
        await client.until(lambda: client.services and "/estimator/base/heading" in client.channels)
        topics = [path["value"].split(".")[0] for path in panels["Plot!imu"]["paths"]]
        topics += [*panels["3D!rover"]["topics"], panels["RawMessages!heading"]["topicPath"]]
        check("its topics are there", set(topics) <= set(client.channels), sorted(set(topics)))
        check("its service is there", panels["CallService!drive"]["serviceName"] in client.services)


async def main():
    for test in [messages_arrive, parameters_are_set_or_refused, services_answer, nothing_is_writable_by_default, others_are_refused,
                 a_stopped_and_a_killed_client_cost_nothing, the_layout_shows_what_is_there]:
        await asyncio.wait_for(test(), 120)
    idle_costs_nothing()


asyncio.run(main())
end()
