// What `robot!` makes of everything.txt. Written by a test: `UPDATE_EXPANSION=1 cargo test -p bb-macros expansion`.

#[allow(
    non_snake_case,
    unreachable_pub,
    unused_imports,
    missing_copy_implementations,
    missing_debug_implementations
)]
mod __Rover_2_11 {
    use super::*;
    /// One of everything.
    pub struct Rover;
}
impl __Rover_2_11::Rover {
    /// Assembles the robot: options may be changed and topics subscribed to before it starts.
    #[allow(dead_code)]
    pub fn builder() -> ::bb_core::Builder<Self> {
        <Self as ::bb_core::Robot>::builder()
    }
}
#[doc(hidden)]
pub type __Rover_2_11__given__sensor_battery = Ina219;
#[doc(hidden)]
pub type __Rover_2_11__probed__sensor_battery = ::bb_core::__private::Probed<
    __Rover_2_11__given__sensor_battery,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__sensor_battery>>::IS_SENSOR,
            <Probe<__Rover_2_11__given__sensor_battery>>::IMPLEMENTS_SENSOR,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__sensor_battery = <__Rover_2_11__probed__sensor_battery as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__sensor_battery = <<__Rover_2_11__probed__sensor_battery as ::bb_core::__private::Known>::Type as ::bb_core::Sensor>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__sensor_battery = <<__Rover_2_11__probed__sensor_battery as ::bb_core::__private::Known>::Given as ::bb_core::Sensor>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__sensor_base_imu = Bmi270;
#[doc(hidden)]
pub type __Rover_2_11__probed__sensor_base_imu = ::bb_core::__private::Probed<
    __Rover_2_11__given__sensor_base_imu,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__sensor_base_imu>>::IS_SENSOR,
            <Probe<__Rover_2_11__given__sensor_base_imu>>::IMPLEMENTS_SENSOR,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__sensor_base_imu = <__Rover_2_11__probed__sensor_base_imu as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__sensor_base_imu = <<__Rover_2_11__probed__sensor_base_imu as ::bb_core::__private::Known>::Type as ::bb_core::Sensor>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__sensor_base_imu = <<__Rover_2_11__probed__sensor_base_imu as ::bb_core::__private::Known>::Given as ::bb_core::Sensor>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__sensor_base_pan_encoder = Encoder;
#[doc(hidden)]
pub type __Rover_2_11__probed__sensor_base_pan_encoder = ::bb_core::__private::Probed<
    __Rover_2_11__given__sensor_base_pan_encoder,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__sensor_base_pan_encoder>>::IS_SENSOR,
            <Probe<__Rover_2_11__given__sensor_base_pan_encoder>>::IMPLEMENTS_SENSOR,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__sensor_base_pan_encoder = <__Rover_2_11__probed__sensor_base_pan_encoder as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__sensor_base_pan_encoder = <<__Rover_2_11__probed__sensor_base_pan_encoder as ::bb_core::__private::Known>::Type as ::bb_core::Sensor>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__sensor_base_pan_encoder = <<__Rover_2_11__probed__sensor_base_pan_encoder as ::bb_core::__private::Known>::Given as ::bb_core::Sensor>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__sensor_base_imu_tilt = Madgwick;
#[doc(hidden)]
pub type __Rover_2_11__probed__sensor_base_imu_tilt = ::bb_core::__private::Probed<
    __Rover_2_11__given__sensor_base_imu_tilt,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__sensor_base_imu_tilt>>::IS_ESTIMATOR,
            <Probe<__Rover_2_11__given__sensor_base_imu_tilt>>::IMPLEMENTS_ESTIMATOR,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__sensor_base_imu_tilt = <__Rover_2_11__probed__sensor_base_imu_tilt as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__sensor_base_imu_tilt = <<__Rover_2_11__probed__sensor_base_imu_tilt as ::bb_core::__private::Known>::Type as ::bb_core::Estimator>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__sensor_base_imu_tilt = <<__Rover_2_11__probed__sensor_base_imu_tilt as ::bb_core::__private::Known>::Given as ::bb_core::Estimator>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__estimator_base_pose = Eskf;
#[doc(hidden)]
pub type __Rover_2_11__probed__estimator_base_pose = ::bb_core::__private::Probed<
    __Rover_2_11__given__estimator_base_pose,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__estimator_base_pose>>::IS_ESTIMATOR,
            <Probe<__Rover_2_11__given__estimator_base_pose>>::IMPLEMENTS_ESTIMATOR,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__estimator_base_pose = <__Rover_2_11__probed__estimator_base_pose as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__estimator_base_pose = <<__Rover_2_11__probed__estimator_base_pose as ::bb_core::__private::Known>::Type as ::bb_core::Estimator>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__estimator_base_pose = <<__Rover_2_11__probed__estimator_base_pose as ::bb_core::__private::Known>::Given as ::bb_core::Estimator>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__actuator_base_pan_servo = Dynamixel;
#[doc(hidden)]
pub type __Rover_2_11__probed__actuator_base_pan_servo = ::bb_core::__private::Probed<
    __Rover_2_11__given__actuator_base_pan_servo,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__actuator_base_pan_servo>>::IS_ACTUATOR,
            <Probe<__Rover_2_11__given__actuator_base_pan_servo>>::IMPLEMENTS_ACTUATOR,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__actuator_base_pan_servo = <__Rover_2_11__probed__actuator_base_pan_servo as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__actuator_base_pan_servo = <<__Rover_2_11__probed__actuator_base_pan_servo as ::bb_core::__private::Known>::Type as ::bb_core::Actuator>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__actuator_base_pan_servo = <<__Rover_2_11__probed__actuator_base_pan_servo as ::bb_core::__private::Known>::Given as ::bb_core::Actuator>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__controller_stability = Stability;
#[doc(hidden)]
pub type __Rover_2_11__probed__controller_stability = ::bb_core::__private::Probed<
    __Rover_2_11__given__controller_stability,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__controller_stability>>::IS_SERVICE,
            <Probe<__Rover_2_11__given__controller_stability>>::IMPLEMENTS_SERVICE,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__controller_stability = <__Rover_2_11__probed__controller_stability as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__controller_stability = <<__Rover_2_11__probed__controller_stability as ::bb_core::__private::Known>::Type as ::bb_core::Service>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__controller_stability = <<__Rover_2_11__probed__controller_stability as ::bb_core::__private::Known>::Given as ::bb_core::Service>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__bridge_ros = RosBridge;
#[doc(hidden)]
pub type __Rover_2_11__probed__bridge_ros = ::bb_core::__private::Probed<
    __Rover_2_11__given__bridge_ros,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__bridge_ros>>::IS_SERVICE,
            <Probe<__Rover_2_11__given__bridge_ros>>::IMPLEMENTS_SERVICE,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__bridge_ros = <__Rover_2_11__probed__bridge_ros as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__bridge_ros = <<__Rover_2_11__probed__bridge_ros as ::bb_core::__private::Known>::Type as ::bb_core::Service>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__bridge_ros = <<__Rover_2_11__probed__bridge_ros as ::bb_core::__private::Known>::Given as ::bb_core::Service>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__command_arm = Arm;
#[doc(hidden)]
pub type __Rover_2_11__probed__command_arm = ::bb_core::__private::Probed<
    __Rover_2_11__given__command_arm,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__command_arm>>::IS_COMMAND,
            <Probe<__Rover_2_11__given__command_arm>>::IMPLEMENTS_COMMAND,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__command_arm = <__Rover_2_11__probed__command_arm as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__command_arm = <<__Rover_2_11__probed__command_arm as ::bb_core::__private::Known>::Type as ::bb_core::Command>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__command_arm = <<__Rover_2_11__probed__command_arm as ::bb_core::__private::Known>::Given as ::bb_core::Command>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__command_move_to = MoveTo;
#[doc(hidden)]
pub type __Rover_2_11__probed__command_move_to = ::bb_core::__private::Probed<
    __Rover_2_11__given__command_move_to,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__command_move_to>>::IS_COMMAND,
            <Probe<__Rover_2_11__given__command_move_to>>::IMPLEMENTS_COMMAND,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__command_move_to = <__Rover_2_11__probed__command_move_to as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__command_move_to = <<__Rover_2_11__probed__command_move_to as ::bb_core::__private::Known>::Type as ::bb_core::Command>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__command_move_to = <<__Rover_2_11__probed__command_move_to as ::bb_core::__private::Known>::Given as ::bb_core::Command>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given__command_stop = Stop;
#[doc(hidden)]
pub type __Rover_2_11__probed__command_stop = ::bb_core::__private::Probed<
    __Rover_2_11__given__command_stop,
    {
        use ::bb_core::__private::{NotProbed as _, Probe};
        ::bb_core::__private::implemented(
            <Probe<__Rover_2_11__given__command_stop>>::IS_COMMAND,
            <Probe<__Rover_2_11__given__command_stop>>::IMPLEMENTS_COMMAND,
        )
    },
>;
#[doc(hidden)]
pub type __Rover_2_11__command_stop = <__Rover_2_11__probed__command_stop as ::bb_core::__private::Known>::Type;
#[doc(hidden)]
pub type __Rover_2_11__options__command_stop = <<__Rover_2_11__probed__command_stop as ::bb_core::__private::Known>::Type as ::bb_core::Command>::Options;
#[doc(hidden)]
pub type __Rover_2_11__given_options__command_stop = <<__Rover_2_11__probed__command_stop as ::bb_core::__private::Known>::Given as ::bb_core::Command>::Options;
#[doc(hidden)]
pub type __Rover_2_11__payload__sensor_battery = <__Rover_2_11__sensor_battery as ::bb_core::Sensor>::Output;
#[doc(hidden)]
pub type __Rover_2_11__payload__controller_stability = <__Rover_2_11__controller_stability as ::bb_core::Service>::Output;
#[doc(hidden)]
pub type __Rover_2_11__payload__bridge_ros = <__Rover_2_11__bridge_ros as ::bb_core::Service>::Output;
#[doc(hidden)]
pub type __Rover_2_11__payload__sensor_base_imu = <__Rover_2_11__sensor_base_imu as ::bb_core::Sensor>::Output;
#[doc(hidden)]
pub type __Rover_2_11__payload__sensor_base_imu_tilt = <<<__Rover_2_11__sensor_base_imu_tilt as ::bb_core::Estimator>::Output as ::bb_core::Outputs>::Only as ::bb_core::__private::EmittedAt<
    <__Rover_2_11__sensor_base_imu_tilt as ::bb_core::Estimator>::Output,
>>::Payload;
#[doc(hidden)]
pub type __Rover_2_11__payload__estimator_base_pose_pose = <::bb_core::__private::At<
    {
        ::bb_core::__private::find_output::<
            <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
        >("pose")
    },
> as ::bb_core::__private::EmittedAt<
    <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
>>::Payload;
#[doc(hidden)]
pub type __Rover_2_11__payload__nav_velocity = <::bb_core::__private::At<
    {
        ::bb_core::__private::find_output::<
            <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
        >("velocity")
    },
> as ::bb_core::__private::EmittedAt<
    <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
>>::Payload;
#[doc(hidden)]
pub type __Rover_2_11__payload__sensor_base_pan_encoder = <__Rover_2_11__sensor_base_pan_encoder as ::bb_core::Sensor>::Output;
#[doc(hidden)]
pub type __Rover_2_11_must_be_declared_outside_of_functions = __Rover_2_11::Rover;
#[allow(clippy::all, non_snake_case, non_camel_case_types, unused_variables)]
const _: () = {
    use ::bb_core::__private;
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__sensor_battery,
        0usize,
    >("Ina219", []);
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__sensor_base_imu,
        1usize,
    >("Bmi270", ["bus"]);
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__sensor_base_pan_encoder,
        1usize,
    >("Encoder", ["id"]);
    const _: () = ::bb_core::__private::check_number::<
        __Rover_2_11__options__sensor_base_pan_encoder,
    >("Encoder", "id", 3f64);
    const _: () = ::bb_core::__private::check_nested::<
        __Rover_2_11__sensor_base_imu_tilt,
        1usize,
    >("Madgwick", ["beta"], false);
    const _: () = ::bb_core::__private::check_number::<
        __Rover_2_11__options__sensor_base_imu_tilt,
    >("Madgwick", "beta", 0.1f64);
    const _: () = ::bb_core::__private::check_estimator::<
        __Rover_2_11__estimator_base_pose,
        0usize,
        3usize,
    >("Eskf", [], ["imu", "tilt", "wheel"], true);
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__actuator_base_pan_servo,
        1usize,
    >("Dynamixel", ["id"]);
    const _: () = ::bb_core::__private::check_number::<
        __Rover_2_11__options__actuator_base_pan_servo,
    >("Dynamixel", "id", 3f64);
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__controller_stability,
        0usize,
    >("Stability", []);
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__bridge_ros,
        1usize,
    >("RosBridge", ["port"]);
    const _: () = ::bb_core::__private::check_number::<
        __Rover_2_11__options__bridge_ros,
    >("RosBridge", "port", 1f64);
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__command_arm,
        0usize,
    >("Arm", []);
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__command_move_to,
        1usize,
    >("MoveTo", ["speed"]);
    const _: () = ::bb_core::__private::check_quantity::<
        __Rover_2_11__options__command_move_to,
    >("MoveTo", "speed", 1f64, [1i8, 0i8, -1i8, 0i8, 0i8, 0i8], "a velocity");
    const _: () = ::bb_core::__private::check_required::<
        __Rover_2_11__options__command_stop,
        0usize,
    >("Stop", []);
    const _: () = ::bb_core::__private::check_input::<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
    >("Eskf", "imu");
    const _: () = ::bb_core::__private::check_input::<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
    >("Eskf", "tilt");
    const _: () = ::bb_core::__private::check_input::<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
    >("Eskf", "wheel");
    const _: () = ::bb_core::__private::check_optional::<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
    >("Eskf", "wheel");
    const _: () = ::bb_core::__private::check_output::<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
    >("Eskf", "pose");
    const _: () = ::bb_core::__private::check_output::<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
    >("Eskf", "velocity");
    const _: () = ::bb_core::__private::check_position(
        "servo",
        "pan",
        &[
            <__Rover_2_11__payload__sensor_base_pan_encoder as ::bb_core::Payload>::TELLS_JOINT_POSITION,
        ],
    );
    const _: () = ::bb_core::__private::check_role(
        "arm",
        <__Rover_2_11__command_arm as ::bb_core::Command>::ROLE,
        &[],
    );
    const _: () = ::bb_core::__private::check_role(
        "move_to",
        <__Rover_2_11__command_move_to as ::bb_core::Command>::ROLE,
        &[("arm", <__Rover_2_11__command_arm as ::bb_core::Command>::ROLE)],
    );
    const _: () = ::bb_core::__private::check_reachable(
        "move_to",
        <__Rover_2_11__command_move_to as ::bb_core::Command>::ROLE,
        &["idle", "degraded"],
    );
    const _: () = ::bb_core::__private::check_role(
        "stop",
        <__Rover_2_11__command_stop as ::bb_core::Command>::ROLE,
        &[
            ("arm", <__Rover_2_11__command_arm as ::bb_core::Command>::ROLE),
            ("move_to", <__Rover_2_11__command_move_to as ::bb_core::Command>::ROLE),
        ],
    );
    static __SENSORS: [__private::SensorDeclaration; 3usize] = [
        __private::SensorDeclaration {
            path: "sensor/battery",
            frame: __private::Frame::new(""),
            period_nanos: __private::None,
            root_from_frame: __private::None,
            supervisor: 0usize,
        },
        __private::SensorDeclaration {
            path: "sensor/base/imu",
            frame: __private::Frame::new("base"),
            period_nanos: __private::Some(5000000i64),
            root_from_frame: __private::Some(__private::Transform::IDENTITY),
            supervisor: 1usize,
        },
        __private::SensorDeclaration {
            path: "sensor/base/pan/encoder",
            frame: __private::Frame::new("pan"),
            period_nanos: __private::Some(20000000i64),
            root_from_frame: __private::Some(__private::Transform {
                translation: [0.2f64, 0f64, 0.9f64],
                rotation: [0.7071067811865476f64, 0f64, 0f64, 0.7071067811865475f64],
            }),
            supervisor: 3usize,
        },
    ];
    static __ESTIMATORS: [__private::EstimatorDeclaration; 2usize] = [
        __private::EstimatorDeclaration {
            path: "sensor/base/imu/tilt",
            frame: __private::Frame::new("base"),
            inputs: &[__private::InputDeclaration::nested("imu", "sensor/base/imu")],
            outputs: &["sensor/base/imu/tilt"],
            output_names: &["out"],
            island: 0usize,
            supervisor: 1usize,
            health: __private::HealthDeclaration {
                latency_budget_nanos: __private::Some(1000000i64),
                lost_after_nanos: __private::Some(100000000i64),
                recover_after: 1u32,
                on_degraded: __private::None,
                on_lost: __private::Some(2usize),
                on_recovered: __private::None,
            },
            worker: __private::None,
        },
        __private::EstimatorDeclaration {
            path: "estimator/base/pose",
            frame: __private::Frame::new("base"),
            inputs: &[
                __private::InputDeclaration {
                    index: 0usize,
                    name: "imu",
                    source: "sensor/base/imu",
                    driver: true,
                    optional: false,
                    tolerance_nanos: __private::Some(20000000i64),
                    stale_after_nanos: __private::None,
                    frame_from_input: __private::Some(__private::Transform::IDENTITY),
                },
                __private::InputDeclaration {
                    index: 1usize,
                    name: "tilt",
                    source: "sensor/base/imu/tilt",
                    driver: false,
                    optional: false,
                    tolerance_nanos: __private::Some(20000000i64),
                    stale_after_nanos: __private::None,
                    frame_from_input: __private::Some(__private::Transform::IDENTITY),
                },
                __private::InputDeclaration {
                    index: 2usize,
                    name: "wheel",
                    source: "sensor/base/pan/encoder",
                    driver: false,
                    optional: true,
                    tolerance_nanos: __private::Some(50000000i64),
                    stale_after_nanos: __private::None,
                    frame_from_input: __private::Some(__private::Transform {
                        translation: [0.2f64, 0f64, 0.9f64],
                        rotation: [
                            0.7071067811865476f64,
                            0f64,
                            0f64,
                            0.7071067811865475f64,
                        ],
                    }),
                },
            ],
            outputs: &["estimator/base/pose/pose", "nav/velocity"],
            output_names: &["pose", "velocity"],
            island: 1usize,
            supervisor: 1usize,
            health: __private::HealthDeclaration::NONE,
            worker: __private::Some(__private::WorkerDeclaration {
                priority: __private::Some(80u8),
                core: __private::None,
            }),
        },
    ];
    static __ACTUATORS: [__private::ActuatorDeclaration; 1usize] = [
        __private::ActuatorDeclaration {
            path: "actuator/base/pan/servo",
            joint: "pan",
            motions: [
                "actuator/base/pan/servo/begin_motion",
                "actuator/base/pan/servo/end_motion",
            ],
            supervisor: 3usize,
            new_topic: __private::ActuatorNode::<
                __Rover_2_11__actuator_base_pan_servo,
            >::new_topic,
        },
    ];
    static __SERVICES: [__private::SensorDeclaration; 2usize] = [
        __private::SensorDeclaration {
            path: "controller/stability",
            frame: __private::Frame::NONE,
            period_nanos: __private::Some(10000000i64),
            root_from_frame: __private::None,
            supervisor: 0,
        },
        __private::SensorDeclaration {
            path: "bridge/ros",
            frame: __private::Frame::NONE,
            period_nanos: __private::None,
            root_from_frame: __private::None,
            supervisor: 0,
        },
    ];
    static __CATEGORIES: [__private::CategoryDeclaration; 2usize] = [
        __private::CategoryDeclaration {
            name: "default",
            concurrency: 1usize,
        },
        __private::CategoryDeclaration {
            name: "motion",
            concurrency: 2usize,
        },
    ];
    static __COMMANDS: [__private::CommandDeclaration; 3usize] = [
        __private::CommandDeclaration {
            name: "arm",
            path: "command/arm",
            allowed_states: __private::None,
            timeout_nanos: __private::None,
            category: 0usize,
            cancel: __private::Cancel::Nothing,
        },
        __private::CommandDeclaration {
            name: "move_to",
            path: "command/move_to",
            allowed_states: __private::Some(&["idle", "degraded"]),
            timeout_nanos: __private::Some(2000000000i64),
            category: 1usize,
            cancel: __private::Cancel::Nothing,
        },
        __private::CommandDeclaration {
            name: "stop",
            path: "command/stop",
            allowed_states: __private::None,
            timeout_nanos: __private::None,
            category: 0usize,
            cancel: __private::Cancel::All,
        },
    ];
    static __PARAMETERS: [__private::ParameterDeclaration; 1usize] = [
        __private::ParameterDeclaration {
            path: "param/imu/beta",
            doc: "Weight of each sample in the estimate.",
            default: __private::ParameterDefault::Float(0.1f64),
            range: __private::Some(__private::Range {
                start: 0f64,
                end: 1f64,
                text: "0.0..=1.0",
            }),
            unit: "",
        },
    ];
    static __TOPOLOGY: __private::Topology = __private::Topology {
        links: &[
            __private::Link {
                name: "base",
                parent_joint: __private::None,
                root_from_link: __private::Some(__private::Transform::IDENTITY),
                inertial: __private::Some(__private::Inertial {
                    link_from_inertia: __private::Origin::IDENTITY,
                    mass: 12f64,
                    inertia: [1f64, 0f64, 0f64, 1f64, 0f64, 1f64],
                }),
                visuals: &[],
                collisions: &[],
            },
            __private::Link {
                name: "head",
                parent_joint: __private::Some(0usize),
                root_from_link: __private::None,
                inertial: __private::None,
                visuals: &[],
                collisions: &[],
            },
        ],
        joints: &[
            __private::Joint {
                name: "pan",
                kind: __private::JointKind::Continuous,
                parent: 0usize,
                child: 1usize,
                parent_from_joint: __private::Origin {
                    xyz: [0.2f64, 0f64, 0.9f64],
                    rpy: [0f64, 0f64, 1.5707963267948966f64],
                },
                axis: __private::Some([0f64, 0f64, 1f64]),
                limit: __private::None,
                dynamics: __private::None,
                mimic: __private::None,
                transmission: __private::None,
            },
        ],
    };
    fn __declared_options() -> __private::OptionsList {
        let mut options = __private::Default::default();
        __declared_options0(&mut options);
        options
    }
    fn __declared_options0(options: &mut __private::OptionsList) {
        options
            .add(
                <__Rover_2_11__given_options__sensor_battery as ::bb_core::Options>::defaults(),
            );
        __declared_sensor_base_imu(options);
        __declared_sensor_base_pan_encoder(options);
        __declared_sensor_base_imu_tilt(options);
        options
            .add(
                <__Rover_2_11__given_options__estimator_base_pose as ::bb_core::Options>::defaults(),
            );
        __declared_actuator_base_pan_servo(options);
        options
            .add(
                <__Rover_2_11__given_options__controller_stability as ::bb_core::Options>::defaults(),
            );
        __declared_bridge_ros(options);
        options
            .add(
                <__Rover_2_11__given_options__command_arm as ::bb_core::Options>::defaults(),
            );
        __declared_command_move_to(options);
        options
            .add(
                <__Rover_2_11__given_options__command_stop as ::bb_core::Options>::defaults(),
            );
    }
    fn __declared_sensor_base_imu(__all: &mut __private::OptionsList) {
        let mut __options: __Rover_2_11__given_options__sensor_base_imu = ::bb_core::Options::defaults();
        __options.bus = ::bb_core::__private::FromText::from_text("i2c-1");
        __all.add(__options);
    }
    fn __declared_sensor_base_pan_encoder(__all: &mut __private::OptionsList) {
        let mut __options: __Rover_2_11__given_options__sensor_base_pan_encoder = ::bb_core::Options::defaults();
        __options.id = 3;
        __all.add(__options);
    }
    fn __declared_sensor_base_imu_tilt(__all: &mut __private::OptionsList) {
        let __options: __Rover_2_11__given_options__sensor_base_imu_tilt = ::bb_core::Options::defaults();
        __all.add(__options);
    }
    fn __declared_actuator_base_pan_servo(__all: &mut __private::OptionsList) {
        let mut __options: __Rover_2_11__given_options__actuator_base_pan_servo = ::bb_core::Options::defaults();
        __options.id = 3;
        __all.add(__options);
    }
    fn __declared_bridge_ros(__all: &mut __private::OptionsList) {
        let mut __options: __Rover_2_11__given_options__bridge_ros = ::bb_core::Options::defaults();
        __options.port = 1;
        __all.add(__options);
    }
    fn __declared_command_move_to(__all: &mut __private::OptionsList) {
        let mut __options: __Rover_2_11__given_options__command_move_to = ::bb_core::Options::defaults();
        __options.speed = __private::FromQuantity::from_quantity(1f64);
        __all.add(__options);
    }
    pub struct __Wiring {
        topics: __Topics,
        islands: __Islands,
        actuators: __Actuators,
        environment: __private::Environment,
    }
    pub struct __Topics {
        g0: __Topics0,
    }
    fn __new_topics() -> __Topics {
        __Topics { g0: __new_topics0() }
    }
    pub struct __Topics0 {
        sensor_battery: __private::Topic<__Rover_2_11__payload__sensor_battery>,
        controller_stability: __private::Topic<
            __Rover_2_11__payload__controller_stability,
        >,
        bridge_ros: __private::Topic<__Rover_2_11__payload__bridge_ros>,
        sensor_base_imu: __private::Topic<__Rover_2_11__payload__sensor_base_imu>,
        sensor_base_imu_tilt: __private::Topic<
            __Rover_2_11__payload__sensor_base_imu_tilt,
        >,
        estimator_base_pose_pose: __private::Topic<
            __Rover_2_11__payload__estimator_base_pose_pose,
        >,
        nav_velocity: __private::Topic<__Rover_2_11__payload__nav_velocity>,
        sensor_base_pan_encoder: __private::Topic<
            __Rover_2_11__payload__sensor_base_pan_encoder,
        >,
    }
    fn __new_topics0() -> __Topics0 {
        __Topics0 {
            sensor_battery: __private::Topic::new("sensor/battery"),
            controller_stability: __private::Topic::new("controller/stability"),
            bridge_ros: __private::Topic::new("bridge/ros"),
            sensor_base_imu: __private::Topic::new("sensor/base/imu"),
            sensor_base_imu_tilt: __private::Topic::new("sensor/base/imu/tilt"),
            estimator_base_pose_pose: __private::Topic::new("estimator/base/pose/pose"),
            nav_velocity: __private::Topic::new("nav/velocity"),
            sensor_base_pan_encoder: __private::Topic::new("sensor/base/pan/encoder"),
        }
    }
    pub struct __Islands {
        g0: __Islands0,
    }
    fn __new_islands(
        options: &__private::OptionsList,
        environment: &__private::Environment,
    ) -> __Islands {
        __Islands {
            g0: __new_islands0(options, environment),
        }
    }
    pub struct __Islands0 {
        sensor_base_imu_tilt: __private::Island<
            __private::Solo<__member__sensor_base_imu_tilt>,
        >,
        estimator_base_pose: __private::Island<__Island_estimator_base_pose>,
    }
    fn __new_islands0(
        options: &__private::OptionsList,
        environment: &__private::Environment,
    ) -> __Islands0 {
        __Islands0 {
            sensor_base_imu_tilt: __private::start_alone(
                options,
                3usize,
                __private::Binding {
                    apply: |
                        options: &mut __Rover_2_11__options__sensor_base_imu_tilt,
                        values: &__private::ParameterValues|
                    {
                        options.beta = __private::FromParameter::from_parameter(
                            values.get::<f64>(0usize),
                        );
                    },
                    parameters: &[0usize],
                },
                environment,
            ),
            estimator_base_pose: __private::Island::new(__Island_estimator_base_pose {
                estimator_base_pose: __private::start::<
                    __member__estimator_base_pose,
                >(options, 4usize, __private::Binding::NONE, environment),
            }),
        }
    }
    pub struct __Actuators {
        g0: __Actuators0,
    }
    fn __new_actuators(
        options: &__private::OptionsList,
        assembly: &__private::Assembly,
    ) -> __Actuators {
        __Actuators {
            g0: __new_actuators0(options, assembly),
        }
    }
    pub struct __Actuators0 {
        actuator_base_pan_servo: __private::ActuatorNode<
            __Rover_2_11__actuator_base_pan_servo,
        >,
    }
    fn __new_actuators0(
        options: &__private::OptionsList,
        assembly: &__private::Assembly,
    ) -> __Actuators0 {
        __Actuators0 {
            actuator_base_pan_servo: __private::ActuatorNode::<
                __Rover_2_11__actuator_base_pan_servo,
            >::new(
                0usize,
                &__ACTUATORS[0usize],
                options,
                5usize,
                __private::Binding::NONE,
                assembly,
            ),
        }
    }
    fn __actuator(
        whole: &__Actuators,
        number: usize,
    ) -> __private::Option<&dyn __private::AnyActuator> {
        match number / 16usize {
            0usize => __actuator0(&whole.g0, number % 16usize),
            _ => __private::None,
        }
    }
    fn __actuator0(
        group: &__Actuators0,
        number: usize,
    ) -> __private::Option<&dyn __private::AnyActuator> {
        match number {
            0usize => __private::Some(&group.actuator_base_pan_servo),
            _ => __private::None,
        }
    }
    fn __topic(
        whole: &__Topics,
        number: usize,
    ) -> __private::Option<&dyn __private::AnyTopic> {
        match number / 16usize {
            0usize => __topic0(&whole.g0, number % 16usize),
            _ => __private::None,
        }
    }
    fn __topic0(
        group: &__Topics0,
        number: usize,
    ) -> __private::Option<&dyn __private::AnyTopic> {
        match number {
            0usize => __private::Some(&group.sensor_battery),
            1usize => __private::Some(&group.controller_stability),
            2usize => __private::Some(&group.bridge_ros),
            3usize => __private::Some(&group.sensor_base_imu),
            4usize => __private::Some(&group.sensor_base_imu_tilt),
            5usize => __private::Some(&group.estimator_base_pose_pose),
            6usize => __private::Some(&group.nav_velocity),
            7usize => __private::Some(&group.sensor_base_pan_encoder),
            _ => __private::None,
        }
    }
    static __ISLANDS: [__private::IslandOf<__Wiring>; 2usize] = [
        __private::island_of::<__private::Solo<__member__sensor_base_imu_tilt>>,
        __private::island_of::<__Island_estimator_base_pose>,
    ];
    impl __private::IslandWiring for __Wiring {
        const ESTIMATORS: &'static [__private::EstimatorDeclaration] = &__ESTIMATORS;
        #[inline]
        fn environment(&self) -> &__private::Environment {
            &self.environment
        }
    }
    impl __Wiring {
        #[inline]
        fn sensor_battery(
            &self,
            message: &__private::Stamped<__Rover_2_11__payload__sensor_battery>,
            now: __private::MonotonicTime,
        ) {
            let line = self
                .environment
                .publish(0usize, &self.topics.g0.sensor_battery, message, now);
        }
        #[inline]
        fn controller_stability(
            &self,
            message: &__private::Stamped<__Rover_2_11__payload__controller_stability>,
            now: __private::MonotonicTime,
        ) {
            let line = self
                .environment
                .publish(1usize, &self.topics.g0.controller_stability, message, now);
        }
        #[inline]
        fn bridge_ros(
            &self,
            message: &__private::Stamped<__Rover_2_11__payload__bridge_ros>,
            now: __private::MonotonicTime,
        ) {
            let line = self
                .environment
                .publish(2usize, &self.topics.g0.bridge_ros, message, now);
        }
        #[inline]
        fn sensor_base_imu(
            &self,
            message: &__private::Stamped<__Rover_2_11__payload__sensor_base_imu>,
            now: __private::MonotonicTime,
        ) {
            let line = self
                .environment
                .publish(3usize, &self.topics.g0.sensor_base_imu, message, now);
            __private::enter_alone::<
                __member__sensor_base_imu_tilt,
            >(self, now, line, message);
            __private::enter::<
                __Island_estimator_base_pose,
                _,
            >(
                self,
                now,
                __private::Key {
                    entry: 7usize,
                    line: line,
                },
                message,
                __Island_estimator_base_pose::sensor_base_imu,
                __Message_estimator_base_pose::sensor_base_imu,
            );
        }
        #[inline]
        fn sensor_base_pan_encoder(
            &self,
            message: &__private::Stamped<__Rover_2_11__payload__sensor_base_pan_encoder>,
            now: __private::MonotonicTime,
        ) {
            let line = self
                .environment
                .publish(7usize, &self.topics.g0.sensor_base_pan_encoder, message, now);
            __private::enter::<
                __Island_estimator_base_pose,
                _,
            >(
                self,
                now,
                __private::Key {
                    entry: 14usize,
                    line: line,
                },
                message,
                __Island_estimator_base_pose::sensor_base_pan_encoder__kept,
                __Message_estimator_base_pose::sensor_base_pan_encoder__kept,
            );
        }
    }
    type __input__sensor_base_imu_tilt = <<__Rover_2_11__sensor_base_imu_tilt as ::bb_core::Estimator>::Input as ::bb_core::Inputs>::Nested;
    type __taken__sensor_base_imu_tilt = <__input__sensor_base_imu_tilt as __private::TakenAt<
        <__Rover_2_11__sensor_base_imu_tilt as ::bb_core::Estimator>::Input,
    >>::Payload;
    type __known__sensor_base_imu_tilt = __private::BothKnown<
        {
            __private::both_known::<
                __Rover_2_11__payload__sensor_base_imu,
                __taken__sensor_base_imu_tilt,
            >()
        },
    >;
    enum __member__sensor_base_imu_tilt {}
    impl __private::Alone for __member__sensor_base_imu_tilt {
        type Wiring = __Wiring;
        type Estimator = __Rover_2_11__sensor_base_imu_tilt;
        type Source = __Rover_2_11__payload__sensor_base_imu;
        type Input = __input__sensor_base_imu_tilt;
        type Output = <<__Rover_2_11__sensor_base_imu_tilt as ::bb_core::Estimator>::Output as ::bb_core::Outputs>::Only;
        const INLET: __private::Inlet<
            __Rover_2_11__payload__sensor_base_imu,
            __taken__sensor_base_imu_tilt,
        > = __private::Inlet {
            number: 0usize,
            entry: 7usize,
            publisher: 4usize,
            feed: <__Rover_2_11__payload__sensor_base_imu as __private::Feeds<
                __taken__sensor_base_imu_tilt,
                __known__sensor_base_imu_tilt,
            >>::feed,
        };
        #[inline(always)]
        fn find(
            wiring: &__Wiring,
        ) -> (
            &__private::Island<__private::Solo<__member__sensor_base_imu_tilt>>,
            &__private::Topic<__Rover_2_11__payload__sensor_base_imu_tilt>,
        ) {
            (
                &wiring.islands.g0.sensor_base_imu_tilt,
                &wiring.topics.g0.sensor_base_imu_tilt,
            )
        }
        #[inline]
        fn publish(
            wiring: &__Wiring,
            emitted: &mut __private::Option<
                <__Rover_2_11__sensor_base_imu_tilt as ::bb_core::Estimator>::Output,
            >,
            stamp: __private::Stamp,
            turn: &__private::Turn<'_>,
        ) {
            <<<__Rover_2_11__sensor_base_imu_tilt as ::bb_core::Estimator>::Output as ::bb_core::Outputs>::Only as __private::EmittedAt<
                _,
            >>::each(
                emitted,
                stamp,
                |message| {
                    turn.emit(4usize, &wiring.topics.g0.sensor_base_imu_tilt, message);
                    __private::enter::<
                        __Island_estimator_base_pose,
                        _,
                    >(
                        wiring,
                        turn.now(),
                        __private::Key {
                            entry: 8usize,
                            line: 0,
                        },
                        message,
                        __Island_estimator_base_pose::sensor_base_imu_tilt__kept,
                        __Message_estimator_base_pose::sensor_base_imu_tilt__kept,
                    );
                    turn.left_for_another_island();
                },
            );
        }
    }
    type __input__estimator_base_pose__imu = ::bb_core::__private::At<
        {
            ::bb_core::__private::find_input::<
                <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
            >("imu")
        },
    >;
    type __taken__estimator_base_pose__imu = <__input__estimator_base_pose__imu as __private::TakenAt<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
    >>::Payload;
    type __known__estimator_base_pose__imu = __private::BothKnown<
        {
            __private::both_known::<
                __Rover_2_11__payload__sensor_base_imu,
                __taken__estimator_base_pose__imu,
            >()
        },
    >;
    type __input__estimator_base_pose__tilt = ::bb_core::__private::At<
        {
            ::bb_core::__private::find_input::<
                <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
            >("tilt")
        },
    >;
    type __taken__estimator_base_pose__tilt = <__input__estimator_base_pose__tilt as __private::TakenAt<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
    >>::Payload;
    type __known__estimator_base_pose__tilt = __private::BothKnown<
        {
            __private::both_known::<
                __Rover_2_11__payload__sensor_base_imu_tilt,
                __taken__estimator_base_pose__tilt,
            >()
        },
    >;
    type __input__estimator_base_pose__wheel = ::bb_core::__private::At<
        {
            ::bb_core::__private::find_input::<
                <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
            >("wheel")
        },
    >;
    type __taken__estimator_base_pose__wheel = <__input__estimator_base_pose__wheel as __private::TakenAt<
        <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
    >>::Payload;
    type __known__estimator_base_pose__wheel = __private::BothKnown<
        {
            __private::both_known::<
                __Rover_2_11__payload__sensor_base_pan_encoder,
                __taken__estimator_base_pose__wheel,
            >()
        },
    >;
    enum __member__estimator_base_pose {}
    impl __private::Member for __member__estimator_base_pose {
        type State = __Island_estimator_base_pose;
        type Estimator = __Rover_2_11__estimator_base_pose;
        const NUMBER: usize = 1usize;
        #[inline(always)]
        fn node(
            island: &mut __Island_estimator_base_pose,
        ) -> &mut __private::Node<__Rover_2_11__estimator_base_pose> {
            &mut island.estimator_base_pose
        }
        #[inline]
        fn publish(
            wiring: &__Wiring,
            island: &mut __Island_estimator_base_pose,
            emitted: &mut __private::Option<
                <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
            >,
            stamp: __private::Stamp,
            turn: &__private::Turn<'_>,
        ) {
            __private::emit::<
                ::bb_core::__private::At<
                    {
                        ::bb_core::__private::find_output::<
                            <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
                        >("pose")
                    },
                >,
                _,
            >(emitted, stamp, turn, 5usize, &wiring.topics.g0.estimator_base_pose_pose);
            __private::emit::<
                ::bb_core::__private::At<
                    {
                        ::bb_core::__private::find_output::<
                            <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
                        >("velocity")
                    },
                >,
                _,
            >(emitted, stamp, turn, 6usize, &wiring.topics.g0.nav_velocity);
        }
        fn cache() -> <<__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input as ::bb_core::Inputs>::Cache {
            let mut cache = __private::Default::default();
            __private::declare::<
                __input__estimator_base_pose__imu,
                <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
            >(&mut cache, &__ESTIMATORS[1usize], 0usize);
            __private::declare::<
                __input__estimator_base_pose__tilt,
                <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
            >(&mut cache, &__ESTIMATORS[1usize], 1usize);
            __private::declare::<
                __input__estimator_base_pose__wheel,
                <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Input,
            >(&mut cache, &__ESTIMATORS[1usize], 2usize);
            cache
        }
        fn emitted(
            output: usize,
            message: &__private::DynamicMessage,
        ) -> __private::Option<
            <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
        > {
            match output {
                0usize => {
                    __private::alone::<
                        ::bb_core::__private::At<
                            {
                                ::bb_core::__private::find_output::<
                                    <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
                                >("pose")
                            },
                        >,
                        _,
                    >(message)
                }
                1usize => {
                    __private::alone::<
                        ::bb_core::__private::At<
                            {
                                ::bb_core::__private::find_output::<
                                    <__Rover_2_11__estimator_base_pose as ::bb_core::Estimator>::Output,
                                >("velocity")
                            },
                        >,
                        _,
                    >(message)
                }
                _ => __private::None,
            }
        }
    }
    struct __Island_estimator_base_pose {
        estimator_base_pose: __private::Node<__Rover_2_11__estimator_base_pose>,
    }
    enum __Message_estimator_base_pose {
        sensor_base_imu(__private::Stamped<__Rover_2_11__payload__sensor_base_imu>),
        sensor_base_imu_tilt__kept(
            __private::Stamped<__Rover_2_11__payload__sensor_base_imu_tilt>,
        ),
        sensor_base_pan_encoder__kept(
            __private::Stamped<__Rover_2_11__payload__sensor_base_pan_encoder>,
        ),
    }
    impl __Island_estimator_base_pose {
        #[inline]
        fn sensor_base_imu(
            &mut self,
            wiring: &__Wiring,
            message: &__private::Stamped<__Rover_2_11__payload__sensor_base_imu>,
            turn: &__private::Turn<'_>,
        ) {
            __private::receive::<
                __member__estimator_base_pose,
                __input__estimator_base_pose__imu,
            >(
                self,
                wiring,
                0usize,
                <__Rover_2_11__payload__sensor_base_imu as __private::Feeds<
                    __taken__estimator_base_pose__imu,
                    __known__estimator_base_pose__imu,
                >>::feed(message),
                turn,
            );
        }
        #[inline]
        fn sensor_base_imu_tilt__kept(
            &mut self,
            wiring: &__Wiring,
            message: &__private::Stamped<__Rover_2_11__payload__sensor_base_imu_tilt>,
            turn: &__private::Turn<'_>,
        ) {
            __private::hold::<
                __member__estimator_base_pose,
                __input__estimator_base_pose__tilt,
            >(
                self,
                1usize,
                <__Rover_2_11__payload__sensor_base_imu_tilt as __private::Feeds<
                    __taken__estimator_base_pose__tilt,
                    __known__estimator_base_pose__tilt,
                >>::feed(message),
                turn,
            );
        }
        #[inline]
        fn sensor_base_pan_encoder__kept(
            &mut self,
            wiring: &__Wiring,
            message: &__private::Stamped<__Rover_2_11__payload__sensor_base_pan_encoder>,
            turn: &__private::Turn<'_>,
        ) {
            __private::hold::<
                __member__estimator_base_pose,
                __input__estimator_base_pose__wheel,
            >(
                self,
                2usize,
                <__Rover_2_11__payload__sensor_base_pan_encoder as __private::Feeds<
                    __taken__estimator_base_pose__wheel,
                    __known__estimator_base_pose__wheel,
                >>::feed(message),
                turn,
            );
        }
    }
    impl __private::IslandState for __Island_estimator_base_pose {
        type Wiring = __Wiring;
        type Message = __Message_estimator_base_pose;
        const DECLARATION: __private::IslandDeclaration = __private::IslandDeclaration {
            number: 1usize,
            name: "estimator/base/pose",
            worker: __private::Some(__private::WorkerDeclaration {
                priority: __private::Some(80u8),
                core: __private::None,
            }),
            is_measured: false,
            estimators: &[1usize],
            inlets: &[
                __private::InletDeclaration {
                    entry: 7usize,
                    inputs: &[(1usize, 0usize)],
                },
                __private::InletDeclaration {
                    entry: 8usize,
                    inputs: &[(1usize, 1usize)],
                },
                __private::InletDeclaration {
                    entry: 14usize,
                    inputs: &[(1usize, 2usize)],
                },
            ],
        };
        #[inline(always)]
        fn find(wiring: &__Wiring) -> &__private::Island<Self> {
            &wiring.islands.g0.estimator_base_pose
        }
        #[inline]
        fn deliver(
            &mut self,
            wiring: &__Wiring,
            message: &__Message_estimator_base_pose,
            turn: &__private::Turn<'_>,
        ) {
            match message {
                __Message_estimator_base_pose::sensor_base_imu(message) => {
                    self.sensor_base_imu(wiring, message, turn)
                }
                __Message_estimator_base_pose::sensor_base_imu_tilt__kept(message) => {
                    self.sensor_base_imu_tilt__kept(wiring, message, turn)
                }
                __Message_estimator_base_pose::sensor_base_pan_encoder__kept(message) => {
                    self.sensor_base_pan_encoder__kept(wiring, message, turn)
                }
            }
        }
        fn act(
            &mut self,
            wiring: &__Wiring,
            estimator: usize,
            act: __private::Act<'_, '_>,
        ) -> bool {
            match estimator {
                1usize => {
                    __private::act::<__member__estimator_base_pose>(self, wiring, act)
                }
                _ => false,
            }
        }
    }
    fn __sources_0(sources: &mut __private::Sources, wiring: &__private::Arc<__Wiring>) {
        sources
            .add::<
                __Rover_2_11__sensor_battery,
                __Wiring,
            >(
                wiring,
                &__SENSORS[0usize],
                0usize,
                0usize,
                __private::Binding::NONE,
                __Wiring::sensor_battery,
            );
        sources
            .add::<
                __Rover_2_11__sensor_base_pan_encoder,
                __Wiring,
            >(
                wiring,
                &__SENSORS[2usize],
                2usize,
                7usize,
                __private::Binding::NONE,
                __Wiring::sensor_base_pan_encoder,
            );
        sources
            .add::<
                __Rover_2_11__sensor_base_imu,
                __Wiring,
            >(
                wiring,
                &__SENSORS[1usize],
                1usize,
                3usize,
                __private::Binding::NONE,
                __Wiring::sensor_base_imu,
            );
        sources
            .add::<
                __private::Serving<__Rover_2_11__controller_stability>,
                __Wiring,
            >(
                wiring,
                &__SERVICES[0usize],
                6usize,
                1usize,
                __private::Binding::NONE,
                __Wiring::controller_stability,
            );
        sources
            .add::<
                __private::Serving<__Rover_2_11__bridge_ros>,
                __Wiring,
            >(
                wiring,
                &__SERVICES[1usize],
                7usize,
                2usize,
                __private::Binding::NONE,
                __Wiring::bridge_ros,
            );
    }
    impl ::bb_core::Robot for __Rover_2_11::Rover {
        const NAME: &'static str = "Rover";
        const TOPOLOGY: &'static __private::Topology = &__TOPOLOGY;
        const SENSORS: &'static [__private::SensorDeclaration] = &__SENSORS;
        const ESTIMATORS: &'static [__private::EstimatorDeclaration] = &__ESTIMATORS;
        const ACTUATORS: &'static [__private::ActuatorDeclaration] = &__ACTUATORS;
        const SERVICES: &'static [__private::SensorDeclaration] = &__SERVICES;
        const STATES: &'static [&'static str] = &["degraded"];
        const CATEGORIES: &'static [__private::CategoryDeclaration] = &__CATEGORIES;
        const COMMANDS: &'static [__private::CommandDeclaration] = &__COMMANDS;
        const PARAMETERS: &'static [__private::ParameterDeclaration] = &__PARAMETERS;
        const ISLANDS: &'static [__private::IslandOf<__Wiring>] = &__ISLANDS;
        const BOUND_OPTIONS: &'static [(usize, &'static str, usize)] = &[
            (3usize, "beta", 0usize),
        ];
        type Topics = __Topics;
        type Wiring = __Wiring;
        fn options() -> __private::OptionsList {
            __declared_options()
        }
        fn topics() -> __Topics {
            __new_topics()
        }
        fn wire(
            topics: __Topics,
            options: &__private::OptionsList,
            assembly: &__private::Assembly,
        ) -> __Wiring {
            __Wiring {
                topics,
                islands: __new_islands(options, assembly.environment()),
                actuators: __new_actuators(options, assembly),
                environment: __private::Clone::clone(assembly.environment()),
            }
        }
        fn sources(wiring: &__private::Arc<__Wiring>) -> __private::Sources {
            let mut sources = __private::Default::default();
            __sources_0(&mut sources, wiring);
            sources
        }
        fn wired_topics(wiring: &__Wiring) -> &__Topics {
            &wiring.topics
        }
        fn topic(
            topics: &__Topics,
            publisher: usize,
        ) -> __private::Option<&dyn __private::AnyTopic> {
            __topic(topics, publisher)
        }
        fn actuator(
            wiring: &__Wiring,
            actuator: usize,
        ) -> __private::Option<&dyn __private::AnyActuator> {
            __actuator(&wiring.actuators, actuator)
        }
        fn commands(
            options: &__private::OptionsList,
        ) -> __private::Vec<__private::Prepared> {
            ::std::vec![
                __private::Prepared::new:: < __Rover_2_11__command_arm > (options,
                8usize, __private::Binding::NONE), __private::Prepared::new:: <
                __Rover_2_11__command_move_to > (options, 9usize,
                __private::Binding::NONE), __private::Prepared::new:: <
                __Rover_2_11__command_stop > (options, 10usize, __private::Binding::NONE)
            ]
        }
    }
};
#[allow(unused_imports, unused_variables)]
const _: () = {
    use rover::sensor::base::imu as _;
    use rover::sensor::base::imu::tilt as _;
    use rover::sensor::base::pan::encoder as _;
    use rover::param::imu::beta as _;
    use rover::command::stop as _;
    use rover::state::degraded as _;
    use rover::category::motion as _;
    {}
    {
        let imu = 1usize;
        let tilt = 1usize;
        let wheel = 1usize;
    }
};
///Handles of what [`Rover`] declares, each at its path.
#[allow(
    missing_docs,
    non_upper_case_globals,
    non_snake_case,
    dead_code,
    private_interfaces,
    unreachable_pub,
    clippy::all
)]
pub mod rover {
    #[doc(hidden)]
    #[allow(unused_imports)]
    pub use super::{
        __Rover_2_11_must_be_declared_outside_of_functions as _,
        __Rover_2_11::Rover as __Robot, __Rover_2_11__sensor_battery,
        __Rover_2_11__sensor_base_imu, __Rover_2_11__sensor_base_pan_encoder,
        __Rover_2_11__sensor_base_imu_tilt, __Rover_2_11__estimator_base_pose,
        __Rover_2_11__actuator_base_pan_servo, __Rover_2_11__controller_stability,
        __Rover_2_11__bridge_ros, __Rover_2_11__command_arm,
        __Rover_2_11__command_move_to, __Rover_2_11__command_stop,
        __Rover_2_11__payload__sensor_base_imu_tilt,
        __Rover_2_11__payload__estimator_base_pose_pose,
        __Rover_2_11__payload__nav_velocity,
    };
    pub mod sensor {
        ///`sensor/battery`
        pub const battery: ::bb_core::__private::SensorHandle<
            super::__Robot,
            super::__Rover_2_11__sensor_battery,
        > = ::bb_core::__private::SensorHandle::new(
            "sensor/battery",
            0usize,
            0usize,
            ::bb_core::__private::Frame::new(""),
            <<super::__Robot as ::bb_core::Robot>::Wiring>::sensor_battery,
        );
        pub mod base {
            /// Fixed to the body.
            ///
            ///`sensor/base/imu`
            pub const imu: ::bb_core::__private::SensorHandle<
                super::super::__Robot,
                super::super::__Rover_2_11__sensor_base_imu,
            > = ::bb_core::__private::SensorHandle::new(
                "sensor/base/imu",
                3usize,
                1usize,
                ::bb_core::__private::Frame::new("base"),
                <<super::super::__Robot as ::bb_core::Robot>::Wiring>::sensor_base_imu,
            );
            pub mod pan {
                ///`sensor/base/pan/encoder`
                pub const encoder: ::bb_core::__private::SensorHandle<
                    super::super::super::__Robot,
                    super::super::super::__Rover_2_11__sensor_base_pan_encoder,
                > = ::bb_core::__private::SensorHandle::new(
                    "sensor/base/pan/encoder",
                    7usize,
                    2usize,
                    ::bb_core::__private::Frame::new("pan"),
                    <<super::super::super::__Robot as ::bb_core::Robot>::Wiring>::sensor_base_pan_encoder,
                );
            }
            pub mod imu {
                ///`sensor/base/imu/tilt`
                pub const tilt: ::bb_core::__private::EstimatorHandle<
                    super::super::super::__Robot,
                    super::super::super::__Rover_2_11__sensor_base_imu_tilt,
                    super::super::super::__Rover_2_11__payload__sensor_base_imu_tilt,
                > = ::bb_core::__private::EstimatorHandle::new(
                    "sensor/base/imu/tilt",
                    0usize,
                    4usize,
                    3usize,
                );
            }
        }
    }
    pub mod estimator {
        pub mod base {
            ///`estimator/base/pose`
            pub const pose: ::bb_core::__private::EstimatorOfSeveralHandle<
                super::super::__Robot,
                super::super::__Rover_2_11__estimator_base_pose,
            > = ::bb_core::__private::EstimatorOfSeveralHandle::new(
                "estimator/base/pose",
                1usize,
                4usize,
            );
            pub mod pose {
                /// Pose of the body.
                ///
                ///`estimator/base/pose/pose`
                pub const pose: ::bb_core::__private::OutputHandle<
                    super::super::super::__Robot,
                    super::super::super::__Rover_2_11__payload__estimator_base_pose_pose,
                > = ::bb_core::__private::OutputHandle::new(
                    "estimator/base/pose/pose",
                    5usize,
                );
            }
        }
    }
    pub mod nav {
        ///`nav/velocity`
        pub const velocity: ::bb_core::__private::OutputHandle<
            super::__Robot,
            super::__Rover_2_11__payload__nav_velocity,
        > = ::bb_core::__private::OutputHandle::new("nav/velocity", 6usize);
    }
    pub mod controller {
        ///`controller/stability`
        pub const stability: ::bb_core::__private::ControllerHandle<
            super::__Robot,
            super::__Rover_2_11__controller_stability,
        > = ::bb_core::__private::ControllerHandle::new(
            "controller/stability",
            1usize,
            6usize,
        );
    }
    pub mod bridge {
        ///`bridge/ros`
        pub const ros: ::bb_core::__private::BridgeHandle<
            super::__Robot,
            super::__Rover_2_11__bridge_ros,
        > = ::bb_core::__private::BridgeHandle::new("bridge/ros", 2usize, 7usize);
    }
    pub mod actuator {
        pub mod base {
            pub mod pan {
                ///`actuator/base/pan/servo`
                pub const servo: ::bb_core::__private::ActuatorHandle<
                    super::super::super::__Robot,
                    super::super::super::__Rover_2_11__actuator_base_pan_servo,
                > = ::bb_core::__private::ActuatorHandle::new(
                    "actuator/base/pan/servo",
                    5usize,
                    |
                        wiring: &<super::super::super::__Robot as ::bb_core::Robot>::Wiring|
                    &wiring.actuators.g0.actuator_base_pan_servo,
                );
            }
        }
    }
    pub mod command {
        ///`command/arm`
        pub const arm: ::bb_core::__private::CommandHandle<
            super::__Robot,
            super::__Rover_2_11__command_arm,
        > = ::bb_core::__private::CommandHandle::new("command/arm", 0usize, 8usize);
        /// Motion to a target.
        ///
        ///`command/move_to`
        pub const move_to: ::bb_core::__private::CommandHandle<
            super::__Robot,
            super::__Rover_2_11__command_move_to,
        > = ::bb_core::__private::CommandHandle::new("command/move_to", 1usize, 9usize);
        ///`command/stop`
        pub const stop: ::bb_core::__private::CommandHandle<
            super::__Robot,
            super::__Rover_2_11__command_stop,
        > = ::bb_core::__private::CommandHandle::new("command/stop", 2usize, 10usize);
    }
    pub mod param {
        pub mod imu {
            /// Weight of each sample in the estimate.
            ///
            ///`param/imu/beta`
            pub const beta: ::bb_core::__private::ParameterHandle<
                super::super::__Robot,
                f64,
            > = ::bb_core::__private::ParameterHandle::new("param/imu/beta", 0usize);
        }
    }
    pub mod state {
        pub const degraded: &str = "degraded";
    }
    pub mod category {
        pub const motion: &str = "motion";
    }
}
#[doc(inline)]
#[allow(unused_imports)]
pub use rover::__Robot as Rover;
