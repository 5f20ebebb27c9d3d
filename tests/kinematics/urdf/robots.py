"""Writes a program that reads the URDFs of real robots and compares their kinematics with what Pinocchio computes of the same
files, which is written beside it.

    python robots.py REPOSITORY FOLDER SEED

The URDFs are those of the package `example-robot-data`, if it is installed, and those of tests/urdf.
"""

import json
import pathlib
import shutil
import sys
import xml.etree.ElementTree as xml

import numpy as np
import pinocchio as pin


def found(repository):
    """Names and files; of two with the same name, the first."""
    files = sorted(pathlib.Path(repository, "tests/urdf").glob("*.urdf"))
    for base in map(pathlib.Path, sys.path):
        files += sorted(base.glob("cmeel.prefix/share/example-robot-data/robots/**/*.urdf"))
    robots = {}
    for file in files:
        name = "".join(word.capitalize() for word in file.stem.replace("-", "_").replace(".", "_").split("_"))
        robots.setdefault(name, file)
    return robots


def case(file, rng):
    """What Pinocchio has of it, or why it has not."""
    try:
        model = pin.buildModelFromUrdf(str(file))
    except ValueError as error:
        return str(error).strip()
    if model.nv == 0:
        return "nothing of it moves"
    data = model.createData()
    joints = {joint.get("name"): joint for joint in xml.parse(file).getroot().findall("joint")}
    mimics = {
        name: joint.find("mimic") for name, joint in joints.items() if joint.find("mimic") is not None and joint.get("type") != "fixed"
    }
    names = [name for name in model.names[1:] if name not in mimics]
    q, v, a = ({name: float(rng.uniform(-2, 2)) for name in names} for _ in range(3))
    full_q, full_v, full_a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    derivative = np.zeros((model.nv, len(names)))
    for number in range(1, model.njoints):
        name, by, plus = model.names[number], 1.0, 0.0
        while name in mimics:
            mimic = mimics[name]
            plus += by * float(mimic.get("offset", 0))
            by *= float(mimic.get("multiplier", 1))
            name = mimic.get("joint")
        if name not in q:
            return f"{model.names[number]} mimics {name}, which does not move"
        made = model.joints[number]
        at = by * q[name] + plus
        if made.nv != 1:
            return f"{name} has {made.nv} degrees of freedom, whose numbers Pinocchio orders otherwise"
        full_q[made.idx_q : made.idx_q + made.nq] = [np.cos(at), np.sin(at)] if made.nq == 2 else [at]
        full_v[made.idx_v], full_a[made.idx_v] = by * v[name], by * a[name]
        derivative[made.idx_v, names.index(name)] = by
    pin.forwardKinematics(model, data, full_q)
    pin.computeJointJacobians(model, data, full_q)
    pin.updateFramePlacements(model, data)
    links = [link for link in xml.parse(file).getroot().findall("link")]
    frames = {link.get("name"): model.getFrameId(link.get("name"), pin.FrameType.BODY) for link in links}
    absent = [name for name, frame in frames.items() if frame >= model.nframes]
    if absent:
        return f"Pinocchio has no link {absent[0]}"
    tip = str(rng.choice(list(frames)))
    jacobian = pin.getFrameJacobian(model, data, frames[tip], pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    mass, moment = 0.0, np.zeros(3)
    for link in links:
        inertial = link.find("inertial")
        if inertial is None:
            continue
        own, origin = float(inertial.find("mass").get("value")), inertial.find("origin")
        centre = np.zeros(3) if origin is None else np.array([float(x) for x in origin.get("xyz", "0 0 0").split()])
        mass += own
        moment += own * data.oMf[frames[link.get("name")]].act(centre)
    spare = model.createData()
    gravity = derivative.T @ pin.computeGeneralizedGravity(model, spare, full_q)
    efforts = derivative.T @ pin.rnea(model, spare, full_q, full_v, full_a)
    return {
        "joints": names,
        "positions": list(q.values()),
        "velocities": list(v.values()),
        "accelerations": list(a.values()),
        "links": {name: data.oMf[frame].homogeneous[:3].tolist() for name, frame in frames.items()},
        "tip": tip,
        "jacobian": (jacobian.reshape(6, model.nv) @ derivative).T.tolist(),
        "gravity": gravity.tolist(),
        "efforts": efforts.tolist(),
        "mass": mass,
        "centre_of_mass": (moment / mass).tolist() if mass else None,
    }


MANIFEST = """[package]
name = "bb-real-robots"
version = "0.0.0"
edition = "2024"

[dependencies]
bb-core = {{ path = "{repository}/bb-core", features = ["urdf"] }}
serde_json = "1"

[workspace]
"""


def main():
    repository, folder, rng = sys.argv[1], pathlib.Path(sys.argv[2]), np.random.default_rng(int(sys.argv[3]))
    (folder / "src").mkdir()
    declarations, calls, cases = [], [], {}
    for name, file in found(repository).items():
        made = case(file, rng)
        if isinstance(made, str):
            print(f"urdf: {name} is left out: {made}")
            continue
        shutil.copy(file, folder / f"{name}.urdf")
        cases[name] = made
        declarations.append(f'bb_core::robot! {{ robot {name}; topology: urdf("{name}.urdf"); }}')
        calls.append(f"    compare::robot::<{name}>(&cases)?;")
    (folder / "cases.json").write_text(json.dumps(cases))
    (folder / "Cargo.toml").write_text(MANIFEST.format(repository=repository))
    shutil.copy(pathlib.Path(repository, "Cargo.lock"), folder)
    shutil.copy(pathlib.Path(repository, "tests/kinematics/urdf/compare.rs"), folder / "src")
    body = "\n".join(calls)
    (folder / "src/main.rs").write_text(
        "mod compare;\n" + "\n".join(declarations) + "\nfn main() -> compare::Result<()> {\n    let cases = compare::cases()?;\n"
        + body + "\n    Ok(())\n}\n"
    )
    print(f"urdf: {len(cases)} robots: {', '.join(cases)}")


main()
