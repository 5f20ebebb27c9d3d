//! `bb arm` and `bb disarm`.

use super::Live;
use crate::say;
use clap::Args;
use serde_json::json;

/// Arms a running robot.
#[derive(Debug, Args)]
pub(crate) struct Arm {
    #[command(flatten)]
    live: Live,
}

/// Disarms a running robot; everybody may.
#[derive(Debug, Args)]
pub(crate) struct Disarm {
    #[command(flatten)]
    live: Live,
    /// Leaves the safety state `error`, even if something still cannot be made safe.
    #[arg(long)]
    force: bool,
}

impl Arm {
    pub(super) fn run(&self) -> Result<bool, String> {
        ask(&self.live, "arm", "armed")
    }
}

impl Disarm {
    pub(super) fn run(&self) -> Result<bool, String> {
        ask(&self.live, if self.force { "force_disarm" } else { "disarm" }, "disarmed")
    }
}

fn ask(live: &Live, op: &str, safety: &str) -> Result<bool, String> {
    live.connect()?.ask(op, json!({}))?;
    say(&if live.json { format!("{}\n", json!({"safety": safety})) } else { format!("{safety}\n") })
}
