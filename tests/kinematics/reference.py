"""Writes random robots with what Pinocchio computes of them, as JSON, for tests/kinematics.rs.

    python reference.py ROBOTS SEED FILE
"""

import json
import sys

import numpy as np
import pinocchio as pin

KINDS = ["fixed", "revolute", "continuous", "prismatic", "planar", "floating"]
DEGREES = {"fixed": (0, 0), "revolute": (1, 1), "continuous": (1, 1), "prismatic": (1, 1), "planar": (3, 3), "floating": (7, 6)}


def rotation(rpy):
    return pin.rpy.rpyToMatrix(*rpy)


def from_z(axis):
    """The shortest rotation that takes z to an axis."""
    return pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis).toRotationMatrix()


def inertial(rng):
    """Mass, centre, angles of its axes, and xx, xy, xz, yy, yz, zz of a body that could exist."""
    mass = float(rng.uniform(0.1, 5.0))
    spread = rng.normal(size=(3, 4))
    second = mass * spread @ spread.T
    inertia = np.trace(second) * np.eye(3) - second
    return [mass, rng.normal(size=3).tolist(), rng.uniform(-3, 3, size=3).tolist(), inertia[np.triu_indices(3)].tolist()]


def robot(rng):
    links = int(rng.integers(2, 14))
    joints = []
    for child in range(1, links):
        kind = KINDS[rng.integers(len(KINDS))] if rng.random() < 0.7 else "revolute"
        axis = rng.normal(size=3)
        if rng.random() < 0.4:
            axis = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
        axis = axis / np.linalg.norm(axis)
        if kind == "planar" and axis[2] < -0.9:
            axis = -axis  # half a turn has no shortest rotation, and Eigen's is inexact near it
        joint = {
            "kind": kind,
            "parent": int(rng.integers(max(0, child - 3), child)),
            "child": child,
            "xyz": rng.normal(size=3).tolist(),
            "rpy": rng.uniform(-3, 3, size=3).tolist(),
            "axis": axis.tolist(),
            "mimic": None,
        }
        single = [i for i, other in enumerate(joints) if DEGREES[other["kind"]][0] == 1]
        if DEGREES[kind][0] == 1 and single and rng.random() < 0.2:
            joint["mimic"] = [int(rng.choice(single)), float(rng.normal()), float(rng.normal())]
        joints.append(joint)
    inertials = [inertial(rng) if rng.random() < 0.8 else None for _ in range(links)]
    return {"links": links, "joints": joints, "inertials": inertials}


def model_of(robot):
    model = pin.Model()
    carrier = {0: (0, pin.SE3.Identity())}
    number = {}
    for index, joint in enumerate(robot["joints"]):
        parent, offset = carrier[joint["parent"]]
        placement = offset * pin.SE3(rotation(joint["rpy"]), np.array(joint["xyz"]))
        axis = np.array(joint["axis"])
        kind = joint["kind"]
        if kind == "fixed":
            carrier[joint["child"]] = (parent, placement)
            continue
        after = pin.SE3.Identity()
        if kind in ("revolute", "continuous"):
            made = pin.JointModelRevoluteUnaligned(axis)
        elif kind == "prismatic":
            made = pin.JointModelPrismaticUnaligned(axis)
        elif kind == "planar":
            turn = pin.SE3(from_z(axis), np.zeros(3))
            placement, after = placement * turn, turn.inverse()
            made = pin.JointModelPlanar()
        else:
            made = pin.JointModelFreeFlyer()
        number[index] = model.addJoint(parent, made, placement, f"joint{index}")
        carrier[joint["child"]] = (number[index], after)
    for link in range(robot["links"]):
        joint, offset = carrier[link]
        model.addFrame(pin.Frame(f"link{link}", joint, 0, offset, pin.FrameType.BODY))
        if robot["inertials"][link]:
            mass, centre, angles, (xx, xy, xz, yy, yz, zz) = robot["inertials"][link]
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            own = pin.SE3(rotation(angles), np.array(centre))
            model.appendBodyToJoint(joint, own.act(pin.Inertia(mass, np.zeros(3), inertia)), offset)
    return model, number


def state(rng, robot, model, number):
    """Coordinates as bb-core has them, those of Pinocchio, and the derivative of Pinocchio's velocities by ours."""
    q, v, a = [], [], []
    first = {}
    full_q, full_v, full_a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    velocities = sum(DEGREES[j["kind"]][1] for j in robot["joints"] if not j["mimic"])
    derivative = np.zeros((model.nv, velocities))
    for index, joint in enumerate(robot["joints"]):
        if joint["kind"] == "fixed":
            continue
        made = model.joints[number[index]]
        if joint["mimic"]:
            other, multiplier, offset = joint["mimic"]
            at, by, plus = first[other]
            multiplier, offset = multiplier * by, multiplier * plus + offset
            first[index] = (at, multiplier, offset)
            full_q[made.idx_q] = multiplier * q[at[0]] + offset
            full_v[made.idx_v] = multiplier * v[at[1]]
            full_a[made.idx_v] = multiplier * a[at[1]]
            derivative[made.idx_v, at[1]] += multiplier
            continue
        first[index] = ((len(q), len(v)), 1.0, 0.0)
        nq, nv = DEGREES[joint["kind"]]
        own = rng.uniform(-3, 3, size=nq)
        if joint["kind"] == "floating":
            own[3:] /= np.linalg.norm(own[3:])
            full_q[made.idx_q : made.idx_q + 7] = [*own[:3], *own[4:], own[3]]
        elif joint["kind"] == "planar":
            full_q[made.idx_q : made.idx_q + 4] = [own[0], own[1], np.cos(own[2]), np.sin(own[2])]
        else:
            full_q[made.idx_q] = own[0]
        derivative[made.idx_v : made.idx_v + nv, len(v) : len(v) + nv] = np.eye(nv)
        own_v, own_a = rng.normal(size=nv), rng.normal(size=nv)
        full_v[made.idx_v : made.idx_v + nv] = own_v
        full_a[made.idx_v : made.idx_v + nv] = own_a
        q.extend(own.tolist())
        v.extend(own_v.tolist())
        a.extend(own_a.tolist())
    return (q, v, a), (full_q, full_v, full_a), derivative


def case(rng):
    one = robot(rng)
    model, number = model_of(one)
    data = model.createData()
    if model.nv == 0:
        return case(rng)
    (q, v, a), (full_q, full_v, full_a), derivative = state(rng, one, model, number)
    pin.forwardKinematics(model, data, full_q, full_v, full_a)
    pin.computeJointJacobians(model, data, full_q)
    pin.updateFramePlacements(model, data)
    frames = [model.getFrameId(f"link{link}") for link in range(one["links"])]
    placements = [data.oMf[frame].homogeneous[:3].tolist() for frame in frames]
    motions = []
    for frame in frames:
        velocity = pin.getFrameVelocity(model, data, frame, pin.LOCAL)
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL)
        motions.append([*velocity.linear, *velocity.angular, *acceleration.linear, *acceleration.angular])
    base, tip = (int(link) for link in rng.choice(one["links"], size=2, replace=False))
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    of_base = pin.getFrameJacobian(model, data, frames[base], world).reshape(6, model.nv) @ derivative
    of_tip = pin.getFrameJacobian(model, data, frames[tip], world).reshape(6, model.nv) @ derivative
    turn = data.oMf[frames[base]].rotation.T
    lever = data.oMf[frames[tip]].translation - data.oMf[frames[base]].translation
    linear = of_tip[:3] - of_base[:3] - np.cross(of_base[3:].T, lever).T
    jacobian = np.vstack([turn @ linear, turn @ (of_tip[3:] - of_base[3:])])
    gravity = rng.normal(size=3) * 5
    model.gravity.linear = gravity
    # What it returns is memory of its argument, which has to live on.
    spare = model.createData()
    efforts = derivative.T @ pin.computeGeneralizedGravity(model, spare, full_q)
    motion_efforts = derivative.T @ pin.rnea(model, spare, full_q, full_v, full_a)
    # By columns: its `crba` takes the joints of a subtree to be numbered in a row, and these are not.
    still, weightless = np.zeros(model.nv), model.copy()
    weightless.gravity.linear = np.zeros(3)
    columns = [pin.rnea(weightless, spare, full_q, still, unit).copy() for unit in np.eye(model.nv)]
    mass_matrix = np.array(columns).T
    forward = None
    # Without mimics, velocities are those of Pinocchio; and each joint has something to move.
    if derivative.shape[0] == derivative.shape[1] and np.linalg.cond(mass_matrix) < 1e4:
        given = rng.normal(size=model.nv) * 10
        # In its own order of the joints, which is that of `derivative`.
        accelerations = pin.aba(model, spare, full_q, full_v, given)
        forward = [(derivative.T @ given).tolist(), (derivative.T @ accelerations).tolist()]
    mass_matrix = derivative.T @ mass_matrix @ derivative
    # Pinocchio leaves out what is fixed to the world.
    masses = [(one["inertials"][link], data.oMf[frames[link]]) for link in range(one["links"]) if one["inertials"][link]]
    mass = sum(inertial[0] for inertial, _ in masses)
    centre = sum((inertial[0] * placement.act(np.array(inertial[1])) for inertial, placement in masses), np.zeros(3))
    return {
        "robot": one,
        "positions": q,
        "velocities": v,
        "accelerations": a,
        "root_from_link": placements,
        "motions": motions,
        "base": base,
        "tip": tip,
        "jacobian": jacobian.T.tolist(),
        "gravity": gravity.tolist(),
        "efforts": efforts.tolist(),
        "motion_efforts": motion_efforts.tolist(),
        "mass_matrix": mass_matrix.tolist(),
        "forward": forward,
        "mass": mass,
        "centre_of_mass": (centre / mass).tolist() if mass else None,
    }


def main():
    robots, seed, file = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    rng = np.random.default_rng(seed)
    with open(file, "w") as out:
        for _ in range(robots):
            out.write(json.dumps(case(rng), separators=(",", ":")) + "\n")


main()
