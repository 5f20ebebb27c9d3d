//! Accounts for every message of a topic by its number.

/// Largest gap that is counted message by message: more than a day at 100 Hz. A larger one is no gap but a sender whose numbers are wrong.
const LARGEST_GAP: u64 = 1 << 24;

/// The numbers of the messages at one path, of the runs of one sender.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    newest: Option<(u64, u64)>,
}

/// The place of a message among the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Newer than all before; so many between were lost.
    Newer {
        /// The messages between that have not come. One that comes later is overtaken, and stays among the lost.
        lost: u64,
    },
    /// Message that is not newer than one before: a repetition, or overtaken.
    Repeated,
    /// Further ahead than messages can have been lost.
    Absurd,
}

impl Tally {
    /// Places the message with that number. Another session is another run of the sender, which counts from its own beginning.
    pub(super) fn place(&mut self, session: u64, sequence: u64) -> Place {
        let place = match self.newest {
            Some((known, newest)) if known == session => match sequence.checked_sub(newest) {
                None | Some(0) => Place::Repeated,
                Some(step) if step > LARGEST_GAP => Place::Absurd,
                Some(step) => Place::Newer { lost: step - 1 },
            },
            _ => Place::Newer { lost: 0 },
        };
        if let Place::Newer { .. } = place {
            self.newest = Some((session, sequence));
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Runs of a sender, each with messages lost, repeated and moved: between the first and the last that arrive of each run, what was
        /// sent is what was taken and what was lost.
        #[test]
        fn every_message_is_accounted_for(
            runs in proptest::collection::vec(
                (any::<u64>(), 0..u64::MAX / 2, proptest::collection::vec((0..4_u8, 0..6_usize), 1..200)),
                1..5,
            ),
        ) {
            let mut tally = Tally::default();
            for (run, (session, first, fates)) in runs.iter().enumerate() {
                let session = session.wrapping_mul(8).wrapping_add(run as u64);
                // Each message arrives 0, 1 or 2 times, at a place moved by up to 5.
                let mut arrivals: Vec<(usize, u64)> = Vec::new();
                for (index, (times, moved)) in fates.iter().enumerate() {
                    let copies = match times { 0 => 0, 3 => 2, _ => 1 };
                    for copy in 0..copies {
                        arrivals.push((index + moved * (copy + 1), first + index as u64));
                    }
                }
                arrivals.sort();
                let (mut taken, mut lost, mut repeated) = (Vec::new(), 0, 0);
                for (_, sequence) in &arrivals {
                    match tally.place(session, *sequence) {
                        Place::Newer { lost: gap } => {
                            lost += gap;
                            taken.push(*sequence);
                        }
                        Place::Repeated => repeated += 1,
                        Place::Absurd => prop_assert!(false),
                    }
                }
                prop_assert!(taken.windows(2).all(|pair| pair[0] < pair[1]));
                prop_assert_eq!(taken.len() + repeated, arrivals.len());
                if let (Some(first), Some(last)) = (taken.first(), taken.last()) {
                    prop_assert_eq!(lost + taken.len() as u64, last - first + 1);
                }
            }
        }

        #[test]
        fn no_number_panics(numbers in proptest::collection::vec((0..3_u64, any::<u64>()), 0..50)) {
            let mut tally = Tally::default();
            for (session, sequence) in numbers {
                if let Place::Newer { lost } = tally.place(session, sequence) {
                    prop_assert!(lost < LARGEST_GAP);
                }
            }
        }
    }
}
