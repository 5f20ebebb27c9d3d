//! `bb recover`: saves the part of a damaged file before the break.

use clap::Args;
use std::path::PathBuf;

/// Saves the part of a damaged file before the break to a complete file.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The damaged MCAP file.
    #[arg(value_name = "BROKEN.mcap")]
    broken: PathBuf,
    /// The file to write, which must not exist yet.
    #[arg(value_name = "WHOLE.mcap")]
    whole: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let Arguments { broken, whole } = arguments;
    let progress = bb_eval::Progress::spinner("recovering");
    let recovered = bb_mcap::recover(broken, whole).map_err(|error| error.to_string());
    progress.finish();
    let recovered = recovered?;
    let what = if recovered.broken.is_some() { "all before the break" } else { "all, for the file was whole" };
    crate::say(&format!("{}: {} messages, {what}\n", whole.display(), recovered.messages))?;
    Ok(true)
}
