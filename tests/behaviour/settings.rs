//! Options and parameters from files, from the command line and by path.

use crate::kit::*;
use bb_tests::laws;
use proptest::prelude::*;
use std::path::PathBuf;

/// Filter of a device's readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
pub(crate) enum Filtering {
    #[default]
    None,
    LowPass {
        cutoff: f64,
    },
}

/// Option that has no JSON form.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Opaque;

/// An option of every kind.
#[derive(Clone, Debug, Options)]
pub(crate) struct EveryOptions {
    /// Device file.
    #[option(required)]
    pub(crate) port: PathBuf,
    /// Readings beyond it are dropped.
    #[option(default = 4.0, range = 0.1..=30.0, unit = "m")]
    pub(crate) maximum_range: f64,
    #[option(default = Duration::from_millis(20))]
    pub(crate) timeout: Duration,
    #[option(default = None, unit = "rad/s")]
    pub(crate) rate: Option<f32>,
    #[option(default = 3, range = 1..=8)]
    pub(crate) retries: u8,
    #[option(default = [1.0, 0.0, 0.0])]
    pub(crate) axis: [f64; 3],
    #[option(default = "imu \"left\"\\\n\u{7f}é")]
    pub(crate) name: String,
    #[option(default = Filtering::None)]
    pub(crate) filtering: Filtering,
    #[option(default = Opaque)]
    pub(crate) opaque: Opaque,
    #[option(default = 0.5, range = 0.0..=1.0)]
    pub(crate) gain: f64,
    #[option(default = f64::INFINITY, unit = "s")]
    pub(crate) horizon: f64,
    #[option(default = [f64::NAN, 1.0])]
    pub(crate) scale: [f64; 2],
    #[option(default = Some(1.5), unit = "m")]
    pub(crate) reach: Option<f64>,
    #[option(default = Some(2))]
    pub(crate) tries: Option<u8>,
    #[option(default = Some("a".to_owned()))]
    pub(crate) nick: Option<String>,
}

robot! {
    robot Set;
    parameters {
        tuning {
            /// Weight of a new reading.
            gain: f64 = 0.5, range: 0.0..=1.0;
            limit: f64 = 2 m/s;
            count: i64 = 3;
            label: String = "a";
            enabled: bool = true;
        }
    }
    link base {
        sensor source: External<Number>() {
            estimator every: Known<EveryOptions>(port = "/dev/null", gain = param::tuning::gain);
        }
    }
}

#[test]
fn a_file_sets_options_and_parameters_alike() {
    let mut builder = Set::builder();
    // Tables of which every key is a comment, as `--list` writes them, say nothing.
    let before = builder.settings().to_string();
    let empty = "[sensor]\n[sensor.base.source.every]\n# port = 1\n[param]\n[param.tuning]\n";
    builder.set_from_toml("rover.toml", empty).expect("nothing is set");
    assert_eq!(builder.settings().to_string(), before);
    let file = r#"
        # Any nesting of the path will do.
        [sensor.base.source.every]
        port = "/dev/ttyUSB0"
        maximum_range = "1200 cm"
        timeout = "0.5 s"
        rate = "180 deg/s"
        retries = 8
        axis = [0, 1.5, -2e-3]
        filtering = { LowPass = { cutoff = 12.5 } }

        [param]
        tuning.gain = 0.25
        "tuning/limit" = "3.6 km/h"
        tuning.label = "b"
        tuning.enabled = false
    "#;
    builder.set_from_toml("rover.toml", file).expect("all is right");
    builder.set("param/tuning/count", "-7").expect("it is an integer");
    builder.set("sensor/base/source/every/name", "plain text").expect("it needs no quotation marks");
    let listed = builder.settings().to_string();
    assert!(listed.contains("count = -7\n") && listed.contains("limit = \"1 m/s\"\n"), "{listed}");
    let simulation = builder.simulate().expect("it starts");
    let options = simulation.call(set::sensor::base::source::every, Which).expect("it answers");
    assert_eq!(options.port, PathBuf::from("/dev/ttyUSB0"));
    assert_eq!(options.maximum_range, 12.0);
    assert_eq!(options.timeout, Duration::from_millis(500));
    assert_eq!(options.rate, Some(std::f32::consts::PI));
    assert_eq!((options.retries, options.axis), (8, [0.0, 1.5, -2e-3]));
    assert_eq!((options.filtering, options.gain), (Filtering::LowPass { cutoff: 12.5 }, 0.25));
    assert_eq!(options.name, "plain text");
}

#[test]
fn all_that_is_wrong_is_said_with_its_line_and_column_and_nothing_is_set() {
    let mut builder = Set::builder();
    let before = builder.settings().to_string();
    let file = "\
[sensor.base.source.every]
retries = 7
maximum_range = 12
timeout = \"5 m\"
rate = \"3 dge/s\"
axis = [1, 2]
port = 3
opaque = 1
gain = 0.1
retires = 7
[sensor.bose.source.every]
port = \"a\"
[param.tuning]
gain = 1.5
limit = 2.5
count = 2.5
enabled = \"yes\"
label = nan
[param.tuning.gian]
";
    let error = builder.set_from_toml("rover.toml", file).expect_err("nearly all is wrong");
    assert_eq!(
        error.to_string(),
        "\
rover.toml:3:17: sensor/base/source/every/maximum_range: expected a length, found a number without a unit; write it with one, as in \"1 m\"
rover.toml:4:11: sensor/base/source/every/timeout: expected a time, found a length
rover.toml:5:8: sensor/base/source/every/rate: unknown unit `dge`; did you mean `deg`?
rover.toml:6:8: sensor/base/source/every/axis: expected an array of 3, found an array of 2
rover.toml:7:8: sensor/base/source/every/port: expected text, found 3
rover.toml:8:10: sensor/base/source/every/opaque: cannot be written as text: its type has no JSON form. Derive `Payload` for it, or set it in code
rover.toml:9:8: sensor/base/source/every/gain: is bound to `param/tuning/gain`; set that
rover.toml:10:1: sensor/base/source/every/retires: there is no such option; did you mean `retries`?
rover.toml:12:1: sensor/bose/source/every/port: there is no such setting; did you mean `sensor/base/source/every/port`?
rover.toml:14:8: param/tuning/gain: expected a number in 0.0..=1.0, found `1.5`
rover.toml:15:9: param/tuning/limit: expected a velocity, found a number without a unit; write it with one, as in \"1 m/s\"
rover.toml:16:9: param/tuning/count: expected an integer from -9223372036854775808 to 9223372036854775807, found 2.5
rover.toml:17:11: param/tuning/enabled: expected true or false, found the text \"yes\"
rover.toml:19:15: param/tuning/gian: there is no such setting; did you mean `param/tuning/gain`?"
    );
    assert_eq!(builder.settings().to_string(), before);
    assert_eq!(error.problems()[0].position(), Some((3, 17)));
}

fn error_of(file: &str) -> String {
    Set::builder().set_from_toml("rover.toml", file).expect_err("it is wrong").to_string()
}

#[test]
fn values_out_of_their_range_are_refused_where_they_are_written() {
    for (file, error) in [
        (
            "[sensor.base.source.every]\ntimeout = \"1 s\"\nmaximum_range = \"31 m\"",
            "rover.toml:3:17: sensor/base/source/every/maximum_range: must be in 0.1..=30.0 m, found `31`",
        ),
        (
            "sensor.base.source.every.timeout = \"-1 s\"",
            "rover.toml:1:36: sensor/base/source/every/timeout: cannot be -1 s",
        ),
        (
            "sensor.base.source.every.filtering = { LowPass = { cutoff = nan } }",
            "rover.toml:1:38: sensor/base/source/every/filtering: expected a finite number",
        ),
        (
            "[param]\ntuning.count = 1\n\"tuning/count\" = 2",
            "rover.toml:3:18: param/tuning/count: is set twice in this file",
        ),
        (
            "sensor.base.source.every = 3",
            "rover.toml:1:20: sensor/base/source/every: is a component; its options are axis, filtering, gain, \
             horizon, maximum_range, name, nick, opaque, port, rate, reach, retries, scale, timeout, tries",
        ),
        ("sensor = 3", "rover.toml:1:1: sensor: there is no such setting; `--list` shows all"),
        // A byte order mark is no column.
        ("\u{feff}a = 1", "rover.toml:1:1: a: there is no such setting; `--list` shows all"),
    ] {
        assert_eq!(error_of(file), error);
    }
    let three = "[sensor.base.source.every]\nretries = 9\nmaximum_range = \"0 m\"\nretires = 1";
    assert_eq!(error_of(three).lines().count(), 3, "all ranges and names at once");
    assert_eq!(error_of("a = \nb = ]").lines().count(), 2, "every syntax error");
    let deep = error_of(&format!("sensor.base.source.every.axis = {}1", "[".repeat(10_000)));
    assert!(deep.starts_with("rover.toml:1:"), "{}", &deep[..200.min(deep.len())]);
    let missing = Set::builder().load_settings("no such file.toml").expect_err("it is not there");
    assert!(missing.to_string().starts_with("no such file.toml: cannot be read: "), "{missing}");
}

#[test]
fn a_parameter_is_held_against_the_options_that_are_bound_to_it() {
    let mut builder = Crowd::builder();
    let says = "param/gain: sensor/base/source/start/gain is bound to it, and must be in 0.0..=1.0, found `1.5`";
    assert_refused(builder.set("param/gain", "1.5"), says);
    let says = "param/gain is not set: sensor/base/source/start/gain is bound to it, and must be in 0.0..=1.0, found `1.5`";
    assert_refused(builder.set_parameter(crowd::param::gain, 1.5), says);
    builder.set_parameter(crowd::param::gain, 0.75).expect("the option takes it");
    assert!(builder.settings().to_string().contains("gain = 0.75"));
}

robot! {
    robot Crowd;
    parameters { gain: f64 = 0.5, range: 0.0..=2.0; }
    link base {
        // An option of the sensor has the name of the estimator that is nested there.
        sensor source: Counter() { rate: 1 Hz; estimator start: Known<EveryOptions>(port = "/dev/null", gain = param::gain); }
    }
}

#[test]
fn options_below_a_setting_of_the_same_name_are_listed_and_in_the_schema() {
    let mut builder = Crowd::builder();
    let listed = builder.settings().to_string();
    assert!(listed.contains("[sensor.base.source]\n# First number.\nstart = 0.0\n"), "{listed}");
    assert!(listed.contains("[\"sensor/base/source/start\"]\n# Device file.\n"), "{listed}");
    let file = listed.replace("retries = 3", "retries = 4").replace("start = 0.0", "start = 2.0");
    builder.set_from_toml("list", &file).expect("what is listed is read");
    assert_eq!(builder.options(crowd::sensor::base::source).start, 2.0);
    assert_eq!(builder.options(crowd::sensor::base::source::start).retries, 4);
    let schema: Value = serde_json::from_str(&Crowd::settings_schema()).expect("it is JSON");
    let sensor = &schema["properties"]["sensor"]["properties"]["base"]["properties"]["source"]["properties"];
    assert_eq!(sensor["start"]["type"], "number", "{schema:#}");
    let retries = &schema["properties"]["sensor/base/source/start"]["properties"]["retries"];
    assert_eq!(retries["maximum"], 8.0, "{schema:#}");
}

#[test]
fn an_option_that_has_a_value_by_default_can_be_none() {
    let mut builder = Set::builder();
    let options = builder.options(set::sensor::base::source::every);
    (options.reach, options.tries, options.nick) = (None, None, None);
    let listed = builder.settings().to_string();
    assert!(listed.contains("reach = \"null\"\ntries = \"null\"\n# nick is not set\n"), "{listed}");
    let mut other = Set::builder();
    other.set_from_toml("list", &listed).expect("what is listed is read");
    let options = other.options(set::sensor::base::source::every);
    assert_eq!((options.reach, options.tries), (None, None));
    other.set("sensor/base/source/every/nick", "null").expect("JSON has a null");
    assert_eq!(other.options(set::sensor::base::source::every).nick, None);
    other.set_from_toml("text", "sensor.base.source.every.nick = 'null'").expect("a text is one");
    assert_eq!(other.options(set::sensor::base::source::every).nick.as_deref(), Some("null"));
}

#[test]
fn of_many_unknown_names_the_first_get_hints() {
    let text: String = (0..3000).map(|number| format!("[sensor.base.sorce.a{number}]\nport = 1\n")).collect();
    let error = Set::builder().set_from_toml("many", &text).expect_err("there are no such names").to_string();
    assert_eq!(error.lines().count(), 101);
    assert!(error.lines().next().is_some_and(|line| line.contains("; ")), "{error}");
    assert!(error.lines().nth(99).is_some_and(|line| line.ends_with("there is no such setting")), "{error}");
    assert_eq!(error.lines().last(), Some("and 2900 more problems"));
    // In one line or in many, each is looked at once: if each were looked for from the beginning, it would take a minute.
    let keys =
        |separator: &str| (0..100_000).map(|key| format!("key{key} = 1")).collect::<Vec<_>>().join(separator);
    for text in
        [format!("[sensor.base.sorce]\n{}\n", keys("\n")), format!("sensor.base.sorce = {{ {} }}\n", keys(", "))]
    {
        let start = std::time::Instant::now();
        let error = Set::builder().set_from_toml("many", &text).expect_err("there are no such names");
        assert_eq!(error.problems().len(), 100);
        assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
    }
}

#[test]
fn arguments_are_taken_and_the_others_are_left() {
    let folder = std::env::temp_dir().join(format!("bb-settings-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("rover.toml");
    std::fs::write(&file, "[param.tuning]\ncount = 5\nlabel = \"from the file\"\n").expect("a file");
    let take = |arguments: &[&str]| {
        let mut builder = Set::builder();
        let others = builder.take_arguments(arguments.iter().map(Into::into));
        (builder.settings().to_string(), others)
    };
    let config = format!("--config={}", file.display());
    let set = "--set=param/tuning/limit=2 m/s";
    let (listed, others) = take(&["--set", "param/tuning/count=6", "data.mcap", &config, set, "--", "--set"]);
    assert_eq!(others.expect("all is right").expect("nothing is listed"), ["data.mcap", "--", "--set"]);
    assert!(listed.contains("count = 6\n") && listed.contains("label = \"from the file\"\n"), "{listed}");
    let message = |arguments: &[&str]| take(arguments).1.expect_err("it is wrong").to_string();
    assert_eq!(message(&["--set"]), "`--set` needs a value: `--set PATH=VALUE`");
    assert_eq!(message(&["--config"]), "`--config` needs a value: `--config FILE`");
    assert_eq!(message(&["--set", "count"]), "expected `--set PATH=VALUE`, found `--set count`");
    let both = "--set param/tuning/count: expected an integer from -9223372036854775808 to 9223372036854775807, found the text \"many\"\n\
                --set param/tuning/lable: there is no such setting; did you mean `param/tuning/label`?";
    assert_eq!(message(&["--set", "param/tuning/count=many", "--set", "param/tuning/lable=x"]), both);
    let (_, listed) = take(&["--list"]);
    assert_eq!(listed.expect("it lists"), None);
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn the_list_is_a_file_with_docs_ranges_and_units() {
    assert_eq!(
        Set::builder().settings().to_string(),
        r#"[sensor.base.source.every]
# Device file.
port = "/dev/null"
# Readings beyond it are dropped.
# In 0.1..=30.0 m.
maximum_range = "4 m"
timeout = "0.02 s"
# rate is not set
# In 1..=8.
retries = 3
axis = [1.0, 0.0, 0.0]
name = "imu \"left\"\\\n\u007Fé"
filtering = "None"
# opaque can be set in code only
# In 0.0..=1.0.
# gain is bound to param/tuning/gain
# horizon has a value that cannot be written
# scale has a value that cannot be written
reach = "1.5 m"
tries = 2
nick = "a"

[param.tuning]
# Weight of a new reading.
# In 0.0..=1.0.
gain = 0.5
limit = "2 m/s"
count = 3
label = "a"
enabled = true
"#
    );
}

#[test]
fn the_schema_says_what_can_be_set() {
    let schema = Set::settings_schema();
    for part in [
        r#""$schema":"https://json-schema.org/draft/2020-12/schema","title":"Set""#,
        r#""port":{"type":"string","description":"Device file.","default":"/dev/null"}"#,
        r#""examples":["1 m"],"description":"Readings beyond it are dropped. In 0.1..=30.0 m.","default":"4 m"}"#,
        r#""retries":{"type":"integer","minimum":1.0,"maximum":8.0,"description":"In 1..=8.","default":3}"#,
        r##""filtering":{"$ref":"#/$defs/Filtering","default":"None"}"##,
        r#""gain":{"type":"number","minimum":0.0,"maximum":1.0,"description":"Weight of a new reading. In 0.0..=1.0.","default":0.5}"#,
        r#""$defs":{"Filtering":"#,
        // Neither a number without a unit nor a text without a number.
        r#""pattern":"^\\s*[-+]?([0-9][0-9_]*\\.?[0-9_]*|\\.[0-9][0-9_]*)([eE][-+]?[0-9]+)?\\s*[^\\s0-9._+\\-eE].*$""#,
    ] {
        assert!(schema.contains(part), "{part} is not in {schema}");
    }
    assert!(!schema.contains("opaque"), "{schema}");
    let parsed: Value = serde_json::from_str(&schema).expect("it is JSON");
    let options =
        parsed.pointer("/properties/sensor/properties/base/properties/source/properties/every/properties");
    let count = options.and_then(Value::as_object).map(serde_json::Map::len);
    assert_eq!(count, Some(13), "gain is bound, opaque is none");
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever is set can be listed, and read back to the same.
    #[test]
    fn a_list_reads_back_to_the_same_settings(
        port in "\\PC{0,12}",
        range in 0.1..30.0_f64,
        seconds in any::<u64>(),
        nanos in 0..1_000_000_000_u32,
        rate in proptest::num::f32::NORMAL,
        retries in 1..=8_u8,
        axis in [proptest::num::f64::NORMAL, proptest::num::f64::NORMAL, proptest::num::f64::NORMAL],
        (name, label) in (".{0,12}", ".{0,12}"),
        (cutoff, reach) in (proptest::option::of(proptest::num::f64::NORMAL), proptest::option::of(proptest::num::f64::NORMAL)),
        limit in proptest::num::f64::NORMAL,
        count in any::<i64>(),
        tries in any::<Option<u8>>(),
    ) {
        let mut builder = Set::builder();
        let options = builder.options(set::sensor::base::source::every);
        options.port = port.into();
        options.maximum_range = range;
        options.timeout = Duration::new(seconds, nanos);
        options.rate = Some(rate);
        options.reach = reach;
        options.tries = tries;
        options.retries = retries;
        options.axis = axis;
        options.name = name;
        options.filtering = cutoff.map_or(Filtering::None, |cutoff| Filtering::LowPass { cutoff });
        builder.set_parameter(set::param::tuning::limit, limit).expect("it has no range");
        builder.set_parameter(set::param::tuning::count, count).expect("it has no range");
        builder.set_parameter(set::param::tuning::label, label).expect("it has no range");
        let expected = format!("{:?}", builder.options(set::sensor::base::source::every));
        let listed = builder.settings().to_string();
        let mut other = Set::builder();
        other.set_from_toml("list", &listed).map_err(|error| TestCaseError::fail(format!("{error}\n{listed}")))?;
        prop_assert_eq!(format!("{:?}", other.options(set::sensor::base::source::every)), expected);
        prop_assert_eq!(other.settings().to_string(), listed);
    }

    #[test]
    fn no_file_panics(text in "[\\[\\]=\"a-z.0-9{}#\\n ]{0,80}") {
        let _ = Set::builder().set_from_toml("any", &text);
    }
}
