//! The output and the plot of `bb eval noise`.

use super::{AXES, Noise};
use bb_estimators::calibration::{Known, SensorNoise};
use bb_estimators::navigation::EskfParams;
use bb_plot::{Line, PALETTE, Part, Plane, Scale, Sheet};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// Colour of fitted lines.
const FITTED: (u8, u8, u8) = (150, 150, 150);

/// The numbers of an axis, in SI.
#[derive(Serialize)]
struct Axis {
    noise_density: f64,
    noise_density_deviation: f64,
    bias_instability: f64,
    bias_instability_time_s: f64,
    /// `true` if the curve rises again after its minimum; otherwise the bias instability is an upper limit.
    bias_instability_is_lowest: bool,
    random_walk: f64,
    random_walk_deviation: f64,
    random_walk_at_most: f64,
    /// Averaging time, Allan deviation, its relative error.
    allan: Vec<[f64; 3]>,
}

impl Axis {
    fn of(noise: &SensorNoise) -> Self {
        Self {
            noise_density: noise.density.value,
            noise_density_deviation: noise.density.deviation,
            bias_instability: noise.bias_instability,
            bias_instability_time_s: noise.bias_instability_time_s,
            bias_instability_is_lowest: noise.is_lowest,
            random_walk: noise.random_walk.value,
            random_walk_deviation: noise.random_walk.deviation,
            random_walk_at_most: noise.random_walk.at_most,
            allan: noise
                .curve
                .points()
                .iter()
                .map(|point| [point.time_s, point.deviation, point.relative_error])
                .collect(),
        }
    }
}

/// Options of the filters: those of the worst axis.
struct Options {
    gyroscope_noise: Option<f64>,
    accelerometer_noise: Option<f64>,
    /// Random walk of the gyroscope if one is seen; otherwise its upper limit, if that says more than the default.
    gyroscope_walk: Option<f64>,
    accelerometer_walk: Option<f64>,
}

impl Options {
    fn of(noise: &Noise) -> Self {
        let worst = |axes: std::ops::Range<usize>, of: &dyn Fn(&SensorNoise) -> f64| {
            let axes = noise.axes.get(axes).unwrap_or_default();
            let values: Option<Vec<_>> = axes.iter().map(|axis| axis.as_ref().ok().map(of)).collect();
            values.and_then(|values| values.into_iter().reduce(f64::max))
        };
        let walk = |axes: std::ops::Range<usize>, default: f64| {
            let seen =
                worst(axes.clone(), &|axis| if is_seen(&axis.random_walk) { axis.random_walk.value } else { 0.0 })?;
            if seen > 0.0 {
                Some(seen)
            } else {
                worst(axes, &|axis| axis.random_walk.at_most).filter(|most| *most < default)
            }
        };
        let EskfParams { gyroscope_bias_walk, accelerometer_bias_walk, .. } = EskfParams::default();
        Self {
            gyroscope_noise: worst(0..3, &|axis| axis.density.value),
            accelerometer_noise: worst(3..6, &|axis| axis.density.value),
            gyroscope_walk: walk(0..3, gyroscope_bias_walk),
            accelerometer_walk: walk(3..6, accelerometer_bias_walk),
        }
    }

    /// Returns the values by the names of the options of `Eskf`; in rad/s, m/s² and roots of Hz.
    fn named(&self) -> [(&'static str, Option<f64>); 4] {
        [
            ("gyroscope_noise", self.gyroscope_noise),
            ("accelerometer_noise", self.accelerometer_noise),
            ("gyroscope_bias_walk", self.gyroscope_walk),
            ("accelerometer_bias_walk", self.accelerometer_walk),
        ]
    }
}

/// Returns whether the random walk differs from zero by more than two standard deviations.
fn is_seen(walk: &Known) -> bool {
    walk.value > 0.0 && walk.value > 2.0 * walk.deviation
}

pub(super) fn json(found: &[Noise]) -> Result<String, String> {
    let object = |noise: &Noise| {
        let axes = |range: std::ops::Range<usize>| -> Map<String, Value> {
            let named = ["x", "y", "z"].into_iter().zip(noise.axes.get(range).unwrap_or_default());
            named.map(|(name, axis)| (name.to_owned(), json!(axis.as_ref().ok().map(Axis::of)))).collect()
        };
        let options: Map<String, Value> = Options::of(noise)
            .named()
            .into_iter()
            .map(|(name, value, ..)| (name.to_owned(), json!(value)))
            .collect();
        json!({
            "file": noise.file.display().to_string(),
            "from_s": noise.still.from_s,
            "seconds": noise.still.seconds,
            "at_rest_by": noise.still.by,
            "rate_hz": 1.0 / noise.still.period_s,
            "gyroscope": axes(0..3),
            "accelerometer": axes(3..6),
            "options": options,
            "warnings": noise.still.warnings,
        })
    };
    let objects: Vec<_> = found.iter().map(object).collect();
    Ok(serde_json::to_string_pretty(&objects).map_err(|error| error.to_string())? + "\n")
}

pub(super) fn text(found: &[Noise]) -> String {
    let mut text = String::new();
    for noise in found {
        let still = &noise.still;
        let (file, rate) = (noise.file.display(), 1.0 / still.period_s);
        let by = if still.by.is_empty() {
            "the IMU alone".to_owned()
        } else {
            format!("the IMU and {}", still.by.join(", "))
        };
        let _ = writeln!(text, "# {file}: {:.1} s at rest by {by}, {rate:.1} Hz", still.seconds);
        for (name, axis) in AXES.iter().zip(&noise.axes) {
            let Ok(axis) = axis else {
                let _ = writeln!(text, "# {name}: none");
                continue;
            };
            let (unit, squared) = if name.starts_with('g') { ("rad/s", "rad/s²") } else { ("m/s²", "m/s³") };
            let SensorNoise { density, random_walk, .. } = axis;
            let part = 100.0 * density.deviation / density.value;
            let limit = if axis.is_lowest { "" } else { "at most " };
            let walk = if is_seen(random_walk) {
                format!(
                    "{:.2e} {squared}/√Hz ±{:.0} %",
                    random_walk.value,
                    100.0 * random_walk.deviation / random_walk.value
                )
            } else {
                format!("not seen, at most {:.1e} {squared}/√Hz", random_walk.at_most)
            };
            let _ = writeln!(
                text,
                "# {name}: {:.3e} {unit}/√Hz ±{part:.1} %; bias instability {limit}{:.2e} {unit} at {:.3} s; random walk {walk}",
                density.value, axis.bias_instability, axis.bias_instability_time_s
            );
        }
        text += "\n# of the worst axis, at rest; not for a vehicle: there, vibration makes the noise 10 to 100 times as much\n";
        let options = Options::of(noise).named();
        let written = options.iter().filter_map(|(name, value)| Some(format!("{name} = {:.2e}", (*value)?)));
        let _ = writeln!(text, "Eskf({})", written.collect::<Vec<_>>().join(", "));
        text.push('\n');
    }
    text
}

/// Prints faults to the error stream; returns whether noise was found for all axes.
pub(super) fn complain(noise: &Noise) -> bool {
    let file = noise.file.display();
    for warning in &noise.still.warnings {
        eprintln!("warning: {file}: {warning}");
    }
    let mut is_whole = true;
    for (name, axis) in AXES.iter().zip(&noise.axes) {
        if let Err(error) = axis {
            eprintln!("error: {file}: {name}: {error}");
            is_whole = false;
        }
    }
    is_whole
}

/// A plane for the gyroscope and one for the accelerometer of each recording.
pub(super) fn picture(found: &[Noise]) -> Sheet {
    let mut parts = Vec::new();
    for noise in found {
        for (sensor, unit, axes) in [("gyroscope", "rad/s", 0..3), ("accelerometer", "m/s²", 3..6)] {
            let mut lines = Vec::new();
            for (index, axis) in axes.clone().zip(noise.axes.get(axes).unwrap_or_default()) {
                let (Ok(axis), Some(colour)) = (axis, PALETTE.get(index % 3)) else { continue };
                let name = AXES[index];
                let curve: Vec<_> =
                    axis.curve.points().iter().map(|point| (point.time_s, point.deviation)).collect();
                let white: Vec<_> =
                    curve.iter().map(|(time_s, _)| (*time_s, axis.density.value / time_s.sqrt())).collect();
                let lowest = curve.iter().map(|(_, deviation)| *deviation).fold(f64::INFINITY, f64::min);
                let white: Vec<_> = white.into_iter().filter(|(_, deviation)| *deviation > 0.3 * lowest).collect();
                lines.push(Line::path(format!("{name}, white"), FITTED, 1, &white));
                if is_seen(&axis.random_walk) {
                    let walk =
                        curve.iter().map(|(time_s, _)| (*time_s, axis.random_walk.value * (time_s / 3.0).sqrt()));
                    let walk: Vec<_> = walk.filter(|(_, deviation)| *deviation > 0.3 * lowest).collect();
                    lines.push(Line::path(format!("{name}, walk"), FITTED, 1, &walk));
                }
                lines.push(Line::path(name, *colour, 1, &curve));
            }
            let plane = Plane {
                title: format!("{}, {sensor}", noise.file.display()),
                x_axis: "averaging time (s)".into(),
                y_axis: format!("Allan deviation ({unit})"),
                scale: Scale::Logarithmic,
                lines,
            };
            parts.push(Part::Plane(plane, 1));
        }
    }
    Sheet { title: "Noise at rest".into(), parts, panel_size: (1200, 480) }
}
