//! Tables in the guides that are made from the documentation of code, and from the figures of filters.
//! `UPDATE_DOCS=1 cargo test -p bb-tests --test robots tables` renews them.

// The accuracy tests use the rest of it.
#[allow(dead_code)]
#[path = "accuracy/known.rs"]
mod known;
#[allow(dead_code)]
#[path = "accuracy/known_families.rs"]
mod known_families;

use bb_estimators::attitude::{AnyFilter, AnyParams, AttitudeFilter, FilterParams, ImuSample};
use bb_eval::Axes;
use known::{Errors, Row};
use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

fn filters() -> impl Iterator<Item = FilterParams> {
    FilterParams::ALL.iter().map(|default| default())
}

/// Checks that the text between `<!-- NAME -->` and `<!-- end -->` is `table`, or replaces it.
fn hold(file: &str, name: &str, table: &str) {
    // Several tables of one file are renewed at the same time.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{file}: {error}"));
    let start = format!("<!-- {name} -->\n");
    let (before, rest) = text.split_once(&start).unwrap_or_else(|| panic!("{file} has no `{}`", start.trim()));
    let (now, after) = rest.split_once("<!-- end -->").unwrap_or_else(|| panic!("{file}: `{name}` has no end"));
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{start}{table}<!-- end -->{after}")).expect("it was read");
    } else {
        assert_eq!(now, table, "{file}: the table `{name}` is another; UPDATE_DOCS=1 renews it");
    }
}

#[test]
fn what_filters_know() {
    type Tells = fn(&AnyFilter) -> bool;
    let rows: [(&str, Tells); 5] = [
        ("orientation_uncertainty", |filter| filter.orientation_uncertainty().is_some()),
        ("gyroscope_bias", |filter| filter.gyroscope_bias().is_some()),
        ("is_at_rest", |filter| filter.is_at_rest().is_some()),
        ("is_magnetically_disturbed", |filter| filter.is_magnetically_disturbed().is_some()),
        ("is_heading_trusted", |filter| filter.is_heading_trusted().is_some()),
    ];
    let started = |filter| {
        let mut filter = AnyFilter::<f64>::new(AnyParams { filter }).expect("defaults are good");
        let sample = ImuSample {
            time_ns: 0,
            angular_velocity: [0.0; 3].into(),
            specific_force: [0.0, 0.0, 9.81].into(),
            magnetic_field: Some([0.0, 20e-6, -45e-6].into()),
        };
        filter.update(&sample).expect("a good sample");
        filter
    };
    let filters: Vec<_> = filters().map(|params| (params.estimator(), started(params))).collect();
    let telling: Vec<_> =
        filters.iter().filter(|(_, filter)| rows.iter().any(|(_, tells)| tells(filter))).collect();
    let mut table = String::from("| |");
    for (name, _) in &telling {
        let _ = write!(table, " `{name}` |");
    }
    table += "\n|---|";
    table += &"---|".repeat(telling.len());
    for (name, tells) in rows {
        let _ = write!(table, "\n| `{name}` |");
        for (_, filter) in &telling {
            table += if tells(filter) { " yes |" } else { " |" };
        }
    }
    hold("book/src/how-to/attitude.md", "knowledge", &(table + "\n"));
}

#[test]
fn what_filters_reach() -> Result<(), Box<dyn Error>> {
    let mut table = String::from("| filter | settings | total | heading | inclination |\n|---|---|---|---|---|\n");
    let rows = known::rows()?;
    for axes in [Axes::Nine, Axes::Six] {
        for row in rows.iter().filter(|row| row.axes == axes) {
            let Row { filter, settings, errors: Some(Errors { mean, worst }), .. } = row else {
                return Err(format!("{} is not measured", row.name()).into());
            };
            let settings = if settings.is_empty() { String::new() } else { format!("`{settings}`") };
            let inclination = format!("{:.2} / {:.2}", mean.inclination, worst.inclination);
            let _ = match axes {
                Axes::Nine => writeln!(
                    table,
                    "| `{filter}` | {settings} | {:.2} / {:.2} | {:.2} / {:.2} | {inclination} |",
                    mean.total, worst.total, mean.heading, worst.heading
                ),
                Axes::Six => writeln!(table, "| `{filter}`, six axes | {settings} | | | {inclination} |"),
            };
        }
    }
    hold("book/src/laboratory/attitude.md", "accuracy", &table);
    Ok(())
}

#[test]
fn what_filters_reach_on_families() -> Result<(), Box<dyn Error>> {
    let rows = known_families::rows()?;
    let measured = |row: &known_families::Row| match &*row.angle {
        "inclination" => row.errors[2],
        "heading" => row.errors[1],
        _ => row.errors[0],
    };
    let of = |family: &str, filter: &str| rows.iter().find(|row| (&*row.family, &*row.filter) == (family, filter));
    let others: Vec<_> =
        filters().map(|filter| filter.name()).filter(|name| !["vqf", "tilt"].contains(name)).collect();
    let mut table = String::from("| family | half | angle | `vqf` |");
    for filter in &others {
        let _ = write!(table, " `{filter}` |");
    }
    table += " `mekf` in 2σ |\n|---|---|---|---|---|";
    table += &"---|".repeat(others.len());
    table += "\n";
    let mut logs = vec![[(0.0, 0); 2]; others.len()];
    for vqf in rows.iter().filter(|row| row.filter == "vqf") {
        let _ = write!(table, "| {} | {} | {} | {:.2}° |", vqf.family, vqf.half, vqf.angle, measured(vqf));
        for (filter, logs) in others.iter().zip(&mut logs) {
            let row = of(&vqf.family, filter).ok_or_else(|| format!("{filter}: no figure on {}", vqf.family))?;
            let ratio = measured(row) / measured(vqf);
            let _ = write!(table, " {ratio:.2} |");
            if let Some(half) = ["A", "B"].iter().position(|half| *half == vqf.half) {
                logs[half].0 += ratio.ln();
                logs[half].1 += 1;
            }
        }
        let mekf = of(&vqf.family, "mekf").ok_or("mekf is a filter")?;
        let share = |share: f64| if share.is_nan() { "–".into() } else { format!("{:.0} %", 100.0 * share) };
        let _ = writeln!(table, " {}, {} |", share(mekf.shares[0]), share(mekf.shares[1]));
    }
    for (half, name) in ["A", "B"].iter().enumerate() {
        let _ = write!(table, "| geometric mean | {name} | | |");
        for logs in &logs {
            let (sum, count) = logs[half];
            let _ = write!(table, " {:.2} |", (sum / f64::from(count)).exp());
        }
        table += " |\n";
    }
    hold("book/src/laboratory/attitude.md", "families", &table);
    Ok(())
}

/// Payloads that have a message of ROS, as the documentation of the conversion lists them.
#[test]
fn messages_of_ros() {
    let file = "bb-message/src/message/codec/ros.rs";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{file}: {error}"));
    let rows = text.lines().filter_map(|line| line.strip_prefix("//! ")).filter(|row| row.starts_with('|'));
    let table: String = rows.map(|row| format!("{row}\n")).collect();
    assert!(table.lines().count() > 10, "{file} has no table");
    hold("book/src/reference/recordings.md", "ros", &table);
}

/// The front page has no figure that no page with its command has.
#[test]
fn figures_of_the_readme_are_measured() {
    let read = |file: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{file}: {error}"))
    };
    let is_number = |text: &str| text.starts_with(|first: char| first.is_ascii_digit());
    let measured: String =
        ["book/src/laboratory/navigation.md", "book/src/laboratory/attitude.md", "benches/peers/README.md"]
            .map(read)
            .concat();
    let measured: Vec<&str> = measured.split(|letter: char| !letter.is_ascii_digit() && letter != '.').collect();
    let readme = read("README.md");
    let words: Vec<&str> = readme.split([' ', '\n', ';', ',', '|']).filter(|word| !word.is_empty()).collect();
    let angles = words.iter().filter_map(|word| word.strip_suffix('°'));
    let others = words
        .windows(2)
        .filter(|pair| ["m", "ms", "ns", "instructions"].contains(&pair[1]) && is_number(pair[0]))
        .map(|pair| pair[0]);
    let figures: Vec<&str> = angles.chain(others).collect();
    assert!(figures.len() > 12, "{figures:?}");
    for figure in figures {
        assert!(measured.contains(&figure), "README.md has {figure}, which no page has");
    }
}
