//! Random robots beside Pinocchio, with what that computed stored in `pinocchio.jsonl`. More of them:
//! `tests/kinematics/check`.

use bb_core::kinematics::{Dynamics, Frames, Kinematics};
use bb_core::nalgebra::{DMatrix, DVector, Isometry3, Matrix6xX, Rotation3, Translation3, Vector3};
use bb_core::topology::{Inertial, Joint, JointKind, Link, Mimic, Origin, Topology};
use serde_json::Value;
use std::error::Error;

type Failure = Box<dyn Error>;

fn numbers(value: &Value) -> Result<Vec<f64>, Failure> {
    let all = value.as_array().ok_or_else(|| format!("no list: {value}"))?;
    all.iter().map(|number| number.as_f64().ok_or_else(|| format!("no number: {number}").into())).collect()
}

fn three(value: &Value) -> Result<[f64; 3], Failure> {
    <[f64; 3]>::try_from(numbers(value)?).map_err(|given| format!("not three: {given:?}").into())
}

fn index(value: &Value) -> Result<usize, Failure> {
    Ok(usize::try_from(value.as_u64().ok_or_else(|| format!("no index: {value}"))?)?)
}

fn kind(name: &str) -> Result<JointKind, Failure> {
    use JointKind::{Continuous, Fixed, Floating, Planar, Prismatic, Revolute};
    let all = [Fixed, Revolute, Continuous, Prismatic, Planar, Floating];
    all.into_iter().find(|kind| kind.name() == name).ok_or_else(|| format!("no kind: {name}").into())
}

fn name(what: &str, number: usize) -> &'static str {
    Box::leak(format!("{what}{number}").into_boxed_str())
}

fn topology(robot: &Value) -> Result<Topology, Failure> {
    let listed = robot["joints"].as_array().ok_or("joints")?;
    let joints = listed.iter().enumerate().map(|(number, joint)| {
        let mimic = match joint["mimic"].as_array().map(Vec::as_slice) {
            Some([other, multiplier, offset]) => Some(Mimic {
                joint: index(other)?,
                multiplier: multiplier.as_f64().ok_or("multiplier")?,
                offset: offset.as_f64().ok_or("offset")?,
            }),
            _ => None,
        };
        Ok(Joint {
            name: name("joint", number),
            kind: kind(joint["kind"].as_str().ok_or("kind")?)?,
            parent: index(&joint["parent"])?,
            child: index(&joint["child"])?,
            parent_from_joint: Origin { xyz: three(&joint["xyz"])?, rpy: three(&joint["rpy"])? },
            axis: Some(three(&joint["axis"])?),
            limit: None,
            dynamics: None,
            mimic,
            transmission: None,
        })
    });
    let joints: Vec<Joint> = joints.collect::<Result<_, Failure>>()?;
    let listed = robot["inertials"].as_array().ok_or("inertials")?;
    let links = listed.iter().enumerate().map(|(number, inertial)| {
        let inertial = match inertial.as_array().map(Vec::as_slice) {
            Some([mass, centre, angles, inertia]) => Some(Inertial {
                link_from_inertia: Origin { xyz: three(centre)?, rpy: three(angles)? },
                mass: mass.as_f64().ok_or("mass")?,
                inertia: numbers(inertia)?.try_into().map_err(|given| format!("not six: {given:?}"))?,
            }),
            _ => None,
        };
        Ok(Link {
            name: name("link", number),
            parent_joint: joints.iter().position(|joint| joint.child == number),
            root_from_link: None,
            inertial,
            visuals: &[],
            collisions: &[],
        })
    });
    let links: Vec<Link> = links.collect::<Result<_, Failure>>()?;
    Ok(Topology { links: links.leak(), joints: joints.leak() })
}

fn isometry(rows: &Value) -> Result<Isometry3<f64>, Failure> {
    let rows: Vec<Vec<f64>> = rows.as_array().ok_or("rows")?.iter().map(numbers).collect::<Result<_, _>>()?;
    let entry = |row: usize, column: usize| rows[row][column];
    let rotation = bb_core::nalgebra::Matrix3::from_fn(entry);
    let translation = Translation3::new(entry(0, 3), entry(1, 3), entry(2, 3));
    Ok(Isometry3::from_parts(translation, Rotation3::from_matrix_unchecked(rotation).into()))
}

/// The largest difference of their entries, relative to the largest entry where that is beyond 1.
fn difference(left: &[f64], right: &[f64]) -> f64 {
    assert_eq!(left.len(), right.len());
    // The larger one of NaN and a number is the number.
    assert!(left.iter().all(|entry| entry.is_finite()), "{left:?}");
    let largest = right.iter().fold(1.0_f64, |largest, entry| largest.max(entry.abs()));
    left.iter().zip(right).fold(0.0_f64, |most, (left, right)| most.max((left - right).abs())) / largest
}

fn entries(isometry: &Isometry3<f64>) -> Vec<f64> {
    isometry.to_homogeneous().iter().copied().collect()
}

/// The largest differences: of frames, motions, Jacobian, efforts against gravity, centre of mass, efforts of the motion, mass
/// matrix and accelerations caused by efforts.
const WORST: [&str; 8] =
    ["frames", "motions", "Jacobians", "efforts", "centres", "motion efforts", "mass matrices", "accelerations"];

/// The bounds of these. Accelerations are multiplied by the condition of the mass matrix, which is at most 1e4.
const BOUNDS: [f64; 8] = [1e-12, 1e-12, 1e-12, 1e-12, 1e-12, 1e-12, 1e-12, 1e-10];

fn compare(case: &Value) -> Result<[f64; 8], Failure> {
    let topology = topology(&case["robot"])?;
    let kinematics = Kinematics::new(&topology)?;
    let id = |number: usize| kinematics.link(topology.links[number].name).ok_or("a link");
    let [q, v, a] = [numbers(&case["positions"])?, numbers(&case["velocities"])?, numbers(&case["accelerations"])?];
    let mut frames = Frames::new(kinematics.clone());
    frames.update_motion(&q, &v, &a)?;
    let mut worst = [0.0_f64; 8];
    // Relative to the fastest link: what turns one link against others is the difference of what they do.
    let (mut motions, mut expected_motions) = (Vec::new(), Vec::new());
    for number in 0..topology.links.len() {
        let expected = isometry(&case["root_from_link"][number])?;
        let root_from_link = frames.root_from_link(id(number)?)?;
        worst[0] = worst[0].max(difference(&entries(&root_from_link), &entries(&expected)));
        let motion = frames.motion(id(number)?)?;
        let all = [motion.velocity, motion.angular_velocity, motion.acceleration, motion.angular_acceleration];
        motions.extend(all.iter().flat_map(|vector| vector.iter().copied()));
        expected_motions.extend(numbers(&case["motions"][number])?);
    }
    worst[1] = difference(&motions, &expected_motions);
    let (base, tip) = (id(index(&case["base"])?)?, id(index(&case["tip"])?)?);
    let chain = kinematics.chain(base, tip)?;
    let mut jacobian = Matrix6xX::zeros(kinematics.velocities());
    let base_from_tip = chain.jacobian(&q, &mut jacobian)?;
    let expected = entries(&frames.transform(base, tip)?);
    worst[0] = worst[0].max(difference(&entries(&base_from_tip), &expected));
    worst[0] = worst[0].max(difference(&entries(&chain.transform(&q)?), &expected));
    let columns = case["jacobian"].as_array().ok_or("columns")?;
    let columns: Vec<f64> = columns.iter().map(numbers).collect::<Result<Vec<_>, _>>()?.concat();
    worst[2] = difference(jacobian.as_slice(), &columns);
    let mut efforts = vec![0.0; kinematics.velocities()];
    frames.gravity_efforts(&Vector3::from(three(&case["gravity"])?), &mut efforts)?;
    worst[3] = difference(&efforts, &numbers(&case["efforts"])?);
    let centre = frames.centre_of_mass();
    assert_eq!(centre.is_some(), !case["centre_of_mass"].is_null());
    if let Some(centre) = centre {
        worst[4] = difference(centre.as_slice(), &numbers(&case["centre_of_mass"])?);
        assert!((frames.mass() - case["mass"].as_f64().ok_or("mass")?).abs() < 1e-12 * frames.mass());
    }
    let [of_motion, of_masses, forward] = compare_dynamics(case, kinematics, [&q, &v, &a])?;
    (worst[5], worst[6], worst[7]) = (of_motion, of_masses, forward);
    Ok(worst)
}

/// The differences of the efforts of a motion, of the mass matrix, and of the accelerations that efforts cause.
fn compare_dynamics(case: &Value, kinematics: Kinematics, [q, v, a]: [&[f64]; 3]) -> Result<[f64; 3], Failure> {
    let velocities = kinematics.velocities();
    let gravity = Vector3::from(three(&case["gravity"])?);
    let mut dynamics = Dynamics::new(kinematics);
    dynamics.frames_mut().update_motion(q, v, a)?;
    let mut efforts = vec![0.0; velocities];
    dynamics.efforts(&gravity, &mut efforts)?;
    let of_motion = difference(&efforts, &numbers(&case["motion_efforts"])?);
    let mut masses = DMatrix::zeros(velocities, velocities);
    dynamics.mass_matrix(&mut masses)?;
    let rows = case["mass_matrix"].as_array().ok_or("rows")?;
    let rows: Vec<f64> = rows.iter().map(numbers).collect::<Result<Vec<_>, _>>()?.concat();
    let of_masses = difference(masses.transpose().as_slice(), &rows);
    assert!((&masses - masses.transpose()).abs().max() <= 1e-12 * masses.abs().max());
    let Some([given, expected]) = case["forward"].as_array().map(Vec::as_slice) else {
        return Ok([of_motion, of_masses, 0.0]);
    };
    dynamics.frames_mut().update_motion(q, v, &vec![0.0; velocities])?;
    dynamics.efforts(&gravity, &mut efforts)?;
    let left = DVector::from(numbers(given)?) - DVector::from(efforts);
    let accelerations = masses.cholesky().ok_or("the mass matrix is positive definite")?.solve(&left);
    Ok([of_motion, of_masses, difference(accelerations.as_slice(), &numbers(expected)?)])
}

fn agree(cases: &str) -> Result<usize, Failure> {
    let mut worst = [0.0_f64; 8];
    let mut forward = 0;
    for (number, case) in cases.lines().enumerate() {
        let case: Value = serde_json::from_str(case)?;
        forward += usize::from(!case["forward"].is_null());
        let differences = compare(&case).map_err(|error| format!("robot {number}: {error}"))?;
        assert!(
            differences.iter().zip(&BOUNDS).all(|(difference, bound)| difference < bound),
            "robot {number} differs by {differences:?}"
        );
        worst.iter_mut().zip(differences).for_each(|(worst, difference)| *worst = worst.max(difference));
    }
    let worst: Vec<String> =
        WORST.iter().zip(worst).map(|(what, difference)| format!("{what} {difference:.1e}")).collect();
    println!("{} robots, largest differences: {}", cases.lines().count(), worst.join(", "));
    assert!(
        forward * 20 >= cases.lines().count(),
        "only {forward} of {} with accelerations",
        cases.lines().count()
    );
    Ok(cases.lines().count())
}

#[test]
fn random_robots_move_as_in_pinocchio() -> Result<(), Failure> {
    assert_eq!(agree(include_str!("pinocchio.jsonl"))?, 30);
    Ok(())
}

#[test]
#[ignore = "reads what tests/kinematics/check has Pinocchio compute"]
fn more_random_robots_move_as_in_pinocchio() -> Result<(), Failure> {
    let file = std::env::var("BB_KINEMATICS_REFERENCE")?;
    assert!(agree(&std::fs::read_to_string(file)?)? >= 1_000);
    Ok(())
}
