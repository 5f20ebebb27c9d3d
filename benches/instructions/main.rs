//! Instructions of the estimators' steps and of the hops between them, by callgrind, beside the figures that are stored in `steps.rs`.
//!
//! `cargo bench -p bb-benches --bench instructions` prints a line a step, and fails if one takes 2 % more than is stored. Without
//! valgrind it says so, and passes. The figures hold for x86-64, the compiler of `rust-toolchain.toml` and glibc 2.36; whoever
//! changes those, or makes a step cheaper, stores the new ones.

mod hop;
mod motion;
mod steps;

use bb_benches::callgrind;
use std::error::Error;
use std::process::ExitCode;
use steps::{STEPS, Step};

/// Steps of the two runs that are subtracted, of most.
const SHORT: usize = 1000;
const LONG: usize = 3000;

/// A step may take as much more than is stored for it.
const TOLERANCE: f64 = 0.02;

/// The argument that makes this program a run to be counted.
const COUNT: &str = "count";

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [word, name, steps] = &*arguments
        && word == COUNT
    {
        let step = STEPS.iter().find(|step| step.name == *name).ok_or("no such step")?;
        (step.run)(steps.parse()?)?;
        return Ok(ExitCode::SUCCESS);
    }
    if cfg!(not(all(target_arch = "x86_64", target_os = "linux"))) {
        println!("instructions: skipped: the figures are those of x86-64 Linux");
        return Ok(ExitCode::SUCCESS);
    }
    if !callgrind::is_there() {
        println!("instructions: skipped: no valgrind");
        return Ok(ExitCode::SUCCESS);
    }
    let mut too_many = 0;
    for step in STEPS {
        let counted = instructions(step)?;
        let ratio = counted / step.stored;
        println!("{:32} {counted:8.0} of {:8.0}  ratio {ratio:6.4}", step.name, step.stored);
        if ratio > 1.0 + TOLERANCE {
            eprintln!("{}: {counted:.0} instructions, {:.0} are stored", step.name, step.stored);
            too_many += 1;
        } else if ratio < 1.0 - TOLERANCE {
            println!("{}: cheaper than is stored: store {counted:.0} in benches/instructions/steps.rs", step.name);
        }
    }
    if too_many > 0 {
        eprintln!("{too_many} of {} steps take over {:.0} % more than is stored", STEPS.len(), TOLERANCE * 100.0);
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

/// Counts the instructions of one step, less those of what it is made on top of.
fn instructions(step: &Step) -> Result<f64, Box<dyn Error>> {
    let (short, long) = step.steps;
    let of = |name: &str| {
        callgrind::per_step(callgrind::ANY_PROCESSOR, short, long, |steps| {
            [COUNT, name, &steps.to_string()].map(String::from).to_vec()
        })
    };
    let below = step.on.map_or(Ok(0.0), of)?;
    Ok(of(step.name)? - below)
}
