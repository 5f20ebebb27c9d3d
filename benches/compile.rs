//! Cost of compiling a robot: seconds of `cargo check` for 10, 100 and 1,000 sensors with an estimator each, and of `cargo build` for 10
//! and 100, per declaration, after everything it depends on is built; and beside it a crate without a robot. A build without optimization
//! writes the code of every estimator, which a check does not.
//!
//! `cargo bench -p bb-benches --bench compile` prints one JSON object a line. It makes a crate in the target folder.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

const RUNS: usize = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize()?;
    let folder = workspace.join("target/bench-compile");
    std::fs::create_dir_all(folder.join("src"))?;
    std::fs::write(folder.join("Cargo.toml"), manifest(&workspace))?;
    for (command, sizes) in [("check", &[10, 100, 1000][..]), ("build", &[10, 100])] {
        let empty_s = compile(&folder, command, "")?;
        for estimators in sizes {
            let seconds = compile(&folder, command, &robot(*estimators))?;
            // A sensor and an estimator.
            let per_declaration_ms = (seconds - empty_s) * 1e3 / (2 * estimators) as f64;
            let line = serde_json::json!({
                "name": format!("cargo_{command}"),
                "estimators": estimators,
                "seconds": seconds,
                "beside_seconds": empty_s,
                "ms_per_declaration": per_declaration_ms,
            });
            println!("{line}");
        }
    }
    Ok(())
}

fn manifest(workspace: &Path) -> String {
    format!(
        "[package]\nname = \"robot\"\nversion = \"0.0.0\"\nedition = \"2024\"\n[dependencies]\n\
         bb-core = {{ path = {:?} }}\n\
         bb-estimators = {{ path = {:?}, default-features = false, features = [\"runtime\"] }}\n[workspace]\n",
        workspace.join("bb-core"),
        workspace.join("bb-estimators"),
    )
}

fn robot(estimators: usize) -> String {
    let mut source = String::from(
        "use bb_core::prelude::*;\nuse bb_estimators::Madgwick;\nrobot! { pub robot Big; link base {\n",
    );
    for number in 0..estimators {
        // Writing to a string cannot fail.
        let _ =
            writeln!(source, "sensor s{number}: External<Imu>() {{ estimator e: Madgwick(beta = 0.1 rad/s); }}");
    }
    source + "} }\n"
}

/// The median time of a `cargo check` or `cargo build` of the crate with this source.
fn compile(folder: &Path, command: &str, source: &str) -> Result<f64, Box<dyn Error>> {
    let file: PathBuf = folder.join("src/lib.rs");
    let mut seconds = Vec::new();
    // The first builds what it depends on.
    for run in 0..=RUNS {
        std::fs::write(&file, format!("// run {run}\n{source}"))?;
        let started = Instant::now();
        // Without what an earlier run has left.
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args([command, "--quiet"]).env("CARGO_INCREMENTAL", "0").current_dir(folder);
        let status = cargo.status()?;
        if !status.success() {
            return Err("the robot does not compile".into());
        }
        seconds.push(started.elapsed().as_secs_f64());
    }
    seconds.remove(0);
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[RUNS / 2])
}
