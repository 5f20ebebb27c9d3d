//! Values that components of a run share.

use crate::fault::lock;
use bb_message::__private::Sorted;
use std::any::{Any, TypeId};
use std::sync::{Arc, Mutex};

/// One value of each type.
#[derive(Default)]
pub(crate) struct SharedValues(Mutex<Sorted<TypeId, Arc<dyn Any + Send + Sync>>>);

impl SharedValues {
    /// The value of type `T`, created if it does not exist yet.
    pub(crate) fn get<T: Send + Sync + 'static>(&self, make: impl FnOnce() -> T) -> Arc<T> {
        if let Some(found) = self.find() {
            return found;
        }
        // Not under the lock, since it is user code. If two are created at the same time, the first is kept.
        let made = Arc::new(make());
        let mut values = lock(&self.0);
        let kept = Arc::clone(values.get_or_insert(TypeId::of::<T>(), || Arc::clone(&made) as _));
        drop(values);
        kept.downcast().unwrap_or(made)
    }

    fn find<T: Send + Sync + 'static>(&self) -> Option<Arc<T>> {
        let values = lock(&self.0);
        let found = values.get(&TypeId::of::<T>()).map(Arc::clone)?;
        drop(values);
        found.downcast().ok()
    }
}
