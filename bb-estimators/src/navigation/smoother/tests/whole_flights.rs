//! Whole flights against one dense system of all that was measured, with the keyframes and landmarks that have left the window.

use std::collections::BTreeMap;
use std::vec::Vec;

use nalgebra::{DMatrix, DVector, Matrix2x3, SMatrix, SVector, Vector3};

use super::super::landmark::{Landmark, Sight};
use super::super::link::{Information, Link};
use super::super::matrix::mirror;
use super::flight::{Drone, Flight, N, Smoother, linear, open, usual};
use super::scenery::{Scenery, exact, seeing};
use crate::navigation::factor::Factor;
use crate::navigation::factor::Rows;
use crate::navigation::{Estimate, LandmarkParams, POSITION, ROTATION, SmootherParams};

/// A keyframe as it was linearised last.
struct Place {
    point: Estimate<N>,
    /// Factors on it alone, whitened.
    rows: Vec<([f64; N], f64)>,
    link: Option<Link<N>>,
}

/// A landmark as it was linearised last, with its observations by keyframe.
struct Point {
    id: u64,
    /// Address at which the smoother holds it: an id may be used again.
    at: *const Landmark,
    place: Vector3<f64>,
    prior: Option<(Vector3<f64>, f64)>,
    sights: BTreeMap<u64, Sight>,
    is_current: bool,
}

impl Point {
    fn is_of(&self, landmark: &Landmark) -> bool {
        self.is_current && self.id == landmark.id && core::ptr::eq(self.at, landmark)
    }
}

/// All that a flight has measured.
struct Record {
    start: (DMatrix<f64>, Estimate<N>),
    places: BTreeMap<u64, Place>,
    points: Vec<Point>,
}

fn dense(information: &Information<N>) -> (DMatrix<f64>, DVector<f64>) {
    let mut matrix = information.matrix;
    mirror(&mut matrix);
    (DMatrix::from_fn(N, N, |i, j| matrix[i][j]), DVector::from_row_slice(&information.vector))
}

impl Record {
    fn new(smoother: &Smoother) -> Self {
        let prior = smoother.window[0].prior.unwrap();
        let start = (dense(&prior.information).0, prior.mean.unwrap());
        Self { start, places: BTreeMap::new(), points: Vec::new() }
    }

    /// Takes what the window holds: after each update, and before a keyframe leaves.
    fn take(&mut self, smoother: &Smoother) {
        for (index, keyframe) in smoother.window.iter().enumerate() {
            let mut rows = Vec::new();
            for held in keyframe.factors.iter().filter(|held| Factor::<Drone, N>::previous(&held.factor).is_none())
            {
                let mut whitened = Rows::new();
                keyframe.rows::<Drone>(&held.factor, None, &mut whitened).unwrap();
                whitened.weigh(held.trust * held.weight);
                rows.extend((0..whitened.count).map(|i| (whitened.at[i], whitened.residual[i])));
            }
            let before = self.places.remove(&keyframe.id).and_then(|place| place.link);
            let link = if index > 0 { Some(keyframe.link) } else { before };
            self.places.insert(keyframe.id, Place { point: keyframe.point, rows, link });
        }
        let landmarks = smoother.landmarks.as_ref().unwrap();
        let first = landmarks.coupling.first;
        for point in &mut self.points {
            let landmark = landmarks.all.iter().find(|landmark| landmark.is_used && point.is_of(landmark));
            let holds = |serial: &u64| {
                landmark.is_some_and(|landmark| landmark.sights.iter().any(|sight| sight.serial == *serial))
            };
            let inside: Vec<bool> = point.sights.range(first..).map(|(serial, _)| holds(serial)).collect();
            // One that began again has none of its observations of before.
            let goes_on =
                inside.contains(&true) || (inside.is_empty() && landmark.is_some_and(|of| of.slot.is_some()));
            point.is_current &= goes_on;
            if goes_on {
                // Those that are behind the camera by now.
                point.sights.retain(|serial, _| *serial < first || holds(serial));
            }
        }
        for landmark in landmarks.all.iter().filter(|landmark| landmark.is_used) {
            let known = self.points.iter().position(|point| point.is_of(landmark));
            let index = known.unwrap_or_else(|| {
                let at = core::ptr::from_ref(&**landmark);
                let (id, place, prior) = (landmark.id, landmark.point, landmark.prior);
                self.points.push(Point { id, at, place, prior, sights: BTreeMap::new(), is_current: true });
                self.points.len() - 1
            });
            let point = &mut self.points[index];
            point.place = landmark.point;
            point.sights.extend(landmark.sights.iter().map(|sight| (sight.serial, *sight)));
        }
    }

    /// Solves for everything at once.
    fn solved(&self) -> Solution {
        let mut system = System::new(self.places.values().map(|place| place.link.as_ref()), self.points.len());
        let ids: Vec<u64> = self.places.keys().copied().collect();
        let (information, mean) = &self.start;
        let error = self.places[&ids[0]].point.error_to::<Drone>(mean);
        system.add(0, information, &(information * DVector::from_row_slice(error.as_slice())));
        for (k, place) in self.places.values().enumerate() {
            if let Some(link) = &place.link {
                let (matrix, vector) = dense(&link.information);
                system.add(k, &matrix, &vector);
            }
            for (row, residual) in &place.rows {
                system.observe(k, &DMatrix::from_row_slice(1, N, row), None, &DVector::repeat(1, *residual));
            }
        }
        for (number, point) in self.points.iter().enumerate() {
            // Those that were never seen are not in the problem; any information keeps it regular.
            let (mean, weight) = point.prior.unwrap_or((point.place, f64::from(u8::from(point.sights.is_empty()))));
            system.guess(number, &(mean - point.place), weight);
            for (serial, sight) in &point.sights {
                let k = ids.iter().position(|id| id == serial).unwrap();
                let mut rows = DMatrix::zeros(2, N);
                rows.view_mut((0, POSITION), (2, 3)).copy_from(&-sight.jacobian);
                let turned = sight.jacobian * sight.arm.cross_matrix();
                rows.view_mut((0, ROTATION), (2, 3)).copy_from(&turned);
                let (weight, residual) = (sight.weight.sqrt(), DVector::from_row_slice(sight.residual.as_slice()));
                system.observe(k, &(rows * weight), Some((number, sight.jacobian * weight)), &(residual * weight));
            }
        }
        system.solved(ids)
    }
}

/// The unknowns are the newest keyframe, the noise of each link, whose covariance is singular, and the landmarks.
struct System {
    /// Each keyframe as an affine function of the unknowns.
    maps: Vec<(DMatrix<f64>, DVector<f64>)>,
    matrix: DMatrix<f64>,
    vector: DVector<f64>,
}

impl System {
    /// The link of each keyframe to the one before it.
    fn new<'a>(links: impl ExactSizeIterator<Item = Option<&'a Link<N>>>, points: usize) -> Self {
        let count = links.len();
        let size = N * count + 3 * points;
        let links: Vec<_> = links.collect();
        let mut maps = vec![(DMatrix::zeros(N, size), DVector::zeros(N)); count];
        maps[count - 1].0.view_mut((0, 0), (N, N)).fill_with_identity();
        for k in (0..count - 1).rev() {
            let link = links[k + 1].unwrap();
            let back = DMatrix::from_fn(N, N, |i, j| link.back[i][j]);
            let (mut map, offset) = (&back * &maps[k + 1].0, &back * &maps[k + 1].1);
            map.view_mut((0, N * (k + 1)), (N, N)).copy_from(&root(&link.noise));
            maps[k] = (map, offset + DVector::from_row_slice(&link.offset));
        }
        let mut matrix = DMatrix::zeros(size, size);
        (N..N * count).for_each(|i| matrix[(i, i)] = 1.0);
        Self { maps, matrix, vector: DVector::zeros(size) }
    }

    fn add(&mut self, k: usize, information: &DMatrix<f64>, vector: &DVector<f64>) {
        let (map, offset) = &self.maps[k];
        let weighted = map.transpose() * information;
        self.matrix += &weighted * map;
        self.vector += map.tr_mul(vector) - weighted * offset;
    }

    /// Adds rows of variance 1 on a keyframe and a landmark.
    fn observe(
        &mut self,
        k: usize,
        rows: &DMatrix<f64>,
        point: Option<(usize, Matrix2x3<f64>)>,
        residual: &DVector<f64>,
    ) {
        let (map, offset) = &self.maps[k];
        let mut all = rows * map;
        if let Some((number, jacobian)) = point {
            all.view_mut((0, N * self.maps.len() + 3 * number), (2, 3)).copy_from(&jacobian);
        }
        self.matrix.gemm_tr(1.0, &all, &all, 1.0);
        self.vector += all.tr_mul(&(residual - rows * offset));
    }

    fn guess(&mut self, number: usize, mean: &Vector3<f64>, weight: f64) {
        let at = N * self.maps.len() + 3 * number;
        for i in 0..3 {
            self.matrix[(at + i, at + i)] += weight;
            self.vector[at + i] += weight * mean[i];
        }
    }

    fn solved(self, ids: Vec<u64>) -> Solution {
        let size = self.vector.len();
        // Scaled to a unit diagonal, and refined once.
        let scale = self.matrix.diagonal().map(|x| 1.0 / x.sqrt());
        let scaled = DMatrix::from_fn(size, size, |i, j| self.matrix[(i, j)] * scale[i] * scale[j]);
        let right = self.vector.component_mul(&scale);
        let root = scaled.clone().cholesky().unwrap();
        let rough = root.solve(&right);
        let solution = &rough + root.solve(&(&right - &scaled * &rough));
        let inverse = root.inverse();
        Solution {
            ids,
            maps: self.maps,
            mean: solution.component_mul(&scale),
            covariance: DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] * scale[i] * scale[j]),
        }
    }
}

/// R with `R Rᵀ` a matrix that may be singular.
fn root(matrix: &[[f64; N]; N]) -> SMatrix<f64, N, N> {
    let scale = SVector::<f64, N>::from_fn(|i, _| matrix[i][i].max(f64::MIN_POSITIVE).sqrt());
    let mut left = SMatrix::<f64, N, N>::from_fn(|i, j| 0.5 * (matrix[i][j] + matrix[j][i]) / scale[i] / scale[j]);
    let mut root = SMatrix::<f64, N, N>::zeros();
    for i in (0..N).filter(|i| matrix[*i][*i] > 0.0) {
        if left[(i, i)] > 1e-13 {
            let column = left.column(i) / left[(i, i)].sqrt();
            left -= column * column.transpose();
            root.set_column(i, &column.component_mul(&scale));
        }
    }
    root
}

struct Solution {
    ids: Vec<u64>,
    maps: Vec<(DMatrix<f64>, DVector<f64>)>,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Solution {
    /// The mean and covariance of a linear function of keyframes.
    fn of(&self, parts: &[(u64, DMatrix<f64>)]) -> (DVector<f64>, DMatrix<f64>) {
        let count = parts[0].1.nrows();
        let mut map = DMatrix::zeros(count, self.mean.len());
        let mut mean = DVector::zeros(count);
        for (id, rows) in parts {
            let (of_keyframe, offset) = &self.maps[self.ids.iter().position(|known| known == id).unwrap()];
            map += rows * of_keyframe;
            mean += rows * offset;
        }
        (mean + &map * &self.mean, &map * &self.covariance * map.transpose())
    }

    /// The largest differences to a window: of its means, in deviations, and of its covariances, as correlations.
    fn differences(&self, smoother: &Smoother) -> (f64, f64) {
        let (mut of_means, mut of_covariances) = (0.0_f64, 0.0_f64);
        // Until landmarks tie keyframes, an update does not propagate small corrections back.
        let mut smoother = smoother.clone();
        smoother.solve_all();
        for index in 0..smoother.window.len() {
            let here = smoother.covariance_now(index).unwrap();
            let keyframe = &smoother.window[index];
            let (mean, covariance) = self.of(&[(keyframe.id, DMatrix::identity(N, N))]);
            let deviation = covariance.diagonal().map(f64::sqrt);
            for i in 0..N {
                of_means = of_means.max((keyframe.correction[i] - mean[i]).abs() / deviation[i]);
                for j in 0..N {
                    let off = (here[i][j] - covariance[(i, j)]).abs() / (deviation[i] * deviation[j]);
                    of_covariances = of_covariances.max(off);
                }
            }
        }
        (of_means, of_covariances)
    }
}

/// Flies with tracks that may outlive the window, and calls `step` after each update.
fn flown(
    seed: u64,
    (keyframes, count): (usize, usize),
    guess: Option<f64>,
    (params, landmarks): (SmootherParams, LandmarkParams),
    mut step: impl FnMut(&mut Smoother, &mut Record, &Flight, usize),
) {
    let flight = Flight::new(seed, keyframes, 1.0);
    let scenery = Scenery::new(&flight, seed, count, 40, guess);
    let mut smoother = seeing(&flight, params, landmarks);
    let mut record = Record::new(&smoother);
    for k in 0..keyframes {
        if k > 0 {
            flight.advance(&mut smoother, k);
        }
        scenery.observe(&mut smoother, k);
        smoother.update().unwrap();
        record.take(&smoother);
        step(&mut smoother, &mut record, &flight, k);
    }
}

/// Landmarks of any fate: lost, cut and begun again, or unknowns of their own. One that is carried on without a guess has a
/// deviation of a hundred times its distance in the window, and none in the dense system.
#[test]
fn a_window_is_the_dense_system_of_the_flight() {
    for (seed, guess) in [(5, None), (7, Some(5.0)), (26, None), (28, Some(5.0))] {
        for persistent in [0, 3, 32] {
            let params = (linear(5), LandmarkParams { relinearise: 1.0, persistent, ..exact() });
            flown(seed, (16, 6), guess, params, |smoother, record, _, k| {
                if k == 5 || k == 15 {
                    let (means, covariances) = record.solved().differences(smoother);
                    let what = std::format!("seed {seed}, {guess:?}, {persistent}, keyframe {k}");
                    let limit = if guess.is_some() { 1e-9 } else { 2e-6 };
                    assert!(means < limit && covariances < limit, "{what}: {means:e} {covariances:e}");
                }
            });
        }
    }
}

/// Landmarks that are hardly known may move behind a camera when keyframes are relinearised. Their observations are not lost.
#[test]
fn nothing_is_lost_when_all_is_relinearised() {
    for (seed, window, count) in [(5, 4, 8), (1, 5, 6), (9, 4, 6), (12, 6, 8)] {
        let landmarks = LandmarkParams { persistent: 0, ..exact() };
        flown(seed, (14, count), None, (usual(window), landmarks), |smoother, record, _, k| {
            if k % 3 == 1 {
                let (means, covariances) = record.solved().differences(smoother);
                assert!(means < 1e-8 && covariances < 1e-8, "seed {seed}, keyframe {k}: {means:e} {covariances:e}");
            }
        });
    }
}

/// The gate of a relative pose knows what landmarks say of the motion: at the newest keyframe, and at earlier ones.
#[test]
fn relative_poses_are_judged_by_all_that_is_known() {
    for (seed, persistent) in [(1, 32), (2, 0), (3, 32)] {
        let params = (linear(6), LandmarkParams { relinearise: 1.0, persistent, ..exact() });
        flown(seed, (14, 6), Some(5.0), params, |smoother, record, flight, k| {
            for back in [0, 1, 3] {
                if k < 6 || k % 3 != 0 {
                    continue;
                }
                let id = k - back;
                let factor = flight.measured[id][0];
                let index = smoother.window.iter().position(|keyframe| keyframe.id == id as u64).unwrap();
                let mut rows = Rows::new();
                let before = Some(&*smoother.window[index - 1]);
                smoother.window[index].rows::<Drone>(&factor, before, &mut rows).unwrap();
                let of = |rows: &[[f64; N]], count| DMatrix::from_fn(count, N, |i, j| rows[i][j]);
                let parts =
                    [(id as u64 - 1, of(&rows.previous, rows.count)), (id as u64, of(&rows.at, rows.count))];
                let (mean, covariance) = record.solved().of(&parts);
                let innovation = DVector::from_row_slice(&rows.residual[..rows.count]) - mean;
                let covariance = covariance + DMatrix::identity(rows.count, rows.count);
                let expected = innovation.dot(&covariance.cholesky().unwrap().solve(&innovation));
                // It is added to a copy: the flight stays what it is.
                let judged = smoother.clone().add(&mut open(), id as u64, factor).unwrap();
                let off = (judged.nis / expected - 1.0).abs();
                assert!(off < 1e-6, "seed {seed}, keyframe {id} of {k}: {} {expected}", judged.nis);
            }
        });
    }
}
