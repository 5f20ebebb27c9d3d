//! Cost of kinematics: a transform through seven moving joints, its Jacobian, all links, and inverse kinematics of random poses within the
//! limits of two arms, the fastest of three times each.
//!
//! `cargo bench -p bb-benches --bench kinematics` prints one JSON object a line.

use bb_core::kinematics::{Frames, InverseKinematics, InverseParams, Kinematics, LinkId, Target};
use bb_core::nalgebra::Matrix6xX;
use bb_core::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardUniform};
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

robot! { robot Panda; topology: urdf("../tests/urdf/panda.urdf"); }
robot! { robot Ur5; topology: urdf("../tests/urdf/ur5_robot.urdf"); }

/// Poses for which a solution is looked for.
const POSES: usize = 10_000;

fn main() -> Result<(), Box<dyn Error>> {
    arm::<Panda>("panda_link0", "panda_hand_tcp")?;
    arm::<Ur5>("base_link", "tool0")
}

fn arm<R: Robot>(base: &str, tip: &str) -> Result<(), Box<dyn Error>> {
    let kinematics = Kinematics::new(R::TOPOLOGY)?;
    let (base, tip) = (kinematics.link(base).ok_or("no base")?, kinematics.link(tip).ok_or("no tip")?);
    let chain = kinematics.chain(base, tip)?;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let positions: Vec<Vec<f64>> = (0..1_000).map(|_| position(&mut random, &kinematics)).collect();
    let mut jacobian = Matrix6xX::zeros(kinematics.velocities());
    let mut frames = Frames::new(kinematics.clone());
    let transform_ns = each(&positions, |positions| drop(black_box(chain.transform(positions))));
    let jacobian_ns = each(&positions, |positions| drop(black_box(chain.jacobian(positions, &mut jacobian))));
    let frames_ns = each(&positions, |positions| drop(black_box(frames.update(positions))));
    println!(
        "{{\"robot\": {:?}, \"joints\": {}, \"transform_ns\": {transform_ns:.1}, \"jacobian_ns\": {jacobian_ns:.1}, \
         \"all_links_ns\": {frames_ns:.1}}}",
        R::NAME,
        chain.joints()
    );
    inverse::<R>(&kinematics, base, tip, &mut random)
}

fn inverse<R: Robot>(
    kinematics: &Kinematics,
    base: LinkId,
    tip: LinkId,
    random: &mut ChaCha8Rng,
) -> Result<(), Box<dyn Error>> {
    let chain = kinematics.chain(base, tip)?;
    let mut solver = InverseKinematics::new(kinematics, base, tip, InverseParams::default())?;
    let neutral = kinematics.neutral();
    let (mut times, mut iterations) = (Vec::new(), 0);
    for _ in 0..POSES {
        let target = Target::Pose(chain.transform(&position(random, kinematics))?);
        // The solver does the same each time: other programs can only make it slower.
        let mut fastest_us = f64::INFINITY;
        for round in 0..3 {
            let start = Instant::now();
            let solution = black_box(solver.solve(&target, &neutral));
            let took_us = start.elapsed().as_secs_f64() * 1e6;
            let Ok(solution) = solution else { break };
            fastest_us = fastest_us.min(took_us);
            iterations += if round == 0 { solution.iterations } else { 0 };
        }
        if fastest_us.is_finite() {
            times.push(fastest_us);
        }
    }
    let in_time = times.iter().filter(|time| **time < 5_000.0).count();
    times.sort_by(f64::total_cmp);
    let percentile = |part: f64| times.get((times.len() as f64 * part) as usize).copied().unwrap_or(f64::NAN);
    println!(
        "{{\"robot\": {:?}, \"poses\": {POSES}, \"solved\": {}, \"solved_within_5_ms\": {in_time}, \
         \"iterations\": {:.1}, \"mean_us\": {:.1}, \"p50_us\": {:.1}, \"p99_us\": {:.1}, \"max_us\": {:.1}}}",
        R::NAME,
        times.len(),
        f64::from(iterations) / POSES as f64,
        times.iter().sum::<f64>() / times.len() as f64,
        percentile(0.5),
        percentile(0.99),
        times.last().copied().unwrap_or(f64::NAN)
    );
    Ok(())
}

/// Nanoseconds a call: the fastest of some rounds over all positions.
fn each(positions: &[Vec<f64>], mut call: impl FnMut(&[f64])) -> f64 {
    let rounds = (0..50).map(|_| {
        let start = Instant::now();
        positions.iter().for_each(|positions| call(black_box(positions)));
        start.elapsed().as_secs_f64() * 1e9 / positions.len() as f64
    });
    rounds.fold(f64::INFINITY, f64::min)
}

fn position(random: &mut ChaCha8Rng, kinematics: &Kinematics) -> Vec<f64> {
    let mut between = |(lower, upper): &(f64, f64)| {
        let part: f64 = StandardUniform.sample(random);
        lower + (upper - lower) * part
    };
    kinematics.bounds().iter().map(&mut between).collect()
}
