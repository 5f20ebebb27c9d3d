//! Signals that stop a robot.

use super::{Live, Robot};
use std::time::{Duration, Instant};

/// Signals that arrive within this time are one: some parents send each twice, to the process and to its group.
const SAME_SIGNAL: Duration = Duration::from_millis(500);

/// See [`Live::stop_on_signals`]. The thread that waits for signals runs no user code.
#[cfg(unix)]
pub(super) fn stop_on_signals<R: Robot>(live: Live<R>) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP])?;
    let run = move || {
        let mut stopping = Stopping::default();
        for signal in &mut signals {
            if stopping.signal(&live) {
                // It does not return: by default these signals end a process.
                let _ = signal_hook::low_level::emulate_default_handler(signal);
            }
        }
    };
    std::thread::Builder::new().name("signals".to_owned()).spawn(run).map(drop)
}

#[cfg(not(unix))]
pub(super) fn stop_on_signals<R: Robot>(live: Live<R>) -> std::io::Result<()> {
    /// The exit code after Ctrl-C, by convention.
    const INTERRUPTED: i32 = 130;
    let mut stopping = Stopping::default();
    let handle = move || {
        if stopping.signal(&live) {
            std::process::exit(INTERRUPTED);
        }
    };
    ctrlc::set_handler(handle).map_err(std::io::Error::other)
}

/// Since when the robot stops because of a signal.
#[derive(Default)]
struct Stopping(Option<Instant>);

impl Stopping {
    /// A signal has arrived. Returns whether the process is to end now.
    fn signal<R: Robot>(&mut self, live: &Live<R>) -> bool {
        let first = *self.0.get_or_insert_with(|| {
            live.request_stop();
            Instant::now()
        });
        if first.elapsed() < SAME_SIGNAL {
            return false;
        }
        live.machine.control.wait_until_disarmed();
        true
    }
}
