#!/usr/bin/env python3
"""The master dies and comes back empty: the node advertises anew, and its latched messages are there again."""
import os
import signal
import unittest

from harness import free_port, wait_until

PORT = free_port()
os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{PORT}"  # before rospy reads it

import rosgraph  # noqa: E402
import rospy  # noqa: E402
from alidade_msgs.msg import Calibration, FrameOrientation, Status  # noqa: E402
from alidade_msgs.srv import Calibrate  # noqa: E402
from ros_harness import Inbox, RosTest  # noqa: E402
from sensor_msgs.msg import CameraInfo  # noqa: E402


class Master(RosTest):
    def start_master(self):
        master = self.start("rosmaster", "--core", "-p", PORT)
        wait_until(rosgraph.is_master_online, "the master's answer")
        return master

    def test_node_survives_the_restart_of_the_master(self):
        master = self.start_master()
        edge = self.edge(self.camera())
        node = self.start("rosrun", "alidade_ros", "alidade_node", f"_url:={edge.url}")
        rospy.init_node("master_test")
        before = Inbox("/frame_orientation", FrameOrientation)
        calibrations = Inbox("/calibration", Calibration)
        known = calibrations.wait_for(lambda m: True, "the calibration")
        before.wait_for(lambda m: m.mode != 0, "an orientation")
        # Connections outlive the master: these must not be what the later ones hear by.
        before.subscriber.unregister()
        calibrations.subscriber.unregister()

        master.end(signal.SIGKILL)
        self.start_master()
        # The new master knows nobody: these subscribers register with it, and meet a publisher only if the node does.
        after = Inbox("/frame_orientation", FrameOrientation)
        first = after.wait_for(lambda m: m.mode != 0, "an orientation after the restart")
        self.assertGreater(first.record, before.all()[0].record)
        again = Inbox("/calibration", Calibration).wait_for(lambda m: True, "the calibration")
        self.assertEqual((again.header.stamp, again.json), (known.header.stamp, known.json))
        Inbox("/camera_info", CameraInfo).wait_for(lambda m: m.width == 160, "the camera_info")
        Inbox("/status", Status).wait_for(lambda m: m.connected and m.connections == 1, "the status")
        rospy.wait_for_service("/calibrate", timeout=90)
        self.assertIn("409", rospy.ServiceProxy("/calibrate", Calibrate)().message)
        self.assertEqual(node.end(signal.SIGINT)[0], 0)


if __name__ == "__main__":
    unittest.main()
