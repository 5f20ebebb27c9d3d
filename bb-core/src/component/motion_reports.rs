//! An actuator's reports of its motions, until the runtime publishes them.

use crate::payload::{BeginMotion, EndMotion, MotionEnd};

/// An actuator's report of its motion.
#[derive(Clone, Debug)]
pub(crate) enum MotionReport {
    Begin(BeginMotion),
    End(EndMotion),
}

/// Reports not yet published, and the motion that is under way.
#[derive(Debug, Default)]
pub(super) struct MotionReports {
    pending: Vec<MotionReport>,
    current: Option<BeginMotion>,
    /// Reason for which the actuator is failing: its motion ends with this reason, whatever it reports meanwhile.
    failing: Option<String>,
    /// The runtime has reported the end of the last motion. A later report of that end is dropped.
    has_ended: bool,
}

impl MotionReports {
    pub(super) fn begin(&mut self, motion: BeginMotion) {
        self.current = Some(motion);
        self.has_ended = false;
        self.pending.push(MotionReport::Begin(motion));
    }

    pub(super) fn end(&mut self, mut motion: EndMotion) {
        if self.has_ended {
            return;
        }
        if let Some(reason) = &self.failing {
            motion.end = MotionEnd::Failed(reason.clone());
        }
        self.current = None;
        self.pending.push(MotionReport::End(motion));
    }

    pub(super) fn take(&mut self) -> Vec<MotionReport> {
        std::mem::take(&mut self.pending)
    }

    pub(super) fn set_failing(&mut self, reason: &str) {
        self.failing = Some(reason.to_owned());
    }

    /// Ends the current motion, if the actuator has not, at a position computed from its beginning.
    pub(super) fn end_current(&mut self, end: MotionEnd, position: impl FnOnce(&BeginMotion) -> f64) {
        self.failing = None;
        if let Some(begin) = self.current.take() {
            self.pending.push(MotionReport::End(EndMotion { position: position(&begin), end }));
            self.has_ended = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn begin() -> BeginMotion {
        BeginMotion {
            initial_position: 0.25,
            target_position: Some(1.0),
            velocity: None,
            speed: None,
            expected_arrival: None,
        }
    }

    fn ends(reports: &mut MotionReports) -> Vec<(f64, MotionEnd)> {
        let ends = reports.take().into_iter().filter_map(|report| match report {
            MotionReport::End(end) => Some((end.position, end.end)),
            MotionReport::Begin(_) => None,
        });
        ends.collect()
    }

    #[test]
    fn a_motion_ends_once_whichever_side_reports_its_end_first() {
        let failed = || MotionEnd::Failed("no current".to_owned());
        let mut reports = MotionReports::default();
        // The actuator reports nothing while it fails, and the end too late.
        reports.begin(begin());
        reports.set_failing("no current");
        reports.end_current(failed(), |begin| begin.initial_position);
        reports.end(EndMotion { position: 0.5, end: MotionEnd::Stopped });
        assert_eq!(ends(&mut reports), [(0.25, failed())]);
        // It reports the end while it is made safe: the position is the actuator's, the reason the runtime's.
        reports.begin(begin());
        reports.set_failing("no current");
        reports.end(EndMotion { position: 0.5, end: MotionEnd::Stopped });
        reports.end_current(failed(), |begin| begin.initial_position);
        assert_eq!(ends(&mut reports), [(0.5, failed())]);
        // Without a motion there is nothing to end.
        reports.set_failing("no current");
        reports.end_current(failed(), |begin| begin.initial_position);
        assert_eq!(ends(&mut reports), []);
        // The end of a motion whose beginning was not reported.
        reports.end(EndMotion { position: 0.5, end: MotionEnd::Stalled });
        assert_eq!(ends(&mut reports), [(0.5, MotionEnd::Stalled)]);
    }
}
