//! Deadlines by key, in the order of their times.

use super::Bell;
use crate::fault::lock;
use crate::time::MonotonicTime;
use bb_message::__private::Sorted;
use std::sync::Mutex;

/// Deadlines by key, at most one for each; equal times are in the order of the keys.
#[derive(Debug)]
pub(crate) struct Deadlines<K> {
    entries: Mutex<Entries<K>>,
    bell: Bell,
}

#[derive(Debug)]
struct Entries<K> {
    by_time: Sorted<(MonotonicTime, K), ()>,
    of: Sorted<K, MonotonicTime>,
}

impl<K: Ord + Copy> Deadlines<K> {
    pub(crate) fn new(bell: Bell) -> Self {
        Self { entries: Mutex::new(Entries { by_time: Sorted::default(), of: Sorted::default() }), bell }
    }

    /// Sets the deadline of `key`, in place of the one it had. The last instant never comes.
    pub(crate) fn set(&self, key: K, time: MonotonicTime) {
        let mut entries = lock(&self.entries);
        entries.remove(key);
        if time == MonotonicTime::MAX {
            return;
        }
        entries.of.insert(key, time);
        entries.by_time.insert((time, key), ());
        let is_first = entries.by_time.first() == Some(&(time, key));
        drop(entries);
        if is_first {
            self.bell.ring();
        }
    }

    pub(crate) fn clear(&self, key: K) {
        lock(&self.entries).remove(key);
    }

    pub(crate) fn next(&self) -> Option<MonotonicTime> {
        lock(&self.entries).by_time.first().map(|(time, _)| *time)
    }

    /// Takes the first deadline that has come.
    pub(crate) fn take(&self, now: MonotonicTime) -> Option<(MonotonicTime, K)> {
        let mut entries = lock(&self.entries);
        let (time, key) = *entries.by_time.first().filter(|(time, _)| *time <= now)?;
        entries.remove(key);
        Some((time, key))
    }
}

impl<K: Ord + Copy> Entries<K> {
    fn remove(&mut self, key: K) {
        if let Some(time) = self.of.remove(&key) {
            self.by_time.remove(&(time, key));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_has_one_deadline_and_they_pass_in_order() {
        let at = MonotonicTime::from_nanos;
        let deadlines = Deadlines::new(Bell::default());
        for nanos in (10..1000).rev() {
            deadlines.set('a', at(nanos));
        }
        deadlines.set('c', at(20));
        deadlines.set('b', at(20));
        deadlines.set('d', MonotonicTime::MAX);
        deadlines.set('e', at(1));
        deadlines.clear('e');
        assert_eq!((deadlines.take(at(9)), deadlines.next()), (None, Some(at(10))));
        let taken: Vec<_> = std::iter::from_fn(|| deadlines.take(at(2000))).map(|(_, key)| key).collect();
        assert_eq!(taken, ['a', 'b', 'c']);
    }
}
