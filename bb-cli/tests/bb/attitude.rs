//! `bb eval attitude` on whole recordings.

use crate::common::{Walk, bb, eval};
use serde_json::Value;

fn rows(out: &str) -> Vec<Value> {
    serde_json::from_str::<Vec<Value>>(out).expect("an array")
}

#[test]
fn json_has_these_fields() {
    let file = Walk { error: 0.1, ..Walk::default() }.file("json.mcap");
    let output = eval(&[&file], &["--json", "--filter", "madgwick"]);
    assert_eq!((output.code, &*output.err), (Some(0), ""));
    let rows = rows(&output.out);
    assert_eq!(rows.len(), 1);
    let row = rows[0].as_object().expect("an object");
    let mut fields: Vec<_> = row.keys().map(String::as_str).collect();
    fields.sort_unstable();
    let known = [
        "axes",
        "file",
        "filter",
        "heading_deg",
        "heading_drift_deg_per_min",
        "heading_trusted",
        "heading_while_trusted_deg",
        "heading_within_two_sigma",
        "inclination_deg",
        "inclination_within_two_sigma",
        "max_deg",
        "nees",
        "ns_per_update",
        "p95_deg",
        "samples",
        "total_deg",
        "variant",
    ];
    assert_eq!(fields, known);
    assert_eq!(row["file"], file.to_str().expect("is text"));
    assert_eq!((&row["filter"], &row["axes"]), (&"madgwick".into(), &"nine".into()));
    // Every sample in motion has truth; the truth was turned by 0.1 rad.
    assert_eq!(row["samples"], 199);
    let heading = row["heading_deg"].as_f64().expect("a number");
    assert!((heading - 0.1_f64.to_degrees()).abs() < 0.05, "{heading}");
    assert!((row["total_deg"].as_f64().expect("a number") - heading).abs() < 0.01);
    assert!(row["inclination_deg"].as_f64().expect("a number") < 0.01);
    assert!(row["ns_per_update"].as_f64().expect("a number") > 0.0);
}

#[test]
fn with_six_axes_only_the_inclination_counts() {
    let file = Walk { magnetometer: false, ..Walk::default() }.file("six.mcap");
    let output = eval(&[&file], &["--json", "--axes", "six"]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    for row in rows(&output.out) {
        assert_eq!(
            (&row["axes"], &row["total_deg"], &row["heading_deg"]),
            (&"six".into(), &Value::Null, &Value::Null)
        );
        assert!(row["inclination_deg"].as_f64().expect("a number") < 0.01);
    }
    // Both spellings are one.
    let table = eval(&[&file], &["--axes", "6"]).out;
    assert!(table.starts_with("Error against the truth, six axes, RMS in degrees:\n"), "{table}");
}

#[test]
fn a_table_has_a_line_a_run_and_the_averages() {
    let files = [0.1, 0.3].map(|error| Walk { error, ..Walk::default() }.file(&format!("table_{error}.mcap")));
    let output = eval(&[&files[1], &files[0]], &["--filter", "complementary,madgwick"]);
    assert_eq!(output.code, Some(0));
    let cells: Vec<Vec<&str>> = output.out.lines().map(|line| line.split_whitespace().collect()).collect();
    let of = |start: &[&str]| cells.iter().filter(|line| line.starts_with(start)).cloned().collect::<Vec<_>>();
    // In the order of the arguments, filters in the order of the table of filters.
    let names: Vec<_> = of(&["table_0.1"]).into_iter().chain(of(&["table_0.3"])).map(|line| line[1]).collect();
    assert_eq!(names, ["madgwick", "complementary", "madgwick", "complementary"]);
    let at = |name| cells.iter().position(|line| line.first() == Some(&name));
    assert!(at("table_0.3") < at("table_0.1"));
    // 0.1 and 0.3 rad are 5.73 and 17.19 degrees.
    assert_eq!(of(&["mean", "of", "2", "madgwick"])[0][4], "11.46");
    assert_eq!(of(&["worst", "of", "2", "madgwick"])[0][4], "17.19");
}

#[test]
fn a_folder_is_its_recordings_by_name() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("folder");
    std::fs::create_dir_all(folder.join("c_recording")).expect("makes");
    let bytes = Walk::default().bytes();
    for name in ["b.mcap", "a.mcap", "c_recording/c_0.mcap", "notes.txt"] {
        std::fs::write(folder.join(name), &bytes).expect("writes");
    }
    let output = eval(&[&folder], &["--json", "--filter", "mekf"]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    let names: Vec<_> =
        rows(&output.out).iter().map(|row| row["file"].as_str().expect("text").to_owned()).collect();
    let known = ["a.mcap", "b.mcap", "c_recording/c_0.mcap"].map(|name| folder.join(name).display().to_string());
    assert_eq!(names, known);

    let empty = folder.join("empty");
    std::fs::create_dir_all(&empty).expect("makes");
    let output = eval(&[&empty], &[]);
    assert_eq!(output.code, Some(1));
    assert!(output.err.contains("holds no file that ends in .mcap"), "{}", output.err);
}

#[test]
fn lost_truth_is_not_scored() {
    let lost = Walk { lost: 150..200, ..Walk::default() }.file("lost.mcap");
    let output = eval(&[&lost], &["--json", "--filter", "madgwick"]);
    assert_eq!((output.code, &rows(&output.out)[0]["samples"]), (Some(0), &149.into()));
    let all = Walk { lost: 0..300, ..Walk::default() }.file("all_lost.mcap");
    let output = eval(&[&all], &["--json", "--filter", "madgwick"]);
    assert_eq!((output.code, &rows(&output.out)[0]["total_deg"]), (Some(0), &Value::Null));
    assert!(output.err.contains("no truth, so no errors: /truth holds no orientation"), "{}", output.err);
}

#[test]
fn without_truth_it_says_so() {
    let file = Walk { truth: false, ..Walk::default() }.file("no_truth.mcap");
    let output = eval(&[&file], &["--filter", "madgwick"]);
    assert_eq!(output.code, Some(0));
    assert!(
        output.err.contains("no_truth.mcap: no truth, so no errors: no topic of type geometry_msgs"),
        "{}",
        output.err
    );
    assert!(output.out.contains("no_truth"));
    let output = eval(&[&file], &["--json", "--filter", "madgwick"]);
    let row = &rows(&output.out)[0];
    assert_eq!((&row["inclination_deg"], &row["samples"]), (&Value::Null, &0.into()));
}

#[test]
fn without_a_topic_that_says_so_all_is_motion() {
    let file = Walk { moving: false, ..Walk::default() }.file("no_moving.mcap");
    let samples = |arguments: &[&str]| {
        let output = eval(&[&file], &[&["--json", "--filter", "madgwick"], arguments].concat());
        assert_eq!(output.code, Some(0), "{}", output.err);
        rows(&output.out)[0]["samples"].clone()
    };
    assert_eq!(samples(&[]), 300);
    let output = eval(&[&file], &["--start-before-motion", "1"]);
    assert_eq!(output.code, Some(1));
    assert!(output.err.contains("no topic says when it moves (std_msgs/msg/Bool); name one with --moving-topic"));
    // Nothing but motion, where it is asked for.
    let file = Walk::default().file("moving_none.mcap");
    let output = eval(&[&file], &["--json", "--filter", "madgwick", "--moving-topic", "none"]);
    assert_eq!(rows(&output.out)[0]["samples"], 300);
}

#[test]
fn topics_are_named_where_several_fit() {
    let file = Walk { twice: true, ..Walk::default() }.file("twice.mcap");
    let options =
        [("--imu-topic", "/imu"), ("--mag-topic", "/mag"), ("--truth", "/truth"), ("--moving-topic", "/moving")];
    for left_out in 0..options.len() {
        let others = options.iter().enumerate().filter(|(index, _)| *index != left_out);
        let arguments: Vec<_> = others.flat_map(|(_, (option, topic))| [*option, *topic]).collect();
        let output = eval(&[&file], &arguments);
        let (option, topic) = options[left_out];
        assert_eq!(output.code, Some(1));
        let fault = format!(": {topic}, {topic}_too; name one of them ({option})");
        assert!(output.err.contains(&fault), "{}", output.err);
    }
    let arguments: Vec<_> = options.iter().flat_map(|(option, topic)| [*option, *topic]).collect();
    let output = eval(&[&file], &[&arguments[..], &["--json"]].concat());
    assert_eq!(output.code, Some(0), "{}", output.err);
    assert_eq!(rows(&output.out)[0]["samples"], 199);

    let output = eval(&[&file], &["--imu-topic", "/mag"]);
    assert!(output.err.contains(
        "twice.mcap: the messages of /mag are sensor_msgs/msg/MagneticField, and sensor_msgs/msg/Imu is needed"
    ));
    let output = eval(&[&file], &["--imu-topic", "/gone"]);
    assert!(output.err.contains("no topic /gone; the bag has /imu (sensor_msgs/msg/Imu)"), "{}", output.err);
}

#[test]
fn a_start_before_the_motion_leaves_out_the_rest() {
    let file = Walk { error: 0.2, ..Walk::default() }.file("start.mcap");
    for seconds in ["0.5", "1000"] {
        let output = eval(&[&file], &["--json", "--filter", "mekf", "--start-before-motion", seconds]);
        assert_eq!(output.code, Some(0), "{}", output.err);
        assert_eq!(rows(&output.out)[0]["samples"], 199);
    }
    let output = eval(&[&file], &["--start-before-motion", "-1"]);
    assert_eq!(output.code, Some(2), "{}", output.err);
}

#[test]
fn variants_are_seeded_and_distinguished() {
    let file = Walk::default().file("variants.mcap");
    let variants = |more: &[&str]| {
        let options = ["--json", "--filter", "mekf", "--start", "random:3", "--offset", "30uT:2"];
        let output = eval(&[&file], &[&options, more].concat());
        assert_eq!((output.code, &*output.err), (Some(0), ""));
        let row = |row: Value| (row["variant"].clone(), row["total_deg"].clone(), row["samples"].clone());
        rows(&output.out).into_iter().map(row).collect::<Vec<_>>()
    };
    let one = variants(&[]);
    assert_eq!(
        one.iter().map(|(variant, ..)| variant.as_u64()).collect::<Vec<_>>(),
        (0..6).map(Some).collect::<Vec<_>>()
    );
    assert_eq!(one, variants(&["--seed", "1"]));
    assert_ne!(one, variants(&["--seed", "2"]));
    assert!(one.iter().all(|(_, total, samples)| total.is_number() && samples.as_u64() > Some(0)));
    for field in ["--magnet", "--disturb", "--drift"] {
        let output = eval(&[&file], &["--filter", "mekf", field, "20uT"]);
        assert_eq!((output.code, &*output.err), (Some(0), ""), "{field}");
    }
    let output = eval(&[&file], &["--axes", "six", "--offset", "30uT"]);
    assert_eq!(output.code, Some(2));
    assert!(output.err.contains("leave them out"), "{}", output.err);
    let output = eval(&[&file], &["--magnet", "30"]);
    assert!(output.code == Some(2) && output.err.contains("write a number with nT, uT, mT or T"), "{}", output.err);
}

#[test]
fn settings_change_the_filter() {
    let file = Walk { bias: 0.1, ..Walk::default() }.file("settings.mcap");
    let heading = |arguments: &[&str]| {
        let output = eval(&[&file], &[&["--json", "--filter", "madgwick"], arguments].concat());
        assert_eq!(output.code, Some(0), "{}", output.err);
        rows(&output.out)[0]["heading_deg"].as_f64().expect("a number")
    };
    assert_ne!(heading(&["--set", "beta=0"]), heading(&["--set", "madgwick.beta=10"]));
    assert_eq!(heading(&[]), heading(&["--set", "beta=0.1"]));
}

#[test]
fn a_wrong_use_has_exit_code_2_and_a_way_out() {
    let file = Walk::default().file("use.mcap");
    let missing = std::path::Path::new("no/such/folder/plot.svg").display().to_string();
    for (arguments, fault) in [
        (&["--filter", "madgwik"][..], "no filter `madgwik`; did you mean `madgwick`?"),
        (&["--filter", "kalman"], "there are mekf, madgwick"),
        (&["--axes", "seven"], "[possible values: 6, 9]"),
        (&["--set", "betta=1"], "has no parameter `betta`; did you mean `beta`?"),
        (&["--set", "beta"], "write NAME=VALUE"),
        (&["--set", "madgwick.beta=-1"], "choose a value from 0 to 1000 rad/s"),
        (&["--plot", "errors.pdf"], "call the file errors.svg or .png"),
        (&["--plot", &missing], "there is no folder no/such/folder"),
        (&["--jsom"], "--json"),
    ] {
        let output = eval(&[&file], arguments);
        assert_eq!((output.code, &*output.out), (Some(2), ""), "{arguments:?}");
        assert!(output.err.contains(fault), "{arguments:?}: {}", output.err);
    }
    assert_eq!(bb(&["eval", "attitude"]).code, Some(2));
    assert_eq!(bb(&[]).code, Some(2));
    assert_eq!(bb(&["eval", "attitude", "--help"]).code, Some(0));
}

#[test]
fn what_follows_filter_and_is_a_recording_is_one() {
    let file = Walk::default().file("follows.mcap");
    let path = file.to_str().expect("is text");
    let output = bb(&["eval", "attitude", "--filter", "mekf", "madgwick", path, "--json"]);
    assert_eq!(output.code, Some(0), "{}", output.err);
    assert_eq!(rows(&output.out).len(), 2);
}

#[test]
fn errors_are_plotted() {
    let file = Walk { error: 0.1, lost: 150..200, ..Walk::default() }.file("plot.mcap");
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (name, start) in [("errors.svg", &b"<svg"[..]), ("errors.png", b"\x89PNG")] {
        let plot = folder.join(name);
        let output = eval(&[&file, &file], &["--plot", plot.to_str().expect("is text")]);
        assert_eq!(output.code, Some(0), "{}", output.err);
        assert!(std::fs::read(&plot).expect("is there").starts_with(start));
    }
    let svg = std::fs::read_to_string(folder.join("errors.svg")).expect("is there");
    for said in
        ["madgwick", "total error, nine axes", "roll (deg)", "pitch (deg)", "yaw (deg)", "truth", "strength (µT)"]
    {
        assert!(svg.contains(said), "{said}");
    }

    let file = Walk { truth: false, ..Walk::default() }.file("plot_no_truth.mcap");
    let plot = folder.join("nothing.svg");
    let output = eval(&[&file], &["--plot", plot.to_str().expect("is text")]);
    assert_eq!(output.code, Some(1));
    assert!(output.err.contains("not plotted, for no recording has errors"), "{}", output.err);
}
