//! The command line.

use crate::calibrate::Calibrate;
use crate::commands;
use crate::families::{self, FamiliesArguments};
use crate::live;
use crate::navigation::{self, NavigationArguments};
use crate::noise::{self, NoiseArguments};
use bb_estimators::attitude::FilterParams;
use bb_eval::Evaluator;
use bb_eval::{Align, Axes, Chosen, Declination, Disturbances, Mount, Origin, RobotFile, Setting};
use bb_eval::{Field, Offset, Starts, Variants};
use bb_eval::{MovingTopic, Topics};
use bb_eval::{files, filters};
use bb_plot::Picture;
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Inspects, plots and converts recordings, scores filters on them, and shows running robots.
#[derive(Debug, Parser)]
#[command(name = "bb", version)]
struct Bb {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    #[command(flatten)]
    Other(commands::Command),
    #[command(flatten)]
    Live(live::LiveCommand),
    /// Scores algorithms on recordings.
    Eval {
        #[command(subcommand)]
        what: Eval,
    },
    /// Calibrates sensors from a recording.
    Calibrate {
        #[command(subcommand)]
        what: Calibrate,
    },
}

#[derive(Debug, Subcommand)]
enum Eval {
    /// Runs attitude filters on recordings and prints their errors against the truth.
    #[command(after_help = EXAMPLES)]
    Attitude(Box<AttitudeArguments>),
    /// Compares attitude filters on families of motions, fields and faults, recorded and simulated, with VQF.
    #[command(after_help = families::EXAMPLES)]
    Families(Box<FamiliesArguments>),
    /// Runs navigation filters on drives and flights and prints their errors against the truth.
    #[command(after_help = navigation::EXAMPLES)]
    Navigation(Box<NavigationArguments>),
    /// Finds the noise of an IMU from recordings at rest, by its Allan deviation.
    #[command(after_help = noise::EXAMPLES)]
    Noise(Box<NoiseArguments>),
}

const EXAMPLES: &str = "Exit code: 0; 1 if a recording could not be evaluated to its end; 2 for a wrong use.

Examples:
  bb eval attitude walk.mcap
  bb eval attitude recordings/ --filter mekf,madgwick --axes 6 --plot errors.svg
  bb eval attitude walk.mcap --filter madgwick --set beta=0.05 --json
  bb eval attitude walk.mcap --filter mekf,vqf --start random:8 --offset 30uT:4
  bb eval attitude walk.mcap --filter mekf --robot rover.toml --outage 20s/60s --export walk.csv";

#[derive(Debug, Args)]
struct AttitudeArguments {
    /// ROS 2 bags in MCAP, or folders of them.
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The filters, or `all`.
    #[arg(long = "filter", value_name = "NAME", num_args = 1.., value_delimiter = ',', default_value = "all",
          long_help = filters::described())]
    filters: Vec<String>,
    /// Gyroscope and accelerometer only, or the magnetometer as well. With six axes only the inclination counts.
    #[arg(long, value_enum, default_value_t = Axes::Nine)]
    axes: Axes,
    /// Sets a parameter, in SI or with a unit, for all chosen filters that have it; FILTER.NAME=VALUE for one filter.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<Setting>,
    /// Takes the options of the filter from a settings file, as a robot writes it with `--list`; with `:PATH`, those of the
    /// estimator at that path. Needs --filter.
    #[arg(long, value_name = "CONFIG.toml[:PATH]")]
    robot: Option<RobotFile>,
    /// Only prints the parameters of the chosen filters, with defaults, ranges and units.
    #[arg(long)]
    list: bool,
    /// Starts the filters this many seconds before the first motion, instead of at the first sample.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    start_before_motion: Option<f64>,
    /// Starts the filters COUNT times at random in the first 60 % of the motion.
    #[arg(long, value_name = "random:COUNT", conflicts_with = "start_before_motion")]
    start: Option<Starts>,
    /// Adds a constant field to the magnetometer, in each of COUNT random directions, as 30uT:4.
    #[arg(long, value_name = "FIELD:COUNT")]
    offset: Option<Offset>,
    /// Attaches a magnet to the body 4 s before the first motion and removes it 55 s after, as 30uT.
    #[arg(long, value_name = "FIELD")]
    magnet: Option<Field>,
    /// Disturbs the field in the world for 1 to 3 s at a time, 2 to 8 s apart. Needs the truth.
    #[arg(long, value_name = "FIELD")]
    disturb: Option<Field>,
    /// Varies the field in the world slowly, as a sine with a period of 60 to 120 s. Needs the truth.
    #[arg(long, value_name = "FIELD")]
    drift: Option<Field>,
    /// The seed of all random numbers; the same seed gives the same figures.
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// The topic of the IMU, if there are several (sensor_msgs/Imu).
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    /// The topic of the magnetometer, if there are several (sensor_msgs/MagneticField).
    #[arg(long, value_name = "TOPIC")]
    mag_topic: Option<String>,
    /// The topic of the true orientation, if there are several (geometry_msgs/PoseStamped), or if it is nav_msgs/Odometry.
    #[arg(long, alias = "truth-topic", value_name = "TOPIC")]
    truth: Option<String>,
    /// The place of a frame on the robot, m and degrees: FRAME=X,Y,Z,ROLL,PITCH,YAW, over those of /tf_static. FRAME may be the
    /// topic of a sensor, that of the IMU or of the truth. TOPIC=FRAME sets the frame that a topic is about.
    #[arg(long, value_name = "FRAME=…", allow_hyphen_values = true)]
    mount: Vec<Mount>,
    /// Turns the truth, whose world has axes of its own, to the estimates of each filter.
    #[arg(long, value_enum, default_value_t = Align::None)]
    align: Align,
    /// The angle from true north, to which the truth refers, to magnetic north, in degrees, positive to the east; `auto` takes
    /// that of the World Magnetic Model at the first fix, or at --origin. Default: 0.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    declination: Option<Declination>,
    /// The place for `--declination auto`, in degrees and m above the ellipsoid. Default: that of the first fix.
    #[arg(long, value_name = "LATITUDE,LONGITUDE,HEIGHT", allow_hyphen_values = true, requires = "declination")]
    origin: Option<Origin>,
    /// The topic that says whether the body moves, if there are several (std_msgs/Bool); `none` scores the whole recording.
    #[arg(long, value_name = "TOPIC")]
    moving_topic: Option<String>,
    /// Prints an array of objects instead of the table.
    #[arg(long)]
    json: bool,
    /// Plots the errors over time to this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Writes the estimates with their covariances beside the truth to this file, a CSV or an MCAP; with --declination, both to true
    /// north.
    #[arg(long, value_name = "FILE", value_parser = bb_eval::exportable)]
    export: Option<PathBuf>,
    #[command(flatten)]
    disturbances: Disturbances,
}

/// The requested work.
#[derive(Debug)]
pub(crate) enum Job {
    Attitude(Box<Attitude>),
    Families(Box<FamiliesArguments>),
    Navigation(Box<NavigationArguments>),
    Noise(Box<NoiseArguments>),
    Calibrate(Calibrate),
    /// Prints this.
    Print(String),
    Other(commands::Command),
    Live(live::LiveCommand),
}

/// `bb eval attitude`.
#[derive(Debug)]
pub(crate) struct Attitude {
    pub(crate) paths: Vec<PathBuf>,
    pub(crate) evaluator: Evaluator,
    pub(crate) json: bool,
    pub(crate) plot: Option<PathBuf>,
    pub(crate) export: Option<PathBuf>,
}

/// Parses the command line. The error contains the text to print and the exit code, which is 0 for `--help`.
pub(crate) fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Job, clap::Error> {
    let what = match Bb::try_parse_from(arguments)?.command {
        Command::Eval { what } => what,
        Command::Other(command) => return Ok(Job::Other(command)),
        Command::Live(command) => return Ok(Job::Live(command)),
        Command::Calibrate { what } => return Ok(Job::Calibrate(what)),
    };
    let arguments = match what {
        Eval::Attitude(arguments) => arguments,
        Eval::Families(arguments) => return Ok(Job::Families(arguments)),
        Eval::Navigation(arguments) => return Ok(Job::Navigation(arguments)),
        Eval::Noise(arguments) => return Ok(Job::Noise(arguments)),
    };
    arguments.check().map_err(|(kind, fault)| {
        let mut bb = Bb::command();
        bb.build();
        let attitude = bb.find_subcommand_mut("eval").and_then(|eval| eval.find_subcommand_mut("attitude"));
        match attitude {
            Some(attitude) => attitude.error(kind, fault),
            None => bb.error(kind, fault),
        }
    })
}

impl AttitudeArguments {
    fn check(mut self) -> Result<Job, (ErrorKind, String)> {
        let invalid = |fault: String| (ErrorKind::ValueValidation, fault);
        let filters = self.filters().map_err(invalid)?;
        if self.list {
            return Ok(Job::Print(filters::listed(&filters)));
        }
        if self.files.is_empty() {
            let fault = "no recording is named; name bags (.mcap) or folders of them";
            return Err((ErrorKind::MissingRequiredArgument, fault.into()));
        }
        if let Some(seconds) = self.start_before_motion
            && !(0.0..=1e6).contains(&seconds)
        {
            return Err(invalid(format!("--start-before-motion is {seconds}, but must be in 0..=1000000 s")));
        }
        if self.origin.is_some() && self.declination != Some(Declination::Auto) {
            return Err(invalid("--origin changes nothing without --declination auto".to_owned()));
        }
        for (option, is_given) in
            [("--mag-topic", self.mag_topic.is_some()), ("--declination", self.declination.is_some())]
        {
            if is_given && self.axes == Axes::Six {
                return Err(invalid(format!("{option} changes nothing with --axes 6")));
            }
        }
        if let Some(plot) = &self.plot {
            Picture::check(plot, "--plot").map_err(invalid)?;
        }
        if let Some(robot) = &self.robot {
            if filters.len() > 1 {
                return Err(invalid("--robot gives the options of one filter; name it with --filter".to_owned()));
            }
            for filter in &filters {
                let mut settings = Setting::of_robot(filter, robot).map_err(invalid)?;
                settings.append(&mut self.settings);
                self.settings = settings;
            }
        }
        let twice = self.settings.iter().find(|setting| setting.name() == "declination");
        if let Some(setting) = twice.filter(|_| self.declination.is_some()) {
            return Err(invalid(format!("{setting}, and --declination: give it once")));
        }
        let variants = Variants {
            starts: self.start,
            offset: self.offset,
            magnet: self.magnet,
            disturb: self.disturb,
            drift: self.drift,
            seed: self.seed,
        };
        variants.check(self.axes).map_err(invalid)?;
        let evaluator = Evaluator {
            filters: Chosen::all(&filters, self.axes, &self.settings).map_err(invalid)?,
            axes: self.axes,
            topics: Topics {
                imu: self.imu_topic,
                magnetometer: self.mag_topic,
                truth: self.truth,
                moving: match self.moving_topic {
                    None => MovingTopic::ByType,
                    Some(none) if none == "none" => MovingTopic::None,
                    Some(name) => MovingTopic::Named(name),
                },
                mounts: self.mount,
                declination: self.declination.unwrap_or_default(),
                origin: self.origin,
            },
            align: self.align,
            before_motion_s: self.start_before_motion,
            variants,
            disturbances: self.disturbances,
            without: Chosen::without_each(&filters, self.axes, &self.settings).map_err(invalid)?,
            keep_trace: self.plot.is_some() || self.export.is_some(),
        };
        let (json, plot, export) = (self.json, self.plot, self.export);
        let attitude = Attitude { paths: self.files, evaluator, json, plot, export };
        Ok(Job::Attitude(Box::new(attitude)))
    }

    /// The chosen filters, in the order of the table. A path that follows `--filter` is a recording.
    fn filters(&mut self) -> Result<Vec<FilterParams>, String> {
        let is_recording = |name: &str| {
            let path = Path::new(name);
            path.extension().is_some_and(|end| end == files::EXTENSION) || path.exists()
        };
        let filters = || FilterParams::ALL.iter().map(|default| default());
        let known: Vec<_> = filters().map(|filter| filter.name()).chain(["all"]).collect();
        let mut named = Vec::new();
        for name in std::mem::take(&mut self.filters) {
            if known.contains(&&*name) {
                named.push(name);
            } else if is_recording(&name) {
                self.files.push(name.into());
            } else {
                return Err(format!("no filter `{name}`; {}", filters::near(&name, &known)));
            }
        }
        let all = named.iter().any(|name| name == "all");
        let is_chosen = |filter: &FilterParams| match all {
            // Six-axis filters are left out when there are nine axes.
            true => self.axes.suit(filter),
            false => named.iter().any(|name| name == filter.name()),
        };
        Ok(filters().filter(is_chosen).collect())
    }
}
