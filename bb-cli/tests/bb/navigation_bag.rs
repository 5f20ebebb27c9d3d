//! `bb eval navigation` on bags made here, beside the same drive as CSV files.

mod drive;

use crate::common::bb;
use drive::{Bagged, Drive};
use serde_json::Value;
use std::path::Path;

fn text(path: &Path) -> &str {
    path.to_str().expect("is text")
}

/// The objects of `--json`.
fn rows(arguments: &[&str]) -> Vec<Value> {
    let output = bb(&[&["eval", "navigation", "--json"], arguments].concat());
    assert_eq!(output.code, Some(0), "{}", output.err);
    serde_json::from_str(&output.out).expect("an array")
}

fn number(row: &Value, name: &str) -> f64 {
    let value = row[name].get("rms").unwrap_or(&row[name]);
    value.as_f64().unwrap_or_else(|| panic!("{name} is no number: {row}"))
}

const FIGURES: [&str; 4] = ["position_m", "orientation_deg", "velocity_mps", "nees"];

/// Compares figures, within a relative bound.
fn agree(ours: &Value, theirs: &Value, bound: f64) {
    assert_eq!(ours["filter"], theirs["filter"]);
    for name in FIGURES {
        let (ours, theirs) = (number(ours, name), number(theirs, name));
        assert!((ours / theirs - 1.0).abs() < bound, "{name}: {ours} of the bag, {theirs} of the files");
    }
}

/// Files and bag with the same drive give the same figures of one robot; the files hold more of the start.
#[test]
fn a_bag_gives_the_figures_of_the_files() {
    let drive = Drive::new(1, 300);
    let prefix = drive.files("same_poses", &["vio", "anchor"]);
    let bag = drive.bag("same_poses.mcap", &Bagged { relative: true, poses: true, ..Bagged::default() });
    let topics = ["--relative-topic", "/vio", "--truth", "/truth", "--start", "truth"];
    let (files, bag) = (rows(&[text(&prefix)]), rows(&[&[text(&bag)], &topics[..]].concat()));
    agree(&bag[0], &files[0], 0.1);
    assert!(number(&bag[0], "position_m") < 0.9, "{}", bag[0]);
    let prefix = drive.files("same_fixes", &["gps"]);
    let bag = drive.bag("same_fixes.mcap", &Bagged { fixes: true, ..Bagged::default() });
    let origin = ["--origin", drive::ORIGIN, "--truth", "/truth", "--start", "truth"];
    let (files, bag) = (rows(&[text(&prefix)]), rows(&[&[text(&bag)], &origin[..]].concat()));
    agree(&bag[0], &files[0], 0.2);
}

/// Late is late, as in a robot: within its history nothing is lost.
#[test]
fn what_arrives_late_is_fused_at_its_time() {
    let drive = Drive::new(3, 200);
    let bagged = Bagged { fixes: true, wheels: true, ..Bagged::default() };
    let order = drive.bag("in_order.mcap", &bagged);
    let late = drive.bag("late.mcap", &Bagged { late_ns: 350_000_000, ..bagged });
    let options =
        ["--origin", drive::ORIGIN, "--truth", "/truth", "--odometry-topic", "/wheels", "--start", "truth"];
    let (order, late) =
        (rows(&[&[text(&order)], &options[..]].concat()), rows(&[&[text(&late)], &options[..]].concat()));
    assert!(order[0]["fates"][0]["fused"].as_u64() >= late[0]["fates"][0]["fused"].as_u64());
    assert_eq!((&order[0]["refused"], &late[0]["refused"]), (&0.into(), &0.into()));
    assert!(number(&late[0], "position_m") < 1.5 * number(&order[0], "position_m"), "{}", late[0]);
}

/// The sensors somewhere else on the vehicle, which the transforms tell, or options.
#[test]
fn sensors_are_where_the_transforms_or_the_options_say() {
    let drive = Drive::new(4, 300);
    let there = Bagged { fixes: true, wheels: true, mounted: true, transforms: true, ..Bagged::default() };
    let told = drive.bag("told.mcap", &there);
    let options = [
        "--origin",
        drive::ORIGIN,
        "--truth",
        "/truth",
        "--odometry-topic",
        "/wheels",
        "--start",
        "truth",
        "--set",
        "wheel_mounting=1 deg",
        "--set",
        "gnss_delay=1 ms",
    ];
    let told = rows(&[&[text(&told)], &options[..]].concat());
    assert!(number(&told[0], "position_m") < 0.5 && number(&told[0], "orientation_deg") < 1.5, "{}", told[0]);
    assert_eq!(told[0]["refused"], 0);

    let untold = drive.bag("untold.mcap", &Bagged { transforms: false, ..there });
    let mounts = ["--mount", drive::GPS_IN_IMU, "--mount", drive::BASE_IN_IMU];
    let mounted = rows(&[&[text(&untold)], &options[..], &mounts].concat());
    // Of the IMU, and of the base.
    for name in ["position_m", "orientation_deg"] {
        let (told, mounted) = (number(&told[0], name), number(&mounted[0], name));
        assert!((told / mounted - 1.0).abs() < 0.1, "{name}: {told}, {mounted}");
    }

    // Without either they are taken to be where the IMU is, which is said and is wrong.
    let output = bb(&[&["eval", "navigation", "--json", text(&untold)], &options[..]].concat());
    let wrong: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert!(number(&wrong[0], "position_m") > 2.0 * number(&told[0], "position_m"), "{}", wrong[0]);
    assert!(output.err.contains("nothing says where gps of /fix, base of /wheels are"), "{}", output.err);
    // Where the IMU has a mount, that is on the base.
    let output = bb(&[&["eval", "navigation", text(&untold)], &options[..], &["--mount", "imu=0,0,0"]].concat());
    assert!(output.err.contains("nothing says where gps of /fix is"), "{}", output.err);
}

#[test]
fn a_start_is_at_rest_or_at_a_pose_or_at_the_truth() {
    let drive = Drive::new(5, 300);
    let bag = drive
        .bag("starts.mcap", &Bagged { fixes: true, wheels: true, rest: true, start: true, ..Bagged::default() });
    let exact = ["--set", "wheel_mounting=1 deg", "--set", "gnss_delay=1 ms"];
    let options = [&["--origin", drive::ORIGIN, "--odometry-topic", "/wheels"], &exact[..]].concat();
    for start in ["truth", "own", "/start", "/initialpose"] {
        let row = rows(&[&[text(&bag), "--truth", "/truth", "--start", start], &options[..]].concat());
        assert!(number(&row[0], "position_m") < 0.6, "{start}: {}", row[0]);
        assert!(number(&row[0], "orientation_deg") < 5.0, "{start}: {}", row[0]);
    }
    // A pose for the start that is there is taken.
    let output = bb(&[&["eval", "navigation", text(&bag), "--truth", "/truth"], &options[..]].concat());
    assert!(output.code == Some(0) && !output.err.contains("never started"), "{}", output.err);
    // The heading is that of the option: the other way round it is far off at first.
    let turned =
        ["--start", "own", "--set", "heading=180 deg", "--set", "heading_deviation=0.1 rad", "--truth", "/truth"];
    let output = bb(&[&["eval", "navigation", "--json", text(&bag)], &turned[..], &options].concat());
    let row: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert!(number(&row[0], "orientation_deg") > 5.0, "{}", row[0]);
    let silent = drive.bag("silent.mcap", &Bagged { relative: true, ..Bagged::default() });
    let options = ["--relative-topic", "/vio", "--truth", "/truth", "--start", "own"];
    let output = bb(&[&["eval", "navigation", text(&silent)], &options[..]].concat());
    assert!(output.code == Some(1) && output.err.contains("it never started"), "{}", output.err);
}

/// An unknown heading is found or said to be unknown: on a steady circle without wheels, a tilt and a centripetal acceleration look alike.
#[test]
fn an_unknown_heading_is_found_or_said_to_be_unknown() {
    for seed in [5, 6, 18] {
        let name = format!("course_{seed}.mcap");
        let moving = Drive::new(seed, 900).bag(&name, &Bagged { fixes: true, ..Bagged::default() });
        let options = ["--truth", "/truth", "--start", "own", "--origin", drive::ORIGIN];
        let row = &rows(&[&[text(&moving)], &options[..]].concat())[0];
        let states = row["states"].as_array().expect("a list");
        assert!(states.iter().any(|of| of["state"] == "degraded"), "{row}");
        for healthy in states.iter().filter(|of| of["state"] == "healthy") {
            assert!(number(healthy, "heading_deg") < 20.0, "{row}");
        }
        // An alignment goes by the track, which the unknown heading leaves alone.
        let aligned = &rows(&[&[text(&moving)], &options[..], &["--align", "full"]].concat())[0];
        assert!(number(aligned, "position_m") < number(row, "position_m"), "{aligned}");
    }
}

/// Positions alone for the truth, of an antenna on a mast.
#[test]
fn fixes_can_be_the_truth() {
    let drive = Drive::new(6, 300);
    let bagged =
        Bagged { fixes: true, wheels: true, mounted: true, transforms: true, precise: true, ..Bagged::default() };
    let bag = drive.bag("precise.mcap", &bagged);
    let options =
        ["--gnss-topic", "/fix", "--truth", "/precise", "--odometry-topic", "/wheels", "--start", "/truth"];
    let row = &rows(&[&[text(&bag), "--origin", drive::ORIGIN], &options[..]].concat())[0];
    assert!(number(row, "position_m") < 0.7 && (0.5..6.0).contains(&number(row, "nees")), "{row}");
    assert_eq!((&row["orientation_deg"], &row["velocity_mps"]), (&Value::Null, &Value::Null));
}

/// Causes that explain the error; a good recording has none.
#[test]
fn a_turned_world_and_another_convention_are_named() {
    let drive = Drive::new(5, 600);
    let fixes = Bagged { fixes: true, wheels: true, rest: true, ..Bagged::default() };
    let options = ["--origin", drive::ORIGIN, "--truth", "/truth", "--odometry-topic", "/wheels"];
    let said = |bagged: &Bagged, name: &str, more: &[&str]| {
        let bag = drive.bag(name, bagged);
        let output = bb(&[&["eval", "navigation", text(&bag)], &options[..], more].concat());
        let notes = output.err.lines().filter(|line| line.contains("truth"));
        notes.map(|line| line.split(".mcap: ").nth(1).expect("names it").to_owned()).collect::<Vec<_>>()
    };
    for more in [&[][..], &["--filter", "planar"], &["--start", "truth"]] {
        assert_eq!(said(&fixes, "unturned.mcap", more), [""; 0]);
    }
    for turned_deg in [4.0, -4.0] {
        let notes = said(&Bagged { turned_deg, ..fixes }, "turned.mcap", &[]);
        let angle = notes[0].strip_prefix("the truth's world is turned about the vertical by ");
        let angle = angle.and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok()).expect("says it first");
        assert!(notes.len() == 1 && (angle + turned_deg).abs() < 0.5, "{notes:?}");
        assert!(notes[0].ends_with("--align heading, or --declination for a compass"), "{notes:?}");
    }
    let notes = said(&Bagged { ned: true, ..fixes }, "ned.mcap", &[]);
    let lead =
        "/truth: the truth looks to be in north, east, down, of a body whose axes are forward, right, down: ";
    assert!(notes.len() == 1 && notes[0].starts_with(lead), "{notes:?}");
}

#[test]
fn a_plot_has_the_track_the_errors_and_the_innovations() {
    let drive = Drive::new(7, 200);
    let bag = drive.bag("drawn.mcap", &Bagged { relative: true, fixes: true, ..Bagged::default() });
    let options = ["--relative-topic", "/vio", "--truth", "/truth", "--origin", drive::ORIGIN, "--start", "truth"];
    let plot = Path::new(env!("CARGO_TARGET_TMPDIR")).join("drawn.svg");
    let output = bb(&[&["eval", "navigation", text(&bag), "--plot", text(&plot)], &options[..]].concat());
    assert_eq!(output.code, Some(0), "{}", output.err);
    let svg = std::fs::read_to_string(&plot).expect("is there");
    let said = [
        "east (m)",
        "north (m)",
        "estimate",
        "truth",
        "fixes",
        "+3σ",
        "heading (deg)",
        "innovations of fixes",
        "error by the age of the last position",
    ];
    for what in said {
        assert!(svg.contains(what), "{what}");
    }
    // It fits a screen, and the truth is under the estimate.
    let height = svg.split("height=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("has one");
    assert!(height.parse::<u32>().expect("a number") < 1600, "{height}");
    let [truth, estimate] = ["stroke-width=\"7\"", "#0072B2"].map(|line| svg.find(line).expect("is drawn"));
    assert!(truth < estimate);
    // What is not estimated is not drawn, nor states before the first estimate.
    let planar = &["--filter", "planar", "--relative-topic", "none", "--start", "own"];
    let output = bb(&[&["eval", "navigation", text(&bag), "--plot", text(&plot)], &options[2..6], planar].concat());
    let svg = std::fs::read_to_string(&plot).expect("is there");
    for not in ["up (m)", "about east", "starting", "keyframes"] {
        assert!(svg.contains("heading (deg)") && !svg.contains(not), "{not}: {}", output.err);
    }
    let output = bb(&["eval", "navigation", text(&bag), "--plot", "drawn.jpg"]);
    assert!(output.code == Some(2) && output.err.contains("an SVG or a PNG"), "{}", output.err);
}

#[test]
fn without_truth_there_are_no_errors_but_figures_of_cost() {
    let drive = Drive::new(8, 100);
    let bag = drive.bag("untrue.mcap", &Bagged { fixes: true, start: true, ..Bagged::default() });
    let output = bb(&[
        "eval",
        "navigation",
        "--json",
        text(&bag),
        "--truth",
        "none",
        "--start",
        "/start",
        "--odometry-topic",
        "none",
    ]);
    let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert!(output.code == Some(0) && output.err.contains("no truth, so no errors"), "{}", output.err);
    assert_eq!(
        (&rows[0]["position_m"], &rows[0]["nees"], &rows[0]["scored"]),
        (&Value::Null, &Value::Null, &0.into())
    );
    assert!(number(&rows[0], "us_per_imu_sample") > 0.0);
    let output =
        bb(&["eval", "navigation", text(&bag), "--truth", "none", "--start", "/start", "--odometry-topic", "none"]);
    assert!(output.out.contains(" - "), "{}", output.out);
}

#[test]
fn what_is_wrong_with_a_bag_is_said() {
    let drive = Drive::new(9, 100);
    let fixes = Bagged { fixes: true, ..Bagged::default() };
    let fault = |bagged: &Bagged, name: &str, arguments: &[&str], code: i32, said: &str| {
        let bag = drive.bag(name, bagged);
        let output = bb(&[&["eval", "navigation", text(&bag)], arguments].concat());
        assert!(output.code == Some(code) && output.err.contains(said), "{said}: {}", output.err);
    };
    let truth = ["--truth", "/truth", "--origin", drive::ORIGIN, "--start", "truth"];
    let none = Bagged { no_imu: true, ..fixes };
    fault(
        &none,
        "no_imu.mcap",
        &truth,
        1,
        "no topic of type sensor_msgs/msg/Imu; the bag has /truth (nav_msgs/msg/Odometry)",
    );
    let two = Bagged { two_imus: true, ..fixes };
    fault(&two, "two_imus.mcap", &truth, 1, "(--imu-topic)");
    fault(&two, "two_imus.mcap", &[&["--imu-topic", "/imu"], &truth[..]].concat(), 0, "");
    fault(
        &two,
        "two_imus.mcap",
        &["--imu-topic", "/imi"],
        1,
        "no topic /imi (--imu-topic); did you mean `/imu`? of a fitting type there are /imu (sensor_msgs/msg/Imu), ",
    );
    fault(&fixes, "typed.mcap", &["--imu-topic", "/fix"], 1, "sensor_msgs/msg/NavSatFix");
    fault(&fixes, "truths.mcap", &["--truth", "/imu"], 1, "(--truth)");
    let near = "no topic /thruth (--truth); did you mean `/truth`? of a fitting type there are ";
    fault(&fixes, "truths.mcap", &["--truth", "/thruth"], 1, near);
    let two = Bagged { wheels: true, relative: true, ..fixes };
    fault(&two, "two_odometries.mcap", &truth, 1, "leave them out with --odometry-topic none");
    let grown = Bagged { relative: true, flat: true, ..Bagged::default() };
    let relative = [&["--relative-topic", "/vio"], &truth[..]].concat();
    fault(&grown, "flat.mcap", &relative, 1, "the covariance of /vio does not grow");
    fault(&grown, "flat.mcap", &[&["--relative-deviation", "0.02,0.001"], &relative[..]].concat(), 0, "");
    // NaN in some samples and in all, stamps that run back, truth without a message or without a number.
    fault(&Bagged { nan: (20, 30), ..fixes }, "nan.mcap", &truth, 0, "");
    fault(&Bagged { nan: (0, 10_000), ..fixes }, "all_nan.mcap", &truth, 1, "/imu holds no number");
    fault(
        &Bagged { back: true, ..fixes },
        "back.mcap",
        &truth,
        0,
        "3 of 1001 messages of /imu are not stamped after",
    );
    fault(
        &Bagged { no_truth: true, ..fixes },
        "empty.mcap",
        &truth,
        1,
        "the truth tells no orientation to start with",
    );
    let known = Bagged { no_truth: true, start: true, ..fixes };
    let from = ["--truth", "/truth", "--origin", drive::ORIGIN, "--start", "/start"];
    fault(&known, "empty_start.mcap", &from, 0, "no errors: /truth holds no position that is a number");
    let fixed = ["--truth", "/fix", "--start", "/start", "--odometry-topic", "none"];
    fault(&known, "empty_start.mcap", &fixed, 0, "no errors: /fix is fixes, and without a fix the filter's world");
    let apart = Bagged { mounted: true, transforms: true, apart: true, ..fixes };
    fault(
        &apart,
        "apart.mcap",
        &truth,
        1,
        "frame gps of /fix is not connected to base of the robot in /tf_static, which has base-imu",
    );
    // In the words of `bb info`.
    let sure = Bagged { sure: true, ..fixes };
    let bag = Drive::new(9, 300).bag("sure.mcap", &sure);
    let info: Vec<Value> = serde_json::from_str(&bb(&["info", "--json", text(&bag)]).out).expect("an array");
    let topics = info[0]["topics"].as_array().expect("a list");
    let of_fixes = topics.iter().find(|topic| topic["name"] == "/fix").expect("is there");
    let remark = &of_fixes["remarks"][0];
    assert_eq!(remark["subject"], "covariance", "{of_fixes}");
    let output = bb(&[&["eval", "navigation", text(&bag)], &truth[..]].concat());
    let said = format!(
        "note: {}: /fix: {}; the filter takes their scatter for their noise",
        bag.display(),
        remark["text"].as_str().expect("is text")
    );
    assert!(output.err.contains(&said), "{said}: {}", output.err);
    let swapped = ["--truth", "/truth", "--origin", "11.5,48.1,520"];
    fault(&fixes, "typed.mcap", &swapped, 1, "--origin is 5142 km from the nearest fix");
    // In those of `bb info` too.
    let force = "/imu: the specific force has a median of 1.005: it looks to be in g; ROS has m/s²";
    fault(&Bagged { rest: true, in_g: true, ..fixes }, "in_g.mcap", &["--truth", "none"], 1, force);
    let misspelt = [&["--mount", "gpps=0,0,1"], &truth[..]].concat();
    let used = "--mount gpps names no topic of the recording and no frame of one: ";
    fault(&fixes, "misspelt.mcap", &misspelt, 1, used);
    for (arguments, said) in [
        (&["--mount", "gps"][..], "no `=` in it"),
        (&["--origin", "north"], "`north` is no number"),
        (&["--relative-deviation", "0.1"], "two positive numbers"),
    ] {
        fault(&fixes, "typed.mcap", arguments, 2, said);
    }
}

/// Figures are printed all the same, beside why not to trust them.
#[test]
fn figures_of_less_than_half_of_a_bag_are_an_error() {
    let drive = Drive::new(11, 100);
    let fixes = Bagged { fixes: true, ..Bagged::default() };
    let distrusted = |bagged: &Bagged, name: &str, said: &[&str]| {
        let bag = drive.bag(name, bagged);
        let output = bb(&[
            "eval",
            "navigation",
            "--json",
            text(&bag),
            "--truth",
            "/truth",
            "--start",
            "truth",
            "--origin",
            drive::ORIGIN,
        ]);
        assert_eq!(output.code, Some(1), "{}", output.err);
        for said in [said, &["more than half, so its figures are not to be trusted"]].concat() {
            assert!(output.err.contains(said), "{said}: {}", output.err);
        }
        let rows: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
        assert_eq!(rows.len(), 1);
        rows[0].clone()
    };
    let stuck = Bagged { stuck: true, ..fixes };
    distrusted(&stuck, "stuck.mcap", &["700 of 1001 messages of /imu are not stamped after the one before"]);
    let early = Bagged { early_ns: 18_000_000_000, ..fixes };
    let said = "measurements of `gnss` were not used, being stamped 18.0 s before the samples of the IMU";
    let row = distrusted(&early, "early.mcap", &[said]);
    assert_eq!((&row["fates"][0]["fused"], &row["ages"]), (&0.into(), &Value::Array(Vec::new())));
    assert!(row["fates"][0]["unused"].as_u64() > Some(0), "{row}");
}

/// Wrong fixes at the beginning set neither the origin of the world nor the start of the filter.
#[test]
fn a_bag_begins_where_fixes_agree() {
    let drive = Drive::new(13, 300);
    let fixes = Bagged { fixes: true, wheels: true, rest: true, ..Bagged::default() };
    let options = ["--truth", "none", "--start", "own", "--odometry-topic", "/wheels"];
    let figures = |bagged: &Bagged, name: &str| {
        let bag = drive.bag(name, bagged);
        let precise = ["--gnss-topic", "/fix", "--truth", "/precise"];
        rows(&[&[text(&bag)], &precise[..], &options[2..]].concat()).remove(0)
    };
    let precise = Bagged { precise: true, ..fixes };
    let right = figures(&precise, "right_first.mcap");
    let wrong = figures(&Bagged { wrong_fixes: 1, ..precise }, "wrong_first.mcap");
    for row in [right, wrong] {
        assert!(number(&row, "position_m") < 1.0 && row["refused"] == 0, "{row}");
    }
}

#[test]
fn a_bag_that_breaks_off_is_scored_up_to_there() {
    let drive = Drive::new(10, 300);
    let bag = drive.bag("whole.mcap", &Bagged { fixes: true, ..Bagged::default() });
    let bytes = std::fs::read(&bag).expect("is there");
    let broken = crate::common::file("broken_drive.mcap", &bytes[..bytes.len() / 2]);
    let output = bb(&[
        "eval",
        "navigation",
        "--json",
        text(&broken),
        "--truth",
        "/truth",
        "--origin",
        drive::ORIGIN,
        "--start",
        "truth",
    ]);
    assert!(output.code == Some(1) && output.err.contains("truncated after"), "{}", output.err);
    let part: Vec<Value> = serde_json::from_str(&output.out).expect("an array");
    assert!((60..220).contains(&part[0]["scored"].as_u64().expect("a count")), "{}", part[0]);
    // Of a folder, one after the other.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("drives");
    std::fs::create_dir_all(&folder).expect("there is room");
    for name in ["a.mcap", "b.mcap"] {
        std::fs::copy(&bag, folder.join(name)).expect("there is room");
    }
    let rows = rows(&[text(&folder), "--truth", "/truth", "--origin", drive::ORIGIN, "--start", "truth"]);
    assert_eq!(rows.len(), 2);
    assert!(rows[1]["file"].as_str().expect("a name").ends_with("b.mcap"));
}
