//! The world of the truth beside that of the estimates: alignment, and what tells that they differ.

use super::{Instant, Scoring};
use crate::filters::Axes;
use crate::truths::{Compared, doubt};
use crate::turns::{Align, LEFT, TURNED, Turn, Turns, angles, cause};
use bb_core::nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

/// Multiple of the filter's deviations above which a constant error counts as an offset of the truth's world.
const OFFSET_DEVIATIONS: f64 = 2.0;

impl Scoring<'_> {
    /// Turns the truth to the world of the estimates. Returns by how much, in words too.
    pub(in crate::navigation) fn aligned(
        &self,
        instants: &mut [Instant],
        align: Align,
    ) -> Option<(Isometry3<f64>, String)> {
        if align == Align::None {
            return None;
        }
        let (turn, how) = turn_of(instants, align)?;
        let scored = || instants.iter().filter(|instant| instant.is_scored);
        let count = scored().count().max(1) as f64;
        let shift =
            scored().filter_map(|instant| self.moved(instant, &turn.rotation)).sum::<Vector3<f64>>() / count;
        let aligned = Isometry3::from_parts(shift.into(), turn.rotation);
        for instant in instants.iter_mut() {
            instant.truth = instant.truth.moved(&aligned);
            instant.errors = instant.known.map(|known| self.errors(&instant.truth, &known));
        }
        let said = format!(
            "the truth is turned by roll, pitch, yaw {} deg (spread {:.2} deg, by its {how}) and moved by {:.2}, {:.2}, {:.2} m",
            angles(&turn.rotation),
            turn.spread.to_degrees(),
            shift.x,
            shift.y,
            shift.z
        );
        Some((aligned, said))
    }

    /// Way from the true position, turned, to the estimate, m.
    fn moved(&self, instant: &Instant, turn: &UnitQuaternion<f64>) -> Option<Vector3<f64>> {
        let arm = if instant.truth.world_from_body.is_some() { Vector3::zeros() } else { self.antenna };
        let known = instant.known?;
        Some(self.estimated(known.position + known.world_from_body * arm - turn * instant.truth.position))
    }

    /// A place of the truth's world that is not that of the filter's, if it was found to explain the error.
    pub(in crate::navigation) fn displaced(
        &self,
        instants: &[Instant],
        align: Align,
        has_origin: bool,
    ) -> Option<String> {
        // A world that does not begin at a fix is given.
        if align != Align::None || has_origin || self.world.is_none() || self.truth.is_of_fixes {
            return None;
        }
        let scored = || instants.iter().filter(|instant| instant.is_scored);
        let moved: Vec<Vector3<f64>> =
            scored().filter_map(|instant| self.moved(instant, &UnitQuaternion::identity())).collect();
        let mean = moved.iter().sum::<Vector3<f64>>() / moved.len().max(1) as f64;
        let rms = |of: &Vector3<f64>| {
            let squares = moved.iter().map(|moved| (moved - of).norm_squared()).sum::<f64>();
            (squares / moved.len().max(1) as f64).sqrt()
        };
        let (all, left) = (rms(&Vector3::zeros()), rms(&mean));
        let claimed =
            scored().filter_map(|instant| Some(instant.known?.covariance.fixed_view::<3, 3>(0, 0).trace()));
        // An error within the filter's deviations is no offset of the world.
        let claimed = claimed.sum::<f64>() / moved.len().max(1) as f64;
        (LEFT * left < all && mean.norm_squared() > OFFSET_DEVIATIONS * OFFSET_DEVIATIONS * claimed).then(|| {
            format!(
                "the world of the truth begins elsewhere than that of the filter, at its first fix: {left:.2} m of {all:.2} m are \
                 left without a constant offset; say where it begins with --origin, or use --align heading"
            )
        })
    }

    /// A cause of the error, if it was found to explain it.
    pub(in crate::navigation) fn explained(
        &self,
        filter: &str,
        imu: &str,
        instants: &[Instant],
        align: Align,
    ) -> Option<String> {
        let mut compared = Compared::default();
        let right = self.truth.base_from_part.rotation.inverse();
        for instant in instants.iter().filter(|instant| instant.is_scored) {
            if let Some((known, truth)) = instant.known.zip(instant.truth.world_from_body) {
                compared.add(&known.world_from_body, &truth, &[UnitQuaternion::identity(), right]);
            }
        }
        let base_from_imu = self.feed.mounts[0].unwrap_or_else(Isometry3::identity);
        let topic = self.truth.topic.as_deref().unwrap_or_default();
        doubt(Axes::Nine, &[(filter, &compared)], topic, |rms, of| {
            let is_world = |turn: &UnitQuaternion<f64>| !self.contradicts(instants, turn);
            cause(rms, &of.of_body, &of.of_world, (imu, &base_from_imu), align, TURNED, is_world)
        })
        .or_else(|| {
            // An unknown heading at the start hides a turn that the track shows.
            let (turn, _) = turn_of(instants, Align::Heading).filter(|_| align == Align::None)?;
            let of_orientations = turn_of_orientations(instants).heading();
            let agrees = |of: Turn| turn.rotation.angle_to(&of.rotation) <= of.spread;
            (turn.is_turned(TURNED) && of_orientations.is_none_or(agrees)).then(|| turn.of_world())
        })
    }

    /// Returns whether the positions speak against a turn of the truth's world: with it, the tracks differ by more than without.
    fn contradicts(&self, instants: &[Instant], turn: &UnitQuaternion<f64>) -> bool {
        let apart = |turn: &UnitQuaternion<f64>| {
            let scored = instants.iter().filter(|instant| instant.is_scored);
            let moved: Vec<Vector3<f64>> = scored.filter_map(|instant| self.moved(instant, turn)).collect();
            let mean = moved.iter().sum::<Vector3<f64>>() / moved.len().max(1) as f64;
            moved.iter().map(|moved| (moved - mean).norm_squared()).sum::<f64>()
        };
        apart(turn) > 1.01 * apart(&UnitQuaternion::identity())
    }
}

/// The rotation that an alignment takes from the truth: by the orientations or by the track, whichever leaves less beside it. Of any
/// rotation, the track tells the part about the vertical best, for most tracks are level.
fn turn_of(instants: &[Instant], align: Align) -> Option<(Turn, &'static str)> {
    let identity = UnitQuaternion::identity();
    let by = [
        (turn_of_orientations(instants).of(align), "orientations"),
        (turn_of_track(instants, align, &identity), "track"),
    ];
    let by = by.into_iter().filter_map(|(turn, how)| Some((turn?, how)));
    let (turn, how) = by.min_by(|(a, _), (b, _)| a.spread.total_cmp(&b.spread))?;
    let rest = turn_of_track(instants, Align::Heading, &turn.rotation).filter(|rest| rest.spread < turn.spread);
    Some(match rest {
        Some(rest) => (Turn { rotation: rest.rotation * turn.rotation, ..rest }, "track"),
        None => (turn, how),
    })
}

fn turn_of_orientations(instants: &[Instant]) -> Turns {
    let mut turns = Turns::default();
    for instant in instants.iter().filter(|instant| instant.is_scored) {
        if let (Some(known), Some(truth)) = (instant.known, instant.truth.world_from_body) {
            turns.add(&(known.world_from_body * truth.inverse()));
        }
    }
    turns
}

/// The rotation of the track of the truth, after another one.
fn turn_of_track(instants: &[Instant], align: Align, before: &UnitQuaternion<f64>) -> Option<Turn> {
    let scored = instants.iter().filter(|instant| instant.is_scored);
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> =
        scored.filter_map(|instant| Some((instant.known?.position, before * instant.truth.position))).collect();
    let count = pairs.len().max(1) as f64;
    let estimates = pairs.iter().map(|(estimate, _)| estimate).sum::<Vector3<f64>>() / count;
    let truths = pairs.iter().map(|(_, truth)| truth).sum::<Vector3<f64>>() / count;
    let flat = if align == Align::Heading { Vector3::new(1.0, 1.0, 0.0) } else { Vector3::new(1.0, 1.0, 1.0) };
    let centred = |(estimate, truth): &(Vector3<f64>, Vector3<f64>)| {
        ((estimate - estimates).component_mul(&flat), (truth - truths).component_mul(&flat))
    };
    let mut between = Matrix3::zeros();
    for (estimate, truth) in pairs.iter().map(centred) {
        between += estimate * truth.transpose();
    }
    if align == Align::Heading {
        // The rotation about the vertical alone.
        let angle = (between[(1, 0)] - between[(0, 1)]).atan2(between[(0, 0)] + between[(1, 1)]);
        between = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle).to_rotation_matrix().into_inner();
    }
    let svd = between.svd(true, true);
    let (left, right) = (svd.u?, svd.v_t?);
    let mut rotation = left * right;
    if rotation.determinant() < 0.0 {
        let mut mirrored = left;
        mirrored.column_mut(2).neg_mut();
        rotation = mirrored * right;
    }
    let rotation = UnitQuaternion::from_matrix(&rotation);
    let residual: f64 =
        pairs.iter().map(centred).map(|(estimate, truth)| (estimate - rotation * truth).norm_squared()).sum();
    let extents: Matrix3<f64> = pairs.iter().map(centred).map(|(_, truth)| truth * truth.transpose()).sum();
    // About the axis along which the track is longest, what is beside it tells the rotation.
    let along = if align == Align::Heading { 0.0 } else { extents.symmetric_eigenvalues().max() };
    // As an angle over the size of the track.
    let spread = (residual / (extents.trace() - along).max(f64::MIN_POSITIVE)).sqrt();
    (pairs.len() > 2).then_some(Turn { rotation, spread })
}
