//! The last states of one joint.

use super::error::Missing;
use super::status::JointRefusal;
use crate::topology::JointKind;
use bb_message::time::MonotonicTime;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// States of one joint in a ring buffer, ordered by their stamps. It allocates when the first state arrives.
#[derive(Debug)]
pub(super) struct History {
    kind: JointKind,
    positions: usize,
    velocities: usize,
    capacity: usize,
    span_nanos: i64,
    times: Box<[i64]>,
    /// Positions of each state, then its velocities, then its efforts; NaN where a quantity is not measured.
    rows: Box<[f64]>,
    /// The slot for the next state.
    next: usize,
    length: usize,
    /// The first and the last stamp of successive states that were refused because they were older than the newest one, and how many
    /// there were.
    behind: Option<(i64, i64, u32)>,
}

/// Time for which a joint's states may be out of order before the history restarts with them.
const SET_BACK_NANOS: i64 = 100_000_000;
/// Number of such states that there must be.
const SET_BACK_STATES: u32 = 5;

/// The time over which an acceleration is taken.
const ACCELERATION_NANOS: i64 = 50_000_000;

/// A state. An incoming state has empty slices where a quantity is not measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct State<'a> {
    pub(super) time: MonotonicTime,
    pub(super) position: &'a [f64],
    pub(super) velocity: &'a [f64],
    pub(super) effort: &'a [f64],
}

/// Number of turns by which the expected angle of a continuous joint may differ from the reported one. Beyond that, turns are
/// counted from the reported angle.
const MOST_TURNS: f64 = 1e5;

impl History {
    pub(super) fn new(kind: JointKind, capacity: usize, span_nanos: i64) -> Self {
        let (positions, velocities) = match kind {
            JointKind::Fixed => (0, 0),
            JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => (1, 1),
            JointKind::Planar => (3, 3),
            JointKind::Floating => (7, 6),
        };
        Self {
            kind,
            positions,
            velocities,
            capacity: capacity.max(2),
            span_nanos,
            times: Box::default(),
            rows: Box::default(),
            next: 0,
            length: 0,
            behind: None,
        }
    }

    /// Adds a state, or returns why it is refused.
    pub(super) fn add(&mut self, state: State<'_>) -> Result<(), JointRefusal> {
        let is_measured = |values: &[f64]| !values.is_empty();
        if state.position.len() != self.positions
            || [state.velocity, state.effort]
                .into_iter()
                .any(|values| is_measured(values) && values.len() != self.velocities)
        {
            return Err(JointRefusal::OtherCoordinates);
        }
        let mut values = state.position.iter().chain(state.velocity).chain(state.effort);
        if !values.all(|value| value.is_finite()) || !self.is_rotation(state.position) {
            return Err(JointRefusal::NonFinite);
        }
        let time = state.time.as_nanos();
        match self.newest() {
            Some(newest) if time == newest => return Err(JointRefusal::Duplicate),
            Some(newest) if time < newest && !self.is_set_back(time) => return Err(JointRefusal::OutOfOrder),
            // Nothing of the past is comparable with the new clock.
            Some(newest) if time < newest => self.length = 0,
            _ => {}
        }
        self.behind = None;
        if self.times.is_empty() {
            self.times = vec![0; self.capacity].into();
            self.rows = vec![f64::NAN; self.capacity * self.stride()].into();
        }
        let unwound = self.unwound(&state);
        let (index, stride) = (self.next, self.stride());
        if let (Some(slot), Some(row)) =
            (self.times.get_mut(index), self.rows.get_mut(index * stride..(index + 1) * stride))
        {
            *slot = time;
            row.fill(f64::NAN);
            let (position, rest) = row.split_at_mut(self.positions);
            let (velocity, effort) = rest.split_at_mut(self.velocities);
            position.copy_from_slice(state.position);
            if let (Some(angle), Some(unwound)) = (position.first_mut(), unwound) {
                *angle = unwound;
            }
            if is_measured(state.velocity) {
                velocity.copy_from_slice(state.velocity);
            }
            if is_measured(state.effort) {
                effort.copy_from_slice(state.effort);
            }
        }
        self.next = (index + 1) % self.capacity;
        self.length = (self.length + 1).min(self.capacity);
        // The newest state is kept, however old.
        while self.length > 1 && time.saturating_sub(self.time(0)) > self.span_nanos {
            self.length -= 1;
        }
        Ok(())
    }

    /// Returns whether states older than the newest one have arrived in order, and without a newer one between, for [`SET_BACK_NANOS`]
    /// and as [`SET_BACK_STATES`]. Then the clock of the joint's sensor was set back, or the newest stamp was wrong.
    fn is_set_back(&mut self, time: i64) -> bool {
        let (first, count) = match self.behind {
            Some((first, last, count)) if time > last => (first, count.saturating_add(1)),
            // The same state once more.
            Some((_, last, _)) if time == last => return false,
            _ => (time, 1),
        };
        self.behind = Some((first, time, count));
        count >= SET_BACK_STATES && time.saturating_sub(first) >= SET_BACK_NANOS
    }

    /// The quaternion of a floating joint must have a direction.
    fn is_rotation(&self, position: &[f64]) -> bool {
        let norm_squared = || position.iter().skip(3).map(|part| part * part).sum::<f64>();
        self.kind != JointKind::Floating || (1e-12..1e12).contains(&norm_squared())
    }

    /// The angle of a continuous joint, in the turn nearest to the prediction from the last state.
    fn unwound(&self, state: &State<'_>) -> Option<f64> {
        let reported = *state.position.first()?;
        let last = self.length.checked_sub(1)?;
        if self.kind != JointKind::Continuous {
            return None;
        }
        let before = *self.row(last).first()?;
        let velocity_before = self.row(last).get(1).copied().unwrap_or(f64::NAN);
        let velocity = match state.velocity.first() {
            Some(velocity) if velocity_before.is_finite() => 0.5 * (velocity + velocity_before),
            Some(velocity) => *velocity,
            None => 0.0,
        };
        let expected = before + velocity * state.time.seconds_since(MonotonicTime::from_nanos(self.time(last)));
        if (expected - reported).abs() > MOST_TURNS * TAU || expected.is_nan() {
            // An absurd velocity or stamp: restart counting turns here, since the angle would otherwise lose its digits
            // permanently.
            return Some(reported);
        }
        Some(reported + TAU * ((expected - reported) / TAU).round())
    }

    const fn stride(&self) -> usize {
        self.positions + 2 * self.velocities
    }

    /// The index in the ring of the state with that number, counted from the oldest.
    #[inline]
    fn place(&self, number: usize) -> usize {
        let place = self.next + self.capacity - self.length + number;
        if place >= self.capacity { place - self.capacity } else { place }
    }

    #[inline]
    fn time(&self, number: usize) -> i64 {
        self.times.get(self.place(number)).copied().unwrap_or(i64::MIN)
    }

    /// Returns positions, velocities and efforts.
    #[inline]
    fn row(&self, number: usize) -> &[f64] {
        let (place, stride) = (self.place(number), self.stride());
        self.rows.get(place * stride..(place + 1) * stride).unwrap_or(&[])
    }

    /// The stamp of the newest state.
    #[inline]
    pub(super) fn newest(&self) -> Option<i64> {
        self.length.checked_sub(1).map(|last| self.time(last))
    }

    /// The newest state, with NaN where a quantity was not measured.
    pub(super) fn newest_state(&self) -> Option<State<'_>> {
        let last = self.length.checked_sub(1)?;
        let (position, rest) = self.row(last).split_at_checked(self.positions)?;
        let (velocity, effort) = rest.split_at_checked(self.velocities)?;
        Some(State { time: MonotonicTime::from_nanos(self.time(last)), position, velocity, effort })
    }

    /// The change of the velocities over the last 50 ms, per second, or between the two newest states if they are further apart;
    /// nothing if they were not measured. Over less, it would be noise.
    pub(super) fn newest_accelerations(&self) -> impl Iterator<Item = f64> + '_ {
        let last = self.length.saturating_sub(1);
        let is_recent = |number: &usize| self.time(last).saturating_sub(self.time(*number)) <= ACCELERATION_NANOS;
        let before = (0..last).rev().take_while(is_recent).last().unwrap_or(last.saturating_sub(1));
        let duration_s = self.time(last).saturating_sub(self.time(before)) as f64 * 1e-9;
        let velocities = |number| self.row(number).iter().skip(self.positions).take(self.velocities);
        let values = velocities(before).zip(velocities(last)).map(move |(from, to)| (to - from) / duration_s);
        // Also with a single state, whose duration is zero.
        values.filter(|value| value.is_finite())
    }

    /// The position at a time, at most `tolerance_nanos` after the newest state.
    #[inline]
    pub(super) fn sample(
        &self,
        time: MonotonicTime,
        tolerance_nanos: i64,
        position: &mut [f64],
    ) -> Result<(), Missing> {
        let asked = time.as_nanos();
        let Some(last) = self.length.checked_sub(1) else { return Err(Missing::Unknown) };
        let newest = self.time(last);
        if asked >= newest {
            let ahead = asked.saturating_sub(newest);
            if ahead > tolerance_nanos {
                return Err(Missing::after(newest, time));
            }
            let row = self.row(last);
            if let Some(known) = row.get(..self.positions) {
                position.copy_from_slice(known);
            }
            if ahead > 0 {
                let velocity = row.get(self.positions..self.positions + self.velocities).unwrap_or(&[]);
                predict(self.kind, position, velocity, ahead as f64 * 1e-9);
            }
            return Ok(());
        }
        let (before, after) = self.around(asked).ok_or_else(|| Missing::before(self.time(0), time))?;
        let (from, to) = (self.time(before), self.time(after));
        let share = asked.saturating_sub(from) as f64 / to.saturating_sub(from) as f64;
        interpolate(self.kind, self.row(before), self.row(after), share, position);
        Ok(())
    }

    /// The states before and after a time that is before the newest state. Most lookups ask for a recent time.
    #[inline]
    fn around(&self, asked: i64) -> Option<(usize, usize)> {
        let last = self.length.checked_sub(1)?;
        let second = last.checked_sub(1)?;
        if self.time(second) <= asked {
            return Some((second, last));
        }
        // Most joints are measured at a fixed rate, so the index follows from the time.
        let (oldest, newest) = (self.time(0), self.time(second));
        let share = asked.saturating_sub(oldest) as f64 / newest.saturating_sub(oldest) as f64;
        let guess = (share * second as f64) as usize;
        if guess < second && self.time(guess) <= asked && asked < self.time(guess + 1) {
            return Some((guess, guess + 1));
        }
        // Search for the first state that is later.
        let (mut low, mut high) = (0, second);
        while low < high {
            let middle = usize::midpoint(low, high);
            if self.time(middle) > asked {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        Some((high.checked_sub(1)?, high))
    }
}

/// The most coordinates of a joint: the position and the quaternion of a floating joint.
const MOST: usize = 7;

/// Predicts a position from its velocity, which is NaN if not measured. The position is held where an absurd velocity would make it
/// non-finite.
fn predict(kind: JointKind, position: &mut [f64], velocity: &[f64], duration_s: f64) {
    if velocity.iter().any(|value| value.is_nan()) {
        return;
    }
    let mut held = [0.0; MOST];
    let held = &mut held[..position.len().min(MOST)];
    held.copy_from_slice(&position[..held.len()]);
    follow(kind, position, velocity, duration_s);
    if !position.iter().all(|value| value.is_finite()) {
        position[..held.len()].copy_from_slice(held);
    }
}

fn follow(kind: JointKind, position: &mut [f64], velocity: &[f64], duration_s: f64) {
    match (kind, position, velocity) {
        (JointKind::Planar, [x, y, angle], [forward, left, rate]) => {
            // Along the circle, with the axes at its midpoint: the error is of third order.
            let (sin, cos) = (*angle + 0.5 * rate * duration_s).sin_cos();
            *x += (cos * forward - sin * left) * duration_s;
            *y += (sin * forward + cos * left) * duration_s;
            *angle += rate * duration_s;
        }
        (JointKind::Floating, [x, y, z, rw, rx, ry, rz], [vx, vy, vz, wx, wy, wz]) => {
            let rotation = UnitQuaternion::new_normalize(Quaternion::new(*rw, *rx, *ry, *rz));
            let turn = Vector3::new(*wx, *wy, *wz) * duration_s;
            let middle = rotation * UnitQuaternion::from_scaled_axis(turn * 0.5);
            let moved = middle * Vector3::new(*vx, *vy, *vz) * duration_s;
            [*x, *y, *z] = [*x + moved.x, *y + moved.y, *z + moved.z];
            let turned = (rotation * UnitQuaternion::from_scaled_axis(turn)).into_inner();
            [*rw, *rx, *ry, *rz] = [turned.w, turned.i, turned.j, turned.k];
        }
        (_, [position], [velocity]) => *position += velocity * duration_s,
        _ => {}
    }
}

/// Interpolates between two positions.
#[inline]
fn interpolate(kind: JointKind, from: &[f64], to: &[f64], share: f64, position: &mut [f64]) {
    // The difference of two finite numbers may be infinite.
    let lerp = |from: f64, to: f64| match to - from {
        way if way.is_finite() => from + way * share,
        _ => from * (1.0 - share) + to * share,
    };
    match (kind, position) {
        (JointKind::Planar, [x, y, angle]) => {
            let (&[x0, y0, from, ..], &[x1, y1, to, ..]) = (from, to) else { return };
            let turn = to - from;
            [*x, *y] = [lerp(x0, x1), lerp(y0, y1)];
            *angle = if turn.is_finite() { from + (turn - TAU * (turn / TAU).round()) * share } else { from };
        }
        (JointKind::Floating, [x, y, z, rw, rx, ry, rz]) => {
            let (&[x0, y0, z0, w0, i0, j0, k0, ..], &[x1, y1, z1, w1, i1, j1, k1, ..]) = (from, to) else { return };
            [*x, *y, *z] = [lerp(x0, x1), lerp(y0, y1), lerp(z0, z1)];
            let start = UnitQuaternion::new_normalize(Quaternion::new(w0, i0, j0, k0));
            let end = UnitQuaternion::new_normalize(Quaternion::new(w1, i1, j1, k1));
            let end = if start.dot(&end) < 0.0 { UnitQuaternion::new_unchecked(-end.into_inner()) } else { end };
            let between = start * UnitQuaternion::from_scaled_axis((start.inverse() * end).scaled_axis() * share);
            let between = between.into_inner();
            [*rw, *rx, *ry, *rz] = [between.w, between.i, between.j, between.k];
        }
        (_, [position]) => {
            if let (Some(from), Some(to)) = (from.first(), to.first()) {
                *position = lerp(*from, *to);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests;
