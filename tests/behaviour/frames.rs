//! Frames of outputs, transforms of inputs, and the topology as data.

use crate::kit::*;
use bb_core::nalgebra::Vector3;
use bb_core::topology::JointKind;

/// Origins of the inputs in the frame of the output, m.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Origins {
    pub(crate) near: Vector3<f64>,
    pub(crate) far: Vector3<f64>,
    pub(crate) far_x: Vector3<f64>,
}

/// Two numbers from two places.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Places<'a> {
    pub(crate) near: Input<'a, Number>,
    pub(crate) far: Input<'a, Number>,
}

/// Tells what it was given at the start.
pub(crate) struct Surveyor<const MOVING: bool = false>(Origins);

impl<const MOVING: bool> Estimator for Surveyor<MOVING> {
    type Options = NoOptions;
    type Input = Places<'static>;
    type Output = Origins;
    const HANDLES_MOVING_JOINTS: bool = MOVING;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        let far = context.frame_from_input("far");
        let far = match far {
            // It changes: each dispatch is told.
            Err(fault) if MOVING => {
                let message = "there is a moving joint between the input `far` and the output; `handle_transforms` is told where it is";
                assert_eq!(fault.to_string(), message);
                bb_core::nalgebra::Isometry3::identity()
            }
            far => far?,
        };
        Ok(Self(Origins {
            near: context.frame_from_input("near")?.translation.vector,
            far: far.translation.vector,
            far_x: far.rotation * Vector3::x(),
        }))
    }

    fn handle_input(&mut self, places: Places<'_>) -> Result<Reply<Origins>, Fault> {
        assert!((places.near.0 - places.far.0).abs() <= 1.0, "both count from 0 at 1 Hz");
        Ok(Reply::emit(self.0))
    }
}

robot! {
    robot Mast;

    sensors { sensor clock: Counter() { rate: 1 Hz; estimator of_the_robot: Echo(init = note); } }

    link base {
        sensor imu: Counter() { rate: 1 Hz; estimator at_a_link: Echo(init = note); }
        estimator here: Surveyor() {
            input near: sensor::base::imu, driver;
            input far: sensor::base::mount::mast::tip::top::imu;
        }
        estimator moving: Surveyor<true>() {
            input near: sensor::clock, driver;
            input far: sensor::base::pan::head::imu;
        }
        joint mount: fixed {
            origin: { xyz: [1 m, 0 m, 0 m], rpy: [0 deg, 0 deg, 90 deg] };
            sensor weight: Counter() { rate: 1 Hz; estimator at_a_joint: Echo(init = note); }
            link mast {
                joint tip: fixed {
                    origin: { xyz: [2 m, 0 m, 3 m] };
                    link top {
                        sensor imu: Counter() { rate: 1 Hz; estimator scaled: Echo(); }
                        estimator back: Surveyor() {
                            input near: sensor::base::mount::mast::tip::top::imu, driver;
                            input far: sensor::base::imu;
                        }
                        estimator at_joint: Surveyor() {
                            input near: sensor::base::mount::mast::tip::top::imu, driver;
                            input far: sensor::base::mount::weight;
                        }
                    }
                }
            }
        }
        joint pan: continuous {
            origin: { xyz: [0 m, 0 m, 5 m] };
            axis: [0, 3, 4];
            limit: { velocity: 60 deg/s, effort: 5 N*m };
            link head {
                sensor imu: Counter() { rate: 1 Hz; }
                estimator of_a_link: Echo(init = note) { input number: sensor::clock; }
            }
        }
    }
}

#[test]
fn transforms_are_the_products_of_the_fixed_joints() {
    let _alone = one_at_a_time();
    let mut simulation = Mast::builder().simulate().expect("it starts");
    let here = simulation.subscribe(mast::estimator::base::here);
    let back = simulation.subscribe(mast::estimator::base::mount::mast::tip::top::back);
    let at_joint = simulation.subscribe(mast::estimator::base::mount::mast::tip::top::at_joint);
    let moving = simulation.subscribe(mast::estimator::base::moving);
    let scaled = simulation.subscribe(mast::sensor::base::mount::mast::tip::top::imu::scaled);
    simulation.run_for(Duration::from_secs(1));

    let here = here.drain().last().expect("it emitted");
    assert_eq!((here.near, here.frame.name()), (Vector3::zeros(), "base"));
    assert!((here.far - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12);
    assert!((here.far_x - Vector3::y()).norm() < 1e-12);

    let back = back.drain().last().expect("it emitted");
    assert_eq!((back.near, back.frame.name()), (Vector3::zeros(), "top"));
    assert!((back.far - Vector3::new(-2.0, 1.0, -3.0)).norm() < 1e-12);
    assert!((back.far_x + Vector3::y()).norm() < 1e-12);

    // A sensor at a joint is at the origin of the joint, fixed to the parent.
    let at_joint = at_joint.drain().last().expect("it emitted");
    assert!((at_joint.far - Vector3::new(-2.0, 0.0, -3.0)).norm() < 1e-12);

    // A robot-level sensor has no frame.
    let moving = moving.drain().last().expect("it emitted");
    assert_eq!(moving.near, Vector3::zeros());

    assert_eq!(scaled.drain().last().map(|number| number.frame.name()), Some("top"));
}

#[test]
fn the_topology_is_data() {
    let topology = Mast::TOPOLOGY;
    assert_eq!(Mast::NAME, "Mast");
    assert_eq!(topology.root().name(), "base");
    let top = topology.link("top").and_then(|link| link.root_from_link).expect("only fixed joints lie between");
    assert!((top.isometry().translation.vector - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12);
    assert!(topology.link("head").is_some_and(|head| head.root_from_link.is_none()));
    let pan = topology.joint("pan").expect("it is declared");
    assert_eq!((pan.kind, pan.axis), (JointKind::Continuous, Some([0.0, 0.6, 0.8])));
    assert_eq!((topology.links[pan.parent].name, topology.links[pan.child].name), ("base", "head"));
    let limit = pan.limit.expect("it is declared");
    assert_eq!((limit.lower, limit.effort), (None, Some(5.0)));
    assert!((limit.velocity.unwrap_or(0.0) - 60f64.to_radians()).abs() < 1e-15);
}

/// Contexts of estimators, in the order in which they are made.
static CONTEXTS: Mutex<Vec<[&str; 3]>> = Mutex::new(Vec::new());
fn note(context: &Context) -> Done {
    lock(&CONTEXTS).push([context.robot(), context.path(), context.frame().name()]);
    Ok(())
}

#[test]
fn an_estimator_gets_its_robot_its_path_and_its_frame() {
    let _alone = one_at_a_time();
    lock(&CONTEXTS).clear();
    Mast::builder().simulate().expect("it starts");
    let mut contexts = std::mem::take(&mut *lock(&CONTEXTS));
    contexts.sort_unstable();
    let expected = [
        ["Mast", "estimator/base/pan/head/of_a_link", "head"],
        ["Mast", "sensor/base/imu/at_a_link", "base"],
        ["Mast", "sensor/base/mount/weight/at_a_joint", "mount"],
        ["Mast", "sensor/clock/of_the_robot", ""],
    ];
    assert_eq!(contexts, expected);
}
