//! A recorder on its own thread.

use super::{Recorder, RecorderReport};
use crate::error::{RecordingError, RecordingErrorKind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time for which the thread waits for a message before it checks whether to stop.
const WAIT: Duration = Duration::from_millis(20);

/// A recorder that writes on its own thread until it is stopped or dropped.
#[derive(Debug)]
pub struct BackgroundRecorder {
    path: PathBuf,
    thread: Option<JoinHandle<Result<RecorderReport, RecordingError>>>,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    messages: AtomicU64,
    flushed: AtomicU64,
    lost: AtomicU64,
    too_large: AtomicU64,
}

impl BackgroundRecorder {
    pub(crate) fn new(recorder: Recorder) -> Result<Self, RecordingError> {
        let path = recorder.path().to_owned();
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        // If no thread starts, the recorder is returned, so that it is dropped here and its file completed.
        let recorder = Arc::new(Mutex::new(Some(recorder)));
        let handed = Arc::clone(&recorder);
        let thread = std::thread::Builder::new().name("recorder".into()).spawn(move || {
            let recorder = handed.lock().unwrap_or_else(PoisonError::into_inner).take();
            recorder.map_or(Ok(RecorderReport::default()), |recorder| run(recorder, &theirs))
        });
        match thread {
            Ok(thread) => Ok(Self { path, thread: Some(thread), shared }),
            Err(cause) => {
                let kind = RecordingErrorKind::Thread(format!("cannot be started: {cause}"));
                Err(RecordingError::new(&path, kind))
            }
        }
    }

    /// Returns a report of what has been recorded so far.
    pub fn report(&self) -> RecorderReport {
        self.shared.report()
    }

    /// Returns whether it is still writing. If it ends before it is stopped, there was an error, which [`stop`](Self::stop) returns.
    pub fn is_running(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Writes the waiting messages and the end of the file.
    ///
    /// # Errors
    /// Writing failed, now or earlier.
    pub fn stop(mut self) -> Result<RecorderReport, RecordingError> {
        self.end().unwrap_or_else(|| Ok(self.report()))
    }

    fn end(&mut self) -> Option<Result<RecorderReport, RecordingError>> {
        self.shared.stop.store(true, Ordering::Release);
        let thread = self.thread.take()?;
        let panicked = |_| {
            let kind = RecordingErrorKind::Thread("has panicked".into());
            Err(RecordingError::new(&self.path, kind))
        };
        Some(thread.join().unwrap_or_else(panicked))
    }
}

impl Drop for BackgroundRecorder {
    fn drop(&mut self) {
        // The error cannot be reported to anyone.
        let _ = self.end();
    }
}

impl Shared {
    fn report(&self) -> RecorderReport {
        RecorderReport {
            messages: self.messages.load(Ordering::Acquire),
            flushed: self.flushed.load(Ordering::Acquire),
            lost: self.lost.load(Ordering::Acquire),
            too_large: self.too_large.load(Ordering::Acquire),
        }
    }

    fn tell(&self, report: RecorderReport) {
        self.messages.store(report.messages, Ordering::Release);
        self.flushed.store(report.flushed, Ordering::Release);
        self.lost.store(report.lost, Ordering::Release);
        self.too_large.store(report.too_large, Ordering::Release);
    }
}

fn run(mut recorder: Recorder, shared: &Shared) -> Result<RecorderReport, RecordingError> {
    while !shared.stop.load(Ordering::Acquire) {
        recorder.work(WAIT)?;
        shared.tell(recorder.report());
    }
    let report = recorder.finish()?;
    shared.tell(report);
    Ok(report)
}
