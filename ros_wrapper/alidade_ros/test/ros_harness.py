"""What the tests of the node share: the virtual camera and the edge executable as processes, and listening to topics."""
import json
import re
import signal
import threading
import urllib.request

import rospy
from harness import DEADLINE_S, Process, SystemTest, wait_until


def quaternion(q):
    return [q.x, q.y, q.z, q.w]


def vector(v):
    return [v.x, v.y, v.z]


class Inbox:
    """Every message of a topic, in order."""

    def __init__(self, topic, kind):
        self.messages, self.lock = [], threading.Lock()
        self.topic = topic
        self.subscriber = rospy.Subscriber(topic, kind, self._take)

    def _take(self, message):
        with self.lock:
            self.messages.append(message)

    def all(self):
        with self.lock:
            return list(self.messages)

    def wait_for(self, condition, what):
        """The first message for which condition holds, among those there are and those to come."""
        found = []

        def holds():
            found[:] = [m for m in self.all() if condition(m)][:1]
            return found
        wait_until(holds, f"{what} on {self.topic}")
        return found[0]


class Edge:
    """`alidade run` with its HTTP API, and every record that it wrote. plane: a plane.yaml, the ground under the camera."""

    def __init__(self, test, camera, address="127.0.0.1:0", mode="OE", plane=None):
        tracking = {"plane": plane} if plane else {}
        config = test.write_config(camera, output={"json": True, "http": address}, realtime={"mode": mode}, tracking=tracking,
                                   video={"width": 160, "height": 96})
        self.process = test.alidade("run", "-c", config)
        self.address = None
        wait_until(self._find_address, "the edge's announcement of its address")
        self.url = f"http://{self.address}"
        self._records = []

    def _find_address(self):
        for line in self.process.errors:
            found = re.search(r"listening on http://([0-9.]+:[0-9]+)", line)
            if found:
                self.address = found.group(1)
        assert self.process.child.poll() is None, self.process.error_text()
        return self.address

    def record(self, number):
        """The number-th record, counted from 1 as the event stream does."""
        while len(self._records) < number:
            line = self.process.line()
            assert line is not None, self.process.error_text()
            self._records.append(json.loads(line))
        return self._records[number - 1]

    def ask(self, path, question=None):
        """The API's own answer."""
        data = None if question is None else json.dumps(question).encode()
        with urllib.request.urlopen(urllib.request.Request(self.url + path, data), timeout=DEADLINE_S) as answer:
            return json.load(answer)

    def end(self):
        return self.process.end(signal.SIGINT)


class RosTest(SystemTest):
    def start(self, *command, **environment):
        process = Process(*command, **environment)
        self.processes.append(process)
        return process

    def edge(self, camera, **options):
        return Edge(self, camera, **options)


