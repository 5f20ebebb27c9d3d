//! `bb arm` and `bb disarm`.

use super::Where;
use crate::say;
use clap::Args;
use serde_json::json;

/// Arms a running robot.
#[derive(Debug, Args)]
pub(crate) struct Arm {
    #[command(flatten)]
    at: Where,
    /// Prints an object instead of a word.
    #[arg(long)]
    json: bool,
}

/// Disarms a running robot; everybody may.
#[derive(Debug, Args)]
pub(crate) struct Disarm {
    #[command(flatten)]
    at: Where,
    /// Leaves the safety state `error`, even if something still cannot be made safe.
    #[arg(long)]
    force: bool,
    /// Prints an object instead of a word.
    #[arg(long)]
    json: bool,
}

impl Arm {
    pub(super) fn run(&self) -> Result<bool, String> {
        ask(&self.at, "arm", "armed", self.json)
    }
}

impl Disarm {
    pub(super) fn run(&self) -> Result<bool, String> {
        ask(&self.at, if self.force { "force_disarm" } else { "disarm" }, "disarmed", self.json)
    }
}

fn ask(at: &Where, op: &str, safety: &str, as_json: bool) -> Result<bool, String> {
    at.connect()?.ask(op, json!({}))?;
    say(&if as_json { format!("{}\n", json!({"safety": safety})) } else { format!("{safety}\n") })
}
