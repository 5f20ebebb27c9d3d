"""Compares messages of bb-core with how ROS 2's own Python packages, rosbags, mcap and jsonschema understand them,
and reads a recording with these.

`check` writes the messages and runs this; each line of them has the name, definition and hash of a type, and a value as
CDR and as JSON.
"""

import importlib
import json
import math
import pathlib
import shutil
import struct
import sys


class Mismatch(Exception):
    pass


def same_number(ours, theirs):
    """Whether a float of theirs is a number of ours, or the `float32` nearest to it."""
    ours = float(ours)
    if math.isnan(ours) or math.isnan(theirs):
        return math.isnan(ours) and math.isnan(theirs)
    if ours == theirs:
        return math.copysign(1, ours) == math.copysign(1, theirs)
    try:
        return struct.unpack("f", struct.pack("f", ours))[0] == theirs
    except OverflowError:
        return False


def compare(path, ours, theirs):
    """Field by field; `ours` is JSON."""
    if isinstance(ours, dict):
        for name, value in ours.items():
            compare(f"{path}.{name}", value, getattr(theirs, name))
    elif isinstance(ours, list):
        if len(ours) != len(theirs):
            raise Mismatch(f"{path}: {len(ours)} elements, {len(theirs)} there")
        for index, (a, b) in enumerate(zip(ours, theirs)):
            compare(f"{path}[{index}]", a, b)
    elif isinstance(theirs, (str, bool)):
        if ours != theirs:
            raise Mismatch(f"{path}: {ours!r}, {theirs!r} there")
    elif isinstance(ours, str) or "float" in type(theirs).__name__:
        if not same_number(ours, float(theirs)):
            raise Mismatch(f"{path}: {ours!r}, {theirs!r} there")
    elif ours != int(theirs):
        raise Mismatch(f"{path}: {ours!r}, {theirs!r} there")


def fields(message):
    """The names of a message's fields, for the classes of rclpy and of rosbags."""
    return getattr(message, "__dataclass_fields__", None) or message.get_fields_and_field_types()


def check_rclpy(folder, lines):
    from rclpy.serialization import deserialize_message, serialize_message

    back = []
    for line in lines:
        package, kind = line["name"].split("/msg/")
        message_class = getattr(importlib.import_module(f"{package}.msg"), kind)
        message = deserialize_message(bytes.fromhex(line["cdr"]), message_class)
        if set(fields(message)) - {"SLOT_TYPES"} != set(line["json"]):
            raise Mismatch(f"{line['name']}: fields {sorted(line['json'])}")
        compare(line["name"], line["json"], message)
        cdr = serialize_message(message).hex()
        back.append(json.dumps({"name": line["name"], "cdr": cdr, "expected": line["cdr"]}))
        description = pathlib.Path(sys.prefix, "share", package, "msg", f"{kind}.json")
        hashes = json.loads(description.read_text())["type_hashes"]
        expected = next(entry["hash_string"] for entry in hashes if entry["type_name"] == line["name"])
        if line["hash"] != expected:
            raise Mismatch(f"{line['name']}: hash {line['hash']}, {expected} there")
    pathlib.Path(folder, "back.jsonl").write_text("\n".join(back))
    return len(lines)


def check_rosbags(lines, are_ros):
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    for line in lines:
        # What rosbags knows of ROS 2, and the definition that our recordings have.
        ours = get_typestore(Stores.EMPTY)
        ours.register(get_types_from_msg(line["definition"], line["name"]))
        stores = [ours, get_typestore(Stores.LATEST)] if are_ros else [ours]
        for store in stores:
            message = store.deserialize_cdr(bytes.fromhex(line["cdr"]), line["name"])
            if are_ros:
                compare(line["name"], line["json"], message)
            found = store.hash_rihs01(line["name"])
            if found != line["hash"]:
                raise Mismatch(f"{line['name']}: hash {line['hash']}, {found} there")
    return len(lines)


def check_recording(path):
    """Every message of a recording, decoded by the definitions in it; and what is there for viewers."""
    from rosbags.highlevel import AnyReader

    counts = {}
    parents = {}
    with AnyReader([path]) as reader:
        for connection, time, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            if connection.msgtype == "sensor_msgs/msg/Imu":
                stamp = message.header.stamp
                if stamp.sec * 10**9 + stamp.nanosec != time or stamp.sec < 978_307_200:
                    raise Mismatch(f"{connection.topic}: the stamp {stamp} of a message that was logged at {time} ns")
            for transform in getattr(message, "transforms", []):
                parents.setdefault(transform.child_frame_id, set()).add(transform.header.frame_id)
    for child, found in parents.items():
        if len(found) != 1:
            raise Mismatch(f"the frame {child} has the parents {sorted(found)}")
    topics = ["imu", "imu/magnetic_field", "imu/orientation", "shoulder/encoder"]
    for topic in ["/tf", "/tf_static", "/robot_description"] + [f"/sensor/base/{topic}" for topic in topics]:
        if topic not in counts:
            raise Mismatch(f"{topic} is not in the recording, which has {sorted(counts)}")
    return sum(counts.values())


def check_mcap(path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return sum(1 for _ in reader.iter_decoded_messages())


def check_times(path):
    """Every message of a recording has a time of this century, and the whole is as long as the run was, under a minute."""
    from mcap.reader import make_reader

    century = range(978_307_200 * 10**9, 4_133_980_800 * 10**9)
    times = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
            for time in (message.log_time, message.publish_time):
                if time not in century:
                    raise Mismatch(f"{channel.topic}: a message of {time} ns")
            times.setdefault(channel.topic, []).append(message.log_time)
    for topic, found in times.items():
        # Several threads write these two; a line of the journal has the time at which its cause was processed.
        if topic not in ("/tf", "/journal") and found != sorted(found):
            raise Mismatch(f"{topic}: the times run back")
    span = max(map(max, times.values())) - min(map(min, times.values()))
    if span > 60 * 10**9:
        raise Mismatch(f"a run of seconds spans {span} ns")
    return times.keys()


def check_moving_arm(path):
    """What a recording of everything holds of an arm that moves."""
    topics = check_times(path)
    servo = [f"actuator/base/elbow/servo{part}" for part in ("", "/begin_motion", "/end_motion")]
    others = ["journal", "safety", "param/pace", "command/go", "mission/note", "sensor/base/elbow/position"]
    for topic in servo + others:
        if f"/{topic}" not in topics:
            raise Mismatch(f"/{topic} is not in the recording, which has {sorted(topics)}")
    return len(topics)


def check_jsonschema(lines):
    from jsonschema import Draft202012Validator

    for line in lines:
        Draft202012Validator.check_schema(line["schema"])
        Draft202012Validator(line["schema"]).validate(line["json"])
    return len(lines)


def hashes_of(package, folder):
    """The hashes by which ROS knows the types of a package of `.msg` and `.srv` files, as its build makes them."""
    from rosidl_adapter.msg import convert_msg_to_idl
    from rosidl_adapter.srv import convert_srv_to_idl
    from rosidl_generator_type_description import generate_type_hash

    converters = {"msg": convert_msg_to_idl, "srv": convert_srv_to_idl}
    files = [file for kind in converters for file in sorted(package.glob(f"{kind}/*.{kind}"))]
    for file in files:
        kind = file.suffix[1:]
        converters[kind](package, package.name, file.relative_to(package), folder / kind)
    share = pathlib.Path(sys.prefix, "share")
    arguments = {
        "package_name": package.name,
        "output_dir": str(folder),
        "idl_tuples": [f"{folder}:{file.parent.name}/{file.stem}.idl" for file in files],
        "include_paths": [f"{name.name}:{name}" for name in share.iterdir() if name.is_dir()],
    }
    settings = folder / "arguments.json"
    settings.write_text(json.dumps(arguments))
    hashes = {}
    for path in generate_type_hash(str(settings)):
        entries = json.loads(pathlib.Path(path).read_text())["type_hashes"]
        hashes.update({entry["type_name"]: entry["hash_string"] for entry in entries})
    return hashes


def check_interfaces(folder):
    """The package of a robot's own types, whose hashes a changed name changes."""
    lines = [json.loads(line) for line in pathlib.Path(folder, "interfaces.jsonl").read_text().splitlines()]
    package = pathlib.Path(folder, "bb_msgs")
    found = hashes_of(package, pathlib.Path(folder, "hashed"))
    for line in lines:
        if found.get(line["name"]) != line["hash"]:
            raise Mismatch(f"{line['name']}: hash {line['hash']}, {found.get(line['name'])} there")
    other = pathlib.Path(folder, "renamed", "bb_msgs")
    shutil.copytree(package, other)
    nested = other / "msg" / "Nested.msg"
    nested.write_text(nested.read_text().replace(" names", " words"))
    renamed = hashes_of(other, pathlib.Path(folder, "rehashed"))
    changed = {name for name in found if renamed[name] != found[name]}
    if not {"bb_msgs/msg/Nested", "bb_msgs/msg/EverythingStamped", "bb_msgs/srv/GoFar"} <= changed:
        raise Mismatch(f"a renamed field changes the hashes of {sorted(changed)} alone")
    return len(lines)


def main():
    folder = sys.argv[2]
    ros, exact = (
        [json.loads(line) for line in pathlib.Path(folder, f"{name}.jsonl").read_text().splitlines()]
        for name in ("ros", "exact")
    )
    print(f"ros2: rclpy reads {check_rclpy(folder, ros)} messages field by field, with the same type hashes")
    count = check_rosbags(ros, True) + check_rosbags(exact, False)
    print(f"ros2: rosbags reads {count} messages by our definitions, with the same type hashes")
    recording = pathlib.Path(folder, "recording.mcap")
    print(f"ros2: rosbags reads {check_recording(recording)} messages of a recording")
    print(f"ros2: the reader of MCAP's own project reads {check_mcap(recording)} messages of it")
    check_times(recording)
    topics = check_moving_arm(pathlib.Path(folder, "moving_arm.mcap"))
    print(f"ros2: all messages of {topics} topics of a moving arm have times of this century")
    print(f"ros2: rosidl gives {check_interfaces(folder)} types of a robot's own the same type hashes")
    print(f"ros2: jsonschema accepts {check_jsonschema(ros + exact)} values and their schemas")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Mismatch as mismatch:
        print(f"ros2: {mismatch}")
        sys.exit(2)
