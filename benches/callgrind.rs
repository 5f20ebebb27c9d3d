//! Instructions per step: a program runs itself under callgrind, for a short and a long run, and takes the difference.

use std::error::Error;
use std::process::Command;

/// An environment in which glibc takes its functions for any x86-64: which it takes else depends on the processor, and makes a
/// difference of up to a tenth.
pub const ANY_PROCESSOR: &[(&str, &str)] =
    &[("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-ERMS,-FSRM,-AVX_Fast_Unaligned_Load")];

/// Returns whether valgrind can be run.
pub fn is_there() -> bool {
    Command::new("valgrind").arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Instructions per step of this program, which is run in `environment`, with the arguments that `arguments` gives for a number
/// of steps. All that it does but the steps must be the same whatever their number.
///
/// # Errors
///
/// If valgrind cannot be run, or the program fails under it; with what it printed.
pub fn per_step(
    environment: &[(&str, &str)],
    short: usize,
    long: usize,
    arguments: impl Fn(usize) -> Vec<String>,
) -> Result<f64, Box<dyn Error>> {
    let counted = |steps: usize| -> Result<f64, Box<dyn Error>> {
        let mut valgrind = Command::new("valgrind");
        valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(std::env::current_exe()?);
        let output = valgrind.args(arguments(steps)).envs(environment.iter().copied()).output();
        let output = output.map_err(|error| format!("valgrind cannot be run: {error}; install it"))?;
        let said = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            return Err(format!("{} under valgrind: {said}", output.status).into());
        }
        let collected = said.lines().find_map(|line| line.split_once("Collected : "));
        let (_, collected) = collected.ok_or_else(|| format!("valgrind counted nothing: {said}"))?;
        Ok(collected.trim().parse()?)
    };
    Ok((counted(long)? - counted(short)?) / (long - short) as f64)
}
