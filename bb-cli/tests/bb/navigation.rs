//! `bb eval navigation`, on a small data set made here.

use crate::common::{bb, file};
use serde_json::Value;
use std::fmt::Write;
use std::path::PathBuf;

/// Ten seconds of straight motion at 2 m/s to the east, with a fix a second. Gives the prefix of its files.
fn drive(name: &str) -> PathBuf {
    let (mut imu, mut keyframes) =
        (String::from("t,gx,gy,gz,ax,ay,az,dt\n"), String::from("k,t,imu_start,truth_row,eval\n"));
    let mut truth = String::from("t,px,py,pz,qw,qx,qy,qz,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz\n");
    let mut gps = String::from("k,t,x,y,z,sigma_h,sigma_v\n");
    for i in 0..1000 {
        let _ = writeln!(imu, "{},0,0,0,0,0,9.81,0.01", f64::from(i) * 0.01);
    }
    for k in 0..=100 {
        let t = f64::from(k) * 0.1;
        let _ = writeln!(keyframes, "{k},{t},{},{k},1", k * 10);
        let _ = writeln!(truth, "{t},{},0,0,1,0,0,0,2,0,0,nan,nan,nan,nan,nan,nan", 2.0 * t);
        if k % 10 == 0 {
            let _ = writeln!(gps, "{k},{t},{},0,0,0.5,1", 2.0 * t);
        }
    }
    let init = "px,…\n0.2,0,0,1,0,0,0,2,0,0,0,0,0,0,0,0,0.01,0.5,0.1,0.001,0.01\n";
    let noise = "gyro_nd,gyro_rw,accel_nd,accel_rw,gravity\n1e-4,1e-6,1e-3,1e-5,9.81\n";
    let files = [("truth", &*truth), ("keyframes", &keyframes), ("gps", &gps), ("init", init), ("noise", noise)];
    for (what, text) in files {
        file(&format!("{name}_{what}.csv"), text.as_bytes());
    }
    let last = file(&format!("{name}_imu.csv"), imu.as_bytes());
    last.with_file_name(name)
}

#[test]
fn a_drive_is_scored() {
    let drive = drive("straight");
    let prefix = drive.to_str().expect("is text");
    let output = bb(&["eval", "navigation", prefix, "--filter", "eskf,eskf-single", "--json"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((rows.len(), &rows[0]["filter"], &rows[1]["filter"]), (2, &"eskf".into(), &"eskf-single".into()));
    for row in &rows {
        let number = |name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name} is no number: {row}"));
        assert!(number("position_rmse_m") < 0.3 && number("velocity_rmse_mps") < 0.2, "{row}");
        assert!(number("orientation_rmse_deg") < 1.0 && number("nees") < 6.0, "{row}");
        assert!(number("us_per_imu_sample") > 0.0 && number("ms_per_keyframe_p50") > 0.0, "{row}");
        assert!(number("ms_per_keyframe_p99") >= number("ms_per_keyframe_p50"), "{row}");
        assert_eq!((&row["keyframes"], &row["refused"], &row["file"]), (&90.into(), &0.into(), &prefix.into()));
    }
    let output = bb(&["eval", "navigation", prefix]);
    assert!(output.out.contains("straight  eskf ") && output.out.contains("NEES"), "{}", output.out);
}

#[test]
fn a_smoother_tells_of_its_window() {
    let drive = drive("smoothed");
    let prefix = drive.to_str().expect("is text");
    let filters = "smoother,smoother-single,eskf";
    let output = bb(&["eval", "navigation", prefix, "--filter", filters, "--window", "10", "--json"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!(rows.len(), 3);
    for row in &rows[..2] {
        let number = |name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name} is no number: {row}"));
        assert!(number("position_rmse_m") < 0.3 && number("nees") < 6.0, "{row}");
        assert!(number("position_smoothed_rmse_m") < 0.3 && number("orientation_smoothed_rmse_deg") < 1.0, "{row}");
        assert_eq!((&row["keyframes"], &row["refused"], &row["allocations"]), (&90.into(), &0.into(), &0.into()));
    }
    assert_eq!((&rows[2]["allocations"], &rows[2]["position_smoothed_rmse_m"]), (&Value::Null, &Value::Null));
    for window in ["1", "1001", "ten"] {
        let output = bb(&["eval", "navigation", prefix, "--filter", "smoother", "--window", window]);
        assert!(output.code == Some(2) && output.err.contains("--window"), "{window}: {}", output.err);
    }
    // Of a window that is never full nothing is smoothed.
    let output = bb(&["eval", "navigation", prefix, "--filter", "smoother", "--window", "500", "--json"]);
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((output.code, &rows[0]["position_smoothed_rmse_m"]), (Some(0), &Value::Null));
}

/// The drive with landmarks 50 m below, each seen at the pixel that `pixel` makes of the true one.
fn drive_above(name: &str, keyframes: std::ops::Range<u32>, pixel: fn(u32, (f64, f64)) -> (f64, f64)) -> PathBuf {
    let (mut seen, mut known) = (String::from("k,id,u,v,sigma_px\n"), String::from("id,x,y,z,gx,gy,gz,sigma\n"));
    let place = |id: u32| (f64::from(id % 5) * 6.0 - 6.0, f64::from(id / 5) * 6.0 - 9.0, -50.0);
    for id in 0..20 {
        let (x, y, z) = place(id);
        let _ = writeln!(known, "{id},{x},{y},{z},{x},{y},{z},1");
    }
    for k in keyframes {
        for id in 0..20 {
            let (x, y, z) = place(id);
            // From the camera, which is 10 cm ahead of the body and 5 cm below.
            let (ahead, down) = (x - 0.2 * f64::from(k) - 0.1, -0.05 - z);
            let (u, v) = pixel(id, (376.0 - 458.0 * y / down, 240.0 - 458.0 * ahead / down));
            let _ = writeln!(seen, "{k},{id},{u},{v},1");
        }
    }
    file(&format!("{name}_obs.csv"), seen.as_bytes());
    file(&format!("{name}_landmarks.csv"), known.as_bytes());
    drive(name)
}

#[test]
fn landmarks_count_from_the_first_keyframe_on() {
    let first = |id, (u, v)| if id < 3 { (-5.0, v) } else { (u, v) };
    let drive = drive_above("first_seen", 0..1, first);
    let prefix = drive.to_str().expect("is text");
    let output = bb(&["eval", "navigation", prefix, "--filter", "smoother-single", "--json"]);
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((&*output.err, &rows[0]["refused"]), ("", &3.into()));
    let drive = drive_above("never_off", 0..101, |_, pixel| pixel);
    let prefix = drive.to_str().expect("is text");
    let output = bb(&["eval", "navigation", prefix, "--filter", "smoother-single", "--json"]);
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((&*output.err, &rows[0]["refused"]), ("", &0.into()));
}

#[test]
fn landmarks_that_are_refused_are_reported() {
    let drive = drive_above("scrambled", 0..101, |id, (u, v)| if id < 11 { (-5.0, v) } else { (u, v) });
    let prefix = drive.to_str().expect("is text");
    let output = bb(&["eval", "navigation", prefix, "--filter", "smoother-single"]);
    let said = "1111 of 2020 observations of landmarks were refused (the first: a value is beyond the range of any \
        sensor): more than half, so its figures are not to be trusted";
    assert!(output.code == Some(1) && output.err.contains(said), "{}", output.err);
    let output = bb(&["eval", "navigation", prefix, "--filter", "smoother-single", "--set", "landmarks=false"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
}

/// Each by its file, its line and its column.
#[test]
fn numbers_that_nothing_can_have_are_named() {
    let zeros = |line: &str, of: std::ops::Range<usize>, with: &str| {
        let cells = line.split(',').enumerate();
        cells.map(|(i, cell)| if of.contains(&i) { with } else { cell }).collect::<Vec<_>>().join(",")
    };
    for (file, columns, with, said) in [
        ("init", 3..7, "0", "_init.csv, line 2: columns qw to qz are no rotation"),
        ("init", 3..7, "nan", "_init.csv, line 2: columns qw to qz are no rotation"),
        ("init", 17..18, "1e-160", "_init.csv, line 2: a column sigma is not between 1e-9 and 1e9"),
        ("gps", 5..6, "1e-160", "_gps.csv, line 2: a column sigma is not between 1e-9 and 1e9"),
        ("gps", 6..7, "nan", "_gps.csv, line 2: a column sigma is not between 1e-9 and 1e9"),
        ("gps", 2..3, "1e300", "_gps.csv, line 2: a position is NaN, or not near the Earth"),
        ("noise", 0..1, "1e-160", "`gyroscope_noise`"),
        ("imu", 7..8, "0", "_imu.csv, line 2: column dt must be positive"),
    ] {
        let prefix = drive("absurd");
        let file = PathBuf::from(format!("{}_{file}.csv", prefix.display()));
        let text = std::fs::read_to_string(&file).expect("is there");
        let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
        lines[1] = zeros(&lines[1], columns, with);
        std::fs::write(&file, lines.join("\n")).expect("there is room");
        let output = bb(&["eval", "navigation", prefix.to_str().expect("is text"), "--filter", "eskf-single"]);
        assert!(output.code == Some(1) && output.err.contains(said), "{said}: {}", output.err);
        assert!(!output.out.contains("NaN"), "{}", output.out);
    }
}

#[test]
fn mistakes_are_named() {
    let good = drive("good");
    let good = good.to_str().expect("is text");
    let broken = drive("broken");
    file("broken_imu.csv", b"t,gx,gy,gz,ax,ay,az,dt\n0,0,0,0,0,0,9.81,0.01\n0,0,zero,0,0,0,9.81,0.01\n");
    let broken = broken.to_str().expect("is text");
    let output = bb(&["eval", "navigation", "no_such", broken, good]);
    assert_eq!(output.code, Some(1));
    assert!(output.err.contains("no_such_imu.csv: there is no such file"), "{}", output.err);
    assert!(output.err.contains("broken_imu.csv, line 3: invalid float literal"), "{}", output.err);
    assert!(output.out.contains("good"), "{}", output.out);
    for (arguments, fault) in [
        (&["--filter", "eskff"][..], "no filter `eskff`; did you mean `eskf`?"),
        (&["--set", "gyro_noise=1"], "no parameter `gyro_noise`; did you mean `gyroscope_noise`?"),
        (&["--set", "gravity=down"], "`gravity` is `down`: write a number from 1 to 30 m/s^2"),
        (&["--set", "gravity=100"], "`gravity` is 100 m/s^2: choose a value from 1 to 30 m/s^2"),
        (&["--set", "gravity=1 g"], "`gravity` is `1 g`: its unit is m/s^2"),
    ] {
        let output = bb(&[&["eval", "navigation", good], arguments].concat());
        assert!(output.code == Some(2) && output.err.contains(fault), "{fault}: {}", output.err);
    }
}
