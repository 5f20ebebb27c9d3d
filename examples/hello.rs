//! An attitude filter without a robot: a plain value, fed by a loop. `cargo run --example hello`
//!
//! The body is level at first, then rolls to the right by 90° in three seconds.

use bb_estimators::attitude::{AttitudeFilter, ImuSample, MekfFilter, MekfParams};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut filter = MekfFilter::<f64>::new(MekfParams::default())?;
    let rate = 30_f64.to_radians();
    for step in 0..=800 {
        let time_s = f64::from(step) * 0.005;
        let angular_velocity = if time_s > 1.0 { rate } else { 0.0 };
        let roll = (time_s - 1.0).max(0.0) * rate;
        filter.update(&ImuSample {
            time_ns: i64::from(step) * 5_000_000,
            angular_velocity: [angular_velocity, 0.0, 0.0].into(),
            // An accelerometer at rest measures 1 g upwards.
            specific_force: [0.0, 9.81 * roll.sin(), 9.81 * roll.cos()].into(),
            magnetic_field: None,
        })?;
        if step % 200 == 0
            && let Some(world_from_body) = filter.world_from_body()
        {
            let (roll, pitch, yaw) = world_from_body.euler_angles();
            println!("{time_s:.0} s: roll {:.0}°", roll.to_degrees());
            assert!(pitch.abs() < 0.02 && yaw.abs() < 0.02);
        }
    }
    Ok(())
}
