//! Samples and inputs in their order, a state that they move on, and the copies of it from which they are run again.
//!
//! An input from the past is inserted at its place, and the next run begins at the last copy before it. So the state is that of inputs
//! that arrive in order, to the last bit.

use super::ring::Ring;
use crate::navigation::eskf::ImuMean;

/// The place of an input: its stamp, then its rank, then its order among those alike. Keys are unique.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::navigation) struct Key {
    pub(in crate::navigation) time_ns: i64,
    pub(in crate::navigation) rank: u8,
    pub(in crate::navigation) order: u64,
}

impl Key {
    /// Before all inputs.
    pub(in crate::navigation) const FIRST: Self = Self::of_sample(i64::MIN);

    /// A sample of the IMU precedes measurements at its end.
    pub(in crate::navigation) const fn of_sample(time_ns: i64) -> Self {
        Self { time_ns, rank: 0, order: 0 }
    }

    /// After all inputs of that time.
    pub(in crate::navigation) const fn end_of(time_ns: i64) -> Self {
        Self { time_ns, rank: u8::MAX, order: u64::MAX }
    }
}

/// Effects of samples and inputs on a state.
pub(in crate::navigation) trait Run<T, I> {
    /// Moves the state on to a time within a sample. `since_ns` is where the sample began: `None` if nothing came before.
    fn advance(&mut self, state: &mut T, until_ns: i64, sample: &ImuMean, since_ns: Option<i64>);

    /// Applies an input. Returns `false` if that has broken the state, which is then restored. The input is passed again.
    fn apply(&mut self, state: &mut T, key: Key, input: &mut I) -> bool;

    /// Returns whether a copy is due, so many samples after the last one.
    fn is_due(&self, last: &T, state: &T, samples: usize) -> bool;
}

/// A state, and how far it has run.
#[derive(Clone, Debug)]
pub(in crate::navigation) struct Reached<T> {
    pub(in crate::navigation) state: T,
    /// The last input that is in it.
    pub(in crate::navigation) key: Key,
    /// Number of samples since the last copy.
    samples: usize,
}

/// See the module. The constants are the rooms where storage is inline.
#[derive(Clone, Debug)]
pub(in crate::navigation) struct Past<T, I, const SAMPLES: usize, const INPUTS: usize, const COPIES: usize> {
    pub(in crate::navigation) now: Reached<T>,
    pub(in crate::navigation) samples: Ring<ImuMean, SAMPLES>,
    /// The time of the last sample that was dropped: the first one held begins there.
    pub(in crate::navigation) dropped_ns: Option<i64>,
    pub(in crate::navigation) inputs: Ring<(Key, I), INPUTS>,
    pub(in crate::navigation) copies: Ring<Reached<T>, COPIES>,
    /// State before the last input from the past: the next one is seldom older.
    pub(in crate::navigation) recent: Option<Reached<T>>,
    /// The first place that has changed since the last run.
    pub(in crate::navigation) changed: Option<Key>,
}

impl<T: Clone, I, const SAMPLES: usize, const INPUTS: usize, const COPIES: usize>
    Past<T, I, SAMPLES, INPUTS, COPIES>
{
    /// Begins with a state at a place, and room for so many samples, inputs and copies. The first sample begins at `since_ns`, if that
    /// is known.
    pub(in crate::navigation) fn new(
        state: T,
        key: Key,
        since_ns: Option<i64>,
        [samples, inputs, copies]: [usize; 3],
    ) -> Self {
        let mut past = Self {
            now: Reached { state, key, samples: 0 },
            samples: Ring::new(samples),
            dropped_ns: since_ns,
            inputs: Ring::new(inputs),
            copies: Ring::new(copies),
            recent: None,
            changed: None,
        };
        past.copy_now();
        past
    }

    /// Continues at another place, without the past.
    pub(in crate::navigation) fn restart(&mut self, key: Key, since_ns: Option<i64>) {
        self.samples.clear();
        self.inputs.clear();
        (self.now.key, self.dropped_ns, self.changed) = (key, since_ns, None);
        self.copy_now();
    }

    /// Keeps no copy but one of the present state.
    pub(in crate::navigation) fn copy_now(&mut self) {
        self.copies.clear();
        self.recent = None;
        self.now.samples = 0;
        self.copies.push(self.now.clone());
    }

    /// Returns whether there is a copy from before a place.
    pub(in crate::navigation) fn reaches(&self, key: Key) -> bool {
        self.copies.get(0).is_some_and(|copy| copy.key < key)
    }

    /// Inserts an input. Returns whether it is in the past, so that the next run begins there.
    pub(in crate::navigation) fn insert(&mut self, key: Key, input: I) -> bool {
        let index = self.inputs.count_while(|(other, _)| *other < key);
        self.inputs.insert(index, (key, input));
        let is_past = key < self.now.key;
        if is_past {
            self.change(key);
        }
        is_past
    }

    /// Notes a change at a place that may have been run already.
    pub(in crate::navigation) fn change(&mut self, at: Key) {
        self.changed = Some(self.changed.map_or(at, |before| before.min(at)));
    }

    /// Appends a sample. The oldest is dropped if there is no room.
    pub(in crate::navigation) fn push(&mut self, sample: ImuMean) {
        if self.samples.is_full() {
            self.drop_sample();
        }
        self.samples.push(sample);
    }

    /// Drops the oldest sample.
    pub(in crate::navigation) fn drop_sample(&mut self) {
        self.dropped_ns = self.samples.pop_front().map(|sample| sample.time_ns).or(self.dropped_ns);
    }

    /// Drops the inputs that all copies contain.
    pub(in crate::navigation) fn trim(&mut self) {
        let Some(oldest) = self.copies.get(0).map(|copy| copy.key) else { return };
        while self.inputs.pop_front_if(|(key, _)| *key <= oldest).is_some() {}
    }

    /// The time at which a sample begins. Inputs may divide it into parts of any length.
    pub(in crate::navigation) fn since_ns(&self, index: usize) -> Option<i64> {
        let before = index.checked_sub(1).and_then(|before| self.samples.get(before));
        before.map(|before| before.time_ns).or(self.dropped_ns)
    }

    /// Runs on to a place. What has passed is run again if it has changed. Returns how often a copy was restored.
    pub(in crate::navigation) fn run(&mut self, until: Key, run: &mut impl Run<T, I>) -> u64 {
        let from = self.changed.take().filter(|from| *from < self.now.key);
        let until = from.map_or(until, |_| until.max(Key::end_of(self.now.key.time_ns)));
        let (mut back, mut restored) = (from, 0);
        loop {
            if let Some(place) = back {
                self.take_back(place);
                restored += 1;
            }
            // Every input breaks the state at most once.
            back = self.run_until(until, from, run).err();
            if back.is_none() {
                return restored;
            }
        }
    }

    /// Restores the last copy before a place.
    fn take_back(&mut self, from: Key) {
        while self.copies.len() > 1 && self.copies.last().is_some_and(|copy| copy.key >= from) {
            self.copies.pop();
        }
        let last = self.copies.last();
        let is_nearer = |recent: &Reached<T>| recent.key < from && last.is_none_or(|last| last.key < recent.key);
        if let Some(before) = self.recent.take().filter(is_nearer).or_else(|| last.cloned()) {
            self.now = before;
        }
    }

    /// Runs on. An input that breaks the state is returned. `from` is the place that has changed.
    fn run_until(&mut self, until: Key, from: Option<Key>, run: &mut impl Run<T, I>) -> Result<(), Key> {
        let key = self.now.key;
        let mut sample_index = self.samples.count_while(|sample| Key::of_sample(sample.time_ns) <= key);
        let mut input_index = self.inputs.count_while(|(other, _)| *other <= key);
        loop {
            let now_ns = self.now.key.time_ns;
            let sample = self.samples.get(sample_index).copied();
            let of_sample = sample.map(|sample| Key::of_sample(sample.time_ns));
            // Nothing is known after the newest sample.
            let of_input = self.inputs.get(input_index).map(|(key, _)| *key);
            let of_input = of_input.filter(|key| sample.is_some() || key.time_ns <= now_ns);
            let next = of_sample.into_iter().chain(of_input).min();
            let Some(next) = next.filter(|next| *next <= until) else { return Ok(()) };
            if self.recent.is_none() && from.is_some_and(|from| from <= next) {
                self.recent = Some(self.now.clone());
            }
            if let Some(sample) = sample.filter(|_| now_ns < next.time_ns) {
                // Also on the way of a run that is repeated: it has dropped those after the change, and the next one may be as late.
                let is_due = |last: &Reached<T>| run.is_due(&last.state, &self.now.state, self.now.samples);
                if self.copies.last().is_none_or(is_due) {
                    self.now.samples = 0;
                    self.copies.push(self.now.clone());
                }
                // The sample is a mean, so its parts have the same values.
                let since_ns = self.since_ns(sample_index);
                run.advance(&mut self.now.state, next.time_ns, &sample, since_ns);
            }
            self.now.key = next;
            if of_sample == Some(next) {
                self.now.samples += 1;
                sample_index += 1;
            } else if let Some((_, input)) = self.inputs.get_mut(input_index) {
                if !run.apply(&mut self.now.state, next, input) {
                    return Err(next);
                }
                input_index += 1;
            }
        }
    }

    /// Calls a function for the state and all copies of it.
    pub(in crate::navigation) fn each(&mut self, with: impl Fn(&mut T)) {
        with(&mut self.now.state);
        self.copies.iter_mut().chain(&mut self.recent).for_each(|copy| with(&mut copy.state));
    }

    /// The input at a place.
    pub(in crate::navigation) fn input(&self, key: Key) -> Option<&I> {
        let index = self.inputs.count_while(|(other, _)| *other < key);
        self.inputs.get(index).filter(|(other, _)| *other == key).map(|(_, input)| input)
    }
}
