//! The bags themselves: topics, types, counts and stamps.

use bb_core::payload::{Imu, MagneticField, Pose};
use bb_mcap::{Bag, IMU, MAGNETIC_FIELD, POSE};
use bb_tests::recordings::broad;
use std::time::Instant;

#[test]
fn the_recordings_read_through() {
    for path in broad().expect("they are there") {
        let name = path.file_name().expect("a name").display();
        let bag = Bag::open(&path).expect("opens");
        let imu = bag.topic_of("sensor_msgs/Imu").expect("one").clone();
        let mag = bag.topic_of("sensor_msgs/MagneticField").expect("one").clone();
        let truth = bag.topic_of("geometry_msgs/PoseStamped").expect("one").clone();
        let moving = bag.topic_of("std_msgs/Bool").expect("one").clone();
        assert_eq!([&*imu.name, &*mag.name, &*truth.name, &*moving.name], ["/imu", "/mag", "/truth", "/moving"]);

        let start = Instant::now();
        let topics = [&imu, &mag, &truth, &moving];
        let mut counts = [0u64; 4];
        let mut last = [i64::MIN; 4];
        let mut ends = [(0, 0); 4];
        let mut first_truth = None;
        let mut last_log = 0;
        for message in bag.messages(&topics.map(|t| t.name.clone())).expect("opens") {
            let message = message.expect("reads");
            let i = topics.iter().position(|t| t.name == message.topic).expect("a chosen topic");
            assert!(message.log_time_ns >= last_log, "{name}: in order of log time");
            last_log = message.log_time_ns;
            let at = match i {
                3 => message.log_time_ns as i64,
                _ => message.header().expect("reads").stamp.wall_time().as_unix_nanos(),
            };
            assert!(at > last[i], "{name}: stamps of {} increase", topics[i].name);
            if counts[i] == 0 {
                ends[i].0 = at;
            }
            (last[i], ends[i].1) = (at, at);
            counts[i] += 1;
            match &*message.schema {
                IMU => {
                    let (imu, _) = message.payload::<Imu>().expect("reads");
                    let values = imu.angular_velocity.iter().chain(&imu.linear_acceleration);
                    assert!(values.into_iter().all(|v| v.is_finite() && v.abs() < 200.0));
                }
                MAGNETIC_FIELD => {
                    let (field, _) = message.payload::<MagneticField>().expect("reads");
                    assert!(field.magnetic_field.norm() < 1e-3, "{name}: tesla");
                }
                POSE => {
                    let (pose, _) = message.payload::<Pose>().expect("reads");
                    let norm = pose.world_from_body.norm();
                    assert!(norm.is_nan() || (norm - 1.0).abs() < 1e-5, "{name}: {norm}");
                    // NaN where the markers were lost, in some recordings from the start.
                    if norm.is_finite() {
                        first_truth.get_or_insert(norm);
                    }
                }
                _ => {}
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        let total: u64 = counts.iter().sum();
        println!("{name}: {counts:?} messages, {:.0} messages/s", total as f64 / seconds);

        assert!((first_truth.expect("truth") - 1.0).abs() < 1e-5, "{name}: the first truth is a rotation");
        for (topic, count) in topics.iter().zip(counts) {
            assert_eq!(topic.messages, Some(count), "{name}: {}", topic.name);
        }
        let rate = (counts[0] - 1) as f64 / (ends[0].1 - ends[0].0) as f64 * 1e9;
        assert!((rate - 285.714).abs() < 0.01, "{name}: {rate} Hz");
        assert!(counts[0] > 10_000 && counts[3] > 0);
    }
}
