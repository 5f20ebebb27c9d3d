//! Remarks on a data set.

use crate::navigation::doubt::{distrusted, is_most};

/// Assumptions made, and data left out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notes {
    pub(crate) notes: Vec<String>,
    pub(crate) doubts: Vec<String>,
}

impl Notes {
    pub(crate) fn push(&mut self, note: String) {
        self.notes.push(note);
    }

    /// Records that a part was left out. If that is more than half, the figures are misleading.
    pub(crate) fn left_out(&mut self, part: usize, all: usize, note: String) {
        if is_most(part as u64, all as u64) {
            self.doubts.push(distrusted(&note));
        } else if part > 0 {
            self.notes.push(note);
        }
    }
}
