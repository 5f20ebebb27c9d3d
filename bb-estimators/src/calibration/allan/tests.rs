//! Comparisons with Python's `allantools`, and with noise of known densities.

use super::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// Numbers from 0 to 1 of an xorshift, which Python makes as easily.
fn even(mut state: u32) -> impl Iterator<Item = f64> {
    core::iter::from_fn(move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        Some(f64::from(state) / f64::from(u32::MAX))
    })
}

/// Samples with one element before them, integrated.
fn integrals(samples: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut integrals: Vec<f64> = core::iter::once(0.0).chain(samples).collect();
    integrate(&mut integrals);
    integrals
}

/// `allantools.oadev(x, rate=100.0, data_type="freq", taus=2**k / 100)` of allantools 2024.06, where x is 0.3, and 0.01 times white
/// noise from seed 12345, and 1e-4 times the sum of that from seed 54321. `tests/allan/check` makes and compares them again.
#[test]
fn deviations_are_those_of_allantools() {
    let unit = |value: f64| (value - 0.5) * 12_f64.sqrt();
    let mut walk = 0.0;
    let samples = even(12345).zip(even(54321)).take(20_000).map(|(white, step)| {
        walk += unit(step);
        0.3 + 0.01 * unit(white) + 1e-4 * walk
    });
    let integrals = integrals(samples);
    let known = [
        0.01005850986931214,
        0.007069606553783354,
        0.005022366926963112,
        0.003576224451502642,
        0.002534073372546979,
        0.0018165119379507989,
        0.001310534839910743,
        0.0011022605792980647,
        0.0011060773849685792,
        0.0012650832104811624,
        0.0015377362509240893,
        0.0016509527521147954,
    ];
    for (octave, known) in known.into_iter().enumerate() {
        let deviation = allan_deviation(&integrals, 1 << octave).unwrap();
        assert!((deviation / known - 1.0).abs() < 1e-9, "{deviation}, allantools has {known}");
    }
    let noise = sensor_noise(&integrals, 0.01).unwrap();
    assert_eq!(noise.curve.points().len(), known.len());
    assert!((noise.bias_instability / (known[7] / 0.66428) - 1.0).abs() < 1e-4, "{noise:?}");
    assert!((noise.bias_instability_time_s - 1.28).abs() < 1e-12 && noise.is_lowest);
}

/// `allantools.edf_simple(20001, m, alpha)`, but for flicker noise over one sample, where its formula lacks the square.
#[test]
fn degrees_of_freedom_are_those_of_allantools() {
    let known = [
        (0, [13332.44453332889, 11427.047771420952, 1863.8991300192035, 27.297042449390126]),
        (1, [f64::NAN, 12496.876124606388, 1558.8371030038904, 21.164568081554332]),
        (2, [20000.00015002, 9998.500150025004, 1247.190275423182, 16.738560742262845]),
    ];
    for (noise, known) in known {
        for (m, known) in [1.0, 2.0, 16.0, 1024.0].into_iter().zip(known) {
            let degrees = degrees_of_freedom(noise, 20001.0, m);
            assert!(known.is_nan() || (degrees / known - 1.0).abs() < 1e-9, "{noise}, {m}: {degrees}");
        }
    }
}

const SEEDS: u64 = 100;
const PERIOD_S: f64 = 0.01;

/// `seconds` of white noise and a random walk of these densities, at 100 Hz.
fn simulated(seed: u64, seconds: f64, density: f64, walk: f64) -> SensorNoise {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
    let mut bias = 0.02;
    let samples = (0..(seconds / PERIOD_S) as usize).map(|_| {
        bias += walk * PERIOD_S.sqrt() * normal();
        bias + density / PERIOD_S.sqrt() * normal()
    });
    sensor_noise(&integrals(samples), PERIOD_S).unwrap()
}

/// Mean and root mean square of values that should be of mean 0 and variance 1.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    (values.iter().sum::<f64>() / count, (values.iter().map(|value| value * value).sum::<f64>() / count).sqrt())
}

/// White noise alone, ten minutes: an overlapping Allan variance over one sample has 2 n / 3 degrees of freedom, so that its root is
/// known to √(3 / 4 n), 0.35 %; the longer averages make it better.
#[test]
fn white_noise_is_found_as_well_as_chi_square_allows() {
    let density = 1.7e-4;
    let found: Vec<_> = (0..SEEDS).map(|seed| simulated(seed, 600.0, density, 0.0)).collect();
    let bound = (0.75_f64 / 60_000.0).sqrt();
    let mut errors = Vec::new();
    for noise in &found {
        assert!(noise.density.deviation < 1.1 * bound * density, "{:?}", noise.density);
        assert!((noise.density.value / density - 1.0).abs() < 4.0 * bound, "{:?}", noise.density);
        errors.push((noise.density.value - density) / noise.density.deviation);
    }
    // Three deviations of the mean of that many; the constraint to non-negative components lowers it slightly.
    let (mean, deviation) = moments(&errors);
    assert!(
        mean.abs() < 0.3 + 3.0 / (SEEDS as f64).sqrt() && (0.75..1.25).contains(&deviation),
        "{mean} {deviation}"
    );
    // A walk that is not there is hardly seen.
    let over = found.iter().filter(|noise| noise.random_walk.value > 2.0 * noise.random_walk.deviation).count();
    assert!(over <= 10, "{over} of {SEEDS} see a random walk");
}

/// Half an hour of white noise that a random walk overtakes after three seconds.
#[test]
fn a_random_walk_is_found_as_well_as_it_is_said_to_be() {
    let (density, walk) = (1.7e-4, 1e-4);
    let found: Vec<_> = (0..SEEDS).map(|seed| simulated(seed, 1800.0, density, walk)).collect();
    let (mut of_density, mut of_walk, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for noise in &found {
        of_density.push((noise.density.value - density) / noise.density.deviation);
        of_walk.push((noise.random_walk.value - walk) / noise.random_walk.deviation);
        ratios.push(noise.random_walk.value / walk);
        assert!((noise.density.value / density - 1.0).abs() < 0.015, "{:?}", noise.density);
        assert!((noise.random_walk.value / walk - 1.0).abs() < 0.35, "{:?}", noise.random_walk);
        // σ² is N²/τ + K² τ/3: lowest is 2 N K / √3.
        let lowest = (2.0 * density * walk / 3_f64.sqrt()).sqrt() / FLOOR;
        assert!((noise.bias_instability / lowest - 1.0).abs() < 0.1 && noise.is_lowest, "{noise:?} {lowest}");
    }
    let mean_ratio = ratios.iter().sum::<f64>() / SEEDS as f64;
    println!("random walk: {mean_ratio} of the true one, {:?} {:?}", moments(&of_density), moments(&of_walk));
    assert!((mean_ratio - 1.0).abs() < 0.04, "{mean_ratio}");
    // Three deviations of the mean of that many, and of their root mean square; the constraint to non-negative values
    // lowers it slightly.
    let by_chance = 3.0 / (SEEDS as f64).sqrt();
    for (mean, deviation) in [moments(&of_density), moments(&of_walk)] {
        assert!(mean.abs() < by_chance && (deviation - 1.0).abs() < by_chance / 2_f64.sqrt(), "{mean} {deviation}");
    }
}

#[test]
fn what_is_no_noise_is_refused() {
    let few = integrals((0..100).map(f64::from));
    assert_eq!(sensor_noise(&few, 0.01), Err(AllanError::TooShort { samples: 100, least: 256 }));
    let constant = integrals((0..1000).map(|_| 9.81));
    assert_eq!(sensor_noise(&constant, 0.01), Err(AllanError::Constant));
    let lost = integrals((0..1000).map(|i| if i == 500 { f64::NAN } else { f64::from(i % 3) }));
    assert_eq!(sensor_noise(&lost, 0.01), Err(AllanError::NonFinite));
    let good = integrals((0..1000).map(|i| f64::from(i % 3)));
    assert_eq!(sensor_noise(&good, 0.0), Err(AllanError::NonFinite));
    assert!(sensor_noise(&good, 0.01).is_ok());
    assert_eq!((allan_deviation(&good, 0), allan_deviation(&good, 501)), (None, None));
    assert_eq!(allan_deviation(&good, usize::MAX), None);
    assert_eq!(sensor_noise(&[], 0.01), Err(AllanError::TooShort { samples: 0, least: 256 }));
}

/// A bias a million times the noise changes nothing.
#[test]
fn a_bias_costs_no_digits() {
    let noise = |bias: f64| {
        let samples = even(7).take(10_000).map(move |value| bias + 1e-3 * value);
        sensor_noise(&integrals(samples), 0.01).unwrap().density.value
    };
    assert!((noise(1e3) / noise(0.0) - 1.0).abs() < 1e-7);
}
