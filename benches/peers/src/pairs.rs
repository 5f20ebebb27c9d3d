//! Pairs of our filters and peers that are compared.

use crate::peers::{self, Beside};
use bb_eval::Axes;

/// One of our filters and a peer, each with its parameters.
pub struct Pair {
    pub name: &'static str,
    /// Name that `bb eval attitude --filter` takes; a pair without it is left out.
    pub ours: &'static str,
    /// Settings as `--set` takes them.
    pub settings: &'static [&'static str],
    pub axes: Axes,
    pub peer: fn() -> Beside,
}

impl Pair {
    pub fn nine(&self) -> bool {
        self.axes == Axes::Nine
    }
}

/// Pairs that are compared. Where both sides are one algorithm, they have the same settings. Else ours run with their defaults and the
/// peers with what is best for them on BROAD; VQF has its defaults.
pub const PAIRS: &[Pair] = &[
    Pair {
        name: "madgwick/ahrs_madgwick/nine",
        ours: "madgwick",
        settings: &["beta=0.12"],
        axes: Axes::Nine,
        peer: || peers::madgwick(0.12),
    },
    Pair {
        name: "madgwick/ahrs_madgwick/six",
        ours: "madgwick",
        settings: &["beta=0.03"],
        axes: Axes::Six,
        peer: || peers::madgwick(0.03),
    },
    Pair {
        name: "mahony/ahrs_mahony/nine",
        ours: "mahony",
        settings: &[],
        axes: Axes::Nine,
        peer: || peers::mahony(0.74, 0.0012),
    },
    Pair {
        name: "complementary/ahrs_mahony/nine",
        ours: "complementary",
        settings: &[],
        axes: Axes::Nine,
        peer: || peers::mahony(0.74, 0.0012),
    },
    Pair {
        name: "complementary/ahrs_mahony/six",
        ours: "complementary",
        settings: &[],
        axes: Axes::Six,
        peer: || peers::mahony(0.18, 0.0015),
    },
    Pair {
        name: "fusion/fusion_ahrs/nine",
        ours: "fusion",
        // 40° and 20°.
        settings: &["gain=0.1", "acceleration_rejection=0.698132", "magnetic_rejection=0.349066"],
        axes: Axes::Nine,
        peer: peers::fusion_best,
    },
    Pair {
        name: "fusion_published/fusion_ahrs/nine",
        ours: "fusion",
        settings: &[],
        axes: Axes::Nine,
        peer: peers::fusion_published,
    },
    Pair {
        name: "complementary/fusion_ahrs/nine",
        ours: "complementary",
        settings: &[],
        axes: Axes::Nine,
        peer: peers::fusion_best,
    },
    Pair {
        name: "mahony/ahrs_mahony/six",
        ours: "mahony",
        settings: &["proportional_gain=0.18", "integral_gain=0.0015"],
        axes: Axes::Six,
        peer: || peers::mahony(0.18, 0.0015),
    },
    Pair { name: "vqf/vqf_rs/nine", ours: "vqf", settings: &[], axes: Axes::Nine, peer: peers::vqf },
    Pair { name: "vqf/vqf_rs/six", ours: "vqf", settings: &[], axes: Axes::Six, peer: peers::vqf },
    Pair { name: "mekf/vqf_rs/nine", ours: "mekf", settings: &[], axes: Axes::Nine, peer: peers::vqf },
    Pair { name: "mekf/vqf_rs/six", ours: "mekf", settings: &[], axes: Axes::Six, peer: peers::vqf },
];
