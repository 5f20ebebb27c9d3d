"""Compares a simulated ride of an arm with what MuJoCo's own sensors measure on the same motion.

    python beside_mujoco.py RIDE.json
"""

import json
import sys

import mujoco
import numpy as np


def model_of(ride):
    spec = mujoco.MjSpec.from_string(ride["urdf"])
    spec.compiler.fusestatic = False
    spec.option.gravity = [0, 0, -ride["gravity"]]
    for link in ride["links"]:
        spec.body(link).add_site(name=link)
        for kind in ("ACCELEROMETER", "GYRO"):
            made = getattr(mujoco.mjtSensor, f"mjSENS_{kind}")
            spec.add_sensor(name=f"{kind}_{link}", type=made, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=link)
    model = spec.compile()
    for joint, damping, motor in zip(ride["joints"], ride["damping"], ride["motors"]):
        moved = model.jnt_dofadr[model.joint(joint).id]
        model.dof_damping[moved], model.dof_armature[moved] = damping, motor
    # MuJoCo pushes joints back before they are at a limit.
    model.jnt_limited[:] = 0
    return model


def main():
    with open(sys.argv[1]) as file:
        ride = json.load(file)
    model = model_of(ride)
    data = mujoco.MjData(model)
    order = [model.joint(joint).id for joint in ride["joints"]]
    at, moves = model.jnt_qposadr[order], model.jnt_dofadr[order]
    worst = {"force": 0.0, "rate": 0.0, "effort": 0.0}
    fastest, strongest = 0.0, 0.0
    for sample in ride["samples"]:
        data.qpos[at], data.qvel[moves], data.qacc[moves] = sample["position"], sample["velocity"], sample["acceleration"]
        mujoco.mj_inverse(model, data)
        effort = np.abs(data.qfrc_inverse[moves] - sample["effort"]).max()
        worst["effort"] = np.maximum(worst["effort"], effort)
        for link, imu in zip(ride["links"], sample["imus"]):
            force = np.abs(data.sensor(f"ACCELEROMETER_{link}").data - imu["force"]).max()
            rate = np.abs(data.sensor(f"GYRO_{link}").data - imu["rate"]).max()
            worst["force"], worst["rate"] = np.maximum(worst["force"], force), np.maximum(worst["rate"], rate)
            fastest = max(fastest, np.linalg.norm(imu["rate"]))
            strongest = max(strongest, np.linalg.norm(imu["force"]))
    print(
        f"simulation: {len(ride['samples'])} samples, up to {fastest:.1f} rad/s and {strongest:.1f} m/s²; MuJoCo {mujoco.__version__} "
        f"differs by at most {worst['force']:.1e} m/s², {worst['rate']:.1e} rad/s and {worst['effort']:.1e} N·m"
    )
    if fastest < 2 or strongest < 12:
        sys.exit("simulation: it hardly moves")
    # Encoders measure what they are compared by. An effort is that in the middle of a step, whose velocity is predicted.
    # NaN is not within them either.
    if not (worst["force"] <= 1e-6 and worst["rate"] <= 1e-6 and worst["effort"] <= 3e-3):
        sys.exit("simulation: differs from MuJoCo")


main()
