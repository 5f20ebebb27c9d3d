//! Errors of an odometry that last.

/// The readings of an odometry, whose errors are alike for a while: slip lasts.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Correlation {
    time_s: f64,
    last_ns: Option<i64>,
}

impl Correlation {
    /// Creates the readings whose errors are alike over this time, s.
    pub(in crate::navigation) fn new(time_s: f64) -> Self {
        Self { time_s, last_ns: None }
    }

    /// The factor on the deviation of a reading: its variance is that of all within the correlation time, `1 + 2 τ / dt` times its own.
    pub(in crate::navigation) fn factor(&mut self, now_ns: i64) -> f64 {
        let since_s = self.last_ns.map_or(f64::INFINITY, |before| now_ns.saturating_sub(before) as f64 * 1e-9);
        self.last_ns = Some(now_ns);
        (1.0 + 2.0 * self.time_s / since_s.max(1e-3)).sqrt()
    }
}
