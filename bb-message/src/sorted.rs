//! A small map in the order of its keys.

use std::borrow::Borrow;

/// A list sorted by key, the first key last. For a few hundred entries it is as fast as `BTreeMap`, of which each pair of types
/// compiles a whole B-tree: 6 to 12 thousand lines of IR.
#[derive(Clone, Debug)]
pub struct Sorted<K, V>(Vec<(K, V)>);

impl<K, V> Default for Sorted<K, V> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<K: Ord, V> Sorted<K, V> {
    /// The number of entries.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The entries, in the order of their keys.
    pub fn iter(&self) -> impl Iterator<Item = (&K, &V)> {
        self.0.iter().rev().map(|(key, value)| (key, value))
    }

    /// The value of `key`.
    pub fn get<Q: Ord + ?Sized>(&self, key: &Q) -> Option<&V>
    where
        K: Borrow<Q>,
    {
        let index = self.find(key).ok()?;
        self.0.get(index).map(|(_, value)| value)
    }

    /// The value of `key`, to change.
    pub fn get_mut<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<&mut V>
    where
        K: Borrow<Q>,
    {
        let index = self.find(key).ok()?;
        self.0.get_mut(index).map(|(_, value)| value)
    }

    /// The value of `key`, made if it has none.
    pub fn get_or_insert(&mut self, key: K, make: impl FnOnce() -> V) -> &mut V {
        let index = self.find(&key).unwrap_or_else(|index| {
            self.0.insert(index, (key, make()));
            index
        });
        &mut self.0[index].1
    }

    /// Sets the value of `key`, and returns the one it had.
    pub fn insert(&mut self, key: K, value: V) -> Option<V> {
        match self.find(&key) {
            Ok(index) => self.0.get_mut(index).map(|(_, before)| std::mem::replace(before, value)),
            Err(index) => {
                self.0.insert(index, (key, value));
                None
            }
        }
    }

    /// Removes the entry of `key`, and returns its value.
    pub fn remove<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<V>
    where
        K: Borrow<Q>,
    {
        let index = self.find(key).ok()?;
        Some(self.0.remove(index).1)
    }

    /// The first key.
    pub fn first(&self) -> Option<&K> {
        self.0.last().map(|(key, _)| key)
    }

    /// All entries, in the order of the keys.
    pub fn into_entries(self) -> impl Iterator<Item = (K, V)> {
        self.0.into_iter().rev()
    }

    /// Removes the first entry, and returns it.
    pub fn pop_first(&mut self) -> Option<(K, V)> {
        self.0.pop()
    }

    fn find<Q: Ord + ?Sized>(&self, key: &Q) -> Result<usize, usize>
    where
        K: Borrow<Q>,
    {
        self.0.binary_search_by(|(other, _)| key.cmp(other.borrow()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    laws! {
        #[test]
        fn it_is_a_map_in_the_order_of_its_keys(steps in proptest::collection::vec((0..4, 0..20u8, any::<u16>()), 0..200)) {
            let (mut sorted, mut map) = (Sorted::default(), BTreeMap::new());
            for (step, key, value) in steps {
                match step {
                    0 => prop_assert_eq!(*sorted.get_or_insert(key, || value), *map.entry(key).or_insert(value)),
                    1 => prop_assert_eq!(sorted.insert(key, value), map.insert(key, value)),
                    2 => prop_assert_eq!(sorted.remove(&key), map.remove(&key)),
                    _ => prop_assert_eq!(sorted.pop_first(), map.pop_first()),
                }
                prop_assert_eq!(sorted.get(&key), map.get(&key));
                prop_assert_eq!(sorted.get_mut(&key), map.get_mut(&key));
                prop_assert_eq!((sorted.first(), sorted.len()), (map.keys().next(), map.len()));
            }
            prop_assert!(sorted.iter().eq(map.iter()) && sorted.clone().into_entries().eq(map.clone()));
        }
    }
}
