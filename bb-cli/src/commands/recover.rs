//! `bb recover`: a whole file of what is before the break of a broken one.

use clap::Args;
use std::path::PathBuf;

/// Makes a whole file of what is before the break of a damaged one.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The damaged file, any MCAP.
    #[arg(value_name = "BROKEN.mcap")]
    broken: PathBuf,
    /// The file to write; must not exist.
    #[arg(value_name = "WHOLE.mcap")]
    whole: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let Arguments { broken, whole } = arguments;
    let progress = crate::Progress::spinner("recovering");
    let recovered = bb_mcap::recover(broken, whole).map_err(|error| error.to_string());
    progress.finish();
    let recovered = recovered?;
    let what = if recovered.broken.is_some() { "all before the break" } else { "all, for the file was whole" };
    crate::say(&format!("{}: {} messages, {what}\n", whole.display(), recovered.messages))?;
    Ok(true)
}
