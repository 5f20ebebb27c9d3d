mod killed;

use super::*;
use bb_tests::laws;
use proptest::prelude::*;
use redb::StorageBackend;
use redb::backends::InMemoryBackend;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};

type Values = BTreeMap<String, ParameterValue>;

/// A disk that loses power: writes from the given one on are lost, and half of that one may have arrived.
#[derive(Clone, Debug)]
struct Disk(Arc<State>);

#[derive(Debug)]
struct State {
    disk: InMemoryBackend,
    /// The writes left.
    left: Mutex<Option<u32>>,
    is_torn: bool,
}

impl Disk {
    fn new(is_torn: bool) -> Self {
        Self(Arc::new(State { disk: InMemoryBackend::new(), left: Mutex::new(None), is_torn }))
    }

    fn fail_after(&self, writes: Option<u32>) {
        *self.0.left.lock().unwrap_or_else(PoisonError::into_inner) = writes;
    }

    fn has_failed(&self) -> bool {
        *self.0.left.lock().unwrap_or_else(PoisonError::into_inner) == Some(0)
    }

    fn open(&self) -> RedbStore {
        let database = Database::builder().create_with_backend(self.clone()).expect("it is a store");
        RedbStore { name: "disk".to_owned(), database }
    }
}

fn no_power() -> io::Error {
    io::Error::other("the power is gone")
}

impl StorageBackend for Disk {
    fn len(&self) -> io::Result<u64> {
        self.0.disk.len()
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.0.disk.read(offset, out)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        if self.has_failed() { Err(no_power()) } else { self.0.disk.set_len(len) }
    }

    fn sync_data(&self) -> io::Result<()> {
        if self.has_failed() { Err(no_power()) } else { Ok(()) }
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        let mut left = self.0.left.lock().unwrap_or_else(PoisonError::into_inner);
        match &mut *left {
            Some(0) => Err(no_power()),
            Some(writes) => {
                *writes -= 1;
                if *writes > 0 || !self.0.is_torn {
                    return self.0.disk.write(offset, data);
                }
                self.0.disk.write(offset, &data[..data.len() / 2])?;
                Err(no_power())
            }
            None => self.0.disk.write(offset, data),
        }
    }
}

/// Sixty values that belong together.
fn set(number: i64) -> Values {
    (0..60).map(|index| (format!("param/group/value_{index}"), number.into())).collect()
}

#[test]
fn power_lost_at_any_write_leaves_a_complete_set() {
    for is_torn in [false, true] {
        let (mut kept_old, mut kept_new) = (0, 0);
        for writes in 1.. {
            let disk = Disk::new(is_torn);
            let mut store = disk.open();
            store.store(&set(1)).expect("there is power");
            store.store(&set(2)).expect("there is power");
            disk.fail_after(Some(writes));
            let stored = store.store(&set(3));
            let has_failed = disk.has_failed();
            drop(store);
            disk.fail_after(None);
            let values = disk.open().load().expect("it opens");
            assert!(values == set(2) || values == set(3), "after {writes} writes: {values:?}");
            // What was acknowledged is there.
            assert!(stored.is_err() || values == set(3), "after {writes} writes");
            if values == set(2) {
                kept_old += 1
            } else {
                kept_new += 1
            }
            if !has_failed {
                break;
            }
        }
        assert!(kept_old > 1 && kept_new > 0, "{kept_old} {kept_new}");
    }
}

fn values() -> impl Strategy<Value = ParameterValue> {
    prop_oneof![
        any::<bool>().prop_map(ParameterValue::Bool),
        any::<i64>().prop_map(ParameterValue::Integer),
        proptest::num::f64::NORMAL.prop_map(ParameterValue::Float),
        proptest::num::f64::SUBNORMAL.prop_map(ParameterValue::Float),
        any::<String>().prop_map(ParameterValue::Text),
    ]
}

laws! {
    /// Each set replaces the last one, and comes back bit for bit.
    #[test]
    fn what_is_stored_comes_back(
        sets in proptest::collection::vec(proptest::collection::btree_map("[a-z/]{1,20}", values(), 0..12), 1..5),
    ) {
        let disk = Disk::new(false);
        for set in &sets {
            disk.open().store(set).expect("there is power");
            prop_assert_eq!(&disk.open().load().expect("it opens"), set);
        }
    }
}

#[test]
fn a_file_that_is_no_store_is_refused_and_left_as_it_is() {
    let file = std::env::temp_dir().join(format!("bb-redb-refused-{}", std::process::id()));
    std::fs::write(&file, "gains: 4.5\n".repeat(2000)).expect("it is writable");
    let error = RedbStore::open(&file).expect_err("it is text").to_string();
    assert!(error.starts_with(&format!("{}: ", file.display())), "{error}");
    assert_eq!(std::fs::read_to_string(&file).ok(), Some("gains: 4.5\n".repeat(2000)));
    // It might have been one: its values are not replaced by the defaults without a word.
    std::fs::write(&file, "").expect("it is writable");
    let error = RedbStore::open(&file).expect_err("it is empty").to_string();
    assert!(error.contains("the file is empty") && file.metadata().is_ok_and(|data| data.len() == 0), "{error}");
    std::fs::remove_file(&file).expect("it is there");
}

/// A folder of its own, which is removed at the end.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("bb-redb-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("it is writable");
        Self(folder)
    }

    fn names(&self) -> Vec<std::ffi::OsString> {
        let entries = std::fs::read_dir(&self.0).expect("it is there");
        entries.map(|entry| entry.expect("it is readable").file_name()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_store_that_another_program_has_created_meanwhile_is_kept() {
    let folder = Folder::new("meanwhile");
    let file = folder.0.join("store.redb");
    let mut other = RedbStore::open(&file).expect("it is created");
    // What `open` does where there was no file a moment ago.
    create(&file).expect("there is one");
    other.store(&set(1)).expect("it is open");
    drop(other);
    assert_eq!(RedbStore::open(&file).and_then(|mut store| store.load()).expect("it opens"), set(1));
    assert_eq!(folder.names(), ["store.redb"]);
}

#[test]
fn one_of_many_that_create_a_store_at_once_has_it_open() {
    let folder = Folder::new("at_once");
    for round in 0..20 {
        let file = folder.0.join(format!("store-{round}.redb"));
        let (threads, gate) = (4, std::sync::Barrier::new(4));
        let opened: Vec<_> = std::thread::scope(|scope| {
            let open = || {
                gate.wait();
                RedbStore::open(&file)
            };
            let threads: Vec<_> = (0..threads).map(|_| scope.spawn(open)).collect();
            threads.into_iter().map(|thread| thread.join().expect("no panic")).collect()
        });
        let errors: Vec<_> = opened.iter().filter_map(|opened| opened.as_ref().err()).collect();
        assert_eq!(errors.len(), threads - 1, "{errors:?}");
        assert!(errors.iter().all(|error| error.to_string().contains("already open")), "{errors:?}");
        for mut store in opened.into_iter().flatten() {
            store.store(&set(round)).expect("it is open");
        }
        assert_eq!(RedbStore::open(&file).and_then(|mut store| store.load()).expect("it opens"), set(round));
    }
    assert_eq!(folder.names().len(), 20, "{:?}", folder.names());
}
