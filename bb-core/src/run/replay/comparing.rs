//! Comparing the outputs of a turn with those in the journal.

use super::Replayer;
use crate::journal::Event;

impl Replayer {
    /// Compares an output with the recorded one.
    pub(super) fn compare(&self, island: usize, publisher: usize, checksum: u64) -> Result<(), String> {
        let path = self.path_of(publisher);
        match self.machine.environment.replayed().take(island) {
            Some(again) if again == (publisher, checksum) => Ok(()),
            Some((other, _)) if other == publisher => Err(format!(
                "`{path}` emits another message than it did: the algorithm is not deterministic{}",
                self.hint(island)
            )),
            Some((other, _)) => {
                let other = self.path_of(other);
                Err(format!("`{path}` emitted a message then, and `{other}` does now{}", self.hint(island)))
            }
            None => Err(format!("`{path}` emitted a message then, and does not now{}", self.hint(island))),
        }
    }

    /// Compares the outputs of the last turn with those in the lines that follow.
    pub(super) fn compare_outputs_of(&self, island: usize) -> Result<(), String> {
        let mut next = self.next_of(island, 0);
        while let Some(index) = next
            && let Event::Output { publisher, checksum, .. } = self.waiting[index].event
        {
            self.compare(island, publisher, checksum)?;
            next = self.next_of(island, index + 1);
        }
        self.no_more_outputs_of(island)
    }

    pub(super) fn no_more_outputs_of(&self, island: usize) -> Result<(), String> {
        let Some((publisher, _)) = self.machine.environment.replayed().take(island) else { return Ok(()) };
        Err(format!("`{}` emits a message more than it did{}", self.path_of(publisher), self.hint(island)))
    }

    /// Returns a possible explanation of a difference.
    pub(super) fn hint(&self, island: usize) -> String {
        let Some((line, name)) = self.unrecorded.get(&island) else { return String::new() };
        format!(
            "; or the request of type `{name}` in line {line} has changed it, which the journal does not hold: set \
             `RECORD` for it"
        )
    }
}
