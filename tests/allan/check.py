"""Makes a recording of noise at rest, and compares the Allan deviations of it with those of allantools.

`check` runs this.
"""

import csv
import json
import sys

import allantools
import numpy

RATE = 100.0
NAMES = ["gx", "gy", "gz", "ax", "ay", "az"]


def even(count, state):
    """Numbers from 0 to 1 of an xorshift: those of the test in Rust."""
    numbers = []
    for _ in range(count):
        state ^= (state << 13) & 0xFFFFFFFF
        state ^= state >> 17
        state ^= (state << 5) & 0xFFFFFFFF
        numbers.append(state / 0xFFFFFFFF)
    return numpy.array(numbers)


def rest(seed):
    """White noise and a random walk; of seeds 12345 and 54321 that of the test in Rust."""
    white = (even(20000, seed) - 0.5) * numpy.sqrt(12)
    walk = numpy.cumsum((even(20000, 66666 - seed) - 0.5) * numpy.sqrt(12))
    return 0.01 * white + 1e-4 * walk


def make(file):
    columns = [rest(seed) for seed in (12345, 23456, 34567, 45678, 56789, 61234)]
    times = numpy.arange(20000) / RATE
    with open(file, "w", newline="") as out:
        writer = csv.writer(out)
        writer.writerow(["t", *NAMES])
        for row in zip(times, *columns):
            writer.writerow([repr(float(value)) for value in row])


def compare(file, ours):
    samples = numpy.loadtxt(file, delimiter=",", skiprows=1)
    with open(ours) as found:
        (found,) = json.load(found)
    worst = 0.0
    for column, name in enumerate(NAMES, start=1):
        axis = found["gyroscope" if name[0] == "g" else "accelerometer"][name[1]]
        times = numpy.array([time for time, _, _ in axis["allan"]])
        _, theirs, _, _ = allantools.oadev(samples[:, column], rate=RATE, data_type="freq", taus=times)
        if len(theirs) != len(times):
            sys.exit(f"allan: {name}: {len(times)} averaging times, allantools has {len(theirs)}")
        for (time, deviation, _), their in zip(axis["allan"], theirs):
            error = abs(deviation / their - 1)
            worst = max(worst, error)
            if error > 1e-6:
                sys.exit(f"allan: {name} at {time} s: {deviation}, allantools has {their}")
        lowest = min(theirs) / 0.66428
        if abs(axis["bias_instability"] / lowest - 1) > 1e-6:
            sys.exit(f"allan: {name}: bias instability {axis['bias_instability']}, allantools has {lowest}")
    print(f"allan: {len(NAMES)} axes agree with allantools {allantools.__version__} within {worst:.1e}")


if sys.argv[1] == "make":
    make(sys.argv[2])
else:
    compare(sys.argv[2], sys.argv[3])
