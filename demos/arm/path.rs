//! Path of the arm.

/// Joints of the arm, from the base to the tip.
const JOINTS: [&str; 6] = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];

/// Legs of the path: it passes through all points of a leg, and comes to rest at the last. Angles in rad.
pub(crate) const LEGS: &[&[[f64; 6]]] = &[
    &[[0.0, -1.2, 1.0, -1.3, -1.5, 0.0]],
    &[[0.8, -0.9, 1.4, -1.8, -1.2, 0.6], [1.6, -1.4, 1.6, -1.5, -1.6, 1.2]],
    &[[0.6, -1.0, 1.8, -2.1, -1.5, 0.2], [-0.8, -1.3, 1.2, -1.2, -1.4, -0.8]],
    &[[0.0, -1.2, 1.0, -1.3, -1.5, 0.0]],
];

pub(crate) fn joints() -> Vec<String> {
    JOINTS.map(str::to_owned).to_vec()
}

/// Returns the positions at which the joints come to rest at the end, rad.
pub(crate) fn end() -> impl Iterator<Item = (&'static str, f64)> {
    let last = LEGS.last().and_then(|leg| leg.last()).copied().unwrap_or_default();
    JOINTS.into_iter().zip(last)
}
