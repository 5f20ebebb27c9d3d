//! The Kalman filter on recordings made harder: started in motion, with iron on the body and in the world.

use bb_eval::{Averages, Axes, Chosen, Evaluator, Field, Offset, Progress, Starts, Variants, evaluate_variant};
use bb_tests::recordings::broad;
use std::error::Error;

/// Change of the recordings, and the total error as measured on ten trials of BROAD: mean and worst, degrees.
struct Known {
    name: &'static str,
    before_motion_s: Option<f64>,
    variants: Variants,
    total: [f64; 2],
}

fn known() -> Result<[Known; 6], String> {
    let seeded = || Variants { seed: 1, ..Variants::default() };
    let field = |text: &str| text.parse::<Field>().map(Some);
    Ok([
        Known { name: "2 s before the motion", before_motion_s: Some(2.0), variants: seeded(), total: TOTAL[0] },
        Known {
            name: "random starts in motion",
            before_motion_s: None,
            variants: Variants { starts: Some("random:2".parse::<Starts>()?), ..seeded() },
            total: TOTAL[1],
        },
        Known {
            name: "an offset of 30 µT",
            before_motion_s: None,
            variants: Variants { offset: Some("30uT:1".parse::<Offset>()?), ..seeded() },
            total: TOTAL[2],
        },
        Known {
            name: "a magnet of 30 µT",
            before_motion_s: None,
            variants: Variants { magnet: field("30uT")?, ..seeded() },
            total: TOTAL[3],
        },
        Known {
            name: "disturbances of 20 µT",
            before_motion_s: None,
            variants: Variants { disturb: field("20uT")?, ..seeded() },
            total: TOTAL[4],
        },
        Known {
            name: "a drift of 6 µT",
            before_motion_s: None,
            variants: Variants { drift: field("6uT")?, ..seeded() },
            total: TOTAL[5],
        },
    ])
}

const TOTAL: [[f64; 2]; 6] =
    [[2.501, 11.119], [4.770, 15.823], [14.274, 44.392], [12.352, 38.547], [4.685, 14.267], [6.134, 13.130]];

#[test]
fn hard_recordings_are_no_worse_than_known() -> Result<(), Box<dyn Error>> {
    let files = broad()?;
    let mut worse = Vec::new();
    for Known { name, before_motion_s, variants, total } in known()? {
        let count = variants.count();
        let evaluator = Evaluator {
            before_motion_s,
            variants,
            ..Evaluator::new(vec![Chosen::named("mekf", Axes::Nine, &[])?], Axes::Nine)
        };
        let mut scores = Vec::new();
        for file in &files {
            for variant in 0..count {
                let evaluation = evaluate_variant(file, variant, &evaluator, &Progress::new("", 0));
                scores.extend(evaluation.runs?.first().and_then(|run| run.score.rms()));
            }
        }
        let averages = Averages::of(scores).ok_or("no score")?;
        let measured = [averages.mean.total, averages.worst.total];
        println!("{name}: mean {:.3}, worst {:.3}", measured[0], measured[1]);
        let is_worse = measured.iter().zip(total).any(|(measured, known)| *measured > 1.02 * known);
        if is_worse {
            worse.push(format!("{name}: {measured:?} was {total:?}"));
        }
    }
    assert!(worse.is_empty(), "{worse:?}");
    Ok(())
}
