//! `bb eval navigation`, on a small data set made here.

use crate::common::{bb, file};
use serde_json::Value;
use std::fmt::Write;
use std::path::PathBuf;

/// Ten seconds of straight motion at 2 m/s to the east, 7 m above the origin, with a fix a second. Gives the prefix of its files.
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
        let _ = writeln!(truth, "{t},{},0,7,1,0,0,0,2,0,0,nan,nan,nan,nan,nan,nan", 2.0 * t);
        if k % 10 == 0 {
            let _ = writeln!(gps, "{k},{t},{},0,7,0.5,1", 2.0 * t);
        }
    }
    let init = "px,…\n0.2,0,7,1,0,0,0,2,0,0,0,0,0,0,0,0,0.01,0.5,0.1,0.001,0.01\n";
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
    let output = bb(&["eval", "navigation", prefix, "--filter", "eskf,planar", "--json"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert_eq!((rows.len(), &rows[0]["filter"], &rows[1]["filter"]), (2, &"eskf".into(), &"planar".into()));
    for row in &rows {
        let number = |name: &str| row[name]["rms"].as_f64().unwrap_or_else(|| panic!("{name} is no number: {row}"));
        assert!(number("position_m") < 0.3 && number("heading_deg") < 1.0, "{row}");
        assert!(number("horizontal_m") <= row["horizontal_m"]["max"].as_f64().expect("is known"), "{row}");
        assert!(row["nees"].as_f64().expect("is known") < 6.0, "{row}");
        assert!(row["us_per_imu_sample"].as_f64().expect("is known") > 0.0, "{row}");
        // It starts at the second fix, on a plane once it has moved for a second; a tenth is not scored.
        assert!((70..92).contains(&row["scored"].as_u64().expect("is counted")), "{row}");
        assert_eq!((&row["refused"], &row["file"]), (&0.into(), &prefix.into()));
        for state in row["states"].as_array().expect("a list") {
            assert!(state["position_m"]["rms"].as_f64().is_none_or(|rms| rms < 0.4), "{state}");
        }
    }
    // What a plane tells is not scored.
    assert_eq!(
        (&rows[1]["vertical_m"], &rows[1]["tilt_deg"], &rows[1]["nees_expected"]),
        (&Value::Null, &Value::Null, &3.into())
    );
    let output = bb(&["eval", "navigation", prefix]);
    assert!(output.out.contains("straight   eskf ") && output.out.contains("healthy for"), "{}", output.out);
}

/// Options of a robot's settings file, of an unknown one, and of one that changes nothing.
#[test]
fn a_robot_lends_its_settings() {
    let drive = drive("lent");
    let prefix = drive.to_str().expect("is text");
    let said = |text: &str, arguments: &[&str]| {
        let config = file("lent.toml", text.as_bytes());
        let config = config.to_str().expect("is text");
        bb(&[&["eval", "navigation", prefix, "--json", "--robot", config], arguments].concat())
    };
    let figures = |output: &crate::common::Output| {
        let rows: Vec<Value> = serde_json::from_str(&output.out).unwrap_or_else(|_| panic!("{}", output.err));
        rows[0]["position_m"].clone()
    };
    let text =
        "[sensor.base.imu]\nrate = 3\n[estimator.base.pose]\naccelerometer_noise = 0.5\ngnss_deviation = \"5 m\"\n";
    let lent = said(text, &[]);
    let set = bb(&["eval", "navigation", prefix, "--json", "--set", "accelerometer_noise=0.5"]);
    let plain = bb(&["eval", "navigation", prefix, "--json"]);
    // The other one is the default, and said nothing about.
    assert_eq!((lent.code, &*lent.err), (Some(0), ""));
    assert_eq!(figures(&lent), figures(&set));
    assert_ne!(figures(&lent), figures(&plain));
    let unknown = said("[estimator.base.pose]\naccelerometer_noise = 0.5\ngnss_deviatoin = \"5 m\"\n", &[]);
    assert!(
        unknown.code == Some(1)
            && unknown.err.contains(
                "estimator/base/pose/gnss_deviatoin: this filter has no such option; did you mean `gnss_deviation`?"
            ),
        "{}",
        unknown.err
    );
    let two = "[estimator.a]\naccelerometer_noise = 0.5\n[estimator.b]\naccelerometer_noise = 0.6\n";
    let two = said(two, &[]);
    assert!(two.code == Some(1) && two.err.contains("lent.toml:estimator/a or "), "{}", two.err);
    // There are no barometer and no wheels.
    for option in ["pressure_deviation=2 m", "wheel_scale=0.1"] {
        let output = bb(&["eval", "navigation", prefix, "--set", option]);
        let name = option.split('=').next().expect("has one");
        assert!(
            output.code == Some(1)
                && output.err.contains(&format!("--set {name}"))
                && output.err.contains("changes nothing"),
            "{}",
            output.err
        );
    }
    let state = bb(&["eval", "navigation", prefix, "--set", "gnss_delay=0.2 s"]);
    assert_eq!(state.code, Some(0), "{}", state.err);
}

/// Made harder by an option, where a recording had to be written again.
#[test]
fn outages_gaps_delays_and_noise_are_options() {
    let drive = drive("harder");
    let prefix = drive.to_str().expect("is text");
    let row = |arguments: &[&str]| {
        let output = bb(&[&["eval", "navigation", prefix, "--json"], arguments].concat());
        assert_eq!(output.code, Some(0), "{}", output.err);
        let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
        rows[0].clone()
    };
    let fused = |row: &Value| row["fates"][0]["fused"].as_u64().expect("is counted");
    let plain = row(&[]);
    let outage = row(&["--outage", "7s/10s"]);
    assert!(fused(&outage) + 6 <= fused(&plain), "{outage}");
    assert!(outage["ages"].as_array().expect("a list").len() == 2, "{outage}");
    assert!(fused(&row(&["--every", "2"])) <= fused(&plain) / 2 + 1);
    let gaps = row(&["--drop", "imu=300ms/2s"]);
    assert!(gaps["gaps"].as_u64() >= Some(4) && plain["gaps"] == 0, "{gaps}");
    for (arguments, least) in [(&["--delay", "gnss=500ms"][..], 0.5), (&["--noise-times", "100"], 0.0)] {
        let row = row(arguments);
        assert_ne!(row["position_m"], plain["position_m"]);
        assert!(row["position_m"]["rms"].as_f64() > Some(least), "{row}");
    }
    let output = bb(&["eval", "navigation", prefix, "--drop", "odometry=1s/2s"]);
    assert!(
        output.code == Some(1) && output.err.contains("--drop changes nothing: no message of `odometry`"),
        "{}",
        output.err
    );
    for (arguments, fault) in [
        (["--every", "0"], "write a whole number, at least 2"),
        (["--noise-times", "1"], "write a factor from 1e-6 to 1e6 other than 1"),
    ] {
        let output = bb(&[&["eval", "navigation", prefix], &arguments[..]].concat());
        assert!(output.code == Some(2) && output.err.contains(fault), "{}", output.err);
    }
    let output = bb(&["eval", "navigation", prefix, "--delay", "gps=1s"]);
    assert!(output.code == Some(2) && output.err.contains("did you mean `gnss`?"), "{}", output.err);
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
        ("noise", 0..1, "1e-160", "gyroscope_noise: must be in 1e-9..=10.0"),
        ("imu", 7..8, "0", "_imu.csv, line 2: column dt must be positive"),
    ] {
        let prefix = drive("absurd");
        let file = PathBuf::from(format!("{}_{file}.csv", prefix.display()));
        let text = std::fs::read_to_string(&file).expect("is there");
        let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
        lines[1] = zeros(&lines[1], columns, with);
        std::fs::write(&file, lines.join("\n")).expect("there is room");
        let output = bb(&["eval", "navigation", prefix.to_str().expect("is text")]);
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
    let output = bb(&["eval", "navigation", good, "--filter", "eskff"]);
    assert!(
        output.code == Some(2) && output.err.contains("no filter `eskff`; did you mean `eskf`?"),
        "{}",
        output.err
    );
    for (setting, fault) in [
        ("gyro_noise=1", "--set gyro_noise: there is no such option; did you mean `gyroscope_noise`?"),
        ("gravity=down", "--set gravity: "),
        ("gravity=100 m/s^2", "--set gravity: "),
    ] {
        let output = bb(&["eval", "navigation", good, "--set", setting]);
        assert!(output.code == Some(1) && output.err.contains(fault), "{fault}: {}", output.err);
    }
}
