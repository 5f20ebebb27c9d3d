//! Signals that stop a robot.

#[cfg(unix)]
use crate::fault::lock;
use crate::schedule::start_thread;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Signals that arrive within this time are one: some parents send each twice, to the process and to its group.
const SAME_SIGNAL: Duration = Duration::from_millis(500);

/// A robot of this process that stops on signals.
struct Entry {
    stop: Box<dyn Fn() + Send>,
    wait_until_safe: Box<dyn Fn() + Send>,
    is_over: Box<dyn Fn() -> bool + Send>,
}

/// The robots, and when the first signal came since the last of them was added.
struct Stopping {
    robots: Vec<Entry>,
    first: Option<Instant>,
}

static STOPPING: Mutex<Stopping> = Mutex::new(Stopping { robots: Vec::new(), first: None });

/// `true` if the process has its handler.
static HANDLED: Mutex<bool> = Mutex::new(false);

/// Has the first signal stop all robots of the process, and a later one end it once all are safe. The thread that waits for
/// signals runs these functions, which must not run user code.
pub(super) fn stop_on_signals(
    stop: impl Fn() + Send + 'static,
    wait_until_safe: impl Fn() + Send + 'static,
    is_over: impl Fn() -> bool + Send + 'static,
) -> std::io::Result<()> {
    let mut handled = lock(&HANDLED);
    if !*handled {
        handle_signals()?;
        *handled = true;
    }
    let entry =
        Entry { stop: Box::new(stop), wait_until_safe: Box::new(wait_until_safe), is_over: Box::new(is_over) };
    let mut stopping = lock(&STOPPING);
    stopping.robots.retain(|robot| !(robot.is_over)());
    stopping.robots.push(entry);
    // Signals for robots of before are not for this one.
    stopping.first = None;
    Ok(())
}

#[cfg(unix)]
fn handle_signals() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    let run = move || {
        for signal in &mut signals {
            if ends_the_process() {
                // It does not return: by default these signals end a process.
                let _ = signal_hook::low_level::emulate_default_handler(signal);
            }
        }
    };
    start_thread("signals", Box::new(run)).map(drop)
}

/// `signal-hook` cannot wait for signals here, and does not hear that a console is closed.
#[cfg(not(unix))]
fn handle_signals() -> std::io::Result<()> {
    /// The exit code after Ctrl-C, by convention.
    const INTERRUPTED: i32 = 130;
    let handle = || {
        if ends_the_process() {
            std::process::exit(INTERRUPTED);
        }
    };
    ctrlc::set_handler(handle).map_err(std::io::Error::other)
}

/// Takes a signal. Returns whether the process is to end now.
fn ends_the_process() -> bool {
    let mut stopping = lock(&STOPPING);
    let first = match stopping.first {
        Some(first) => first,
        None => {
            stopping.robots.iter().for_each(|robot| (robot.stop)());
            *stopping.first.insert(Instant::now())
        }
    };
    if first.elapsed() < SAME_SIGNAL {
        return false;
    }
    stopping.robots.iter().for_each(|robot| (robot.wait_until_safe)());
    true
}
