//! `bb eval navigation`.

use bb_eval::{
    Align, BagOptions, DataSet, Disturbances, Drawn, Drive, NAVIGATION_FILTERS, NavigationBag, NavigationFilter,
    NavigationRun, NavigationSetting, Played, Progress, RobotFile, RobotSettings, ScoredNavigation, StartFrom,
    export_navigation, exportable, files, navigation_json, navigation_table, play_navigation, plot_navigation,
};
use bb_plot::Picture;
use clap::Args;
use std::path::{Path, PathBuf};

pub(crate) const EXAMPLES: &str =
    "Exit code: 0; 1 if a recording could not be evaluated to its end, an option changed nothing, or most of a recording was
left out or refused; 2 for a wrong use.

Examples:
  bb eval navigation drive.mcap --truth /ground_truth --plot drive.svg
  bb eval navigation drive.mcap --mount gps=-0.4,0,1.6 --set heading=\"90 deg\" --every 4 --outage 30s/90s
  bb eval navigation drive.mcap --robot rover.toml --filter eskf,planar --align heading
  bb eval navigation flight.mcap --relative-topic /vio/odometry --odometry-topic none --filter state-smoother
  bb eval navigation drives/kitti_s2 drives/kitti_s5 --json";

#[derive(Debug, Args)]
pub(crate) struct NavigationArguments {
    /// ROS 2 bags in MCAP, folders of them, or prefixes of CSV files: `folder/name` for `folder/name_imu.csv`,
    /// `folder/name_keyframes.csv` and the others.
    #[arg(value_name = "DATA", required_unless_present = "list")]
    data: Vec<PathBuf>,
    /// The filters: several with commas.
    #[arg(long = "filter", value_name = "NAME", value_delimiter = ',', default_value = NAVIGATION_FILTERS[0].name,
          long_help = filters_in_words())]
    filters: Vec<NavigationFilter>,
    /// Takes the options of the filter from a settings file, as a robot writes it with `--list`; with `:PATH`, those of the
    /// estimator at that path.
    #[arg(long, value_name = "CONFIG.toml[:PATH]")]
    robot: Option<RobotFile>,
    /// Sets an option of the filter, as on the command line of a robot.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<NavigationSetting>,
    /// Multiplies the noise of the IMU that the filter assumes.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    noise_times: Option<f64>,
    /// Turns and moves the truth, whose world has axes and an origin of its own, to the estimates.
    #[arg(long, value_enum, default_value_t = Align::None)]
    align: Align,
    /// Only prints the options of the filters, with defaults, ranges and units, as a settings file.
    #[arg(long)]
    list: bool,
    /// Prints an array of objects instead of the table.
    #[arg(long)]
    json: bool,
    /// Plots the track, errors, innovations, and errors by the age of positions to this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE", value_parser = picture)]
    plot: Option<PathBuf>,
    /// Writes all estimates with their covariances beside the truth to this file, a CSV or an MCAP, and the instants of the truth
    /// that are compared between them.
    #[arg(long, value_name = "FILE", value_parser = exportable)]
    export: Option<PathBuf>,
    #[command(flatten)]
    disturbances: Disturbances,
    #[command(flatten)]
    bag: BagOptions,
}

fn factor(text: &str) -> Result<f64, String> {
    let factor: Option<f64> = text.parse().ok();
    factor
        .filter(|factor| (1e-6..=1e6).contains(factor) && *factor != 1.0)
        .ok_or_else(|| "write a factor from 1e-6 to 1e6 other than 1".to_owned())
}

fn filters_in_words() -> String {
    let mut text = String::from("The filters, each as a robot declares it: several with commas.\n");
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

/// Results so far, with notes and faults for the error stream.
#[derive(Default)]
struct Done {
    scores: Vec<ScoredNavigation>,
    drawn: Vec<Drawn>,
    notes: Vec<String>,
    faults: Vec<String>,
}

impl Done {
    /// Adds the lines of a file to a list, each once: many are the same for all filters.
    fn say(list: &mut Vec<String>, file: &Path, lines: Vec<String>) {
        for line in lines {
            let line = format!("{}: {line}", file.display());
            if !list.contains(&line) {
                list.push(line);
            }
        }
    }
}

impl NavigationArguments {
    /// Returns the text to print, and whether all went well. Notes and faults go to the error stream.
    pub(crate) fn run(&self) -> Result<(String, bool), String> {
        if self.list {
            let options: Vec<String> = self.filters.iter().map(NavigationFilter::options).collect();
            return Ok((options.join("\n"), true));
        }
        let mut done = Done::default();
        for path in &self.data {
            if is_prefix(path) {
                let drive = DataSet::read(path).map(|data| self.started(data.drive()));
                self.evaluate(path, drive, &mut done);
                continue;
            }
            for (file, found) in files::recordings(std::slice::from_ref(path)) {
                let bag = found.and_then(|()| NavigationBag::read(&file, &self.bag));
                if let Some(broken) = bag.as_ref().ok().and_then(NavigationBag::broken) {
                    done.faults.push(format!("{}: {broken}; scored up to there", file.display()));
                }
                let drive = bag.and_then(|bag| bag.drive());
                self.evaluate(&file, drive.map_err(|fault| format!("{}: {fault}", file.display())), &mut done);
            }
        }
        if let Some(plot) = &self.plot {
            match plot_navigation(plot, &done.drawn) {
                Ok(()) => eprintln!("plotted {}", plot.display()),
                Err(fault) => done.faults.push(fault),
            }
        }
        if let Some(export) = &self.export {
            match export_navigation(export, &done.drawn) {
                Ok(rows) => eprintln!("wrote {rows} estimates to {}", export.display()),
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

    /// Removes the start that a data set has, if `--start own` asks for that.
    fn started(&self, drive: Drive) -> Drive {
        match self.bag.start {
            Some(StartFrom::Own) => drive.without_start(),
            _ => drive,
        }
    }

    fn evaluate(&self, file: &Path, drive: Result<Drive, String>, done: &mut Done) {
        let drive = match drive {
            Ok(drive) => drive,
            Err(fault) => return done.faults.push(fault),
        };
        for filter in &self.filters {
            let progress = Progress::new("evaluating", drive.samples());
            let played = self.settings(filter).and_then(|settings| {
                let run = NavigationRun {
                    settings,
                    disturbances: self.disturbances.clone(),
                    align: self.align,
                    keep_trace: self.plot.is_some() || self.export.is_some(),
                };
                play_navigation(&drive, filter, &run, || progress.add(1))
            });
            progress.finish();
            let Played { score, notes, doubts, trace } = match played {
                Ok(played) => played,
                Err(fault) => {
                    done.faults.push(format!("{}: {}: {fault}", file.display(), filter.name));
                    continue;
                }
            };
            Done::say(&mut done.notes, file, notes);
            Done::say(&mut done.faults, file, doubts);
            done.scores.push((file.to_owned(), filter.name, score));
            let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
            done.drawn.extend(trace.map(|trace| Drawn { name: format!("{name}, {}", filter.name), trace }));
        }
    }

    fn settings(&self, filter: &NavigationFilter) -> Result<RobotSettings, String> {
        RobotSettings::new(filter, self.robot.as_ref(), &self.settings, self.noise_times)
    }
}

/// Returns whether a path is the prefix of CSV files, not a recording.
fn is_prefix(path: &Path) -> bool {
    let mut samples = path.as_os_str().to_owned();
    samples.push("_imu.csv");
    let is_recording = path.exists() || path.extension().is_some_and(|end| end == files::EXTENSION || end == "db3");
    Path::new(&samples).exists() || !is_recording
}
