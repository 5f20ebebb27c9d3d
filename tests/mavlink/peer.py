"""A flight controller: sends what it measures, and writes what it hears, a line of JSON each, until its input ends.

Lines of its input tell it what to do wrong: `mute` stops HIGHRES_IMU, `ahead MS` sets its clock ahead, `flood` sends
without a pause, and `well` ends all of these.
"""

import json
import math
import os
import sys
import threading
import time

# Before the import, which chooses the version by it.
os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil
from pymavlink.dialects.v20 import common

START = time.monotonic()


class Wrong:
    """What it does wrong."""

    is_mute = False
    floods = False
    ahead_ms = 0
    has_ended = False


def obey():
    for line in sys.stdin:
        match line.split():
            case ["mute"]:
                Wrong.is_mute = True
            case ["ahead", ms]:
                Wrong.ahead_ms = int(ms)
            case ["flood"]:
                Wrong.floods = True
            case _:
                Wrong.is_mute, Wrong.floods, Wrong.ahead_ms = False, False, 0
    Wrong.has_ended = True


def boot_ms():
    return 1_000_000 + int((time.monotonic() - START) * 1000) + Wrong.ahead_ms


def heartbeat():
    return common.MAVLink_heartbeat_message(
        common.MAV_TYPE_FIXED_WING, common.MAV_AUTOPILOT_PX4, common.MAV_MODE_FLAG_SAFETY_ARMED, 77, common.MAV_STATE_ACTIVE, 3
    )


def measured():
    """All that it measures, and whether it is sent as MAVLink 1."""
    ms = boot_ms()
    half = math.sqrt(0.5)
    if not Wrong.is_mute:
        yield common.MAVLink_highres_imu_message(
            ms * 1000, 1.0, 2.0, -9.5, 0.25, 0.5, 0.75, 0, 0, 0, 0, 0, 0, 0, fields_updated=0x3F
        ), False
    yield common.MAVLink_scaled_imu2_message(ms, 100, 200, -1000, 10, 20, 30, 0, 0, 0), True
    # To the east.
    yield common.MAVLink_attitude_quaternion_message(ms, half, 0, 0, half, 0, 0, 0), False
    yield common.MAVLink_gps_raw_int_message(
        ms * 1000, common.GPS_FIX_TYPE_RTK_FIXED, -338_000_000, 1_512_000_000, 40_000, 70, 65535, 0, 0, 17,
        alt_ellipsoid=62_500, h_acc=20, v_acc=40,
    ), False


def plain(value):
    """As JSON has it: what is not a number is null."""
    if isinstance(value, float) and math.isnan(value):
        return None
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value


def main():
    connection = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common", source_system=1, source_component=1)
    print(connection.port.getsockname()[1], flush=True)
    threading.Thread(target=obey, daemon=True).start()
    knows_peer, next_round = False, time.monotonic()
    while not Wrong.has_ended:
        message = connection.recv_match(blocking=not Wrong.floods, timeout=0.005)
        if message is not None and message.get_type() != "BAD_DATA":
            knows_peer = True
            values = {name: plain(value) for name, value in message.to_dict().items()}
            values["from"] = [message.get_srcSystem(), message.get_srcComponent()]
            print(json.dumps(values), flush=True)
        if knows_peer and (Wrong.floods or time.monotonic() >= next_round):
            next_round = time.monotonic() + 0.02
            connection.mav.send(heartbeat(), force_mavlink1=True)
            for message, is_old in measured():
                connection.mav.send(message, force_mavlink1=is_old)


main()
