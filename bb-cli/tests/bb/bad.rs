//! Recordings with something wrong: a line that says what, and the others' results all the same.

use crate::common::{Walk, bb, eval, file};
use serde_json::Value;
use std::path::Path;

#[test]
fn a_bad_recording_does_not_hide_the_others() {
    let good = Walk::default().file("good.mcap");
    let text = file("text.mcap", b"t,gx,gy,gz\n");
    let missing = Path::new("no_such.mcap");
    let output = eval(&[missing, &good, &text], &["--json", "--filter", "madgwick"]);
    assert_eq!(output.code, Some(1));
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((rows.len(), &rows[0]["samples"]), (1, &199.into()));
    let lines: Vec<_> = output.err.lines().collect();
    assert_eq!(lines[0], "error: no_such.mcap: no such file; check the path");
    assert!(lines[1].contains("text.mcap: not an MCAP file"), "{}", lines[1]);
    assert_eq!(lines[2], "error: 2 of 3 recordings could not be evaluated to the end");
    // The table as well.
    let output = eval(&[missing, &good], &[]);
    assert!(output.out.contains("good") && output.code == Some(1));
}

#[test]
fn what_is_not_there_is_named() {
    let none = Walk { samples: 0, ..Walk::default() }.file("empty_topics.mcap");
    let no_magnetometer = Walk { magnetometer: false, ..Walk::default() }.file("no_mag.mcap");
    let nothing = file("nothing.mcap", b"");
    for (file, arguments, fault) in [
        (&none, &[][..], "empty_topics.mcap: /imu holds no message, so there is nothing to play"),
        (
            &no_magnetometer,
            &[],
            "no topic of type sensor_msgs/msg/MagneticField; the bag has /imu (sensor_msgs/msg/Imu)",
        ),
        (&no_magnetometer, &[], "; without one, choose --axes 6"),
        (&no_magnetometer, &["--mag-topic", "/mag"], "no topic /mag; the bag has"),
        (
            &no_magnetometer,
            &["--axes", "six", "--truth", "/imu"],
            "/imu are sensor_msgs/msg/Imu, and geometry_msgs",
        ),
        (
            &no_magnetometer,
            &["--axes", "six", "--moving-topic", "/imu"],
            "/imu are sensor_msgs/msg/Imu, and std_msgs",
        ),
        (&nothing, &[], "nothing.mcap: truncated after 0 messages (byte 0 of 0)"),
    ] {
        let output = eval(&[file], arguments);
        assert_eq!((output.code, &*output.out), (Some(1), ""));
        assert!(output.err.contains(fault), "{fault}: {}", output.err);
        let output = eval(&[file], &[arguments, &["--json"]].concat());
        assert_eq!((output.code, &*output.out), (Some(1), "[]\n"));
    }
}

/// A folder may hold recordings that are not read: none is left out in silence.
#[test]
fn what_a_folder_holds_is_named_with_the_way_out() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("others");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("walk")).expect("makes");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("writes");
    write("a.mcap", &Walk::default().bytes());
    write("metadata.yaml", b"rosbag2_bagfile_information:");
    let packed = [&[0x28, 0xb5, 0x2f, 0xfd][..], &[0; 40]].concat();
    write("walk/walk_0.mcap.zstd", &packed);
    write("walk/walk_1.bag", b"#ROSBAG V2.0\n");
    write("walk/walk_2.db3", b"SQLite format 3\0 and no more");
    let output = eval(&[&folder], &["--json", "--filter", "madgwick"]);
    assert_eq!(output.code, Some(1));
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((rows.len(), &rows[0]["samples"]), (1, &199.into()));
    let lines: Vec<_> = output.err.lines().collect();
    assert!(lines[0].ends_with(
        "walk_0.mcap.zstd: not an MCAP file: it is packed as a whole with zstd; unpack it with `zstd -d`"
    ));
    assert!(lines[1].contains("walk_1.bag: not an MCAP file: it is a ROS 1 bag; convert it"), "{}", lines[1]);
    let way_out =
        if cfg!(feature = "sqlite") { "check that it is a bag of ROS 2" } else { "with the feature `sqlite`" };
    assert!(lines[2].contains("walk_2.db3: ") && lines[2].contains(way_out), "{}", lines[2]);
    assert_eq!(lines[3], "error: 3 of 4 recordings could not be evaluated to the end");
    // The description of a bag means its folder, to what reads one recording too.
    let described = folder.join("metadata.yaml");
    let output = eval(&[&described], &["--json", "--filter", "madgwick"]);
    assert!(output.err.ends_with("error: 3 of 4 recordings could not be evaluated to the end\n"), "{}", output.err);
    let echo = |path: &Path| bb(&["echo", path.to_str().expect("is text"), "/imu", "--limit", "1"]);
    assert!(echo(&described).err.contains("the folder holds several recordings; name one of them"));
    std::fs::remove_dir_all(folder.join("walk")).expect("removes");
    for path in [&described, &folder] {
        let output = echo(path);
        assert!(output.code == Some(0) && output.out.contains("angular_velocity"), "{}", output.err);
    }
}

/// Cut anywhere, as by a recorder that was killed: scored up to the break, which is reported.
#[test]
fn an_interrupted_recording_is_scored_up_to_the_break() {
    let bytes = Walk { error: 0.1, ..Walk::default() }.bytes();
    let mut most = 0;
    for part in [5, 20, 40, 60, 80] {
        let cut = file("interrupted.mcap", &bytes[..bytes.len() * part / 100]);
        let output = eval(&[&cut], &["--json", "--filter", "madgwick"]);
        assert_eq!(output.code, Some(1), "{part} %");
        assert!(output.err.contains("interrupted.mcap: truncated after "), "{}", output.err);
        let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
        let Some(row) = rows.first() else { continue };
        assert!(output.err.contains("; scored up to there"), "{}", output.err);
        let samples = row["samples"].as_u64().expect("a count");
        assert!(samples >= most);
        most = samples;
        if samples > 0 {
            let heading = row["heading_deg"].as_f64().expect("a number");
            assert!((heading - 0.1_f64.to_degrees()).abs() < 0.1, "{heading}");
        }
    }
    assert!(most > 100, "{most}");
}

/// A changed bit is an error or, where nothing checks it, other figures, but no crash.
#[test]
fn a_damaged_recording_does_not_crash() {
    let bytes = Walk { samples: 60, ..Walk::default() }.bytes();
    for at in (0..bytes.len()).step_by(bytes.len() / 40) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        let output = eval(&[&file("damaged.mcap", &damaged)], &["--json", "--filter", "mekf"]);
        assert!(matches!(output.code, Some(0 | 1)), "byte {at}: {:?} {}", output.code, output.err);
        assert!(serde_json::from_str::<Vec<Value>>(&output.out).is_ok(), "byte {at}");
    }
}
