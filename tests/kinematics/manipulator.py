"""Writes the ride of a mobile manipulator with what Pinocchio computes of it, as JSON, for tests/kinematics/manipulator.rs.

    python manipulator.py SEED FILE

The robot is made here by hand from the numbers of the declaration, and joints are interpolated with numpy.
"""

import json
import sys

import numpy as np
import pinocchio as pin


def at(xyz, rpy_deg=(0, 0, 0)):
    return pin.SE3(pin.rpy.rpyToMatrix(*np.radians(rpy_deg)), np.array(xyz, dtype=float))


def robot():
    model = pin.Model()
    z = np.array([0.0, 0.0, 1.0])
    drive = model.addJoint(0, pin.JointModelPlanar(), at([0.5, -0.2, 0], [0, 0, 30]), "drive")
    lift = model.addJoint(drive, pin.JointModelPrismaticUnaligned(z), at([-0.1, 0, 0.4]), "lift")
    shoulder = model.addJoint(lift, pin.JointModelRevoluteUnaligned(z), at([0, 0, 0.1]), "shoulder")
    elbow_axis = np.array([0.0, 0.6, 0.8])
    elbow = model.addJoint(shoulder, pin.JointModelRevoluteUnaligned(elbow_axis), at([0.4, 0, 0], [90, 0, 0]), "elbow")
    wrist_axis = np.array([1.0, 0.0, 0.0])
    wrist = model.addJoint(elbow, pin.JointModelRevoluteUnaligned(wrist_axis), at([0.35, 0, 0.02], [0, -40, 0]), "wrist")
    model.addFrame(pin.Frame("lidar", drive, 0, at([0.3, 0, 0.2], [180, 0, 0]), pin.FrameType.BODY))
    model.addFrame(pin.Frame("camera", wrist, 0, at([0.05, 0.01, 0.03], [-90, 0, -90]), pin.FrameType.BODY))
    return model


def between(time, states):
    """Each column of the states, whose first one is time, by straight lines."""
    return [np.interp(time, states[:, 0], column) for column in states[:, 1:].T]


def place(model, frame, drive, arm):
    x, y, heading = drive
    lift, shoulder, elbow = arm
    wrist = -0.5 * elbow + np.radians(10)
    data = model.createData()
    q = np.array([x, y, np.cos(heading), np.sin(heading), lift, shoulder, elbow, wrist])
    pin.framesForwardKinematics(model, data, q)
    placed = data.oMf[model.getFrameId(frame)]
    return [*placed.translation.tolist(), *placed.rotation.flatten().tolist()]


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def main():
    rng = np.random.default_rng(int(sys.argv[1]))
    model = robot()
    # Times in nanoseconds, as sensors without a common clock have them.
    odometry, arm = [], []
    time = 0
    while time < 4_000_000_000:
        t = time * 1e-9
        odometry.append([time, 0.8 * t, np.sin(t), 2.5 * t + 0.3 * np.sin(3 * t)])
        time += int(rng.integers(8_000_000, 12_000_000))
    time = 1
    while time < 4_000_000_000:
        t = time * 1e-9
        arm.append([time, 0.25 + 0.2 * np.sin(t), 4.0 * t, 0.9 * np.sin(1.7 * t)])
        time += int(rng.integers(3_000_000, 6_000_000))
    odometry, arm = np.array(odometry), np.array(arm)
    lidar = np.sort(rng.integers(20_000_000, 3_900_000_000, size=400)).tolist()
    views = []
    for camera in np.sort(rng.integers(40_000_000, 3_900_000_000, size=300)).tolist():
        # What was the last scan, as the estimator has it.
        scans = [scan for scan in lidar if scan <= camera]
        if not scans or camera - scans[-1] > 30_000_000:
            continue
        placed = place(model, "camera", between(camera, odometry), between(camera, arm))
        scanned = place(model, "lidar", between(scans[-1], odometry), [0.0, 0.0, 0.0])
        views.append({"time": camera, "camera": placed, "scan": scans[-1], "lidar": scanned})
    # Sensors tell angles in one turn.
    told = {
        "odometry": [[int(row[0]), row[1], row[2], wrapped(row[3])] for row in odometry.tolist()],
        "arm": [[int(row[0]), row[1], wrapped(row[2]), row[3]] for row in arm.tolist()],
        "lidar": lidar,
        "views": views,
    }
    with open(sys.argv[2], "w") as file:
        json.dump(told, file, separators=(",", ":"))
        file.write("\n")


main()
