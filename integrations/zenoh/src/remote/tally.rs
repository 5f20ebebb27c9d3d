//! Accounts for every message of a topic by its number.

use bb_core::MonotonicTime;
use std::time::Duration;

/// Largest gap that is counted message by message: more than a day at 100 Hz. A larger one is no gap but a sender whose numbers are wrong.
const LARGEST_GAP: u64 = 1 << 24;

/// Messages in a row whose numbers go on from each other, after which these are believed.
const FOLLOWING: u32 = 3;

/// The numbers of the messages at one path, of the runs of one sender.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    newest: Option<Number>,
    /// The last of those that have come since and are not newer, or absurd, and how many of them go on from each other.
    aside: Option<(u64, u32)>,
    /// Messages without a right number that have come since the newest: of those missing before the next, these are not lost.
    unnumbered: u64,
}

/// The number of a message that has arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Number {
    /// The run of the sender.
    pub(super) session: u64,
    pub(super) sequence: u64,
    /// Time of arrival, on the local clock.
    pub(super) arrival: MonotonicTime,
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
    /// Counts a message whose number is missing or wrong, and that is accounted for.
    pub(super) fn add_unnumbered(&mut self) {
        self.unnumbered = self.unnumbered.saturating_add(1);
    }

    /// Places the message with that number. Another session is another run of the sender, which counts from its own beginning.
    ///
    /// A number that is wrong makes those that follow look old. So numbers that go on from each other are believed again if none that is
    /// newer has come for `within`: repetitions that are that late are too old to be taken.
    pub(super) fn place(&mut self, number: Number, within: Duration) -> Place {
        let Some(newest) = self.newest.filter(|newest| newest.session == number.session) else {
            return self.believe(number, 0);
        };
        let place = match number.sequence.checked_sub(newest.sequence) {
            Some(step @ 1..=LARGEST_GAP) => {
                return self.believe(number, (step - 1).saturating_sub(self.unnumbered));
            }
            None | Some(0) => Place::Repeated,
            Some(_) => {
                self.add_unnumbered();
                Place::Absurd
            }
        };
        let following = match self.aside {
            Some((last, count)) if (1..=LARGEST_GAP).contains(&number.sequence.wrapping_sub(last)) => count + 1,
            _ => 1,
        };
        self.aside = Some((number.sequence, following));
        if following >= FOLLOWING && number.arrival.duration_since(newest.arrival) > within {
            return self.believe(number, 0);
        }
        place
    }

    fn believe(&mut self, number: Number, lost: u64) -> Place {
        *self = Self { newest: Some(number), aside: None, unnumbered: 0 };
        Place::Newer { lost }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WITHIN: Duration = Duration::from_millis(200);

    fn place(tally: &mut Tally, session: u64, sequence: u64, ms: i64) -> Place {
        let arrival = MonotonicTime::from_nanos(ms * 1_000_000);
        tally.place(Number { session, sequence, arrival }, WITHIN)
    }

    /// Messages at 100 Hz, of which one has a number that no message between could have led to, ahead or behind.
    #[test]
    fn a_wrong_number_silences_a_sender_for_as_long_as_a_message_may_be_old() {
        for wrong in [1000 + LARGEST_GAP / 2, 1000 + LARGEST_GAP, 3, u64::MAX] {
            for at in [0, 500] {
                let mut tally = Tally::default();
                let mut silent = Vec::new();
                for step in 0..1000 {
                    let sequence = if step == at { wrong } else { 1000 + step };
                    if !matches!(place(&mut tally, 1, sequence, step as i64 * 10), Place::Newer { .. }) {
                        silent.push(step);
                    }
                }
                let longest = silent.last().map_or(0, |last| last - at);
                assert!(longest <= 20, "number {wrong} at {at}: silent for {longest} messages");
            }
        }
    }

    /// A second way by which each message comes, however much later.
    #[test]
    fn what_comes_again_is_newer_only_if_it_is_too_old_to_be_taken() {
        for late_ms in [0, 50, 150] {
            let mut tally = Tally::default();
            let first = (0..100).map(|step| (step as i64 * 10, step));
            let again = (0..100).map(|step| (step as i64 * 10 + late_ms, step));
            let mut arrivals: Vec<(i64, u64)> = first.chain(again).collect();
            arrivals.sort();
            let newer = arrivals
                .iter()
                .filter(|(ms, sequence)| matches!(place(&mut tally, 1, *sequence, *ms), Place::Newer { .. }));
            assert_eq!(newer.count(), 100, "{late_ms} ms later");
        }
    }

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
                    match place(&mut tally, session, *sequence, 0) {
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
        fn no_number_panics(numbers in proptest::collection::vec((0..3_u64, any::<u64>(), 0..1000_i64), 0..50)) {
            let mut tally = Tally::default();
            for (session, sequence, ms) in numbers {
                if let Place::Newer { lost } = place(&mut tally, session, sequence, ms) {
                    prop_assert!(lost < LARGEST_GAP);
                }
            }
        }
    }
}
