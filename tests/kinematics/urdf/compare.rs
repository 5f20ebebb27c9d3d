//! A robot that was read from a URDF, compared with what Pinocchio computed of the same file. Part of a program that
//! `robots.py` writes.

use bb_core::Robot;
use bb_core::kinematics::{Dynamics, Kinematics};
use bb_core::nalgebra::{Matrix6xX, Vector3};
use serde_json::Value;

pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// The largest differences of frames, and of everything else, relative to the largest number where that is beyond 1.
const FRAMES: f64 = 1e-12;
const OTHERS: f64 = 1e-10;

pub fn cases() -> Result<Value> {
    Ok(serde_json::from_str(&std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/cases.json"))?)?)
}

fn numbers(value: &Value) -> Result<Vec<f64>> {
    let all = value.as_array().ok_or_else(|| format!("no list: {value}"))?;
    let nested: Vec<Vec<f64>> = all
        .iter()
        .map(|entry| entry.as_f64().map_or_else(|| numbers(entry), |number| Ok(vec![number])))
        .collect::<Result<_>>()?;
    Ok(nested.concat())
}

fn difference(left: &[f64], right: &[f64]) -> Result<f64> {
    if left.len() != right.len() {
        return Err(format!("{} numbers instead of {}", left.len(), right.len()).into());
    }
    // The larger one of NaN and a number is the number.
    if !left.iter().all(|entry| entry.is_finite()) {
        return Err(format!("not finite: {left:?}").into());
    }
    let largest = right.iter().fold(1.0_f64, |largest, entry| largest.max(entry.abs()));
    Ok(left.iter().zip(right).fold(0.0_f64, |most, (left, right)| most.max((left - right).abs())) / largest)
}

pub fn robot<R: Robot>(cases: &Value) -> Result<()> {
    let (frames, others) = compare::<R>(&cases[R::NAME]).map_err(|error| format!("{}: {error}", R::NAME))?;
    println!("urdf: {}: frames within {frames:.1e}, all else within {others:.1e}", R::NAME);
    if frames <= FRAMES && others <= OTHERS { Ok(()) } else { Err(format!("{} differs", R::NAME).into()) }
}

fn compare<R: Robot>(case: &Value) -> Result<(f64, f64)> {
    let kinematics = Kinematics::new(R::TOPOLOGY)?;
    let names = case["joints"].as_array().ok_or("joints")?;
    if names.len() != kinematics.velocities() {
        return Err(format!("{} joints instead of {}", kinematics.velocities(), names.len()).into());
    }
    // The order of the joints in the file and that of Pinocchio differ.
    let places: Vec<usize> = names
        .iter()
        .map(|name| {
            let name = name.as_str().unwrap_or_default();
            let joint = kinematics.joint(name).ok_or_else(|| format!("no joint {name}"))?;
            Ok::<_, Box<dyn std::error::Error>>(joint.velocities.start)
        })
        .collect::<Result<_>>()?;
    let placed = |values: &Value| -> Result<Vec<f64>> {
        let mut all = vec![0.0; places.len()];
        places.iter().zip(numbers(values)?).for_each(|(place, value)| all[*place] = value);
        Ok(all)
    };
    let [q, v, a] = [placed(&case["positions"])?, placed(&case["velocities"])?, placed(&case["accelerations"])?];
    let mut dynamics = Dynamics::new(kinematics.clone());
    dynamics.frames_mut().update_motion(&q, &v, &a)?;
    let (mut frames, mut others) = (0.0_f64, 0.0_f64);
    let links = case["links"].as_object().ok_or("links")?;
    if links.len() != R::TOPOLOGY.links.len() {
        return Err(format!("{} links instead of {}", R::TOPOLOGY.links.len(), links.len()).into());
    }
    for (name, expected) in links {
        let link = kinematics.link(name).ok_or_else(|| format!("no link {name}"))?;
        let rows = dynamics.frames().root_from_link(link)?.to_homogeneous().fixed_rows::<3>(0).transpose();
        frames = frames.max(difference(rows.as_slice(), &numbers(expected)?)?);
    }
    let root = kinematics.link(R::TOPOLOGY.links[0].name).ok_or("a root")?;
    let tip = kinematics.link(case["tip"].as_str().ok_or("tip")?).ok_or("a tip")?;
    let mut jacobian = Matrix6xX::zeros(kinematics.velocities());
    kinematics.chain(root, tip)?.jacobian(&q, &mut jacobian)?;
    let columns: Vec<f64> = places.iter().flat_map(|place| jacobian.column(*place).iter().copied().collect::<Vec<_>>()).collect();
    others = others.max(difference(&columns, &numbers(&case["jacobian"])?)?);
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let mut efforts = vec![0.0; places.len()];
    dynamics.efforts(&gravity, &mut efforts)?;
    others = others.max(difference(&efforts, &placed(&case["efforts"])?)?);
    let mut frames_at_rest = dynamics.frames().clone();
    frames_at_rest.gravity_efforts(&gravity, &mut efforts)?;
    others = others.max(difference(&efforts, &placed(&case["gravity"])?)?);
    let mass = case["mass"].as_f64().ok_or("mass")?;
    others = others.max(difference(&[frames_at_rest.mass()], &[mass])?);
    match (frames_at_rest.centre_of_mass(), case["centre_of_mass"].is_null()) {
        (Some(centre), false) => others = others.max(difference(centre.as_slice(), &numbers(&case["centre_of_mass"])?)?),
        (None, true) => {}
        _ => return Err("only one of both has a mass".into()),
    }
    Ok((frames, others))
}
