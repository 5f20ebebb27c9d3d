//! The output and the plot of `bb calibrate imu`.

use super::Calibration;
use bb_core::nalgebra::{Matrix3, Vector3};
use bb_estimators::attitude::ImuSample;
use bb_estimators::calibration::{AccelerometerFit, GyroscopeFit, MagnetometerFit, Model};
use bb_plot::{Line, Panel, Picture};
use std::fmt::Write;
use std::path::Path;

/// `key = value` lines, which are TOML and options of `robot!`, with their uncertainty in comments.
pub(super) fn text(file: &Path, calibration: &Calibration) -> String {
    let rests = &calibration.rests;
    let seconds: f64 = rests.iter().map(|rest| (rest.end_ns - rest.start_ns) as f64 * 1e-9).sum();
    let mut text = format!("# {}: {} rests, {seconds:.1} s together\n", file.display(), rests.len());
    match &calibration.gyroscope {
        Ok(fit) => gyroscope(&mut text, fit),
        Err(error) => missing(&mut text, "gyroscope", &error.to_string()),
    }
    match &calibration.accelerometer {
        Ok(fit) => accelerometer(&mut text, fit),
        Err(error) => missing(&mut text, "accelerometer", &error.to_string()),
    }
    match &calibration.magnetometer {
        Some(Ok(fit)) => magnetometer(&mut text, fit),
        Some(Err(error)) => missing(&mut text, "magnetometer", &error.to_string()),
        None => missing(&mut text, "magnetometer", "no field was recorded"),
    }
    text
}

fn missing(text: &mut String, sensor: &str, why: &str) {
    let _ = writeln!(text, "\n# {sensor}: not calibrated: {why}");
}

fn gyroscope(text: &mut String, fit: &GyroscopeFit) {
    let GyroscopeFit { offset, deviation, residual } = fit;
    let _ = writeln!(text, "\n# rad/s, known to {}; rests differ by {residual:.1e}", vector(deviation, 1));
    let _ = writeln!(text, "gyroscope_offset = {}", vector(offset, 5));
}

fn accelerometer(text: &mut String, fit: &AccelerometerFit) {
    let model = match fit.model {
        Model::Scale => "offset and scale; misalignment takes nine directions",
        Model::ScaleAndMisalignment => "offset, scale and misalignment",
    };
    let _ = writeln!(
        text,
        "\n# {model}, from {} directions\n# m/s², known to {}; the norm at rest misses gravity by {:.4} m/s², before by {:.4}",
        fit.directions,
        vector(&fit.offset_deviation, 1),
        fit.residual,
        fit.residual_before
    );
    let _ = writeln!(text, "accelerometer_offset = {}", vector(&fit.calibration.offset, 5));
    let _ = writeln!(text, "# known to {:.1e}", fit.matrix_deviation.max());
    let _ = writeln!(text, "accelerometer_matrix = {}", matrix(&fit.calibration.matrix));
}

fn magnetometer(text: &mut String, fit: &MagnetometerFit) {
    let _ = writeln!(
        text,
        "\n# T, known to {}; the norm misses {:.2e} T by {:.1e}, before by {:.1e}",
        vector(&fit.offset_deviation, 1),
        fit.norm,
        fit.residual,
        fit.residual_before
    );
    let _ = writeln!(text, "magnetometer_offset = {}", vector(&fit.calibration.offset, 5));
    let _ = writeln!(text, "# known to {:.1e}", fit.matrix_deviation.max());
    let _ = writeln!(text, "magnetometer_matrix = {}", matrix(&fit.calibration.matrix));
}

fn vector(vector: &Vector3<f64>, digits: usize) -> String {
    format!("[{:.digits$e}, {:.digits$e}, {:.digits$e}]", vector.x, vector.y, vector.z)
}

fn matrix(matrix: &Matrix3<f64>) -> String {
    let row = |row: usize| format!("[{:.7}, {:.7}, {:.7}]", matrix[(row, 0)], matrix[(row, 1)], matrix[(row, 2)]);
    format!("[{}, {}, {}]", row(0), row(1), row(2))
}

const MEASURED: (u8, u8, u8) = (230, 150, 30);
const CALIBRATED: (u8, u8, u8) = (0, 80, 170);
const WANTED: (u8, u8, u8) = (110, 110, 110);

/// Norms over time, measured, calibrated and expected.
pub(super) fn picture(file: &Path, samples: &[ImuSample], calibration: &Calibration, gravity: f64) -> Picture {
    let start_ns = samples.first().map_or(0, |sample| sample.time_ns);
    let seconds = |time_ns: i64| time_ns.saturating_sub(start_ns) as f64 * 1e-9;
    let mut panels = Vec::new();
    // One point per rest, at its middle: between rests the norm includes the acceleration of the motion.
    let rests = |norm: &dyn Fn(&Vector3<f64>) -> f64| -> Vec<(f64, Option<f64>)> {
        let rests = calibration.rests.iter();
        rests.map(|rest| (seconds(rest.start_ns / 2 + rest.end_ns / 2), Some(norm(&rest.force)))).collect()
    };
    let mut lines = vec![
        Line::new("gravity", WANTED, 1, &rests(&|_| gravity)),
        Line::new("measured", MEASURED, 3, &rests(&|force| force.norm())),
    ];
    if let Ok(fit) = &calibration.accelerometer {
        lines.push(Line::new("calibrated", CALIBRATED, 3, &rests(&|force| fit.calibration.apply(force).norm())));
    }
    panels.push(Panel::new("specific force at rest (m/s²)", lines));
    if let Some(magnetometer) = &calibration.magnetometer {
        let fields = |norm: &dyn Fn(&Vector3<f64>) -> f64| -> Vec<(f64, Option<f64>)> {
            let fields = samples.iter().filter_map(|sample| Some((sample.time_ns, sample.magnetic_field?)));
            fields.map(|(time_ns, field)| (seconds(time_ns), Some(norm(&field) * 1e6))).collect()
        };
        let mut lines = vec![Line::new("measured", MEASURED, 1, &fields(&|field| field.norm()))];
        if let Ok(fit) = magnetometer {
            lines.push(Line::new(
                "calibrated",
                CALIBRATED,
                1,
                &fields(&|field| fit.calibration.apply(field).norm()),
            ));
        }
        panels.push(Panel::new("magnetic field (µT)", lines));
    }
    Picture { title: format!("Calibration by {}", file.display()), panels, panel_size: (1400, 320) }
}
