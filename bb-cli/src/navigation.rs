//! `bb eval navigation`.

use bb_eval::{
    BagOptions, DataSet, Drawn, NAVIGATION_FILTERS, NavigationBag, NavigationFilter, NavigationSetting, Played,
    Progress, ScoredNavigation, Trace, files, navigation_json, navigation_parameters, navigation_table,
    play_navigation, plot_navigation,
};
use bb_plot::Picture;
use clap::Args;
use std::path::{Path, PathBuf};

pub(crate) const EXAMPLES: &str =
    "Exit code: 0; 1 if a data set could not be evaluated to its end, or most of it was left out or
rejected; 2 for a wrong use.

Examples:
  bb eval navigation drive.mcap --truth /ground_truth --plot drive.svg
  bb eval navigation drive.mcap --mount gps=-0.4,0,1.6 --set heading=\"90 deg\" --start align
  bb eval navigation flight.mcap --relative-topic /vio/odometry --odometry-topic none --filter smoother
  bb eval navigation drives/kitti_s2 drives/kitti_s5 --filter eskf --json
  bb eval navigation flights/one --filter eskf-single --set gyroscope_noise=1e-3";

#[derive(Debug, Args)]
pub(crate) struct NavigationArguments {
    /// ROS 2 bags in MCAP, folders of them, or prefixes of CSV files: `folder/name` for `folder/name_imu.csv`,
    /// `folder/name_keyframes.csv` and the others.
    #[arg(value_name = "DATA", required_unless_present = "list")]
    data: Vec<PathBuf>,
    /// The filters: several with commas.
    #[arg(long = "filter", value_name = "NAME", value_delimiter = ',', default_value = NAVIGATION_FILTERS[0].name,
          value_parser = filter, long_help = filters_in_words())]
    filters: Vec<NavigationFilter>,
    /// The number of keyframes in a smoother's window.
    #[arg(long, value_name = "KEYFRAMES", default_value_t = 20,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(2..=1000))]
    window: usize,
    /// Sets a parameter, in SI or with a unit, instead of the data set's value.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<NavigationSetting>,
    /// Only prints the parameters, with defaults, ranges and units.
    #[arg(long)]
    list: bool,
    /// Prints an array of objects instead of the table.
    #[arg(long)]
    json: bool,
    /// Plots the track, errors, innovations, and errors by the age of poses to this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE", value_parser = picture)]
    plot: Option<PathBuf>,
    #[command(flatten)]
    bag: BagOptions,
}

fn filter(name: &str) -> Result<NavigationFilter, String> {
    let known = NAVIGATION_FILTERS.map(|filter| filter.name);
    let found = NAVIGATION_FILTERS.into_iter().find(|filter| filter.name == name);
    found.ok_or_else(|| format!("no filter `{name}`; {}", bb_eval::filters::near(name, &known)))
}

fn filters_in_words() -> String {
    let mut text = String::from("The filters: several with commas.\n");
    for filter in NAVIGATION_FILTERS {
        text += &format!("\n{}: {}", filter.name, filter.about);
    }
    text
}

fn picture(file: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(file);
    Picture::check(&file, "it")?;
    Ok(file)
}

/// What a path refers to.
enum Source {
    Set(Box<DataSet>),
    Bag(Box<NavigationBag>),
}

/// The results, and the faults.
#[derive(Default)]
struct Done {
    scores: Vec<ScoredNavigation>,
    drawn: Vec<Drawn>,
    notes: Vec<String>,
    faults: Vec<String>,
}

impl NavigationArguments {
    /// Returns the text to print, and whether every data set could be evaluated to its end. Notes and faults go to
    /// the error stream.
    pub(crate) fn run(&self) -> Result<(String, bool), String> {
        if self.list {
            return Ok((navigation_parameters(), true));
        }
        let mut done = Done::default();
        for path in &self.data {
            if is_prefix(path) {
                let source = DataSet::read(path).map(|data| Source::Set(Box::new(data)));
                self.evaluate(path, source, &mut done);
                continue;
            }
            for (file, found) in files::recordings(std::slice::from_ref(path)) {
                let bag = found.and_then(|()| NavigationBag::read(&file, &self.bag));
                let source = bag.map(|bag| Source::Bag(Box::new(bag)));
                self.evaluate(&file, source.map_err(|fault| format!("{}: {fault}", file.display())), &mut done);
            }
        }
        if let Some(plot) = &self.plot {
            match plot_navigation(plot, &done.drawn) {
                Ok(()) => eprintln!("plotted {}", plot.display()),
                Err(fault) => done.faults.push(fault),
            }
        }
        for note in &done.notes {
            eprintln!("note: {note}");
        }
        for fault in &done.faults {
            eprintln!("error: {fault}");
        }
        let text = if self.json { navigation_json(&done.scores)? } else { navigation_table(&done.scores) };
        Ok((text, done.faults.is_empty()))
    }

    fn evaluate(&self, file: &Path, source: Result<Source, String>, done: &mut Done) {
        let source = match source {
            Ok(source) => source,
            Err(fault) => return done.faults.push(fault),
        };
        if let Source::Bag(bag) = &source
            && let Some(broken) = bag.broken()
        {
            done.faults.push(format!("{}: {broken}; scored up to there", file.display()));
        }
        for filter in &self.filters {
            if let Err(fault) = self.evaluate_one(file, &source, filter, done) {
                let fault = format!("{}: {}: {fault}", file.display(), filter.name);
                done.faults.push(fault);
            }
        }
    }

    fn evaluate_one(
        &self,
        file: &Path,
        source: &Source,
        filter: &NavigationFilter,
        done: &mut Done,
    ) -> Result<(), String> {
        let made;
        let data = match source {
            Source::Set(data) => data,
            Source::Bag(bag) => {
                made = bag.data_set(&self.settings, filter.is_smoother())?;
                for note in &made.notes {
                    let note = format!("{}: {note}", file.display());
                    if !done.notes.contains(&note) {
                        done.notes.push(note);
                    }
                }
                // It is the same for all filters.
                for doubt in &made.doubts {
                    let doubt = format!("{}: {doubt}", file.display());
                    if !done.faults.contains(&doubt) {
                        done.faults.push(doubt);
                    }
                }
                &made.data
            }
        };
        let progress = Progress::new("evaluating", data.count() as u64);
        let mut trace = self.plot.is_some().then(Trace::default);
        let played = play_navigation(data, filter, &self.settings, self.window, trace.as_mut(), || progress.add(1));
        progress.finish();
        let Played { score, doubts } = played?;
        done.scores.push((file.to_owned(), filter.name, score));
        let named = |doubt| format!("{}: {}: {doubt}", file.display(), filter.name);
        done.faults.extend(doubts.into_iter().map(named));
        let name = format!("{}, {}", file.file_name().unwrap_or(file.as_os_str()).to_string_lossy(), filter.name);
        done.drawn.extend(trace.map(|trace| Drawn { name, trace }));
        Ok(())
    }
}

/// Whether a path is the prefix of CSV files, not a recording.
fn is_prefix(path: &Path) -> bool {
    let mut samples = path.as_os_str().to_owned();
    samples.push("_imu.csv");
    let is_recording = path.exists() || path.extension().is_some_and(|end| end == files::EXTENSION || end == "db3");
    Path::new(&samples).exists() || !is_recording
}
