"""Makes a bag of a set of CSV files with rosbags, and compares what `bb eval navigation` finds on both.

`check` runs this.
"""

import csv
import json
import math
import pathlib
import sys

# Where KITTI's world may be on the Earth, degrees and m.
ORIGIN = (49.0, 8.4, 115.0)
START_NS = 1_700_000_000_000_000_000


def rows(prefix, what):
    file = pathlib.Path(f"{prefix}_{what}.csv")
    if not file.exists():
        return []
    with open(file) as source:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(source)]


def geodetic(position):
    """Latitude, longitude in degrees and height of a position in the tangent frame at the origin, WGS 84."""
    a, f = 6378137.0, 1 / 298.257223563
    e2 = f * (2 - f)
    lat, lon, height = math.radians(ORIGIN[0]), math.radians(ORIGIN[1]), ORIGIN[2]
    normal = a / math.sqrt(1 - e2 * math.sin(lat) ** 2)
    x = (normal + height) * math.cos(lat) * math.cos(lon)
    y = (normal + height) * math.cos(lat) * math.sin(lon)
    z = (normal * (1 - e2) + height) * math.sin(lat)
    e, n, u = position
    x += -math.sin(lon) * e - math.sin(lat) * math.cos(lon) * n + math.cos(lat) * math.cos(lon) * u
    y += math.cos(lon) * e - math.sin(lat) * math.sin(lon) * n + math.cos(lat) * math.sin(lon) * u
    z += math.cos(lat) * n + math.sin(lat) * u
    longitude, p = math.atan2(y, x), math.hypot(x, y)
    latitude = math.atan2(z, p * (1 - e2))
    for _ in range(20):
        normal = a / math.sqrt(1 - e2 * math.sin(latitude) ** 2)
        latitude = math.atan2(z + e2 * normal * math.sin(latitude), p)
    return math.degrees(latitude), math.degrees(longitude), p / math.cos(latitude) - normal


def product(a, b):
    """Of two quaternions, w first."""
    (w, x, y, z), (s, i, j, k) = a, b
    return (
        w * s - x * i - y * j - z * k,
        w * i + x * s + y * k - z * j,
        w * j - x * k + y * s + z * i,
        w * k + x * j - y * i + z * s,
    )


def turned(q, v):
    return product(product(q, (0.0, *v)), (q[0], -q[1], -q[2], -q[3]))[1:]


def xyz(row, names):
    return tuple(row[name] for name in names)


def quaternion(row):
    return xyz(row, ("qw", "qx", "qy", "qz"))


def make(prefix, folder):
    import numpy
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = store.types
    position = ("px", "py", "pz")
    messages = []

    def ns(time_s):
        return START_NS + round(time_s * 1e9)

    def header(time, frame):
        stamp = kind["builtin_interfaces/msg/Time"](sec=time // 10**9, nanosec=time % 10**9)
        return kind["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    def vector(v, name="Vector3"):
        return kind[f"geometry_msgs/msg/{name}"](x=v[0], y=v[1], z=v[2])

    def pose(p, q, first, second):
        q = kind["geometry_msgs/msg/Quaternion"](w=q[0], x=q[1], y=q[2], z=q[3])
        pose = kind["geometry_msgs/msg/Pose"](position=vector(p, "Point"), orientation=q)
        covariance = numpy.diag([first] * 3 + [second] * 3).flatten()
        return kind["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=covariance)

    def odometry(time, p, q, variances, velocity=(0.0, 0.0, 0.0), variance=0.0):
        twist = kind["geometry_msgs/msg/Twist"](linear=vector(velocity), angular=vector((0.0, 0.0, 0.0)))
        covariance = numpy.diag([variance] * 6).flatten()
        twist = kind["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=covariance)
        return kind["nav_msgs/msg/Odometry"](
            header=header(time, "map"), child_frame_id="imu", pose=pose(p, q, *variances), twist=twist
        )

    def fix(time, p, horizontal, vertical):
        latitude, longitude, height = geodetic(p)
        status = kind["sensor_msgs/msg/NavSatStatus"](status=0, service=1)
        covariance = numpy.diag([horizontal**2, horizontal**2, vertical**2]).flatten()
        return kind["sensor_msgs/msg/NavSatFix"](
            header=header(time, "imu"),
            status=status,
            latitude=latitude,
            longitude=longitude,
            altitude=height,
            position_covariance=covariance,
            position_covariance_type=2,
        )

    samples, keyframes, truth = rows(prefix, "imu"), rows(prefix, "keyframes"), rows(prefix, "truth")
    (init,), (noise,) = rows(prefix, "init"), rows(prefix, "noise")
    start = ns(keyframes[0]["t"])

    def imu(time, row):
        nothing = numpy.zeros(9)
        orientation = kind["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
        message = kind["sensor_msgs/msg/Imu"](
            header=header(time, "imu"),
            orientation=orientation,
            orientation_covariance=numpy.array([-1.0] + [0.0] * 8),
            angular_velocity=vector(xyz(row, ("gx", "gy", "gz"))),
            angular_velocity_covariance=nothing,
            linear_acceleration=vector(xyz(row, ("ax", "ay", "az"))),
            linear_acceleration_covariance=nothing,
        )
        messages.append((time, "/imu", message))

    # A message holds since the one before, and the first begins.
    imu(start, samples[0])
    for before, after in zip(keyframes, keyframes[1:]):
        time_s = before["t"]
        for row in samples[int(before["imu_start"]) : int(after["imu_start"])]:
            time_s += row["dt"]
            # The last is at the keyframe, whatever the clock of the IMU says.
            is_last = row is samples[int(after["imu_start"]) - 1]
            imu(ns(after["t"] if is_last else min(time_s, after["t"] - 1e-6)), row)

    q, v = quaternion(init), xyz(init, ("vx", "vy", "vz"))
    variances = (init["sigma_p"] ** 2, init["sigma_rot"] ** 2)
    back = (q[0], -q[1], -q[2], -q[3])
    message = odometry(start, xyz(init, position), q, variances, turned(back, v), init["sigma_v"] ** 2)
    messages.append((start, "/start", message))

    has_orientation = False
    for keyframe in keyframes:
        if keyframe["eval"] > 0:
            row, time = truth[int(keyframe["truth_row"])], ns(keyframe["t"])
            q, p, v = quaternion(row), xyz(row, position), xyz(row, ("vx", "vy", "vz"))
            if math.isnan(q[0]):
                messages.append((time, "/truth", fix(time, p, 0.0, 0.0)))
            else:
                has_orientation = True
                inverse = (q[0], -q[1], -q[2], -q[3])
                messages.append((time, "/truth", odometry(time, p, q, (0.0, 0.0), turned(inverse, v))))

    times = [ns(keyframe["t"]) for keyframe in keyframes]
    relative = rows(prefix, "vio")
    place, turn, grown = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0)
    if relative:
        messages.append((start, "/vio", odometry(start, place, turn, (1e-12, 1e-12))))
    for row in relative:
        way = turned(turn, xyz(row, ("tx", "ty", "tz")))
        place = tuple(a + b for a, b in zip(place, way))
        turn = product(turn, quaternion(row))
        length = math.sqrt(sum(x * x for x in turn))
        turn = tuple(x / length for x in turn)
        grown = (grown[0] + row["sigma_t"] ** 2, grown[1] + row["sigma_rot"] ** 2)
        time = times[int(row["k_to"])]
        messages.append((time, "/vio", odometry(time, place, turn, (grown[0] + 1e-12, grown[1] + 1e-12))))
    for row in rows(prefix, "anchor"):
        time = times[int(row["k"])]
        with_covariance = pose(xyz(row, position), quaternion(row), row["sigma_p"] ** 2, row["sigma_rot"] ** 2)
        message = kind["geometry_msgs/msg/PoseWithCovarianceStamped"](header=header(time, "map"), pose=with_covariance)
        messages.append((time, "/pose", message))
    # Filters leave fixes out where a set has relative poses.
    for row in [] if relative else rows(prefix, "gps"):
        time = times[int(row["k"])]
        messages.append((time, "/fix", fix(time, xyz(row, "xyz"), row["sigma_h"], row["sigma_v"])))

    messages.sort(key=lambda message: message[0])
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}
        for time, topic, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
            writer.write(connections[topic], time, store.serialize_cdr(message, message.__msgtype__))
    names = {
        "gyroscope_noise": "gyro_nd",
        "gyroscope_bias_walk": "gyro_rw",
        "accelerometer_noise": "accel_nd",
        "accelerometer_bias_walk": "accel_rw",
        "gravity": "gravity",
    }
    options = ["--start /start", f"--origin={','.join(map(str, ORIGIN))}", "--truth /truth"]
    units = {"gravity": "m/s^2"}
    options += [f"--set '{name}={noise[column]!r} {units.get(name, '')}'" for name, column in names.items()]
    options += ["--relative-topic /vio"] if relative else []
    pathlib.Path(f"{folder}.options").write_text(" ".join(options) + "\n")


def compare(name, files, bag):
    (files,), (bag,) = json.loads(pathlib.Path(files).read_text()), json.loads(pathlib.Path(bag).read_text())
    said = []
    for figure in ("position_m", "orientation_deg", "velocity_mps", "nees"):
        ours, theirs = (of[figure]["rms"] if isinstance(of[figure], dict) else of[figure] for of in (bag, files))
        said.append(f"{figure} {ours}")
        bound = 1e-2
        if (ours is None) != (theirs is None) or (ours is not None and abs(ours / theirs - 1) > bound):
            sys.exit(f"rosbags: {name}: {figure} is {ours}, of the files {theirs}")
    print(f"rosbags: {name} gives the figures of its files: {', '.join(said)}")


def same(folder, converted):
    """Whether two bags hold the same messages, byte for byte."""
    import itertools

    from rosbags.highlevel import AnyReader

    def messages(bag):
        with AnyReader([pathlib.Path(bag)]) as reader:
            for connection, time, data in reader.messages():
                yield connection.topic, connection.msgtype, time, data

    count = 0
    for before, after in itertools.zip_longest(messages(folder), messages(converted)):
        if before != after:
            sys.exit(f"rosbags: message {count} of {folder} became another: {before} {after}")
        count += 1
    print(f"rosbags: {count} messages are the same after ROS 1")


if sys.argv[1] == "make":
    make(sys.argv[2], sys.argv[3])
elif sys.argv[1] == "same":
    same(sys.argv[2], sys.argv[3])
else:
    compare(*sys.argv[2:])
