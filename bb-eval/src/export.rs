//! `--export`: estimates with their covariances beside the truth, as a CSV or an MCAP.

use crate::evaluate::{Estimate, Evaluation, Run};
use crate::navigation::{Drawn, Row};
use crate::report::name;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::payload::{Odometry, Orientation, Pose, Twist};
use bb_core::prelude::*;
use bb_core::time::WallTime;
use bb_mcap::{BagWriter, RecorderOptions, RecordingError};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes the estimates of navigation filters with their covariances beside the truth, as a CSV, or else as an MCAP: all of them,
/// and the instants that are compared between them. Returns how many.
///
/// # Errors
/// The file cannot be written.
pub fn export_navigation(file: &Path, runs: &[Drawn]) -> Result<usize, String> {
    let rows = |run: &Drawn| run.trace.rows.iter().map(|row| (time_ns(run, row), *row)).collect();
    let runs: Vec<_> = runs.iter().map(|run| (run.name.clone(), rows(run))).collect();
    export(file, &runs)
}

fn time_ns(run: &Drawn, row: &Row) -> i64 {
    (row.time_s * 1e9) as i64 + run.trace.first_ns
}

/// Writes the estimates of attitude filters with their covariances, as far as they report them, beside the truth, at each
/// sample of the IMU. Returns how many.
///
/// # Errors
/// The file cannot be written.
pub fn export_attitude(file: &Path, evaluations: &[Evaluation]) -> Result<usize, String> {
    let rows = |run: &Run| run.estimates.iter().map(|row| (row.time_ns, *row)).collect();
    let of_one = |evaluation: &Evaluation| -> Vec<(String, Vec<(i64, Estimate)>)> {
        let name = name(evaluation, evaluations);
        evaluation.runs.iter().flatten().map(|run| (format!("{name}, {}", run.filter), rows(run))).collect()
    };
    export(file, &evaluations.iter().flat_map(of_one).collect::<Vec<_>>())
}

/// An estimate beside the truth.
trait Exported {
    /// The columns after the run, but for those of the covariance.
    const HEAD: &'static str;
    /// Rows of the covariance.
    const DIMENSION: usize;

    fn time_s(&self) -> f64;

    /// Writes the cells of `HEAD` after the time.
    fn cells(&self, text: &mut String);

    fn covariance(&self, row: usize, column: usize) -> f64;

    /// Writes the estimate, and to another topic the truth.
    fn messages(
        &self,
        time_ns: i64,
        topic: &str,
        truth: Option<&str>,
        writer: &mut BagWriter,
    ) -> Result<(), RecordingError>;
}

/// Checks before a run whether estimates can be written to this file.
///
/// # Errors
/// It is neither a CSV nor an MCAP.
pub fn exportable(file: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(file);
    match file.extension().and_then(|end| end.to_str()) {
        Some("csv" | "mcap") => Ok(file),
        _ => Err("write to a file that ends in .csv or .mcap".to_owned()),
    }
}

/// Writes runs, each with its name and its estimates by time.
fn export<T: Exported>(file: &Path, runs: &[(String, Vec<(i64, T)>)]) -> Result<usize, String> {
    let written = match file.extension().and_then(|end| end.to_str()) {
        Some("csv") => std::fs::write(file, csv(runs)).map_err(|error| error.to_string()),
        _ => mcap(file, runs).map_err(|error| error.kind().to_string()),
    };
    written.map_err(|fault| format!("{}: {fault}", file.display()))?;
    Ok(runs.iter().map(|(_, rows)| rows.len()).sum())
}

fn csv<T: Exported>(runs: &[(String, Vec<(i64, T)>)]) -> String {
    let mut text = format!("run,t_s,{}", T::HEAD);
    // The upper triangle.
    let upper = || (0..T::DIMENSION).flat_map(|row| (row..T::DIMENSION).map(move |column| (row, column)));
    for (row, column) in upper() {
        let _ = write!(text, ",p{row}{column}");
    }
    text.push('\n');
    for (name, rows) in runs {
        for (_, estimate) in rows {
            let _ = write!(text, "\"{}\",{:?}", name.replace('"', "'"), estimate.time_s());
            estimate.cells(&mut text);
            for (row, column) in upper() {
                let _ = write!(text, ",{:?}", estimate.covariance(row, column));
            }
            text.push('\n');
        }
    }
    text
}

/// A topic of estimates a run, and one of the truth.
fn mcap<T: Exported>(file: &Path, runs: &[(String, Vec<(i64, T)>)]) -> Result<(), RecordingError> {
    let mut writer = BagWriter::create(file, &RecorderOptions::default())?;
    let mut messages: Vec<(i64, usize, &T)> = Vec::new();
    for (index, (_, rows)) in runs.iter().enumerate() {
        messages.extend(rows.iter().map(|(time_ns, estimate)| (*time_ns, index, estimate)));
    }
    messages.sort_by_key(|(time_ns, ..)| *time_ns);
    for (time_ns, index, estimate) in messages {
        let topic = if runs.len() == 1 { "/estimate".to_owned() } else { format!("/estimate/{index}") };
        estimate.messages(time_ns, &topic, (index == 0).then_some("/truth"), &mut writer)?;
    }
    writer.finish().map(drop)
}

fn vector(text: &mut String, vector: Option<Vector3<f64>>) {
    let vector = vector.unwrap_or_else(|| Vector3::repeat(f64::NAN));
    let _ = write!(text, ",{:?},{:?},{:?}", vector.x, vector.y, vector.z);
}

fn rotation(text: &mut String, rotation: Option<UnitQuaternion<f64>>) {
    let [w, i, j, k] = rotation.map_or([f64::NAN; 4], |of| [of.w, of.i, of.j, of.k]);
    let _ = write!(text, ",{w:?},{i:?},{j:?},{k:?}");
}

/// Position, then rotation about the axes of the world. `nav_msgs/Odometry`, and `geometry_msgs/PoseStamped`.
impl Exported for Row {
    const HEAD: &'static str = "x,y,z,qw,qx,qy,qz,vx,vy,vz,true_x,true_y,true_z,true_qw,true_qx,true_qy,true_qz";
    const DIMENSION: usize = 6;

    fn time_s(&self) -> f64 {
        self.time_s
    }

    fn cells(&self, text: &mut String) {
        vector(text, Some(self.known.position));
        rotation(text, Some(self.known.world_from_body));
        vector(text, Some(self.known.velocity));
        vector(text, self.truth.map(|truth| truth.position));
        rotation(text, self.truth.and_then(|truth| truth.world_from_body));
    }

    fn covariance(&self, row: usize, column: usize) -> f64 {
        self.known.covariance[(row, column)]
    }

    fn messages(
        &self,
        time_ns: i64,
        topic: &str,
        truth: Option<&str>,
        writer: &mut BagWriter,
    ) -> Result<(), RecordingError> {
        let known = &self.known;
        let pose = Pose {
            position: known.position,
            world_from_body: known.world_from_body,
            covariance: Some(known.covariance),
        };
        let linear = known.world_from_body.inverse() * known.velocity;
        let twist = Twist { linear, angular: Vector3::zeros(), covariance: None };
        writer.payload(topic, &stamped(time_ns, Odometry { pose, twist }))?;
        if let Some((topic, truth)) = truth.zip(self.truth) {
            let world_from_body = truth.world_from_body.unwrap_or_else(UnitQuaternion::identity);
            let pose = Pose { position: truth.position, world_from_body, covariance: None };
            writer.payload(topic, &stamped(time_ns, pose))?;
        }
        Ok(())
    }
}

/// Rotation about the axes of the world. `geometry_msgs/QuaternionStamped`; the truth as `geometry_msgs/PoseStamped`.
impl Exported for Estimate {
    const HEAD: &'static str = "qw,qx,qy,qz,true_qw,true_qx,true_qy,true_qz";
    const DIMENSION: usize = 3;

    fn time_s(&self) -> f64 {
        self.time_s
    }

    fn cells(&self, text: &mut String) {
        rotation(text, Some(self.world_from_body));
        rotation(text, self.truth);
    }

    fn covariance(&self, row: usize, column: usize) -> f64 {
        self.covariance.map_or(f64::NAN, |covariance| covariance[(row, column)])
    }

    fn messages(
        &self,
        time_ns: i64,
        topic: &str,
        truth: Option<&str>,
        writer: &mut BagWriter,
    ) -> Result<(), RecordingError> {
        // That of a payload is about the axes of the body.
        let body_from_world = self.world_from_body.inverse().to_rotation_matrix().into_inner();
        let covariance = self.covariance.map(|of| body_from_world * of * body_from_world.transpose());
        let world_from_body = self.world_from_body;
        writer.payload(topic, &stamped(time_ns, Orientation { world_from_body, covariance }))?;
        if let Some((topic, world_from_body)) = truth.zip(self.truth) {
            let pose = Pose { position: Vector3::zeros(), world_from_body, covariance: None };
            writer.payload(topic, &stamped(time_ns, pose))?;
        }
        Ok(())
    }
}

fn stamped<T: Payload>(time_ns: i64, payload: T) -> Stamped<T> {
    let mut message = Stamped::new(MonotonicTime::from_nanos(time_ns), payload);
    message.wall_time = WallTime::from_unix_nanos(time_ns);
    message
}
