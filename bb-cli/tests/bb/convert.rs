//! `bb convert`: recordings of other programs as bags that the other commands read.

use crate::common::{bb, file};
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::payload::{GnssFix, GnssStatus, Imu, MagneticField, Pose};
use bb_mcap::Bag;
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn csv(name: &str, text: &str) -> PathBuf {
    file(name, text.as_bytes())
}

/// Returns the path of the bag of this name.
fn bag(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&path);
    path
}

fn convert(input: &Path, out: &Path, arguments: &[&str]) -> crate::common::Output {
    let files = [input, out].map(|path| path.to_str().expect("is text"));
    bb(&[&["convert"][..], &files, arguments].concat())
}

/// Ten seconds at 100 Hz: rest, then turns about z by 0.5 rad/s; angles in deg/s, forces in g, fields in µT.
fn walk(head: &str, delimiter: &str) -> String {
    let mut text = head.to_owned();
    for index in 0..1000_u32 {
        let turning = index > 300;
        let angle = 0.005 * f64::from(index.saturating_sub(300));
        let world_from_body = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let field = world_from_body.inverse() * Vector3::new(0.0, 20.0, -40.0);
        let [x, y, z, w] = <[f64; 4]>::from(world_from_body.coords);
        // The magnetometer has every other sample.
        let field =
            if index % 2 == 0 { [field.x, field.y, field.z].map(|v| v.to_string()) } else { Default::default() };
        let rate: f64 = if turning { 0.5 } else { 0.0 };
        let time_us = 1_700_000_000_000_000 + 10_000 * u64::from(index);
        let cells = [
            time_us.to_string(),
            "0".into(),
            "0".into(),
            rate.to_degrees().to_string(),
            "0".into(),
            "0".into(),
            "1".into(),
        ];
        let truth = [w, x, y, z].map(|value| value.to_string());
        let cells: Vec<_> =
            cells.into_iter().chain(field).chain(truth).chain([u8::from(turning).to_string()]).collect();
        writeln!(text, "{}", cells.join(delimiter)).expect("writes");
    }
    text
}

const MAP: [&str; 7] =
    ["time=1:us", "gyr=2-4:deg/s", "acc=5-7:g", "mag=8-10:uT", "quat=11-14", "moving=15", "pos=12-14:mm"];

#[test]
fn a_converted_recording_is_scored() {
    for (name, delimiter, head) in [("comma", ",", ""), ("semicolon", ";", "Time;Gyr;;;Acc;;\n;x;y;z;x;y;z\n")] {
        let (input, out) = (csv(&format!("{name}.csv"), &walk(head, delimiter)), bag(&format!("{name}.mcap")));
        let output = convert(&input, &out, &[&["--columns"], &MAP[..6]].concat());
        assert_eq!((output.code, &*output.err), (Some(0), ""));
        let said = "1000 on /imu, 500 on /mag, 1000 on /truth, 2 on /moving";
        let head = if head.is_empty() { "" } else { ", after 2 lines of head" };
        assert_eq!(output.out, format!("{}: {said}{head}\n", out.display()));

        let score = bb(&["eval", "attitude", out.to_str().expect("is text"), "--json", "--filter", "madgwick"]);
        assert_eq!(score.code, Some(0), "{}", score.err);
        let rows: Vec<Value> = serde_json::from_str(&score.out).expect("an array");
        assert_eq!(rows[0]["samples"], 699);
        assert!(rows[0]["total_deg"].as_f64().expect("a number") < 1.0, "{}", score.out);
        let info = bb(&["info", out.to_str().expect("is text"), "--json"]);
        assert!(!info.out.contains("\"subject\""), "no units or clocks look wrong: {}", info.out);
    }
}

#[test]
fn values_are_in_si_with_their_nanoseconds() {
    let text = "#timestamp [ns],w_x [deg s^-1],w_y,w_z,a_x,a_y,a_z,m,n,o,q_x,q_y,q_z,q_w\n\
        1403636579758555392,90,0,-180,0,0,2,0.5,0,0,0.6,0,0,0.8\n\
        1403636579763555584,0,0,0,0,0,1,,,,nan,nan,nan,nan\n";
    let (input, out) = (csv("si.csv", text), bag("si.mcap"));
    let map = "time=timestamp:ns gyr=w_*:deg/s acc=a_*:g mag=m,n,o:50uT quat=11-14:xyzw";
    let output = convert(&input, &out, &["--columns", map]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let bag = Bag::open(&out).expect("opens");
    let messages =
        |topic: &str| bag.messages(&[topic]).expect("is there").map(|message| message.expect("is whole"));
    let (imu, time) = messages("/imu").next().expect("is one").payload::<Imu>().expect("is one");
    assert_eq!(time.as_unix_nanos(), 1_403_636_579_758_555_392);
    let wanted = Vector3::new(90_f64.to_radians(), 0.0, -180_f64.to_radians());
    assert!((imu.angular_velocity - wanted).norm() < 1e-12);
    assert_eq!(imu.linear_acceleration, Vector3::new(0.0, 0.0, 2.0 * 9.80665));
    assert_eq!(imu.orientation, None);
    let fields: Vec<_> =
        messages("/mag").map(|message| message.payload::<MagneticField>().expect("is one")).collect();
    assert_eq!(fields.len(), 1, "empty cells are no reading");
    assert!((fields[0].0.magnetic_field - Vector3::new(2.5e-5, 0.0, 0.0)).norm() < 1e-18);
    let poses: Vec<_> = messages("/truth").map(|message| message.payload::<Pose>().expect("is one").0).collect();
    assert_eq!(<[f64; 4]>::from(poses[0].world_from_body.coords), [0.6, 0.0, 0.0, 0.8]);
    assert!(poses[1].world_from_body.coords.iter().all(|value| value.is_nan()), "an unknown truth stays unknown");
}

#[test]
fn truth_may_have_a_file_of_its_own() {
    let (imu, truth): (Vec<_>, Vec<_>) = walk("", ",")
        .lines()
        .map(|line| {
            let cells: Vec<_> = line.split(',').collect();
            (cells[..7].join(","), [&cells[..1], &cells[10..]].concat().join(","))
        })
        .unzip();
    let (input, truth) = (csv("imu.csv", &imu.join("\n")), csv("truth.csv", &truth.join("\n")));
    let out = bag("truth.mcap");
    let with = format!("{} time=1:us quat=2-5 moving=6", truth.display());
    let arguments = [&["--columns"], &MAP[..3], &["--with", &with]];
    let output = convert(&input, &out, &arguments.concat());
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let score =
        bb(&["eval", "attitude", out.to_str().expect("is text"), "--json", "--axes", "6", "--filter", "mekf"]);
    let rows: Vec<Value> = serde_json::from_str(&score.out).expect("an array");
    assert_eq!(rows[0]["samples"], 699);
    // By log time, so that players need not sort.
    let bag = Bag::open(&out).expect("opens");
    let times = bag.messages(&["/imu", "/truth", "/moving"]).expect("are there");
    assert!(times.map(|message| message.expect("is whole").log_time_ns).is_sorted());
}

#[test]
fn a_rate_takes_the_place_of_times() {
    let (input, out) = (csv("rate.csv", "1,2,3,0,0,9.8\n1,2,3,0,0,9.8\n1,2,3,0,0,9.8\n"), bag("rate.mcap"));
    let output = convert(&input, &out, &["--rate", "200", "--columns", "gyr=1-3", "acc=4-6"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let hz = bb(&["hz", out.to_str().expect("is text"), "--json"]);
    let rows: Vec<Value> = serde_json::from_str(&hz.out).expect("an array");
    assert!((rows[0]["rate_hz"].as_f64().expect("a number") - 200.0).abs() < 1e-6);
    assert!(!bb(&["info", out.to_str().expect("is text")]).out.contains("zero"), "the first stamp is one");
}

#[test]
fn errors_are_reported_by_line_and_column() {
    let map = ["--columns", "time=t gyr=gx,gy,gz acc=4-6"];
    let head = "t,gx,gy,gz,ax,ay,az\n";
    for (name, text, fault) in [
        ("word", "0,1,2,3,4,5,6\n1,1,2,x,4,5,6\n", "line 3, column 4 (gz): `x` is not a number"),
        ("short", "0,1,2,3,4,5,6\n\n1,1,2\n", "line 4, column 4 (gz): is missing, since the line has 3 columns"),
        ("empty", "0,1,2,3,,5,6\n", "line 2, column 5 (acc): `` is not a number"),
        ("time", "0,1,2,3,4,5,6\nnan,1,2,3,4,5,6\n", "line 3, column 1 (t): `nan` is not a time"),
        (
            "huge",
            "0,1,2,3,4,5,6\r\n\r\n1,1e400,2,3,4,5,6\r\n",
            "line 4, column 2 (gx): `1e400` is not a finite number",
        ),
        ("infinite", "0,1,2,3,-inf,5,6", "line 2, column 5 (acc): `-inf` is not a finite number"),
        (
            "before",
            "-0.25,1,2,3,4,5,6\n",
            "line 2, column 1 (t): `-0.25` is before 1970, where no time of a bag is; say when the clock was zero, as time=1@1700000000",
        ),
        (
            "after",
            "1700000000000,1,2,3,4,5,6\n",
            "line 2, column 1 (t): `1700000000000` is after 2038, which no stamp of ROS holds; is the unit another (s, ms, us, ns)?",
        ),
        ("words", "zero,1,2\n", "it has no line that begins with a number"),
        ("none", "", "it has no line that begins with a number"),
    ] {
        let (input, out) = (csv(&format!("bad_{name}.csv"), &format!("{head}{text}")), bag("bad.mcap"));
        let output = convert(&input, &out, &map);
        assert_eq!((output.code, &*output.out), (Some(1), ""), "{name}");
        assert_eq!(output.err, format!("error: {}: {fault}\n", input.display()));
        assert!(!out.exists(), "{name}: a bag that is no use is removed");
    }
    let text = "t;gx;gy;gz;ax;ay;az\n0;1;2;3;4;5;6\n0,01;1;2;3;4;5;6\n";
    let (input, out) = (csv("bad_decimal.csv", text), bag("bad.mcap"));
    let output = convert(&input, &out, &map);
    let fault = "line 3, column 1 (t): `0,01` has a decimal comma; make it a point, as `tr , .` does where cells are not \
                 separated by commas";
    assert_eq!(output.err, format!("error: {}: {fault}\n", input.display()));
    let input = csv("bad_map.csv", &format!("{head}0,1,2,3,4,5,6\n"));
    for (map, code, fault) in [
        ("time=t gyr=gx,gy,gzz acc=5-7", 1, "no column `gzz`; did you mean `gz`?"),
        ("gyr=2-4 acc=5-7", 1, "columns: time is needed, as time=1:us, or --rate"),
        ("time=t gyr=2-4", 1, "--columns: gyr and acc are needed"),
        ("time=t gyr=2-4:rpm acc=5-7", 2, "no unit `rpm`; there are rad/s, deg/s, dps"),
        ("time=t gyro=2-4 acc=5-7", 2, "no quantity `gyro`; did you mean `gyr`?"),
    ] {
        let output = convert(&input, &bag("bad_map.mcap"), &["--columns", map]);
        assert_eq!(output.code, Some(code), "{map}: {}", output.err);
        assert!(output.err.contains(fault), "{map}: {}", output.err);
    }
    let out = bag("there.mcap");
    std::fs::write(&out, "mine").expect("writes");
    let output = convert(&input, &out, &map);
    assert!(output.err.contains("it exists already"), "{}", output.err);
    assert_eq!(std::fs::read(&out).expect("reads"), b"mine", "what was there stays");
}

/// A head serves for the names of the columns only, whatever is in it.
#[test]
fn a_comment_does_not_choose_the_delimiter() {
    let text = "# logged at noon; by me; with a chip; in a hurry\r\nt,gx,gy,gz,ax,ay,az\r\n\r\n1,1,2,3,0,0,9.8";
    let (input, out) = (csv("comment.csv", text), bag("comment.mcap"));
    let output = convert(&input, &out, &["--columns", "time=t gyr=gx,gy,gz acc=ax,ay,az"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    assert_eq!(output.out, format!("{}: 1 on /imu, after 2 lines of head\n", out.display()));
}

/// A pipe gives each byte once, and its writer waits for the reader.
#[test]
fn a_pipe_is_read_once() {
    let text = walk("t,gx,gy,gz,ax,ay,az,mx,my,mz,w,x,y,z,moving\n", ",");
    let piped = |input: &str, name: &str| {
        let out = bag(name);
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_bb"))
            .args(["convert", input, out.to_str().expect("is text"), "--columns"])
            .args(&MAP[..6])
            .stdin(std::process::Stdio::piped())
            .stdout(std::process::Stdio::piped())
            .spawn()
            .expect("runs");
        let mut stdin = child.stdin.take().expect("is piped");
        std::io::Write::write_all(&mut stdin, text.as_bytes()).expect("is read");
        drop(stdin);
        let output = child.wait_with_output().expect("ends");
        String::from_utf8(output.stdout).expect("is text")
    };
    let counts = "1000 on /imu, 500 on /mag, 1000 on /truth, 2 on /moving, after one line of head\n";
    assert!(piped("-", "pipe.mcap").ends_with(counts));
    if cfg!(unix) {
        assert!(piped("/dev/stdin", "pipe_by_name.mcap").ends_with(counts));
    }
}

/// Columns as phones log them: each sensor with a file, a rate and times of its own.
#[test]
fn sensors_with_files_of_their_own_are_joined() {
    let rows = |step: f64, offset: f64, count: u32, value: fn(f64) -> [f64; 3]| {
        let row = |index: u32| {
            let time = 100.0 + offset + step * f64::from(index);
            let [x, y, z] = value(time);
            format!("{time:.4}\t{x}\t{y}\t{z}\n")
        };
        (0..count).map(row).collect::<String>()
    };
    // The specific force grows linearly, so that interpolation is exact.
    let gyroscope = csv("gyroscope.txt", &rows(0.01, 0.0, 100, |t| [0.0, 0.0, t]));
    let accelerometer = csv("accelerometer.txt", &rows(0.008, 0.003, 100, |t| [t, 2.0 * t, 9.8]));
    // Spaces, on a clock that began 50 s before.
    let field = rows(0.02, 50.0, 50, |_| [0.0, 20.0, -40.0]).replace('\t', "  ");
    let field = csv("magnetometer.txt", &field);
    let out = bag("joined.mcap");
    let with = [
        format!("{} time=1 acc=2-4", accelerometer.display()),
        format!("{} time=1@-50 mag=2-4:uT", field.display()),
    ];
    let arguments = ["--columns", "time=1 gyr=2-4", "--with", &with[0], "--with", &with[1]];
    let output = convert(&gyroscope, &out, &arguments);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    // Forces are known from 100.003 to 100.795.
    let said = "79 on /imu, 50 on /mag, 21 angular velocities without a specific force within 0.1 s left out\n";
    assert_eq!(output.out, format!("{}: {said}", out.display()));
    let opened = Bag::open(&out).expect("opens");
    for message in opened.messages(&["/imu"]).expect("is there") {
        let (imu, time) = message.expect("is whole").payload::<Imu>().expect("is one");
        let time = time.as_unix_nanos() as f64 * 1e-9;
        let wanted = Vector3::new(time, 2.0 * time, 9.8);
        assert!((imu.linear_acceleration - wanted).norm() < 1e-6, "{time}: {imu:?}");
        assert!((imu.angular_velocity.z - time).abs() < 1e-9);
    }
    let times = opened.messages(&["/imu", "/mag"]).expect("are there");
    assert!(times.map(|message| message.expect("is whole").log_time_ns).is_sorted());

    let description = csv(
        "phone.toml",
        "[[file]]\npath = \"gyroscope.txt\"\ncolumns = \"time=1 gyr=2-4\"\n\
         [[file]]\npath = \"accelerometer.txt\"\ncolumns = \"time=1 acc=2-4\"\n\
         [[file]]\npath = \"magnetometer.txt\"\ncolumns = \"time=1@-50 mag=2-4:uT\"\n",
    );
    let described = bag("described.mcap");
    let output = convert(&description, &described, &[]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    assert_eq!(output.out, format!("{}: {said}", described.display()));
    assert_eq!(std::fs::read(&described).expect("reads"), std::fs::read(&out).expect("reads"));
}

#[test]
fn a_description_is_checked() {
    for (name, text, fault) in [
        ("key", "[[file]]\npath = \"a\"\ncolumn = \"time=1\"\n", "unknown field `column`"),
        ("path", "[[file]]\nrate = 5.0\n", "missing field `path`"),
        ("map", "[[file]]\npath = \"a.csv\"\ncolumns = \"gyro=1-3\"\n", "a.csv: columns: no quantity `gyro`"),
        ("rate", "[[file]]\npath = \"a.csv\"\nrate = -1.0\n", "a.csv: rate: must be above 0"),
        ("none", "", "missing field `file`"),
        ("gone", "[[file]]\npath = \"not_there.csv\"\n", "not_there.csv: cannot be read"),
    ] {
        let out = bag("undescribed.mcap");
        let output = convert(&csv(&format!("description_{name}.toml"), text), &out, &[]);
        assert_eq!(output.code, Some(1), "{name}");
        assert!(output.err.contains(fault), "{name}: {}", output.err);
        assert!(!out.exists(), "{name}");
    }
    let output = convert(&csv("columns.txt", "0,1,2,3\n"), &bag("columns.mcap"), &[]);
    assert!(
        output.err.contains("columns.txt: what its columns contain is not said; name them with --columns"),
        "{}",
        output.err
    );
}

/// Returns a sentence with its checksum.
fn sentence(text: &str) -> String {
    let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${text}*{sum:02X}\r\n")
}

#[test]
fn sentences_of_a_receiver_are_fixes() {
    // Over midnight: the date comes a second after the first fix.
    let text = [
        sentence("GPGGA,235959.50,4807.0380,N,01131.0000,E,1,08,0.9,545.4,M,46.9,M,,"),
        sentence("GPRMC,000000.00,A,4807.0380,N,01131.0000,E,022.4,084.4,240624,003.1,W"),
        sentence("GNGST,000000.00,1.2,,,,0.8,0.6,1.5"),
        sentence("GPGGA,000000.00,4807.0380,N,01131.0000,E,4,08,0.9,545.4,M,46.9,M,,"),
        sentence("GPGGA,000000.50,,,,,0,00,,,M,,M,,"),
        "$GPGGA,000001.00,4807.0380,N,01131.0000,E,1,08,0.9,545.4,M,46.9,M,,*00\r\n".to_owned(),
        sentence("PUBX,41,1,0007,0003,19200,0"),
    ];
    let (input, out) = (csv("drive.nmea", &text.concat()), bag("nmea.mcap"));
    let output = convert(&input, &out, &[]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let said = "3 on /fix, 1 line is no sentence with the right checksum";
    assert_eq!(output.out, format!("{}: {said}\n", out.display()));
    let wrong: String = text.iter().map(|line| line.replace('*', "*1")).collect();
    let output = convert(&csv("wrong.nmea", &wrong), &bag("wrong_nmea.mcap"), &[]);
    let said = "6 lines are no sentences with the right checksum, and none of the others is an RMC or ZDA that says the date";
    assert!(output.code == Some(1) && output.err.contains(said), "{}", output.err);
    let fixes = fixes(&out, "/fix");
    // 2024-06-24T00:00:00Z
    let midnight = 1_719_187_200_000_000_000;
    let times: Vec<_> = fixes.iter().map(|(_, time)| time - midnight).collect();
    assert_eq!(times, [-500_000_000, 0, 500_000_000]);
    let place = fixes[1].0.position.expect("is known");
    assert!((place.latitude_rad.to_degrees() - (48.0 + 7.038 / 60.0)).abs() < 1e-9);
    // Above the ellipsoid.
    assert!((place.altitude.expect("is known") - 592.3).abs() < 1e-3);
    assert_eq!(fixes[0].0.position_covariance, None);
    let covariance = fixes[1].0.position_covariance.expect("is known");
    assert!((covariance[(0, 0)] - 0.36).abs() < 1e-6 && (covariance[(1, 1)] - 0.64).abs() < 1e-6);
    assert_eq!((fixes[2].0.status, fixes[2].0.position), (GnssStatus::NoFix, None));
    let undated = csv("undated.nmea", &text[0]);
    let output = convert(&undated, &bag("undated.mcap"), &[]);
    assert!(output.err.contains("no RMC or ZDA sentence says the date"), "{}", output.err);
}

fn fixes(file: &Path, topic: &str) -> Vec<(GnssFix, i64)> {
    let bag = Bag::open(file).expect("opens");
    let messages = bag.messages(&[topic]).expect("is there");
    let fix = |message: Result<bb_mcap::BagMessage, _>| {
        let (fix, time) = message.expect("is whole").payload::<GnssFix>().expect("is one");
        (fix, time.as_unix_nanos())
    };
    messages.map(fix).collect()
}

#[test]
fn solutions_of_rtklib_are_fixes() {
    let head = "% program   : RTKPOST\n% inp file  : rover.obs\n%  GPST                  latitude(deg) longitude(deg)  height(m)   \
                Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio\n";
    let row = "2019/05/01 07:26:19.000   48.137000000   11.575000000   520.0000   1   9   0.0200   0.0100   0.0500   \
               0.0000   0.0000   0.0000   0.50    3.0\n";
    let (solution, out) = (csv("reference.pos", &format!("{head}{row}")), bag("pos.mcap"));
    let imu = csv("pos_imu.csv", "1556695561.0,0,0,0,0,0,9.8\n1556695561.5,0,0,0,0,0,9.8\n");
    // A name with a space.
    let spaced = solution.with_file_name("reference of the roof.pos");
    std::fs::copy(&solution, &spaced).expect("copies");
    let with = format!("{} topic=/rtk", spaced.display());
    let output = convert(&imu, &out, &["--columns", "time=1 gyr=2-4 acc=5-7", "--with", &with]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    assert_eq!(output.out, format!("{}: 2 on /imu, 1 on /rtk\n", out.display()));
    let fixes = fixes(&out, "/rtk");
    // GPS time is 18 s ahead.
    assert_eq!(fixes[0].1, 1_556_695_561_000_000_000);
    assert!((fixes[0].0.position.expect("is known").longitude_rad.to_degrees() - 11.575).abs() < 1e-12);
    let cut = csv("cut.pos", &format!("{head}2019/05/01 07:26:19.000   48.1\n"));
    let output = convert(&cut, &bag("cut.mcap"), &[]);
    assert!(output.err.contains("cut.pos: line 4: 3 columns are too few"), "{}", output.err);
}

/// A rate or a topic that a format does not take is not passed over, and neither is a description in another.
#[test]
fn what_a_format_has_not_is_refused() {
    let solution = csv("refused.pos", "% program\n2019/05/01 07:26:19.000 48.1 11.5 520 1 9 1 1 1 0 0 0 0 0\n");
    let outer = csv("outer.toml", "[[file]]\npath = \"inner.toml\"\n");
    let out = bag("refused.mcap");
    let ros1 = format!("{} topic=/rtk", data("ros1.bag").display());
    for (input, arguments, fault) in [
        (&solution, &["--rate", "10"][..], "--rate is for a CSV without times, and a solution of RTKLIB has times"),
        (&data("px4.ulg"), &["--rate", "10"], "and a log of PX4 has times; leave it out"),
        (&data("ros1.bag"), &["--rate", "10"], "and a bag of ROS 1 has times; leave it out"),
        (&outer, &["--rate", "10"], "outer.toml: --rate is for a CSV without times"),
        (
            &solution,
            &["--with", &ros1],
            "topic=/rtk names a topic for fixes, and a bag of ROS 1 has topics of its own",
        ),
        (&outer, &[], "inner.toml, another description; list that one's files here"),
    ] {
        let output = convert(input, &out, arguments);
        assert_eq!((output.code, out.exists()), (Some(1), false), "{}", output.err);
        assert!(output.err.contains(fault), "{fault}: {}", output.err);
    }
}

/// A file of `tests/data`.
fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Figures of `pyulog` 1.3.0, read from the same file.
#[test]
fn logs_of_px4_are_in_the_axes_of_ros() {
    let out = bag("px4.mcap");
    let output = convert(&data("px4.ulg"), &out, &[]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    assert_eq!(output.out, format!("{}: 419 on /imu, 104 on /mag, 15 on /fix\n", out.display()));
    let opened = Bag::open(&out).expect("opens");
    let first =
        |topic: &str| opened.messages(&[topic]).expect("is there").next().expect("is one").expect("is whole");
    // The receiver's clock at its first fix is 2021-04-21T06:30:58.600345 UTC, 20.471648 s after boot.
    let boot_ns = 1_618_986_658_600_345_000 - 20_471_648_000;
    let (imu, time) = first("/imu").payload::<Imu>().expect("is one");
    assert_eq!(time.as_unix_nanos() / 1000, (boot_ns + 20_326_716_000) / 1000);
    let close = |found: Vector3<f64>, wanted: [f64; 3]| {
        assert!((found - Vector3::from(wanted)).norm() < 1e-6 * found.norm(), "{found}")
    };
    close(imu.linear_acceleration, [0.001_245_805_6, 0.154_344_98, 9.634_243]);
    close(imu.angular_velocity, [0.002_968_383_5, -0.003_646_239_9, -0.000_942_496_1]);
    let (field, _) = first("/mag").payload::<MagneticField>().expect("is one");
    close(field.magnetic_field, [4.291_782_7e-5, 1.141_843_7e-5, 5.181_336e-6]);
    let (fix, _) = first("/fix").payload::<GnssFix>().expect("is one");
    let place = fix.position.expect("is known");
    assert!((place.latitude_rad.to_degrees() - 63.417_062_2).abs() < 1e-9);
    assert!((place.altitude.expect("is known") - 106.766).abs() < 1e-9);
    let covariance = fix.position_covariance.expect("is known");
    assert!((covariance[(0, 0)].sqrt() - 3.26).abs() < 1e-6 && (covariance[(2, 2)].sqrt() - 6.984).abs() < 1e-6);
}

/// Written by Python's `rosbags` 0.11, packed with bzip2.
#[test]
fn bags_of_ros_1_keep_their_topics() {
    let out = bag("ros1.mcap");
    let output = convert(&data("ros1.bag"), &out, &[]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    assert_eq!(output.out, format!("{}: 20 on /imu/data, 2 on /pose, 2 on /camera/info\n", out.display()));
    let opened = Bag::open(&out).expect("opens");
    for (index, message) in opened.messages(&["/imu/data"]).expect("is there").enumerate() {
        let (imu, time) = message.expect("is whole").payload::<Imu>().expect("is one");
        assert_eq!(time.as_unix_nanos(), 1_600_000_000_000_000_000 + 10_000_000 * index as i64);
        assert_eq!((imu.orientation, imu.angular_velocity.z), (None, 0.1 * index as f64));
    }
    let text = out.to_str().expect("is text");
    let camera = bb(&["echo", text, "/camera/info", "--limit", "1", "--json"]);
    let line: Value = serde_json::from_str(&camera.out).expect("is JSON");
    assert_eq!(line["message"]["d"], serde_json::json!([0.1, 0.2]));
    assert_eq!(line["message"]["distortion_model"], "plumb_bob");

    let whole = std::fs::read(data("ros1.bag")).expect("reads");
    for length in [20, 3000, 5000] {
        let out = bag("cut_ros1.mcap");
        let output = convert(&file("cut_ros1.bag", &whole[..length]), &out, &[]);
        assert_eq!(output.code, Some(1), "{length}");
        assert!(output.err.contains("rosbag reindex"), "{length}: {}", output.err);
        assert!(!out.exists());
    }
}
