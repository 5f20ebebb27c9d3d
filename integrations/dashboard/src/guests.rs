//! The places of viewers.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Viewers at once.
const MOST: usize = 16;

/// The viewers. Clones share the list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Guests(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    seats: Mutex<Vec<Arc<Guest>>>,
    counted: AtomicU64,
}

#[derive(Debug, Default)]
struct Guest {
    number: u64,
    has_token: AtomicBool,
    leave: Notify,
}

/// The place of a viewer, which is free again once it is dropped.
#[derive(Debug)]
pub(crate) struct Seat {
    guests: Guests,
    guest: Arc<Guest>,
}

impl Guests {
    /// A place; if none is free, that of the oldest viewer without the token. `None` if all have it.
    pub(crate) fn seat(&self) -> Option<Seat> {
        let mut seats = self.seats();
        if seats.len() >= MOST {
            let index = seats.iter().position(|guest| !guest.has_token.load(Ordering::Relaxed))?;
            seats.remove(index).leave.notify_one();
        }
        let number = self.0.counted.fetch_add(1, Ordering::Relaxed) + 1;
        let guest = Arc::new(Guest { number, ..Guest::default() });
        seats.push(Arc::clone(&guest));
        Some(Seat { guests: self.clone(), guest })
    }

    pub(crate) fn count(&self) -> usize {
        self.seats().len()
    }

    fn seats(&self) -> MutexGuard<'_, Vec<Arc<Guest>>> {
        self.0.seats.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Seat {
    /// Counts the viewers from 1.
    pub(crate) fn number(&self) -> u64 {
        self.guest.number
    }

    pub(crate) fn has_token(&self) -> bool {
        self.guest.has_token.load(Ordering::Relaxed)
    }

    pub(crate) fn set_has_token(&self, has_token: bool) {
        self.guest.has_token.store(has_token, Ordering::Relaxed);
    }

    /// Returns once the place is given to another.
    pub(crate) async fn asked_to_leave(&self) {
        self.guest.leave.notified().await;
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.guests.seats().retain(|guest| guest.number != self.guest.number);
    }
}
