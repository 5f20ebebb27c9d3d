"""Calibrates the six poses of a CSV file by imucal: `ferraris.py FILE GRAVITY`.

The file has 400 rows a pose, of which the first 300 are at rest, in the order +x, -x, +y, -y, +z, -z upwards; columns are
specific force (m/s²) and angular velocity (rad/s). Prints what `bb calibrate imu` prints. The three rotations that the method
wants for the gyroscope's scale are simulated ones, without errors but its offset.
"""

import sys

import numpy as np
from imucal import FerrarisCalibration, FerrarisSignalRegions

file, gravity = sys.argv[1], float(sys.argv[2])
rows = np.loadtxt(file, delimiter=",")
poses = [rows[400 * i : 400 * i + 300] for i in range(6)]

RATE = 100.0
bias = rows[:, 3:].mean(axis=0)


def rotation(axis):
    turned = np.zeros((1000, 6))
    turned[:, 2] = gravity
    turned[:, 3:] = bias
    # Two pi and no more: the method is told a full turn.
    turned[:, 3 + axis] += -2 * np.pi / 10.0
    return turned


# Its order is +x, -x, +y, -y, +z, -z too: accelerometer, then gyroscope; then the same of the three rotations.
rotations = [rotation(axis) for axis in range(3)]
held = [pose[:, :3] for pose in poses] + [pose[:, 3:] for pose in poses]
turned = [one[:, :3] for one in rotations] + [one[:, 3:] for one in rotations]
regions = FerrarisSignalRegions(*held, *turned)
found = FerrarisCalibration(grav=gravity, expected_angle=-2 * np.pi).compute(
    regions, RATE, from_acc_unit="m/s^2", from_gyr_unit="rad/s"
)
matrix = np.linalg.inv(found.K_a @ found.R_a)


def text(values):
    return "[" + ", ".join(repr(float(value)) for value in np.ravel(values)) + "]"


print("accelerometer_offset =", text(found.b_a))
print("accelerometer_matrix =", text(matrix))
print("gyroscope_offset =", text(found.b_g))
