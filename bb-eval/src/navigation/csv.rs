//! A data set as CSV files with one prefix: `_imu`, `_keyframes`, `_truth`, `_init`, `_noise`, and any of `_vio`,
//! `_anchor`, `_gps`, `_obs` with `_landmarks`, and `_camera`.

use super::data::{DEVIATIONS, DataSet, Keyframe, Noise, Sample, Truth, nanoseconds};
use bb_core::nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector2, Vector3};
use bb_estimators::navigation::{AbsolutePose, Camera, GnssPosition, Observation, RelativePose, Start};
use std::collections::{HashMap, HashSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

impl DataSet {
    /// Reads the files of a prefix, `folder/name` for `folder/name_imu.csv` and the others. Each has a header row:
    ///
    /// | file | columns |
    /// |---|---|
    /// | `_imu` | t, angular velocity (rad/s), specific force (m/s²), dt: means over dt |
    /// | `_keyframes` | k, t, imu_start (the first sample after the keyframe), truth_row, eval (1: score it) |
    /// | `_truth` | t, position, quaternion (w first), velocity; NaN where unknown |
    /// | `_vio`, optional | k_from, k_to, t_to, translation, quaternion, sigma_rot, sigma_t |
    /// | `_anchor`, optional | k, t, position, quaternion, sigma_p, sigma_rot, is_outlier (not read) |
    /// | `_gps`, optional | k, t, position, sigma_h, sigma_v; used if there is no `_vio` |
    /// | `_init` | position, quaternion, velocity, biases of gyroscope and accelerometer, sigma_rot, sigma_p, sigma_v, sigma_bg, sigma_ba |
    /// | `_noise` | densities of gyroscope, its random walk, accelerometer, its random walk; gravity |
    ///
    /// # Errors
    ///
    /// The file that cannot be read, or the error with its line.
    pub fn read(prefix: &Path) -> Result<Self, String> {
        let samples = Rows::read(prefix, "imu", 8)?;
        let keyframes = Rows::read(prefix, "keyframes", 5)?;
        let truth = Rows::read(prefix, "truth", 11)?;
        let init = Rows::read(prefix, "init", 21)?;
        let noise = Rows::read(prefix, "noise", 5)?;
        let samples = samples.map(|row| {
            let sample = Sample { angular_velocity: row.vector(1), specific_force: row.vector(4), dt: row.0[7] };
            (sample.dt > 0.0).then_some(sample).ok_or("column dt must be positive")
        })?;
        let keyframes = keyframes.map(|row| {
            let truth = truth.rows.get(row.index(3)?).ok_or("column truth_row is beyond the truth")?;
            let sample = row.index(2)?;
            if sample > samples.len() {
                return Err("column imu_start is beyond the samples");
            }
            let known = |value: f64| value.is_finite();
            Ok(Keyframe {
                time_s: row.0[1],
                sample,
                scored: row.0[4] > 0.0,
                truth: Some(Truth {
                    position: truth.vector(1),
                    world_from_body: known(truth.0[4]).then(|| truth.orientation(4)),
                    velocity: known(truth.0[8]).then(|| truth.vector(8)),
                }),
            })
        })?;
        if keyframes.len() < 2 || keyframes.windows(2).any(|pair| pair[0].sample > pair[1].sample) {
            return Err(format!("{}_keyframes.csv: needs two keyframes or more, in order", prefix.display()));
        }
        let start = init.first(|row| {
            let (rotation, position) = (row.deviation(16)?, row.deviation(17)?);
            let velocity = row.deviation(18)?;
            let first_ns = nanoseconds(keyframes[0].time_s);
            let velocity = (row.vector(7), velocity);
            Ok(Start {
                gyroscope_bias: row.vector(10),
                gyroscope_bias_deviation: row.deviation(19)?,
                accelerometer_bias: row.vector(13),
                accelerometer_bias_deviation: row.deviation(20)?,
                ..Start::at(first_ns, (row.position(0)?, position), velocity, (row.rotation(3)?, rotation))
            })
        })?;
        let noise = noise.first(|row| {
            Ok(Noise {
                gyroscope: row.0[0],
                gyroscope_bias: row.0[1],
                accelerometer: row.0[2],
                accelerometer_bias: row.0[3],
                gravity: row.0[4],
            })
        })?;
        let relative = Rows::read_if_there(prefix, "vio", 12)?.map(|row| {
            let translation = (row.position(3)?, row.deviation(11)?);
            let rotation = (row.rotation(6)?, row.deviation(10)?);
            Ok((row.index(1)? as u64, RelativePose::new(row.index(0)? as u64, translation, rotation)))
        })?;
        let anchors = Rows::read_if_there(prefix, "anchor", 11)?.map(|row| {
            let position = (row.position(2)?, row.deviation(9)?);
            let orientation = (row.rotation(5)?, row.deviation(10)?);
            Ok((row.index(0)? as u64, AbsolutePose::new(position, orientation)))
        })?;
        let fixes = Rows::read_if_there(prefix, "gps", 7)?.map(|row| {
            let (horizontal, vertical) = (row.deviation(5)?, row.deviation(6)?);
            Ok((row.index(0)? as u64, GnssPosition::new(row.position(2)?, horizontal, vertical)))
        })?;
        let seen = seen(prefix)?;
        Ok(Self {
            prefix: prefix.to_owned(),
            samples,
            keyframes,
            start,
            noise: Some(noise),
            relative: relative.into_iter().collect(),
            anchors: anchors.into_iter().collect(),
            fixes: fixes.into_iter().collect(),
            camera: (!seen.is_empty()).then(|| camera(prefix)).transpose()?,
            seen,
        })
    }
}

/// The camera's observations, by keyframe. A landmark's prior comes with its first observation.
fn seen(prefix: &Path) -> Result<HashMap<u64, Vec<Observation>>, String> {
    let known = Rows::read_if_there(prefix, "landmarks", 8)?.map(|row| {
        let (place, deviation) = (row.position(4)?, row.deviation(7)?);
        Ok((row.index(0)? as u64, (place, deviation)))
    })?;
    let known: HashMap<_, _> = known.into_iter().collect();
    let rows = Rows::read_if_there(prefix, "obs", 5)?.map(|row| {
        let pixel = Vector2::new(row.0[2], row.0[3]);
        Ok((row.index(0)? as u64, Observation::new(row.index(1)? as u64, pixel, row.deviation(4)?)))
    })?;
    let (mut seen, mut begun) = (HashMap::<u64, Vec<Observation>>::new(), HashSet::new());
    for (keyframe, mut observation) in rows {
        if begun.insert(observation.landmark) {
            observation.guess = known.get(&observation.landmark).copied();
        }
        seen.entry(keyframe).or_default().push(observation);
    }
    Ok(seen)
}

/// The camera of a file `_camera`: focal lengths, principal point, size, distortion k1, k2, k3, p1, p2, and its pose
/// on the body as a quaternion and a position. Without the file, the camera of the simulated flights.
fn camera(prefix: &Path) -> Result<Camera, String> {
    let rows = Rows::read_if_there(prefix, "camera", 18)?;
    if rows.rows.is_empty() {
        let down = Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
        return Ok(Camera {
            body_from_camera: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down)),
            position: Vector3::new(0.1, 0.0, -0.05),
            ..Camera::pinhole((458.0, 458.0), (376.0, 240.0), (752.0, 480.0))
        });
    }
    rows.first(|row| {
        let pair = |first: usize| (row.0[first], row.0[first + 1]);
        Ok(Camera {
            distortion: core::array::from_fn(|i| row.0[6 + i]),
            body_from_camera: row.rotation(11)?,
            position: row.vector(15),
            ..Camera::pinhole(pair(0), pair(2), pair(4))
        })
    })
}

/// Time, angular velocity and specific force.
pub type Inertial = (f64, Vector3<f64>, Vector3<f64>);

/// The samples of a file as `_imu`: s, rad/s, m/s².
///
/// # Errors
///
/// The file cannot be read, or the error with its line.
pub fn inertial(file: &Path) -> Result<Vec<Inertial>, String> {
    let rows = Rows::of_file(file.to_owned(), 7)?;
    if rows.rows.is_empty() {
        return Err(format!("{}: there is no such file, or it has no row", file.display()));
    }
    rows.map(|row| Ok((row.0[0], row.vector(1), row.vector(4))))
}

/// The largest distance from the origin of the world, m.
const FARTHEST: f64 = 1e8;

/// The numbers of a file, without a header row.
struct Rows {
    file: PathBuf,
    rows: Vec<Row>,
}

/// Numbers of a row, with its line in the file.
struct Row(Vec<f64>, usize);

impl Rows {
    fn read(prefix: &Path, what: &str, columns: usize) -> Result<Self, String> {
        let rows = Self::read_if_there(prefix, what, columns)?;
        if rows.rows.is_empty() {
            return Err(format!("{}: there is no such file, or it has no row", rows.file.display()));
        }
        Ok(rows)
    }

    fn read_if_there(prefix: &Path, what: &str, columns: usize) -> Result<Self, String> {
        let mut file = prefix.as_os_str().to_owned();
        file.push(format!("_{what}.csv"));
        Self::of_file(PathBuf::from(file), columns)
    }

    fn of_file(file: PathBuf, columns: usize) -> Result<Self, String> {
        let text = match std::fs::read_to_string(&file) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self { file, rows: Vec::new() }),
            Err(error) => return Err(format!("{}: {error}", file.display())),
        };
        let mut rows = Vec::new();
        for (index, line) in text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty()) {
            let fault = |fault: String| format!("{}, line {}: {fault}", file.display(), index + 1);
            let numbers: Result<Vec<f64>, _> = line.split(',').map(|cell| cell.trim().parse()).collect();
            let numbers = numbers.map_err(|error| fault(format!("{error}")))?;
            if numbers.len() < columns {
                return Err(fault(format!("{} columns, but must be {columns}", numbers.len())));
            }
            rows.push(Row(numbers, index + 1));
        }
        Ok(Self { file, rows })
    }

    fn map<T>(&self, read: impl Fn(&Row) -> Result<T, &'static str>) -> Result<Vec<T>, String> {
        self.rows.iter().map(|row| self.located(row, &read)).collect()
    }

    fn first<T>(&self, read: impl Fn(&Row) -> Result<T, &'static str>) -> Result<T, String> {
        let first = self.rows.first().ok_or_else(|| format!("{}: has no row", self.file.display()))?;
        self.located(first, &read)
    }

    fn located<T>(&self, row: &Row, read: &impl Fn(&Row) -> Result<T, &'static str>) -> Result<T, String> {
        read(row).map_err(|fault| format!("{}, line {}: {fault}", self.file.display(), row.1))
    }
}

impl Row {
    fn vector(&self, first: usize) -> Vector3<f64> {
        Vector3::new(self.0[first], self.0[first + 1], self.0[first + 2])
    }

    /// w, x, y, z.
    fn orientation(&self, first: usize) -> UnitQuaternion<f64> {
        let [w, x, y, z] = [0, 1, 2, 3].map(|i| self.0[first + i]);
        UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
    }

    /// The rotation at these columns, if it has one: its norm is 1.
    fn rotation(&self, first: usize) -> Result<UnitQuaternion<f64>, &'static str> {
        let norm = self.0.iter().skip(first).take(4).map(|x| x * x).sum::<f64>().sqrt();
        (norm - 1.0).abs().lt(&0.1).then(|| self.orientation(first)).ok_or("columns qw to qz are no rotation")
    }

    /// A position, m.
    fn position(&self, first: usize) -> Result<Vector3<f64>, &'static str> {
        let position = self.vector(first);
        let is_near = position.iter().all(|x| x.abs() <= FARTHEST);
        is_near.then_some(position).ok_or("a position is NaN, or not near the Earth")
    }

    /// A standard deviation.
    fn deviation(&self, column: usize) -> Result<f64, &'static str> {
        let deviation = self.0[column];
        let is_one = DEVIATIONS.contains(&deviation);
        is_one.then_some(deviation).ok_or("a column sigma is not between 1e-9 and 1e9")
    }

    fn index(&self, column: usize) -> Result<usize, &'static str> {
        let number = self.0[column];
        let is_index = (0.0..1e12).contains(&number) && number.fract() == 0.0;
        is_index.then_some(number as usize).ok_or("an index is not a whole number")
    }
}
