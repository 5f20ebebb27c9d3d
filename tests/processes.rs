//! Objects of which a whole process has one: its logger, its signals, its priorities.

mod blocked_logger;
#[path = "behaviour/components.rs"]
#[allow(dead_code, reason = "a part of the kit is needed here")]
mod components;
mod features;
mod loggers;
mod logs;

use std::error::Error;
use std::process::Command;

/// Names the test that runs alone in this process.
const ALONE: &str = "BB_TEST_ALONE";

/// Runs a test of this binary, by its whole name, alone in another process.
fn alone(name: &str, test: impl FnOnce() -> Result<(), Box<dyn Error>>) -> Result<(), Box<dyn Error>> {
    if std::env::var(ALONE).is_ok_and(|alone| alone == name) {
        return test();
    }
    let mut other = Command::new(std::env::current_exe()?);
    let output = other.args([name, "--exact", "--nocapture"]).env(ALONE, name).output()?;
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(output.status.success() && said.contains("1 passed"), "{name}: {said}");
    Ok(())
}
