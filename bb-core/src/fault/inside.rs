//! The places that a thread is inside of. Code that would wait for itself asks before it waits.

use std::cell::RefCell;
use std::ops::{Deref, DerefMut};

/// A place, named by the addresses of what it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// An island of the robot with that environment.
    Island(usize),
    /// A disarm callback of the robot with that control state.
    Callback(usize),
    /// The code of a command of that robot.
    Command(usize),
    /// The code of an actuator of that robot.
    Actuator { robot: usize, actuator: usize },
    /// A call with a permit of that tenure.
    Permit(usize),
}

#[cfg(not(loom))]
thread_local! {
    /// A place is listed as often as the thread has entered it.
    static PLACES: RefCell<Vec<Place>> = const { RefCell::new(Vec::new()) };
}
#[cfg(loom)]
loom::thread_local! {
    static PLACES: RefCell<Vec<Place>> = RefCell::new(Vec::new());
}

/// `None` in a thread that ends: values that it drops may still call.
#[inline]
fn with<T>(call: impl FnOnce(&mut Vec<Place>) -> T) -> Option<T> {
    #[cfg(not(loom))]
    return PLACES.try_with(|places| call(&mut places.borrow_mut())).ok();
    #[cfg(loom)]
    return Some(PLACES.with(|places| call(&mut places.borrow_mut())));
}

/// Returns how often the calling thread is inside such places.
pub(crate) fn times_inside(fits: impl Fn(Place) -> bool) -> usize {
    with(|places| places.iter().filter(|place| fits(**place)).count()).unwrap_or(0)
}

/// Returns whether the calling thread is inside that place.
pub(crate) fn is_inside(place: Place) -> bool {
    times_inside(|other| other == place) > 0
}

/// Notes that the calling thread enters a place.
#[inline]
pub(crate) fn enter(place: Place) {
    with(|places| places.push(place));
}

/// Notes that it leaves the place, once.
#[inline]
pub(crate) fn leave(place: Place) {
    with(|places| {
        if places.last() == Some(&place) {
            places.pop();
        } else {
            remove(places, place);
        }
    });
}

#[cold]
fn remove(places: &mut Vec<Place>, place: Place) {
    places.iter().rposition(|other| *other == place).map(|index| places.remove(index));
}

/// Keeps the calling thread inside a place until dropped.
#[derive(Debug)]
pub(crate) struct Inside(Place);

impl Inside {
    #[inline]
    pub(crate) fn new(place: Place) -> Self {
        enter(place);
        Self(place)
    }
}

impl Drop for Inside {
    #[inline]
    fn drop(&mut self) {
        leave(self.0);
    }
}

/// The guard of a place's lock, which keeps the calling thread inside the place.
#[derive(Debug)]
pub(crate) struct Within<G> {
    guard: G,
    _inside: Inside,
}

impl<G> Within<G> {
    #[inline]
    pub(crate) fn new(guard: G, place: Place) -> Self {
        Self { guard, _inside: Inside::new(place) }
    }
}

impl<G: Deref> Deref for Within<G> {
    type Target = G::Target;
    #[inline]
    fn deref(&self) -> &G::Target {
        &self.guard
    }
}

impl<G: DerefMut> DerefMut for Within<G> {
    #[inline]
    fn deref_mut(&mut self) -> &mut G::Target {
        &mut self.guard
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_thread_knows_which_of_many_places_it_is_inside_and_how_often() {
        let of = |number: usize| match number % 3 {
            0 => Place::Island(number),
            1 => Place::Actuator { robot: 0, actuator: number },
            _ => Place::Permit(number),
        };
        let mut within = Vec::new();
        for number in 0..200 {
            assert!((0..number).all(|other| is_inside(of(other))) && !is_inside(of(number)));
            within.push(Within::new(&(), of(number)));
        }
        assert_eq!(times_inside(|place| matches!(place, Place::Actuator { robot: 0, .. })), 67);
        let again = [Inside::new(of(0)), Inside::new(of(0))];
        assert_eq!(times_inside(|place| place == of(0)), 3);
        assert!(std::thread::scope(|scope| scope.spawn(|| !is_inside(of(0))).join().expect("no panic")));
        // Not in the order in which they were entered.
        for number in 0..200 {
            drop(within.remove(0));
            assert!((number + 1..200).all(|other| is_inside(of(other))) && is_inside(of(number)) == (number == 0));
        }
        drop(again);
        assert_eq!(times_inside(|_| true), 0);
    }
}
