#!/usr/bin/env python3
"""Virtual camera -> edge executable -> node, run by rostest (live.test): what comes out is what the edge says, once."""
import math
import pathlib
import signal
import sys
import xmlrpc.client

import rosgraph
import rospy
import rostest
import tf2_py
import yaml
from alidade_msgs.msg import Box, Calibration, Detection, Detections, FrameOrientation, Pixel, Status, Targets
from alidade_msgs.srv import (Calibrate, DirectionToPixel, DirectionToPixelRequest, PixelToDirection,
                              PixelToDirectionRequest)
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import QuaternionStamped, Vector3
from harness import wait_until
from ros_harness import Inbox, RosTest, quaternion, vector
from sensor_msgs.msg import CameraInfo, JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

FRAMES = 500
CLOCK_S = 1e-5  # by which the wall clock of a frame may become better known after its message
LIST = pathlib.Path(__file__).resolve().parents[3] / "edge_app/record/record_fields.yaml"


def scalars_of(fields):
    """Field of the message -> how its value is taken from a record, and its factor; None: a word."""
    scalars = {}
    for field in fields:
        name, ros = field["name"], field["ros"]
        kind = ros.get("as", "same")
        if kind == "pair":
            for i, one in enumerate(ros["names"]):
                scalars[one] = (lambda record, name=name, i=i: record[name][i], 1)
        elif kind == "members":
            for one, member in zip(ros["names"], field["members"]):
                scalars[one] = (lambda record, name=name, key=member["name"]: record[name] and record[name][key], 1)
        elif kind in ("same", "turned", "presence") and field["type"] != "array" and name != "needs":
            factor = {"turned": -1, "same": None if field["type"] == "word" else 1, "presence": 1}[kind]
            scalars[ros["name"]] = (lambda record, name=name: record[name], factor)
    return scalars


SCALARS = scalars_of(yaml.safe_load(LIST.read_text()))


def conjugate_rotate(q, v):
    """The vector v in the frame that q turns into v's."""
    x, y, z, w = q
    t = [2 * (-y * v[2] + z * v[1]), 2 * (-z * v[0] + x * v[2]), 2 * (-x * v[1] + y * v[0])]
    return [v[0] + w * t[0] - y * t[2] + z * t[1], v[1] + w * t[1] - z * t[0] + x * t[2],
            v[2] + w * t[2] - x * t[1] + y * t[0]]


def project(info, d):
    """The pixel of a direction in the optical frame, as sensor_msgs/CameraInfo defines it."""
    x, y = d[0] / d[2], d[1] / d[2]
    k1, k2, p1, p2, k3 = info.D
    r = x * x + y * y
    radial = 1 + k1 * r + k2 * r * r + k3 * r ** 3
    return (info.K[0] * (x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x)) + info.K[2],
            info.K[4] * (y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y) + info.K[5])


class Live(RosTest):
    def setUp(self):
        super().setUp()
        self.virtual_camera = self.camera()
        self.running_edge = self.edge(self.virtual_camera)

    def launch(self, file="alidade.launch", camera="mast", **environment):
        return self.start("roslaunch", "--no-summary", "alidade_ros", file, f"url:={self.running_edge.url}",
                          f"camera:={camera}", **environment)

    def assert_is_the_record(self, message, edge):
        record = edge.record(message.record)
        self.assertEqual(message.has_frame, record["frame"] is not None)
        for field, (take, factor) in SCALARS.items():
            value, expected = getattr(message, field), take(record)
            if expected is None:
                self.assertTrue(field == "frame" or math.isnan(value), field)
            else:
                self.assertEqual(value, expected if factor is None else factor * expected, field)
        self.assertEqual(message.needs, record["needs"] or "")
        self.assertEqual(message.mode, {"none": 0, "PT": 1, "OE": 2}[record["mode"]])
        if record["mode"] != "none":
            x, y, z, w = record["q_base_from_camera"]
            expected = [w, -z, y, -x]  # half a turn about x: the base of ROS
            sign = 1 if expected[3] >= 0 else -1
            self.assertEqual(quaternion(message.orientation), [sign * e for e in expected])
            self.assertEqual(list(message.orientation_covariance), record["orientation_covariance_rad2"])

    def assert_each_record_came_once(self, messages, edge):
        numbers = [m.record for m in messages]
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + len(numbers))))
        for message in messages:
            self.assert_is_the_record(message, edge)

    def test_topics_and_services_say_what_the_edge_says(self):
        edge = self.running_edge
        orientations, tf = Inbox("/frame_orientation", FrameOrientation), Inbox("/tf", TFMessage)
        quaternions, joints = Inbox("/orientation", QuaternionStamped), Inbox("/joint_states", JointState)
        status, calibration = Inbox("/status", Status), Inbox("/calibration", Calibration)
        diagnostics, nodelets = Inbox("/diagnostics", DiagnosticArray), Inbox("/second/frame_orientation",
                                                                              FrameOrientation)
        self.launch()
        self.launch("alidade_nodelet.launch", camera="other", ROS_NAMESPACE="second")
        connected = status.wait_for(lambda s: s.connected and s.mode != 0, "a status with an orientation")
        self.assertEqual(connected.url, edge.url)
        # A late subscriber gets what is latched.
        info = Inbox("/camera_info", CameraInfo).wait_for(lambda m: True, "the latched camera_info")
        known = calibration.wait_for(lambda m: True, "the calibration")
        told = edge.ask("/api/v1/calibration")
        self.assertEqual(known.clock_offset, told["clock_offset"]["value"])
        x, y, z = told["tilt_axis"]["value"]
        self.assertEqual(vector(known.tilt_axis), [-x, y, z])
        self.assertEqual(list(known.covariance), sum(told["covariance"]["matrix"], []))

        to_direction = rospy.ServiceProxy("/pixel_to_direction", PixelToDirection)
        to_pixel = rospy.ServiceProxy("/direction_to_pixel", DirectionToPixel)
        for inbox in (quaternions, joints, nodelets):
            inbox.wait_for(lambda m: True, "the first message")
        tf.wait_for(lambda m: m.transforms[0].child_frame_id == "mast_optical_frame", "the camera's first transform")
        # Asked as frames come: the edge remembers ten seconds.
        answers, enough = [], len(orientations.all()) + FRAMES
        while len(orientations.all()) < enough:
            newest = orientations.all()[-1]
            if newest.mode != FrameOrientation.MODE_NONE:
                answers.append(self.ask_about(newest, edge, to_direction, to_pixel))
            count = len(orientations.all()) + 25
            wait_until(lambda: len(orientations.all()) >= count, "another second's frames")
        self.assertGreater(len(answers), 10)

        messages = orientations.all()
        self.assert_each_record_came_once(messages, edge)
        self.assert_each_record_came_once(nodelets.all(), edge)
        self.assertGreater(len(nodelets.all()), FRAMES / 2)  # it may lag behind
        with_orientation = {m.header.stamp: m for m in messages if m.mode != 0}
        for m in self.of_the_same_frames(quaternions, with_orientation):
            self.assertEqual(m.quaternion, with_orientation[m.header.stamp].orientation)
            self.assertEqual(m.header.frame_id, "mast_base")
        for m in self.of_the_same_frames(joints, with_orientation):
            of_frame = with_orientation[m.header.stamp]
            self.assertEqual(m.name, ["mast_pan_joint", "mast_tilt_joint"])
            self.assertEqual(list(m.position), [of_frame.pan, of_frame.tilt])
            self.assertEqual(list(m.velocity), [of_frame.pan_rate, of_frame.tilt_rate])
        # Capture times: steps of the camera's period.
        steps = [b - a for a, b in zip(sorted(with_orientation), sorted(with_orientation)[1:])]
        self.assertAlmostEqual(sorted(steps)[len(steps) // 2].to_sec(), 0.04, delta=0.002)

        self.assert_tf_projects_as_the_api_does(answers, tf, info)

        # The updater says "Node starting up" of each task alone, before it says anything of both.
        diagnostics.wait_for(
            lambda m: any(s.name.endswith("alidade: edge connection") and s.message == "connected" for s in m.status)
            and any(s.name.endswith("alidade: orientation") for s in m.status), "health")
        # Nothing is to be calibrated here, and the edge says so.
        refused = rospy.ServiceProxy("/calibrate", Calibrate)()
        self.assertFalse(refused.success)
        self.assertIn("409", refused.message)

    def of_the_same_frames(self, inbox, with_orientation):
        """The messages of another topic with these stamps, which must be all from its first on, each once."""
        last = max(with_orientation)
        inbox.wait_for(lambda m: m.header.stamp >= last, "the last frame")
        messages = [m for m in inbox.all() if min(with_orientation) <= m.header.stamp <= last]
        stamps = [m.header.stamp for m in messages]
        self.assertEqual(stamps, sorted(s for s in with_orientation if s >= stamps[0]))
        self.assertGreaterEqual(len(stamps), FRAMES)
        return messages

    def ask_about(self, message, edge, to_direction, to_pixel):
        """Asks the API and the services about three pixels of the message's frame; their answers must be the same."""
        pixels = [[8.25, 5.5], [80, 48], [151, 90.5]]
        told = edge.ask("/api/v1/direction", {"frame": message.frame, "pixels": pixels, "pixel_sigma_px": 0.1})
        said = to_direction(PixelToDirectionRequest(
            at=PixelToDirectionRequest.FRAME, frame=message.frame, pixel_sigma=0.1,
            pixels=[Pixel(u=u - 0.5, v=v - 0.5) for u, v in pixels]))
        self.assertTrue(said.success, said.error)
        self.assertEqual((said.frame, said.mode, said.calibrated), (message.frame, message.mode, True))
        self.assertAlmostEqual((said.stamp - message.header.stamp).to_sec(), 0, delta=CLOCK_S)
        for a, b, pixel in zip(said.directions, told["directions"], pixels):
            x, y, z = b["direction"]
            self.assertEqual(vector(a.direction), [x, -y, -z])
            self.assertEqual([a.pixel.u + 0.5, a.pixel.v + 0.5], pixel)
            self.assertAlmostEqual(a.azimuth, -b["azimuth_rad"], delta=1e-12)
            self.assertAlmostEqual(a.elevation, b["elevation_rad"], delta=1e-12)
            self.assertEqual(list(a.covariance), sum(b["covariance"], []))
            self.assertEqual(a.sigma, b["sigma_rad"])
            self.assertAlmostEqual((a.stamp - message.header.stamp).to_sec(), b["time_s"] - message.time, delta=CLOCK_S)

        # Far directions: those, and straight ahead, which the camera does not always see.
        directions = [d["direction"] for d in told["directions"]] + [[1, 0, 0]]
        told = edge.ask("/api/v1/pixel", {"frame": message.frame, "directions": directions})
        said = to_pixel(DirectionToPixelRequest(
            at=DirectionToPixelRequest.STAMP, stamp=message.header.stamp,
            directions=[Vector3(x, -y, -z) for x, y, z in directions]))
        self.assertTrue(said.success, said.error)
        self.assertEqual(said.frame, message.frame)
        for a, b in zip(said.pixels, told["pixels"]):
            self.assertEqual(a.error, b.get("error", ""))
            if not a.error:
                self.assertEqual([a.pixel.u + 0.5, a.pixel.v + 0.5], b["pixel"])
                self.assertEqual(a.inside, b["inside"])
                self.assertEqual(list(a.covariance), sum(b["covariance_px2"], []))
        return message, [p for p in told["pixels"] if p.get("inside")]

    def assert_tf_projects_as_the_api_does(self, answers, tf, info):
        """Between the transforms of a frame's rows tf2 turns evenly: the frame's acceleration is what it leaves out."""
        def of_camera():
            return [t for m in tf.all() for t in m.transforms if t.child_frame_id == "mast_optical_frame"]
        last = max(m.header.stamp for m, _ in answers)
        wait_until(lambda: any(t.header.stamp > last + rospy.Duration(0.02) for t in of_camera()),
                   "the transforms of the frame after the last")
        buffer = tf2_py.BufferCore(rospy.Duration(1000))
        for transform in of_camera():
            buffer.set_transform(transform, "test")
        count = 0
        for message, pixels in answers:
            readout = abs(message.line_delay) * info.height
            rows = [t for t in of_camera() if abs((t.header.stamp - message.header.stamp).to_sec()) < readout]
            if len(rows) < 3:
                continue  # a subscriber that is late loses the oldest: as many as are asked below must have come
            uneven = math.hypot(message.pan_acceleration, message.tilt_acceleration) * (readout / 2) ** 2 / 8
            for told in pixels:
                at = message.header.stamp + rospy.Duration(told["time_s"] - message.time)
                turn = buffer.lookup_transform_core("mast_base", "mast_optical_frame", at).transform.rotation
                x, y, z = told["direction"]
                u, v = project(info, conjugate_rotate(quaternion(turn), [x, -y, -z]))
                error = math.hypot(u + 0.5 - told["pixel"][0], v + 0.5 - told["pixel"][1])
                self.assertLess(error, 0.001 + 1.5 * info.K[0] * uneven, message)
                count += 1
        self.assertGreater(count, 30)

    def test_recovers_from_restarts_of_node_and_edge(self):
        orientations, status = Inbox("/frame_orientation", FrameOrientation), Inbox("/status", Status)
        self.launch()
        orientations.wait_for(lambda m: m.mode != 0, "an orientation")

        pid = self.pid_of_node()
        self.start("kill", "-KILL", pid).end()
        wait_until(lambda: self.pid_of_node() not in (None, pid), "the node's new life")
        before = len(orientations.all())
        wait_until(lambda: len(orientations.all()) > before + 50, "two seconds' frames of the new node")
        self.assert_is_the_record(orientations.all()[-1], self.running_edge)
        # A record that the old node had sent may have been lost with it; none comes twice.
        numbers = [m.record for m in orientations.all()]
        self.assertEqual(numbers, sorted(set(numbers)))

        first, address = self.running_edge, self.running_edge.address
        code, _ = first.end()
        self.assertEqual(code, 0, first.process.error_text())
        gone = status.wait_for(lambda s: not s.connected and "127.0.0.1" in s.error, "the news of its end")
        self.running_edge = self.edge(self.virtual_camera, address=address)
        back = status.wait_for(lambda s: s.connected and s.start not in ("", gone.start), "the edge's return")
        self.assertEqual(back.connections, 2)

        def of_new_edge():
            return [m for m in orientations.all() if m.header.stamp > gone.header.stamp]
        wait_until(lambda: len(of_new_edge()) > 50, "two seconds' frames of the new edge")
        self.assert_each_record_came_once(of_new_edge(), self.running_edge)

    def test_a_plane_that_is_gone_after_a_restart_is_told_to_nobody_who_comes_later(self):
        address = self.running_edge.address
        self.running_edge.end()
        plane, _ = self.ground()
        self.running_edge = self.edge(self.virtual_camera, address=address, plane=plane)
        transforms = Inbox("/tf_static", TFMessage)
        self.launch()
        said, = transforms.wait_for(lambda m: m.transforms, "the plane").transforms
        self.assertEqual((said.header.frame_id, said.child_frame_id), ("mast_base", "mast_plane"))
        self.assertAlmostEqual(math.hypot(*vector(said.transform.translation)), 20, delta=1e-9)
        self.assertIn("child_frame_id: \"mast_plane\"", self.told_to_who_comes_later("/tf_static"))

        self.running_edge.end()
        self.running_edge = self.edge(self.virtual_camera, address=address)
        transforms.wait_for(lambda m: not m.transforms, "the news that there is none")
        self.assertEqual(self.told_to_who_comes_later("/tf_static"), "transforms: []")

    def told_to_who_comes_later(self, topic):
        """What a process that subscribes only then gets first: within one process subscribers share a connection, and what came by it before."""
        listener = self.start("rostopic", "echo", "-n", "1", topic)
        code, lines = listener.end()
        self.assertEqual(code, 0, listener.error_text())
        return "\n".join(lines).removesuffix("\n---")

    def test_detections_become_targets_and_markers(self):
        """Something stands straight ahead; a detector, which is a node, finds it in each frame that has it."""
        width, height = 6, 4
        orientations, targets = Inbox("/frame_orientation", FrameOrientation), Inbox("/targets", Targets)
        markers = Inbox("/target_markers", MarkerArray)
        detector = rospy.Publisher("/detections", Detections, queue_size=50)
        self.launch()
        orientations.wait_for(lambda m: m.mode != 0, "an orientation")
        wait_until(lambda: detector.get_num_connections() > 0, "the node's subscription")
        asked = set()

        def found():
            newest = orientations.all()[-1]
            if newest.mode != 0 and newest.frame not in asked:
                asked.add(newest.frame)
                ahead = {"frame": newest.frame, "directions": [[1, 0, 0]]}
                pixel = self.running_edge.ask("/api/v1/pixel", ahead)["pixels"][0]
                boxes = []
                if pixel.get("inside"):
                    u, v = pixel["pixel"]
                    boxes = [Detection(box=Box(u=u - 0.5 - width / 2, v=v - 0.5 - height / 2, width=width, height=height),
                                       score=0.9, label="boat")]
                detector.publish(Detections(by_frame=True, frame=newest.frame, detections=boxes))
            return [m for m in targets.all() if any(t.in_picture and t.label == "boat" for t in m.targets)]
        wait_until(found, "a target in the picture")
        message = found()[-1]
        self.assertEqual(message.space, Targets.SPHERE)
        self.assertEqual(message.header.frame_id, "mast_base")
        target, = message.targets
        for value, variance in ((target.azimuth, target.covariance[0]), (target.elevation, target.covariance[5])):
            self.assertLess(abs(value), 4 * math.sqrt(variance))
        self.assertAlmostEqual(target.box.u + target.box.width / 2, target.pixel.u, delta=1e-9)
        self.assertAlmostEqual(target.box.v + target.box.height / 2, target.pixel.v, delta=1e-9)
        self.assertEqual([target.box.width, target.box.height], [width, height])
        of_frame, = [m for m in orientations.all() if m.has_frame and m.frame == message.frame]
        self.assertAlmostEqual((message.header.stamp - of_frame.header.stamp).to_sec(),
                               of_frame.line_delay * 48, delta=0.5 * abs(of_frame.line_delay) + CLOCK_S)
        drawn = markers.wait_for(lambda m: any(k.type == Marker.TEXT_VIEW_FACING and "boat" in k.text for k in m.markers),
                                 "the target's name")
        self.assertEqual({k.header.frame_id for k in drawn.markers}, {"mast_base"})

        # Its markers do not outlive the edge.
        self.running_edge.end()
        markers.wait_for(lambda m: m.markers and all(k.action == Marker.DELETEALL for k in m.markers), "their end")

    def pid_of_node(self):
        try:
            uri = rosgraph.Master("/live_test").lookupNode("/alidade")
            return xmlrpc.client.ServerProxy(uri).getPid("/live_test")[2]
        except (rosgraph.MasterException, OSError):
            return None

    def tearDown(self):
        # roslaunch ends what it started.
        for process in self.processes:
            if process.arguments[0] == "roslaunch":
                process.end(signal.SIGINT)
        super().tearDown()


if __name__ == "__main__":
    rospy.init_node("live_test")
    rostest.rosrun("alidade_ros", "live", Live, sys.argv)
