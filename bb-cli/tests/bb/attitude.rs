//! `bb eval attitude` on whole recordings.

use crate::common::{Walk, bb, eval, file};
use serde_json::Value;

fn rows(out: &str) -> Vec<Value> {
    serde_json::from_str::<Vec<Value>>(out).expect("an array")
}

#[test]
fn json_has_these_fields() {
    let file = Walk { error: 0.1, ..Walk::default() }.file("json.mcap");
    let output = eval(&[&file], &["--json", "--filter", "madgwick"]);
    // The error is constant.
    let said = format!("note: {}: the truth's world is turned about the vertical by -5.7 deg", file.display());
    assert!(
        output.code == Some(0) && output.err.starts_with(&said) && output.err.lines().count() == 1,
        "{}",
        output.err
    );
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
        "outage_deg",
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

    // The slashes may be left out.
    let bare: Vec<_> = arguments.iter().map(|word| word.strip_prefix('/').unwrap_or(word)).collect();
    assert_eq!(eval(&[&file], &[&bare[..], &["--json"]].concat()).code, Some(0));
    let output = eval(&[&file], &["--imu-topic", "/mag"]);
    assert!(output.err.contains(
        "twice.mcap: the messages of /mag are sensor_msgs/msg/MagneticField, and sensor_msgs/msg/Imu is needed"
    ));
    for (topic, said) in [
        ("/gone", "no topic /gone (--imu-topic); of a fitting type there "),
        ("/imuu", "no topic /imuu (--imu-topic); did you mean `/imu`? of a fitting type there "),
    ] {
        let output = eval(&[&file], &["--imu-topic", topic]);
        assert!(output.err.contains(said) && output.err.contains("/imu (sensor_msgs/msg/Imu)"), "{}", output.err);
    }
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
fn a_setting_that_changes_nothing_is_an_error() {
    let file = Walk { bias: 0.1, ..Walk::default() }.file("idle.mcap");
    // VQF forgets biases over hours on this recording of three seconds, at rest or not.
    let idle = ["--filter", "vqf", "--set", "rejection_time=59"];
    let output = eval(&[&file], &idle);
    assert_eq!(output.code, Some(1), "{}", output.err);
    assert!(
        output.err.contains("error: --set rejection_time=59 changes nothing on these recordings"),
        "{}",
        output.err
    );
    // The figures are there nonetheless.
    assert!(output.out.contains("vqf"), "{}", output.out);
    let of_two = ["--filter", "vqf,complementary", "--set", "heading_time_constant=20"];
    assert_eq!(eval(&[&file], &of_two).code, Some(0));
}

/// The options of a robot's settings file are those of `--set`.
#[test]
fn a_robot_lends_its_settings() {
    let walk = Walk { bias: 0.1, ..Walk::default() }.file("lent_walk.mcap");
    let lent = |text: &str, arguments: &[&str]| {
        let config = file("lent_attitude.toml", text.as_bytes());
        eval(&[&walk], &[&["--json", "--robot", config.to_str().expect("is text")], arguments].concat())
    };
    let heading = |output: &crate::common::Output| {
        assert_eq!(output.code, Some(0), "{}", output.err);
        rows(&output.out)[0]["heading_deg"].clone()
    };
    let text = "[sensor.base.imu]\nrate = 3\n[estimator.base.orientation]\nbeta = \"2 rad/s\"\n";
    let set = eval(&[&walk], &["--json", "--filter", "madgwick", "--set", "beta=2"]);
    assert_eq!(heading(&lent(text, &["--filter", "madgwick"])), heading(&set));
    let times = "[estimator.o]\nheading_time_constant = -1\ntilt_time_constant = \"soon\"\n";
    // Of an estimator below a sensor, beside others that have some of the options, as `--list` writes it.
    let listed = "[estimator.base.navigation]\nbeta = 1\ngyroscope_noise = 1\n[sensor.base.imu.tilt]\nbeta = 2\n";
    assert_eq!(heading(&lent(listed, &["--filter", "madgwick"])), heading(&set));
    // A listing has all options of each estimator, which may be some of those of another.
    let all = "[estimator.base.navigation]\nbeta = 1\n[sensor.base.imu.tilt]\nbeta = 2\nmagnetometer = true\n";
    assert_eq!(heading(&lent(all, &["--filter", "madgwick"])), heading(&set));
    for (text, arguments, fault) in [
        (text, &[][..], "--robot gives the options of one filter; name it with --filter"),
        ("[estimator.a]\nbeta = 1\n[sensor.b]\nbeta = 2\n", &["--filter", "madgwick"], "estimator/a or "),
        (text, &["--filter", "mahony"], "no estimator in it has an option of this filter"),
        (
            "[estimator.o]\nbeta = 2\ngamma = 1\n",
            &["--filter", "madgwick"],
            "estimator/o/gamma: this filter has no such option",
        ),
        (
            "[estimator.o]\nbeta = 2\ngamma = 1\nalfa = 1\n",
            &["--filter", "madgwick"],
            "estimator/o/alfa: this filter has no such option",
        ),
        (
            "[estimator.o]\nbeta = 2\ngamma = 1\nalfa = 1\n",
            &["--filter", "madgwick"],
            "estimator/o/gamma: this filter has no such option",
        ),
        (times, &["--filter", "complementary"], "`heading_time_constant` is -1 s"),
        (times, &["--filter", "complementary"], "`tilt_time_constant` is `soon`"),
    ] {
        let output = lent(text, arguments);
        assert!(output.code == Some(2) && output.err.contains(fault), "{}", output.err);
    }
    let idle = lent("[estimator.o]\nrejection_time = \"59 s\"\n", &["--filter", "vqf"]);
    let fault = "lent_attitude.toml: rejection_time changes nothing on these recordings";
    assert!(idle.code == Some(1) && idle.err.contains(fault), "{}", idle.err);
}

/// Made harder by an option, where a recording had to be written again.
#[test]
fn outages_gaps_and_delays_are_options() {
    let file = Walk { bias: 0.05, ..Walk::default() }.file("disturbed.mcap");
    let row = |arguments: &[&str]| {
        let output = eval(&[&file], &[&["--json", "--filter", "madgwick"], arguments].concat());
        assert_eq!(output.code, Some(0), "{}", output.err);
        (rows(&output.out)[0].clone(), output.err)
    };
    let number = |row: &Value, name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name}: {row}"));
    let (plain, said) = row(&[]);
    assert!(plain["outage_deg"].is_null() && said.is_empty(), "{said}");
    // In the last second the gyroscope alone turns the estimate, and its bias is 2.9 deg/s.
    let (outage, said) = row(&["--outage", "1s/2990ms"]);
    assert!(number(&outage, "heading_deg") > number(&plain, "heading_deg") + 0.5, "{outage}");
    assert!(number(&outage, "outage_deg") > number(&outage, "total_deg"), "{outage}");
    assert!(said.contains("madgwick: in 100 samples without a field: total "), "{said}");
    let (every, _) = row(&["--every", "4"]);
    assert!(number(&every, "heading_deg") > number(&plain, "heading_deg"), "{every}");
    let (gaps, _) = row(&["--drop", "imu=200ms/1s"]);
    assert_eq!((plain["samples"].as_u64(), gaps["samples"].as_u64()), (Some(199), Some(159)));
    // It turns by 0.5 rad/s: stamps 100 ms later are off by 2.9 deg.
    let (late, _) = row(&["--delay", "imu=100ms", "--delay", "magnetic_field=100ms"]);
    let heading = number(&late, "heading_deg") - number(&plain, "heading_deg");
    assert!((heading - 2.86).abs() < 0.3, "{heading}");
    let (late, _) = row(&["--delay", "magnetic_field=200ms"]);
    assert!(number(&late, "heading_deg") > number(&plain, "heading_deg"), "{late}");
    for (arguments, fault) in [
        (["--outage", "30s/90s"], "--outage changes nothing: no message of `magnetic_field` falls in it"),
        (["--drop", "gnss=1s/2s"], "--drop changes nothing: no message of `gnss` falls in it"),
        (["--delay", "gnss=1s"], "--delay changes nothing: there is no message of `gnss` to delay"),
    ] {
        let output = eval(&[&file], &arguments);
        assert!(output.code == Some(1) && output.err.contains(fault), "{}", output.err);
    }
    let six = eval(&[&file], &["--axes", "6", "--outage", "1s/2s"]);
    assert!(six.code == Some(1) && six.err.contains("--outage changes nothing"), "{}", six.err);
}

/// Each estimate with its covariance beside the truth, as a CSV and as a bag.
#[test]
fn estimates_are_exported() {
    let walk = Walk { error: 0.1, lost: 150..200, ..Walk::default() }.file("exported.mcap");
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let export_as = |name: &str, filter: &str, more: &[&str]| {
        let to = folder.join(name);
        // Of an earlier run: recordings are not overwritten.
        let _ = std::fs::remove_file(&to);
        let arguments = ["--json", "--filter", filter, "--export", to.to_str().expect("is text")];
        let output = eval(&[&walk], &[&arguments[..], more].concat());
        assert_eq!(output.code, Some(0), "{}", output.err);
        (to, rows(&output.out))
    };
    let export = |name: &str, filter: &str| export_as(name, filter, &[]);
    let (csv, scored) = export("attitude.csv", "mekf,madgwick");
    let text = std::fs::read_to_string(csv).expect("was written");
    let mut lines = text.lines();
    let head = "run,t_s,qw,qx,qy,qz,true_qw,true_qx,true_qy,true_qz,p00,p01,p02,p11,p12,p22";
    assert_eq!(lines.next(), Some(head));
    let lines: Vec<_> = lines.filter(|line| line.starts_with("\"exported, mekf\"")).collect();
    assert_eq!((lines.len(), text.lines().count()), (300, 601));
    let cells: Vec<Vec<f64>> = lines
        .iter()
        .map(|line| line.rsplit("\",").next().expect("has cells").split(','))
        .map(|cells| cells.map(|cell| cell.parse().expect("is a number")).collect())
        .collect();
    assert_eq!(cells.iter().filter(|cells| cells[5].is_nan()).count(), 50, "the truth was lost");
    // The rows give the figure of the table.
    let turned =
        |cells: &[f64]| 2.0 * cells[..4].iter().zip(&cells[4..8]).map(|(a, b)| a * b).sum::<f64>().abs().acos();
    let errors: Vec<f64> =
        cells[101..].iter().map(|cells| turned(&cells[1..])).filter(|error| !error.is_nan()).collect();
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt().to_degrees();
    assert!((rms - scored[0]["total_deg"].as_f64().expect("is scored")).abs() < 1e-6, "{rms}");
    assert!(cells.iter().all(|cells| cells[9] > 0.0 && cells[12] > 0.0 && cells[14] > 0.0), "variances");

    assert!(text.split(['\n', ',']).all(|cell| cell.len() < 26), "digits that say nothing");
    // In true north the truth is what was recorded, and the estimates are turned with it.
    let turned = |name: &str, more: &[&str]| {
        let text = std::fs::read_to_string(export_as(name, "mekf", more).0).expect("was written");
        let row = text.lines().nth(250).expect("has rows").rsplit("\",").next().expect("has cells").to_owned();
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("is a number")).collect();
        // The angle about the vertical.
        [cells[1..5].to_vec(), cells[5..9].to_vec()].map(|of| 2.0 * of[3].atan2(of[0]).to_degrees())
    };
    let ([plain, truth], [declined, same]) =
        (turned("plain.csv", &[]), turned("declined.csv", &["--declination", "4"]));
    assert!(
        (truth - same).abs() < 1e-9 && (plain - 4.0 - declined).abs() < 1e-9,
        "{plain} {declined} {truth} {same}"
    );

    let (bag, _) = export("attitude_export.mcap", "mekf");
    let info = bb(&["info", bag.to_str().expect("is text")]);
    for line in ["/estimate  geometry_msgs/msg/QuaternionStamped", "/truth     geometry_msgs/msg/PoseStamped"] {
        assert!(info.out.contains(line), "{}", info.out);
    }
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
        (&["--export", "walk.txt"], "write to a file that ends in .csv or .mcap"),
        (&["--declination", "east"], "write degrees in -180..=180, or auto"),
        (&["--declination", "4", "--origin", "48,11,500"], "--origin changes nothing without --declination auto"),
        (&["--axes", "6", "--declination", "4"], "--declination changes nothing with --axes 6"),
        (&["--axes", "6", "--mag-topic", "/mag"], "--mag-topic changes nothing with --axes 6"),
        (&["--every", "1"], "write a whole number, at least 2"),
        (&["--jsom"], "--json"),
    ] {
        let output = eval(&[&file], arguments);
        assert_eq!((output.code, &*output.out), (Some(2), ""), "{arguments:?}");
        assert!(output.err.contains(fault), "{arguments:?}: {}", output.err);
    }
    assert_eq!(bb(&["eval", "attitude"]).code, Some(2));
    assert_eq!(bb(&[]).code, Some(2));
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
