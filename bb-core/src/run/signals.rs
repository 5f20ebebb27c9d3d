//! Signals that stop a robot.

use std::time::{Duration, Instant};

/// Signals that arrive within this time are one: some parents send each twice, to the process and to its group.
const SAME_SIGNAL: Duration = Duration::from_millis(500);

/// Has the first signal call `stop`, and a later one end the process once `wait_until_safe` has returned. The thread that waits for
/// signals runs no user code.
#[cfg(unix)]
pub(super) fn stop_on_signals(
    stop: impl Fn() + Send + 'static,
    wait_until_safe: impl Fn() + Send + 'static,
) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    let run = move || {
        let mut stopping = Stopping::default();
        for signal in &mut signals {
            if stopping.signal(&stop, &wait_until_safe) {
                // It does not return: by default these signals end a process.
                let _ = signal_hook::low_level::emulate_default_handler(signal);
            }
        }
    };
    std::thread::Builder::new().name("signals".to_owned()).spawn(run).map(drop)
}

#[cfg(not(unix))]
pub(super) fn stop_on_signals(
    stop: impl Fn() + Send + 'static,
    wait_until_safe: impl Fn() + Send + 'static,
) -> std::io::Result<()> {
    /// The exit code after Ctrl-C, by convention.
    const INTERRUPTED: i32 = 130;
    let mut stopping = Stopping::default();
    let handle = move || {
        if stopping.signal(&stop, &wait_until_safe) {
            std::process::exit(INTERRUPTED);
        }
    };
    ctrlc::set_handler(handle).map_err(std::io::Error::other)
}

/// The time of the first signal, from which on the robot stops.
#[derive(Default)]
struct Stopping(Option<Instant>);

impl Stopping {
    /// Takes a signal. Returns whether the process is to end now.
    fn signal(&mut self, stop: &dyn Fn(), wait_until_safe: &dyn Fn()) -> bool {
        let first = *self.0.get_or_insert_with(|| {
            stop();
            Instant::now()
        });
        if first.elapsed() < SAME_SIGNAL {
            return false;
        }
        wait_until_safe();
        true
    }
}
