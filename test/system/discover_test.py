#!/usr/bin/env python3
"""`alidade discover` on a network: two network namespaces joined by a veth pair, as the loopback carries no multicast.

One holds cameras: the virtual one, found by WS-Discovery and asked by ONVIF; one that zeroconf announces, asked by
VAPIX; and neighbours that send what nobody asked for. In the other, `alidade discover` finds them, writes a
configuration, and `alidade check` is run on it. Where such namespaces are not allowed, the exit code is 77, and ctest
says "skipped".
"""
import contextlib
import http.server
import json
import os
import pathlib
import pty
import re
import select
import signal
import socket
import stat
import struct
import subprocess
import sys
import threading
import unittest

from harness import ALIDADE, DEADLINE_S, IMAGE, Camera, SystemTest

SKIPPED = 77
INSIDE = "ALIDADE_TEST_CAMERA_NETWORK"
CAMERA, HOST = "192.0.2.10", "192.0.2.1"
GROUP, PORT = "239.255.255.250", 3702
DEVICE_PORT, AXIS_PORT = 8000, 8080
UUID = "urn:uuid:4d454930-0000-1000-8000-0123456789ab"

PROBE_MATCHES = """<?xml version="1.0" encoding="UTF-8"?>
<SOAP-ENV:Envelope xmlns:SOAP-ENV="http://www.w3.org/2003/05/soap-envelope"
 xmlns:wsa="http://schemas.xmlsoap.org/ws/2004/08/addressing" xmlns:d="http://schemas.xmlsoap.org/ws/2005/04/discovery"
 xmlns:dn="http://www.onvif.org/ver10/network/wsdl"><SOAP-ENV:Header><wsa:RelatesTo>{relates_to}</wsa:RelatesTo>
 </SOAP-ENV:Header><SOAP-ENV:Body><d:ProbeMatches><d:ProbeMatch><wsa:EndpointReference><wsa:Address>{uuid}</wsa:Address>
 </wsa:EndpointReference><d:Types>dn:NetworkVideoTransmitter</d:Types><d:Scopes>{scopes}</d:Scopes>
 <d:XAddrs>{addresses}</d:XAddrs><d:MetadataVersion>1</d:MetadataVersion></d:ProbeMatch></d:ProbeMatches>
 </SOAP-ENV:Body></SOAP-ENV:Envelope>"""

PARAMETERS = """root.Brand.Brand=AXIS
root.Brand.ProdFullName=AXIS Q6075-E PTZ Dome Network Camera
root.Properties.Image.Format=jpeg,mjpeg,h264
root.Properties.Image.Resolution=1920x1080
root.Properties.PTZ.PTZ=yes
root.Image.I0.Appearance.Resolution=1920x1080
root.Image.I0.MPEG.PCount=31
"""


def enter_namespaces():
    """Replaces this process by itself inside, or ends it. Namespaces go with the last process in them."""
    user = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    unshare = ["unshare", *user, "--net", "--mount"]
    tried = subprocess.run([*unshare, "ip", "link", "add", "name", "near", "type", "veth", "peer", "name", "far"],
                           capture_output=True, text=True, check=False)
    if tried.returncode != 0:
        print(f"skipped: no network namespaces here: {tried.stderr.strip()}", file=sys.stderr)
        sys.exit(SKIPPED)
    os.execvpe(unshare[0], [*unshare, sys.executable, "-B", *sys.argv], {**os.environ, INSIDE: "1"})


class Network:
    """This process is where the cameras are; `command` runs another where the user is."""

    def __init__(self):
        self.holder = subprocess.Popen(["unshare", "--net", "cat"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.holder.stdin.write(b"\n")
        self.holder.stdin.flush()
        self.holder.stdout.readline()  # unshare has done its work
        pid = str(self.holder.pid)
        self.enter = ["nsenter", f"--net=/proc/{pid}/ns/net"]
        run = lambda *words: subprocess.run(words, check=True)
        run("ip", "link", "set", "lo", "up")
        run("ip", "link", "add", "name", "cameras", "type", "veth", "peer", "name", "office", "netns", pid)
        run("ip", "addr", "add", f"{CAMERA}/24", "dev", "cameras")
        run("ip", "link", "set", "cameras", "up")
        run(*self.enter, "ip", "link", "set", "lo", "up")
        run(*self.enter, "ip", "addr", "add", f"{HOST}/24", "dev", "office")
        run(*self.enter, "ip", "link", "set", "office", "up")

    def close(self):
        self.holder.stdin.close()
        self.holder.stdout.close()
        self.holder.wait()


class Responder:
    """Answers probes, as a device does: by unicast to the sender. answers: of (relates_to) -> datagrams."""

    def __init__(self, answers):
        self.answers = answers
        self.probes = []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(("", PORT))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                               struct.pack("4s4s", socket.inet_aton(GROUP), socket.inet_aton(CAMERA)))
        self.wake, self.woken = socket.socketpair()
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self):
        while True:
            ready, _, _ = select.select([self.socket, self.woken], [], [])
            if self.woken in ready:
                return
            probe, sender = self.socket.recvfrom(65536)
            message_id = re.search(rb"MessageID>([^<]+)<", probe)
            if b"Probe>" not in probe or message_id is None:
                continue
            self.probes.append(probe)
            for answer in self.answers(message_id.group(1).decode()):
                self.socket.sendto(answer, sender)

    def close(self):
        self.wake.close()
        self.thread.join()
        self.woken.close()
        self.socket.close()


class Relay:
    """TCP from the network to a port of the loopback, where the virtual camera listens."""

    def __init__(self, port, target):
        self.listener = socket.create_server((CAMERA, port))
        self.target = target
        self.thread = threading.Thread(target=self.accept)
        self.thread.start()

    def accept(self):
        while True:
            try:
                near, _ = self.listener.accept()
            except OSError:
                return
            far = socket.create_connection(("127.0.0.1", self.target))
            threading.Thread(target=self.copy, args=(near, far), daemon=True).start()

    @staticmethod
    def copy(near, far):
        with near, far, contextlib.suppress(OSError):
            while True:
                for source in select.select([near, far], [], [])[0]:
                    data = source.recv(65536)
                    if not data:
                        return
                    (far if source is near else near).sendall(data)

    def close(self):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.thread.join()
        self.listener.close()


class AxisHandler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        texts = {"/axis-cgi/param.cgi": PARAMETERS, "/axis-cgi/com/ptz.cgi": "pan=12.5\r\ntilt=-3.25\r\nzoom=1234\r\n"}
        text = texts.get(self.path.split("?")[0])
        self.send_response(200 if text else 404)
        body = (text or "").encode()
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


class Discover(SystemTest):
    @classmethod
    def setUpClass(cls):
        cls.network = Network()
        cls.addClassCleanup(cls.network.close)

    def serve_virtual_camera(self, user=""):
        """On the network, at the ports that its ONVIF names."""
        camera = Camera(self.folder, codec="h264", user=user, settings={
            "live": {"codec": "h264", "onvif_port": 0,
                     **({"user": user, "password_env": "TEST_CAMERA_PASSWORD"} if user else {})}})
        self.processes.append(camera)
        rtsp = int(camera.video_url.split(":")[2].split("/")[0])
        onvif = int(camera.others["onvif"].rsplit(":", 1)[1])
        for port, target in ((rtsp, rtsp), (DEVICE_PORT, onvif)):
            relay = Relay(port, target)
            self.addCleanup(relay.close)
        return camera

    def respond(self, answers):
        responder = Responder(answers)
        self.addCleanup(responder.close)
        return responder

    @staticmethod
    def match(relates_to, uuid=UUID, name="Virtual%20PTZ", addresses=f"http://{CAMERA}:{DEVICE_PORT}/onvif/device_service"):
        return PROBE_MATCHES.format(relates_to=relates_to, uuid=uuid, addresses=addresses,
                                    scopes=f"onvif://www.onvif.org/name/{name} onvif://www.onvif.org/type/ptz").encode()

    def discover(self, *arguments, code=0, duration_s=2):
        """The JSON, and what was said on stderr."""
        done = subprocess.run([*self.network.enter, ALIDADE, "discover", "--duration", str(duration_s), "--json", *map(str, arguments)],
                              capture_output=True, text=True, timeout=DEADLINE_S, check=False, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return json.loads(done.stdout) if done.stdout else None, done.stderr

    def check(self, config):
        done = subprocess.run([*self.network.enter, ALIDADE, "check", "-c", str(config), "--duration", "4"],
                              capture_output=True, text=True, timeout=DEADLINE_S, check=False)
        return done.returncode, done.stdout + done.stderr

    def test_finds_asks_writes_and_check_passes(self):
        self.serve_virtual_camera()
        # Twice, as devices do that hear of several questions.
        responder = self.respond(lambda of: [self.match(of), self.match(of)])
        found, _ = self.discover()
        self.assertGreaterEqual(len(responder.probes), 2)
        self.assertEqual([camera["host"] for camera in found["cameras"]], [CAMERA])
        camera = found["cameras"][0]
        self.assertEqual(camera["name"], "Alidade Virtual PTZ")
        stream = camera["streams"][camera["take"]]
        self.assertEqual((stream["codec"], stream["width"], stream["height"], stream["rate_hz"], stream["key_frame_distance"]),
                         ("H264", IMAGE["width"], IMAGE["height"], IMAGE["rate_hz"], IMAGE["rate_hz"]))
        self.assertTrue(stream["url"].startswith(f"rtsp://{CAMERA}:"), stream)
        # The generic space has no angles yet, and that is what it says.
        self.assertIn("pan_range_deg", camera["telemetry"]["error"])

        config = self.folder / "camera.yaml"
        _, said = self.discover("--write", config, code=2)
        self.assertIn("--field-of-view", said)
        _, said = self.discover("--write", config, "--field-of-view", "3.4", code=1)
        self.assertIn("--set 'pan_tilt.pan_range_deg", said)
        self.assertFalse(config.exists())
        self.discover("--write", config, "--field-of-view", "3.4", "--set", "pan_tilt.pan_range_deg=[-180, 180]",
                      "--set", "pan_tilt.tilt_range_deg=[-90, 90]")
        self.assertIn(f'url: "http://{CAMERA}:{DEVICE_PORT}"', config.read_text())
        code, report = self.check(config)
        # The picture is too small for OE mode to be happy; what is asked here is that the configuration holds.
        self.assertIn("configuration  ", report)
        self.assertIn(f"{IMAGE['width']}x{IMAGE['height']} px (as expected)", report)
        self.assertIn("pan/tilt       http", report)
        self.assertEqual(code, 0, report)
        # Nothing is overwritten.
        before = config.read_text()
        _, said = self.discover("--write", config, "--field-of-view", "3.4", code=2)
        self.assertIn("exists already", said)
        self.assertEqual(config.read_text(), before)

    def test_asks_for_the_password_without_echo_and_keeps_it_for_its_owner(self):
        self.serve_virtual_camera(user="viewer")
        self.respond(lambda of: [self.match(of)])
        found, _ = self.discover()
        self.assertTrue(found["cameras"][0]["wants_login"])
        self.assertIsNone(found["cameras"][0]["telemetry"]["answers"])
        _, said = self.discover("--user", "viewer", code=2)
        self.assertIn("no terminal", said)

        config, stored = self.folder / "camera.yaml", self.folder / "camera.password"
        arguments = ["discover", "--duration", "2", "--user", "viewer", "--write", str(config), "--set",
                     "pan_tilt.pan_range_deg=[-180, 180]", "--set", "pan_tilt.tilt_range_deg=[-90, 90]"]
        code, seen = self.at_a_terminal(arguments, [("password of viewer: ", "wrong mule")])
        self.assertEqual(code, 1, seen)
        self.assertFalse(stored.exists() or config.exists(), seen)
        code, seen = self.at_a_terminal(arguments, [("password of viewer: ", "right horse"), ("field of view", "3.4")])
        self.assertEqual(code, 0, seen)
        self.assertNotIn("right horse", seen)
        self.assertEqual(stat.S_IMODE(stored.stat().st_mode), 0o600)
        self.assertEqual(stored.read_text(), "right horse\n")
        self.assertNotIn("right horse", config.read_text())
        code, report = self.check(config)
        self.assertEqual(code, 0, report)
        self.assertNotIn("right horse", report)

    def at_a_terminal(self, arguments, answers):
        """Exit code, and all that the terminal showed."""
        pid, terminal = pty.fork()
        if pid == 0:
            os.execvp(self.network.enter[0], [*self.network.enter, ALIDADE, *arguments])
        seen = b""
        waiting = list(answers)
        with contextlib.suppress(OSError):  # its end
            while True:
                ready, _, _ = select.select([terminal], [], [], DEADLINE_S)
                if not ready:
                    os.kill(pid, signal.SIGKILL)
                    break
                data = os.read(terminal, 65536)
                if not data:
                    break
                seen += data
                if waiting and waiting[0][0].encode() in seen.rsplit(b"\n", 1)[-1]:
                    os.write(terminal, waiting.pop(0)[1].encode() + b"\n")
        _, status = os.waitpid(pid, 0)
        os.close(terminal)
        return os.waitstatus_to_exitcode(status), seen.decode(errors="replace")

    def test_finds_an_axis_device_by_dns_sd(self):
        from zeroconf import ServiceInfo, Zeroconf
        server = http.server.ThreadingHTTPServer((CAMERA, AXIS_PORT), AxisHandler)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        announced = Zeroconf(interfaces=[CAMERA])
        self.addCleanup(announced.close)
        announced.register_service(ServiceInfo(
            "_axis-video._tcp.local.", "AXIS Q6075-E - ACCC8E012345._axis-video._tcp.local.", port=AXIS_PORT,
            addresses=[socket.inet_aton(CAMERA)], properties={"macaddress": "ACCC8E012345"},
            server="axis-accc8e012345.local."))
        found, _ = self.discover()
        self.assertEqual([camera["host"] for camera in found["cameras"]], [CAMERA])
        camera = found["cameras"][0]
        self.assertEqual(camera["vapix"], f"http://{CAMERA}:{AXIS_PORT}")
        self.assertEqual(camera["model"], "AXIS Q6075-E PTZ Dome Network Camera")
        self.assertEqual(camera["streams"][camera["take"]]["codec"], "H264")
        self.assertEqual(camera["telemetry"]["type"], "vapix")
        self.assertTrue(camera["telemetry"]["answers"])
        self.assertAlmostEqual(camera["telemetry"]["pan_deg"], 12.5)
        # Known by its address, it is found without a search.
        found, _ = self.discover("--device", f"{CAMERA}:{AXIS_PORT}", duration_s=0)
        self.assertEqual(found["cameras"][0]["model"], "AXIS Q6075-E PTZ Dome Network Camera")

    def test_neighbours_that_send_nonsense_are_named_and_cost_nothing(self):
        bomb = b'<!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><l>&b;</l>'
        self.respond(lambda of: [b"", b"\xff" * 60000, bomb, self.match(of)[:300], b"<a>" * 5000,
                                 self.match("urn:uuid:99999999-9999-4999-8999-999999999999", name="Another"),
                                 self.match(of, uuid="urn:uuid:2", name="x%1b%5b2J", addresses="http://127.0.0.1/a")])
        found, _ = self.discover()
        self.assertEqual([camera["name"] for camera in found["cameras"]], ["x\x1b[2J"])
        self.assertEqual(found["cameras"][0]["onvif"], f"http://{CAMERA}/onvif/device_service")
        self.assertTrue(any("somebody else" in note for note in found["notes"]), found["notes"])
        # For a terminal it is escaped.
        done = subprocess.run([*self.network.enter, ALIDADE, "discover", "--duration", "1"], capture_output=True, text=True,
                              timeout=DEADLINE_S, check=False)
        self.assertNotIn("\x1b", done.stdout + done.stderr)
        self.assertIn("\\x1b", done.stdout)

    def test_says_when_nothing_is_there(self):
        if not any(pathlib.Path("/dev").glob("video*")):
            _, said = self.discover(code=1, duration_s=0.2)
            self.assertIn("no camera was found", said)
        _, said = self.discover("--interface", "none0", "--device", "nonsense://", code=2, duration_s=0.2)
        self.assertIn("is no device's address", said)


if __name__ == "__main__":
    if INSIDE not in os.environ:
        enter_namespaces()
    unittest.main()
