"""Writes, with rosbags, what a newcomer may have recorded, and checks what `bb eval` says of it.

A cart drives a figure of eight at 4 m/s. Its IMU is mounted at 90 degrees, as /tf_static says, magnetic north is 4 degrees east of true
north, there are 20 s without fixes and 0.8 s without samples, and for 15 s fixes with an error of 4 m claim 1 cm. `check` runs this.
"""

import json
import math
import pathlib
import random
import sys

START_NS = 1_700_000_000_000_000_000
OUTAGE, GAP, FALSE = (40.0, 60.0), (70.0, 70.8), (85.0, 100.0)
LATITUDE, LONGITUDE, HEIGHT = 48.1, 11.5, 520.0
DECLINATION = math.radians(4.0)
FIELD = 21e-6, -43e-6


def place(t):
    """East, north and heading, at rest for 5 s and then from rest."""
    since = max(0.0, t - 5.0)
    phase = 0.1 * (since - 2.0 * (1.0 - math.exp(-since / 2.0)))
    x, y = 30.0 * math.sin(phase), 15.0 * math.sin(2.0 * phase)
    heading = math.atan2(30.0 * math.cos(2.0 * phase), 30.0 * math.cos(phase)) - math.pi / 4
    c = math.sqrt(0.5)
    return c * (x + y), c * (y - x), heading


def make(folder):
    import numpy
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = store.types
    noise = random.Random(7)
    curvature = geodesy()

    def header(time, frame):
        stamp = kind["builtin_interfaces/msg/Time"](sec=time // 10**9, nanosec=time % 10**9)
        return kind["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    def vector(*v, name="Vector3"):
        return kind[f"geometry_msgs/msg/{name}"](*v)

    def turned(yaw):
        return kind["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))

    def in_imu(x, y, z, deviation):
        """Of vectors of the base, which is turned by -90 degrees in the IMU."""
        return vector(*(value + noise.gauss(0.0, deviation) for value in (y, -x, z)))

    unknown = numpy.full(9, 0.0)
    messages = []
    transform = kind["geometry_msgs/msg/Transform"](
        translation=vector(0.0, 0.0, 0.3), rotation=turned(math.pi / 2)
    )
    antenna = kind["geometry_msgs/msg/Transform"](translation=vector(-0.3, 0.0, 1.0), rotation=turned(0.0))
    stamped = kind["geometry_msgs/msg/TransformStamped"]
    transforms = [
        stamped(header=header(START_NS, "base_link"), child_frame_id=child, transform=of)
        for child, of in (("imu_link", transform), ("antenna", antenna))
    ]
    messages.append((START_NS, "/tf_static", kind["tf2_msgs/msg/TFMessage"](transforms=transforms)))
    dt = 0.01
    for i in range(12_000):
        time, t = START_NS + i * 10_000_000, i * dt
        (east, north, heading), (e0, n0, h0), (e1, n1, h1) = place(t), place(t - dt), place(t + dt)
        cos, sin = math.cos(heading), math.sin(heading)
        acceleration = (e1 - 2 * east + e0) / dt**2, (n1 - 2 * north + n0) / dt**2
        force = cos * acceleration[0] + sin * acceleration[1], cos * acceleration[1] - sin * acceleration[0]
        if not GAP[0] <= t < GAP[1]:
            rate = math.remainder(heading - h0, math.tau) / dt
            imu = kind["sensor_msgs/msg/Imu"](
                header=header(time, "imu_link"),
                orientation=turned(0.0),
                orientation_covariance=numpy.array([-1.0] + [0.0] * 8),
                angular_velocity=in_imu(0.0, 0.003, rate + 0.003, 2e-3),
                angular_velocity_covariance=unknown,
                linear_acceleration=in_imu(*force, 9.80665, 2e-2),
                linear_acceleration_covariance=unknown,
            )
            messages.append((time, "/imu/data", imu))
            to_north = math.pi / 2 - DECLINATION - heading
            field = in_imu(FIELD[0] * math.cos(to_north), FIELD[0] * math.sin(to_north), FIELD[1], 2e-7)
            magnetic = kind["sensor_msgs/msg/MagneticField"](
                header=header(time, "imu_link"), magnetic_field=field, magnetic_field_covariance=unknown
            )
            messages.append((time, "/imu/mag", magnetic))
        if i % 20 == 10 and not OUTAGE[0] <= t < OUTAGE[1]:
            deviation, claimed = (4.0, 0.01) if FALSE[0] <= t < FALSE[1] else (1.0, 1.0)
            x, y, z = (east - 0.3 * cos, north - 0.3 * sin, 1.0)
            x, y, z = (value + noise.gauss(0.0, deviation) for value in (x, y, z))
            fix = kind["sensor_msgs/msg/NavSatFix"](
                header=header(time, "antenna"),
                status=kind["sensor_msgs/msg/NavSatStatus"](status=0, service=1),
                latitude=LATITUDE + math.degrees(y / curvature[0]),
                longitude=LONGITUDE + math.degrees(x / curvature[1]),
                altitude=HEIGHT + z,
                position_covariance=numpy.eye(3).flatten() * claimed**2,
                position_covariance_type=2,
            )
            messages.append((time, "/gps/fix", fix))
        if i % 5 == 0:
            speed = 1.005 * math.hypot(e1 - e0, n1 - n0) / (2 * dt) + noise.gauss(0.0, 0.02)
            zero = kind["geometry_msgs/msg/Pose"](position=vector(0.0, 0.0, 0.0, name="Point"), orientation=turned(0.0))
            twist = kind["geometry_msgs/msg/Twist"](linear=vector(speed, 0.0, 0.0), angular=vector(0.0, 0.0, 0.0))
            wheels = kind["nav_msgs/msg/Odometry"](
                header=header(time, "odom"),
                child_frame_id="base_link",
                pose=kind["geometry_msgs/msg/PoseWithCovariance"](pose=zero, covariance=numpy.zeros(36)),
                twist=kind["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=numpy.eye(6).flatten() * 0.01),
            )
            messages.append((time, "/wheel/odom", wheels))
        if i % 10 == 0:
            pose = kind["geometry_msgs/msg/Pose"](
                position=vector(east, north, 0.0, name="Point"), orientation=turned(heading)
            )
            truth = kind["geometry_msgs/msg/PoseStamped"](header=header(time, "map"), pose=pose)
            messages.append((time, "/mocap/pose", truth))
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}
        for time, topic, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
            writer.write(connections[topic], time, store.serialize_cdr(message, message.__msgtype__))


def geodesy():
    """Metres a radian to the north and to the east, on WGS 84."""
    a, e2 = 6_378_137.0, 0.00669437999014
    root = math.sqrt(1 - e2 * math.sin(math.radians(LATITUDE)) ** 2)
    meridian, normal = a * (1 - e2) / root**3, a / root
    return meridian + HEIGHT, (normal + HEIGHT) * math.cos(math.radians(LATITUDE))


def check(attitude, navigation):
    (attitude,), (navigation,) = (json.loads(pathlib.Path(file).read_text()) for file in (attitude, navigation))
    wrong = []
    if not attitude["total_deg"] < 4.0:
        wrong.append(f"the orientation is {attitude['total_deg']} deg off")
    if not navigation["position_m"]["rms"] < 1.0:
        wrong.append(f"the position is {navigation['position_m']['rms']} m off")
    if wrong:
        sys.exit(f"rosbags: a newcomer's bag: {', '.join(wrong)}")
    figures = f"{attitude['total_deg']:.2f} deg, {navigation['position_m']['rms']:.3f} m"
    print(f"rosbags: a newcomer's bag gives the right figures: {figures}")


if sys.argv[1] == "make":
    make(sys.argv[2])
else:
    check(*sys.argv[2:])
