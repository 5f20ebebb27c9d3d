"""What is not ours on the other side of the example `rover`: zenoh's own Python, and ROS's own readers and writers of messages.

`judge.py ROVER`, with the program. Each test starts a rover of its own, on a port of
the loopback device that the system chooses. Ends with 1 if something is not as it is to be."""

import contextlib
import importlib.util
import io
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import rclpy
import zenoh
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistWithCovarianceStamped
from judging import Program, check, end, free_port, python, until
from rcl_interfaces.msg import Parameter, ParameterEvent, ParameterType, ParameterValue
from rcl_interfaces.srv import (DescribeParameters, GetParameters, GetParameterTypes, ListParameters, SetParameters,
                                SetParametersAtomically)
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_generator_type_description import generate_type_hash
from sensor_msgs.msg import Imu
from std_msgs.msg import String
from std_srvs.srv import Trigger
from zenoh.ext import HistoryConfig, declare_advanced_subscriber

SHARE, ROVER = os.path.join(sys.prefix, "share"), sys.argv[1]
TOKENS = "@ros2_lv/0/**"


class Rover(Program):
    def __init__(self, *arguments):
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        super().__init__(ROVER, "--listen", self.endpoint, *arguments, stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        assert line.startswith("/rover at "), line

    def session(self):
        """A peer that knows the rover alone, with the settings of `rmw_zenoh_cpp`."""
        config = zenoh.Config()
        for key, value in {"mode": '"peer"', "scouting/multicast/enabled": "false", "scouting/gossip/enabled": "true",
                           "listen/endpoints": '["tcp/127.0.0.1:0"]', "connect/endpoints": json.dumps([self.endpoint])}.items():
            config.insert_json5(key, value)
        return zenoh.open(config)


# As Kilted has it: PyPI has no package of it.
TRANSFORMS = {"tf2_msgs/msg/TFMessage": "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"}


def hash_of(kind):
    """`sensor_msgs/msg/Imu` to the hash that ROS's package has for it."""
    if kind in TRANSFORMS:
        return TRANSFORMS[kind]
    with open(os.path.join(SHARE, kind + ".json")) as file:
        hashes = json.load(file)["type_hashes"]
    return next(entry["hash_string"] for entry in hashes if entry["type_name"] == kind)


def name_of(kind):
    package, group, name = kind.split("/")
    return f"{package}::{group}::dds_::{name}_"


def key(topic, kind, type_hash=None):
    return f"0/{topic}/{name_of(kind)}/{type_hash or hash_of(kind)}"


class Tokens:
    """The tokens of a domain as they come and go."""

    def __init__(self, session):
        self.alive, self.gone_at = set(), {}
        self.subscriber = session.liveliness().declare_subscriber(TOKENS, self.heard, history=True)

    def heard(self, sample):
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self.alive.add(token)
        else:
            self.alive.discard(token)
            self.gone_at[token] = time.monotonic()


NUMBER_OF_TOKENS = 21


def tokens(rover):
    session = rover.session()
    seen = Tokens(session)
    until(lambda: len(seen.alive) >= NUMBER_OF_TOKENS, 10)
    # Whether there are more.
    time.sleep(0.3)
    check("tokens", len(seen.alive) == NUMBER_OF_TOKENS, len(seen.alive))
    names, wrong = {}, []
    for token in seen.alive:
        chunks = token.split("/")
        if len(chunks) == 9:
            check("the node", chunks[5:] == ["NN", "%", "%", "rover"], token)
            continue
        kind, name, dds, type_hash, qos = chunks[5], chunks[9].replace("%", "/"), chunks[10], chunks[11], chunks[12]
        package, group, _, short = dds.split("::")
        names[name] = (kind, f"{package}/{group}/{short[:-1]}", qos)
        if package != "bb_msgs" and hash_of(names[name][1]) != type_hash:
            wrong.append(token)
    check("hashes are those of ROS's packages", not wrong, wrong or len(names))
    for name, expected in {
        "/sensor/base/imu": ("MP", "sensor_msgs/msg/Imu", "::,10:,:,:,,"),
        "/sensor/base/target": ("MS", "geometry_msgs/msg/TwistWithCovarianceStamped", "::,10:,:,:,,"),
        "/tf_static": ("MP", "tf2_msgs/msg/TFMessage", ":1:,1:,:,:,,"),
        "/rover/disarm": ("SS", "std_srvs/srv/Trigger", "::,10:,:,:,,"),
    }.items():
        check(f"{name} is announced", names.get(name) == expected, names.get(name))
    session.close()


def out(rover, number, what):
    """As many messages in a row, none missing, each as it was written."""
    session = rover.session()
    sequence, counted, wrong, gid = [], [], [], set()

    def got(sample):
        attachment = sample.attachment.to_bytes()
        if len(attachment) != 33 or attachment[16] != 16:
            wrong.append(attachment)
        sequence.append(struct.unpack("<q", attachment[:8])[0])
        gid.add(attachment[17:])
        counted.append(sample.payload.to_bytes())

    subscriber = session.declare_subscriber(key("sensor/base/imu", "sensor_msgs/msg/Imu"), got)
    until(lambda: len(sequence) >= number, 300)
    subscriber.undeclare()
    # One more may come meanwhile.
    first = sequence[:number]
    gaps = sum(after != before + 1 for before, after in zip(first, first[1:]))
    messages = [deserialize_message(message, Imu) for message in counted[:number]]
    numbers = [message.linear_acceleration.x for message in messages]
    jumps = sum(after != before + 1 for before, after in zip(numbers, numbers[1:]))
    check(f"{what}: {number} messages without a gap", (len(messages), gaps, jumps) == (number, 0, 0),
          f"{len(messages)} of {number}, {gaps} gaps, {jumps} jumps")
    last = messages[-1]
    check(f"{what}: as they were written", not wrong and len(gid) == 1 and last.header.frame_id == "base"
          and last.angular_velocity.z == 0.1 and abs(last.header.stamp.sec - time.time()) < 400)
    session.close()


def back(rover, number):
    """Messages at 100 Hz to an input, whose estimator says each again."""
    session = rover.session()
    kind = "geometry_msgs/msg/TwistWithCovarianceStamped"
    echoed = []
    session.declare_subscriber(key("estimator/base/motion", kind), lambda sample: echoed.append(
        deserialize_message(sample.payload.to_bytes(), TwistWithCovarianceStamped).twist.twist.linear.x))
    put = session.declare_publisher(key("sensor/base/target", kind), congestion_control=zenoh.CongestionControl.BLOCK)
    time.sleep(0.5)
    target, begin = TwistWithCovarianceStamped(), time.monotonic()
    for count in range(number):
        target.twist.twist.linear.x = float(count)
        attachment = struct.pack("<qqB", count + 1, time.time_ns(), 16) + bytes(range(16))
        put.put(serialize_message(target), attachment=attachment)
        time.sleep(max(0, begin + (count + 1) * 0.01 - time.monotonic()))
    until(lambda: len(echoed) >= number, 30)
    check(f"back: {number} at 100 Hz", echoed == [float(count) for count in range(number)], len(echoed))
    # What is of another definition, or no message at all, is not taken.
    before = len(echoed)
    other = session.declare_publisher(key("sensor/base/target", kind, "RIHS01_" + "0" * 64))
    time.sleep(0.3)
    other.put(serialize_message(target))
    put.put(b"\x00\x01\x00\x00garbage")
    put.put(b"")
    time.sleep(0.5)
    check("back: what is of another definition is refused", len(echoed) == before, len(echoed) - before)
    # A node of Humble has no hash.
    humble = session.declare_publisher(key("sensor/base/target", kind, "TypeHashNotSupported"))
    time.sleep(0.3)
    humble.put(serialize_message(target))
    check("back: from Humble", until(lambda: len(echoed) == before + 1, 10))
    session.close()


class Client:
    """A client of the rover's services, as a node has one."""

    def __init__(self, session):
        self.session, self.sequence, self.gid = session, 0, bytes(range(16, 32))

    def raw(self, service, kind, payload, timeout=20):
        self.sequence += 1
        attachment = struct.pack("<qqB", self.sequence, time.time_ns(), 16) + self.gid
        replies = list(self.session.get(key(f"rover/{service}", kind), payload=payload, attachment=attachment,
                                        target=zenoh.QueryTarget.ALL_COMPLETE, timeout=timeout))
        return replies[0] if len(replies) == 1 else None

    def call(self, service, kind, of, request):
        reply = self.raw(service, kind, serialize_message(request))
        if reply is None or reply.ok is None:
            return None
        sequence, _, length = struct.unpack("<qqB", reply.ok.attachment.to_bytes()[:17])
        assert (sequence, length, reply.ok.attachment.to_bytes()[17:]) == (self.sequence, 16, self.gid)
        return deserialize_message(reply.ok.payload.to_bytes(), of.Response)

    def trigger(self, service):
        return self.call(service, "std_srvs/srv/Trigger", Trigger, Trigger.Request())


def services(rover):
    session = rover.session()
    client = Client(session)
    answer = client.trigger("go_home")
    check("a command is refused while disarmed", answer is not None and not answer.success and "disarmed" in answer.message,
          answer and answer.message)
    answer = client.trigger("arm")
    check("arm", answer is not None and answer.success, answer and answer.message)
    answer = client.trigger("go_home")
    check("a command fails with the robot's text", answer is not None and not answer.success
          and "it has nowhere to go back to" in answer.message, answer and answer.message)
    answer = client.trigger("disarm")
    check("disarm", answer is not None and answer.success, answer and answer.message)
    # Of a type of the robot's own: the request is a number, as ROS writes it.
    client.trigger("arm")
    drive = [token for token in Tokens_of(session) if "%drive" in token][0].split("/")
    request = struct.pack("<4Bd", 0, 1, 0, 0, 2.0)
    replies = list(session.get(f"0/rover/drive/{drive[10]}/{drive[11]}", payload=request, timeout=20))
    response = replies[0].ok.payload.to_bytes() if replies and replies[0].ok else b""
    check("a command with arguments", response[4:5] == b"\x01" and b"2" in response[8:], response)

    names = lambda *names: list(names)
    listed = client.call("list_parameters", "rcl_interfaces/srv/ListParameters", ListParameters, ListParameters.Request())
    check("list", listed is not None and listed.result.names == ["kp", "gains.ki"], listed and listed.result.names)
    got = client.call("get_parameters", "rcl_interfaces/srv/GetParameters", GetParameters,
                      GetParameters.Request(names=names("kp", "none")))
    check("get", got is not None and [value.type for value in got.values] == [ParameterType.PARAMETER_DOUBLE,
          ParameterType.PARAMETER_NOT_SET] and got.values[0].double_value == 1.0)
    types = client.call("get_parameter_types", "rcl_interfaces/srv/GetParameterTypes", GetParameterTypes,
                        GetParameterTypes.Request(names=names("gains.ki")))
    check("types", types is not None and list(types.types) == [ParameterType.PARAMETER_DOUBLE])
    told = client.call("describe_parameters", "rcl_interfaces/srv/DescribeParameters", DescribeParameters,
                       DescribeParameters.Request(names=names("kp")))
    kp = told and told.descriptors[0]
    check("describe", told is not None and kp.description == "Gain of its turns."
          and (kp.floating_point_range[0].from_value, kp.floating_point_range[0].to_value) == (0.0, 10.0))
    events = []
    session.declare_subscriber(key("parameter_events", "rcl_interfaces/msg/ParameterEvent"),
                               lambda sample: events.append(deserialize_message(sample.payload.to_bytes(), ParameterEvent)))
    time.sleep(0.3)
    double = lambda name, value: Parameter(name=name, value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value))
    answer = client.call("set_parameters", "rcl_interfaces/srv/SetParameters", SetParameters,
                         SetParameters.Request(parameters=[double("kp", 5.5), double("kp", 99.0)]))
    check("set, and refused with the range", answer is not None and [result.successful for result in answer.results] == [True, False]
          and "0.0..=10.0" in answer.results[1].reason, answer and answer.results[1].reason)
    until(lambda: events, 10)
    changed = [(event.node, event.changed_parameters[0].name, event.changed_parameters[0].value.double_value) for event in events]
    check("/parameter_events", changed == [("/rover", "kp", 5.5)], changed)
    answer = client.call("set_parameters_atomically", "rcl_interfaces/srv/SetParametersAtomically", SetParametersAtomically,
                         SetParametersAtomically.Request(parameters=[double("kp", 1.0), double("gains.ki", 0.0), double("none", 1.0)]))
    check("set at once: all or none", answer is not None and not answer.result.successful
          and client.call("get_parameters", "rcl_interfaces/srv/GetParameters", GetParameters,
                          GetParameters.Request(names=names("kp"))).values[0].double_value == 5.5)
    # Malformed requests: each gets an error or an answer, and the robot runs on.
    told = 0
    for count in range(300):
        reply = client.raw("set_parameters", "rcl_interfaces/srv/SetParameters", os.urandom(count % 64))
        told += reply is not None
    check("300 malformed requests are each answered", told == 300 and rover.process.poll() is None, told)
    diagnoses = []
    session.declare_subscriber(key("diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),
                               lambda sample: diagnoses.append(deserialize_message(sample.payload.to_bytes(), DiagnosticArray)))
    until(lambda: diagnoses, 10)
    names = [status.name for status in diagnoses[0].status] if diagnoses else []
    check("/diagnostics", names[:1] == ["Rover"] and "Rover: estimator/base/motion" in names, names)
    session.close()


def Tokens_of(session):
    return [str(reply.ok.key_expr) for reply in session.liveliness().get(TOKENS, timeout=5) if reply.ok]


def latched(rover):
    """Who comes late, as `rmw_zenoh_cpp` comes: an advanced subscriber that asks for what was."""
    session = rover.session()
    got = []
    history = HistoryConfig(detect_late_publishers=True)
    kept = [declare_advanced_subscriber(session, key(topic, kind), got.append, history=history)
            for topic, kind in (("robot_description", "std_msgs/msg/String"), ("tf_static", "tf2_msgs/msg/TFMessage"))]
    until(lambda: len(got) >= 2, 10)
    texts = [deserialize_message(sample.payload.to_bytes(), String).data for sample in got if "robot_description" in str(sample.key_expr)]
    check("latched topics for late joiners", len(got) == 2 and len(texts) == 1 and texts[0].startswith("<?xml")
          and '<link name="base"' in texts[0], len(got))
    del kept
    session.close()


def through(rover):
    """Two that know the rover alone hear each other."""
    talker, listener = rover.session(), rover.session()
    heard = []
    listener.declare_subscriber("0/chatter/**", lambda sample: heard.append(sample.payload.to_bytes()))
    put = talker.declare_publisher("0/chatter/std_msgs::msg::dds_::String_/RIHS01_0", congestion_control=zenoh.CongestionControl.BLOCK)
    time.sleep(1)
    for count in range(10):
        put.put(str(count).encode())
        time.sleep(0.05)
    until(lambda: len(heard) >= 10, 10)
    check("two others hear each other", len(heard) == 10, f"{len(heard)} of 10")
    talker.close()
    listener.close()


def gone(with_signal, within):
    """How long its tokens outlive a rover. The lease of the judge's session must not be the shorter one: it is zenoh's 10 s. A busy machine may
    be late: the least time of three counts."""
    times = []
    for _ in range(3):
        with Rover() as rover:
            session = rover.session()
            seen = Tokens(session)
            until(lambda: len(seen.alive) >= NUMBER_OF_TOKENS, 10)
            time.sleep(0.3)
            number, at = len(seen.alive), time.monotonic()
            rover.process.send_signal(with_signal)
            is_gone = until(lambda: not seen.alive, 20)
            times.append(max(seen.gone_at.values()) - at if is_gone and number == NUMBER_OF_TOKENS else float("inf"))
            rover.process.kill()
            session.close()
        if times[-1] <= within:
            break
    check(f"tokens are gone within {within} s of {with_signal.name}", min(times) <= within, times)


def clock():
    with Rover("--simulate", "--rate", "50") as rover:
        session = rover.session()
        times = []
        session.declare_subscriber(key("clock", "rosgraph_msgs/msg/Clock"), lambda sample: times.append(
            (lambda stamp: stamp.sec * 10**9 + stamp.nanosec)(deserialize_message(sample.payload.to_bytes(), Clock).clock)))
        until(lambda: len(times) >= 20, 20)
        check("/clock in a simulation", len(times) >= 20 and all(after > before for before, after in zip(times, times[1:])), len(times))
        session.close()


def interfaces():
    """The types that ROS does not have, as ROS's own generator hashes the files that the rover writes, and as the node announces them."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([ROVER, "--interfaces", folder], check=True, stdout=subprocess.DEVNULL)
        package, idl, made = Path(folder, "bb_msgs"), Path(folder, "idl"), Path(folder, "json")
        files = sorted(package.glob("*/*.msg")) + sorted(package.glob("*/*.srv"))
        for file in files:
            convert = convert_msg_to_idl if file.suffix == ".msg" else convert_srv_to_idl
            with contextlib.redirect_stdout(io.StringIO()):
                convert(package, "bb_msgs", file.relative_to(package), idl / file.parent.name)
        arguments = {
            "package_name": "bb_msgs",
            "output_dir": str(made),
            "idl_tuples": [f"{idl}:{file.parent.name}/{file.stem}.idl" for file in files],
            "include_paths": [f"{needed}:{SHARE}/{needed}" for needed in ("std_msgs", "builtin_interfaces", "service_msgs")],
        }
        written = Path(folder, "arguments.json")
        written.write_text(json.dumps(arguments))
        generate_type_hash(str(written))
        hashes = {}
        for file in files:
            name = f"bb_msgs/{file.parent.name}/{file.stem}"
            described = json.loads((made / file.parent.name / (file.stem + ".json")).read_text())
            hashes[name] = next(entry["hash_string"] for entry in described["type_hashes"] if entry["type_name"] == name)
    with Rover() as rover:
        session = rover.session()
        seen = Tokens(session)
        until(lambda: len(seen.alive) >= NUMBER_OF_TOKENS, 10)
        announced = {}
        for token in seen.alive:
            chunks = token.split("/")
            if len(chunks) > 9 and chunks[10].startswith("bb_msgs::"):
                _, group, _, short = chunks[10].split("::")
                announced[f"bb_msgs/{group}/{short[:-1]}"] = chunks[11]
        session.close()
    check("types of the robot's own", sorted(announced) == ["bb_msgs/msg/PlanStamped", "bb_msgs/srv/Drive"]
          and all(hashes.get(name) == found for name, found in announced.items()), f"{announced}, of {len(hashes)} files")


class Relay(Node):
    """The rover on the middleware that PyPI has: each topic and service that it announces of a type that ROS has, by that name and type."""

    def __init__(self, session):
        super().__init__("relay", start_parameter_services=False)
        self.zenoh = session
        of_kind = {"MP": self.add_publisher, "MS": self.add_subscription, "SS": self.add_service}
        for token in Tokens_of(session):
            kind, name, type_name, type_hash = (token.split("/")[index] for index in (5, -4, -3, -2))
            package, group, short = type_name.replace("::dds_", "").split("::") if "::" in type_name else 3 * [""]
            path = name.replace("%", "/")
            if kind in of_kind and importlib.util.find_spec(package):
                of = getattr(importlib.import_module(f"{package}.{group}"), short[:-1])
                of_kind[kind](of, path, f"0{path}/{type_name}/{type_hash}")

    def add_publisher(self, of, path, key):
        publisher = self.create_publisher(of, path, 10)
        self.zenoh.declare_subscriber(key, lambda sample: publisher.publish(sample.payload.to_bytes()))

    def add_subscription(self, of, path, key):
        attachment = struct.pack("<qqB", 1, time.time_ns(), 16) + bytes(16)
        self.create_subscription(of, path, lambda message: self.zenoh.put(key, message, attachment=attachment), 10, raw=True)

    def add_service(self, of, path, key):
        def answer(request, _):
            reply = next(iter(self.zenoh.get(key, payload=serialize_message(request), timeout=20)))
            return deserialize_message(reply.ok.payload.to_bytes(), of.Response)
        self.create_service(of, path, answer)


def script(rover):
    """What a user of ROS runs, `drive_rover.py`, on Fast DDS, as PyPI does not have `rmw_zenoh_cpp`, with a relay to the rover."""
    os.environ |= {"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(os.getpid() % 100)}
    session = rover.session()
    rclpy.init()
    relay = Relay(session)
    threading.Thread(target=rclpy.spin, args=[relay], daemon=True).start()
    root = Path(__file__).parents[3]
    command = ["timeout", "60", sys.executable, root / "integrations/zenoh/examples/drive_rover.py"]
    run = subprocess.run(command, capture_output=True, text=True)
    shown = (root / "book/src/how-to/ros2.md").read_text().split("```text\n")[1].split("```")[0]
    check("the script of the guide drives the rover", (run.returncode, run.stdout) == (0, shown), run.stdout + run.stderr[-2000:])
    session.close()


def main():
    with Rover() as rover:
        tokens(rover)
        services(rover)
        latched(rover)
        through(rover)
        back(rover, 400)
    with Rover() as rover:
        script(rover)
    gone(signal.SIGKILL, 0.1)
    gone(signal.SIGSTOP, 1.5)
    clock()
    interfaces()
    busy = "while True: pass"
    with python(busy), python(busy):
        with Rover() as rover, Rover("--rate", "2000") as quick:
            slow = threading.Thread(target=out, args=[rover, 2_000, "200 Hz beside two busy loops"])
            slow.start()
            out(quick, 20_000, "2 kHz beside two busy loops")
            slow.join()
    end()


main()
