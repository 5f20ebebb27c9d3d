//! A robot as others reach it over zenoh: in one program, since each takes long to link, and most of them wait.

mod access;
mod kit;
mod link;
mod node;
#[path = "../../examples/two_machines/relay.rs"]
mod relay;
mod remote;
#[cfg(feature = "tls")]
mod tls;

/// The example of two machines, as it is run by hand: it fails unless all happened that should.
#[test]
fn two_machines_behave_as_the_example_expects() {
    let tests = std::env::current_exe().expect("it is this one");
    let folder = tests.parent().and_then(|deps| deps.parent()).expect("it is in `deps`");
    let run = std::process::Command::new(folder.join("examples/two_machines")).output().expect("it is built");
    print!("{}", String::from_utf8_lossy(&run.stdout));
    assert!(run.status.success());
}
