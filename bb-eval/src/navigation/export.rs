//! `--export`: estimates with their covariances beside the truth.

use super::picture::Drawn;
use super::trace::Row;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::payload::{Odometry, Pose, Twist};
use bb_core::prelude::*;
use bb_core::time::WallTime;
use bb_mcap::{BagWriter, RecorderOptions};
use std::fmt::Write;
use std::path::Path;

/// Writes the estimates of runs with their covariances beside the truth: at each instant with truth, and between these at ten a
/// second. Returns how many.
///
/// # Errors
/// The file is neither a CSV nor an MCAP, or cannot be written.
pub fn export_navigation(file: &Path, runs: &[Drawn]) -> Result<usize, String> {
    let written = match file.extension().and_then(|end| end.to_str()) {
        Some("csv") => std::fs::write(file, csv(runs)).map_err(|error| error.to_string()),
        Some("mcap") => mcap(file, runs),
        _ => Err("write to a file that ends in .csv or .mcap".to_owned()),
    };
    written.map_err(|fault| format!("{}: {fault}", file.display()))?;
    Ok(runs.iter().map(|run| run.trace.rows.len()).sum())
}

const HEAD: &str = "run,t_s,x,y,z,qw,qx,qy,qz,vx,vy,vz,true_x,true_y,true_z,true_qw,true_qx,true_qy,true_qz";

fn csv(runs: &[Drawn]) -> String {
    let mut text = HEAD.to_owned();
    // The upper triangle: position, then rotation about the axes of the world.
    for i in 0..6 {
        for j in i..6 {
            let _ = write!(text, ",p{i}{j}");
        }
    }
    text.push('\n');
    let vector = |text: &mut String, vector: Option<Vector3<f64>>| {
        let vector = vector.unwrap_or_else(|| Vector3::repeat(f64::NAN));
        let _ = write!(text, ",{},{},{}", vector.x, vector.y, vector.z);
    };
    let rotation = |text: &mut String, rotation: Option<UnitQuaternion<f64>>| {
        let [w, i, j, k] = rotation.map_or([f64::NAN; 4], |of| [of.w, of.i, of.j, of.k]);
        let _ = write!(text, ",{w},{i},{j},{k}");
    };
    for run in runs {
        for row in &run.trace.rows {
            let _ = write!(text, "\"{}\",{}", run.name.replace('"', "'"), row.time_s);
            vector(&mut text, Some(row.known.position));
            rotation(&mut text, Some(row.known.world_from_body));
            vector(&mut text, Some(row.known.velocity));
            vector(&mut text, row.truth.map(|truth| truth.position));
            rotation(&mut text, row.truth.and_then(|truth| truth.world_from_body));
            for i in 0..6 {
                for j in i..6 {
                    let _ = write!(text, ",{}", row.known.covariance[(i, j)]);
                }
            }
            text.push('\n');
        }
    }
    text
}

/// A topic of estimates a run, `nav_msgs/Odometry`, and one of the truth, `geometry_msgs/PoseStamped`.
fn mcap(file: &Path, runs: &[Drawn]) -> Result<(), String> {
    let mut writer =
        BagWriter::create(file, &RecorderOptions::default()).map_err(|error| error.kind().to_string())?;
    let mut messages: Vec<(i64, usize, &Row)> = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        messages
            .extend(run.trace.rows.iter().map(|row| ((row.time_s * 1e9) as i64 + run.trace.first_ns, index, row)));
    }
    messages.sort_by_key(|(time, ..)| *time);
    for (time_ns, index, row) in messages {
        let topic = if runs.len() == 1 { "/estimate".to_owned() } else { format!("/estimate/{index}") };
        let fault = |error: bb_mcap::RecordingError| error.kind().to_string();
        let known = &row.known;
        let estimate = Odometry {
            pose: Pose {
                position: known.position,
                world_from_body: known.world_from_body,
                covariance: Some(known.covariance),
            },
            twist: Twist {
                linear: known.world_from_body.inverse() * known.velocity,
                angular: Vector3::zeros(),
                covariance: None,
            },
        };
        writer.payload(&topic, &stamped(time_ns, estimate)).map_err(fault)?;
        if let Some(truth) = row.truth.filter(|_| index == 0) {
            let world_from_body = truth.world_from_body.unwrap_or_else(UnitQuaternion::identity);
            let pose = Pose { position: truth.position, world_from_body, covariance: None };
            writer.payload("/truth", &stamped(time_ns, pose)).map_err(fault)?;
        }
    }
    writer.finish().map(drop).map_err(|error| error.kind().to_string())
}

fn stamped<T: Payload>(time_ns: i64, payload: T) -> Stamped<T> {
    let mut message = Stamped::new(MonotonicTime::from_nanos(time_ns), payload);
    message.wall_time = WallTime::from_unix_nanos(time_ns);
    message
}
