"""Drives the rover of `cargo run --example rover`, as any node of ROS 2 does. Needs `RMW_IMPLEMENTATION=rmw_zenoh_cpp`."""

import rclpy
from geometry_msgs.msg import TwistWithCovarianceStamped
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from sensor_msgs.msg import Imu
from std_srvs.srv import Trigger


class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self.turn_rate = None
        self.speed = None
        self.create_subscription(Imu, "/sensor/base/imu", self.on_imu, 10)
        self.create_subscription(TwistWithCovarianceStamped, "/estimator/base/motion", self.on_motion, 10)
        self.targets = self.create_publisher(TwistWithCovarianceStamped, "/sensor/base/target", 10)
        self.parameters = AsyncParameterClient(self, "/rover")

    def on_imu(self, imu):
        self.turn_rate = imu.angular_velocity.z

    def on_motion(self, motion):
        self.speed = motion.twist.twist.linear.x

    def on_timer(self):
        target = TwistWithCovarianceStamped()
        target.header.stamp = self.get_clock().now().to_msg()
        target.twist.twist.linear.x = 0.5
        self.targets.publish(target)

    def wait(self, future):
        rclpy.spin_until_future_complete(self, future, timeout_sec=10.0)
        return future.result()

    def call(self, command):
        client = self.create_client(Trigger, f"/rover/{command}")
        if not client.wait_for_service(timeout_sec=10.0):
            raise SystemExit(f"no service /rover/{command}: does the rover run, and is RMW_IMPLEMENTATION=rmw_zenoh_cpp?")
        answer = self.wait(client.call_async(Trigger.Request()))
        print(f"{command}: {answer.success}, {answer.message}")


rclpy.init()
driver = Driver()
driver.call("turn")  # refused: it is not armed
driver.call("arm")
driver.call("turn")
for kp in 2.5, 99.0:  # the second is out of its range
    response = driver.wait(driver.parameters.set_parameters([Parameter("kp", value=kp)]))
    print(response.results[0].reason or f"kp is set to {kp}")
driver.create_timer(0.1, driver.on_timer)
while driver.turn_rate is None or driver.speed is None:
    rclpy.spin_once(driver)
print(f"it drives at {driver.speed} m/s and turns at {driver.turn_rate} rad/s")
driver.call("disarm")
