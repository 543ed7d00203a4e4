#!/usr/bin/env python3
"""Edge executables on links with a fault every few seconds: `link_soak.py [seconds]` (1800).

RTSP and HTTP from the virtual camera, MJPEG over HTTP and a head on a serial line from link_devices, in a run of more
than a minute all the heads that there are, over UDP and TCP, too; the network links go through a proxy that resets, falls
silent, puts in garbage and refuses. After each fault the records must be good again within what the configuration gives a
source to notice and to try again; while a link is away the records must say so; no angle may be further from the truth
than its sigma allows; what a process uses must not grow; and it must end as it should.
"""
import bisect
import json
import math
import os
import pathlib
import random
import signal
import statistics
import subprocess
import sys
import threading
import time
import unittest
from urllib.parse import urlsplit

from fault_proxy import FaultProxy
from harness import CLOCK_OFFSET_MS, DEADLINE_S, Process, SystemTest, Truth

SECONDS = float(sys.argv.pop(1)) if len(sys.argv) > 1 and sys.argv[1].replace(".", "").isdigit() else 1800
TIMEOUT_S, MAX_BACKOFF_S = 1.0, 0.5
# To notice, to wait, to connect and log in; the rest is the machine's, whose two cores render the camera, too.
RECOVERY_S = TIMEOUT_S + MAX_BACKOFF_S + 10
PERIOD_S = 0.04  # of both cameras
# Of most faults: the machine may be slow for a while, not all the time.
MEDIAN_RECOVERY_S = TIMEOUT_S + MAX_BACKOFF_S + 0.5
LASTING_S = 3 * TIMEOUT_S  # a fault that must show as a loss
LEAST_FAULTS_SETTLED = 4  # after everything has been used once
MOST_SIGMAS = 8  # of an error: beyond what any of a soak's million angles has by chance


class Status:
    """What /proc says of a process."""

    def __init__(self, pid):
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
        fields = dict(line.split(":", 1) for line in status.splitlines())
        self.resident_kib = int(fields["VmRSS"].split()[0])
        self.threads = int(fields["Threads"])
        self.files = len(os.listdir(f"/proc/{pid}/fd"))


class Edge:
    """A running `alidade run`, its records gathered with the host's time."""

    def __init__(self, name, process, true_angles, late_s):
        """true_angles: time_s of a frame -> pan and tilt, or None where they are not known; frames come that late at
        most, which nobody but a calibration can know."""
        self.name = name
        self.process = process
        self.true_angles = true_angles
        self.late_s = late_s
        self.records = []
        self.thread = threading.Thread(target=self._gather)
        self.thread.start()

    def _gather(self):
        while (line := self.process.lines.get()) is not None:
            self.records.append((time.monotonic(), json.loads(line)))

    def good_after(self, moment):
        """Whether a frame that arrived after the moment has an orientation."""
        return any(r["mode"] != "none" and r["receive_time_s"] > moment for t, r in reversed(self.records[-100:]))

    def between(self, begin, end):
        return [r for t, r in self.records if begin <= t <= end]

    def errors_in_sigmas(self):
        """(error / sigma, record) of each angle, the error as far as a late frame does not explain it."""
        for _, record in self.records:
            truth = self.true_angles(record["time_s"]) if record["mode"] != "none" else None
            if truth is not None:
                sigma = max(record["orientation_sigma_rad"])
                for axis, true in zip(("pan", "tilt"), truth):
                    error = abs(math.remainder(record[f"{axis}_rad"] - true, 2 * math.pi))
                    explained = abs(record[f"{axis}_rate_rad_s"]) * self.late_s
                    yield max(0, error - explained) / sigma, record


class Link:
    """A link of an edge executable, and its faults: name -> function that begins it. end() ends it."""

    def __init__(self, name, edge, faults, end, lost_statuses):
        self.name, self.edge, self.faults, self.end, self.lost_statuses = name, edge, faults, end, lost_statuses


# Faults by which nothing passes while they last.
CUTS = {"silence", "unplug", "unplugged", "babble"}


def angles_of_link_devices(time_s):
    return [math.radians(20 * math.cos(time_s / 2)), math.radians(10 * math.cos(time_s / 3))]


def angles_of(truth):
    """Those of the virtual camera's Truth, looked up fast; its telemetry is of another clock than its video."""
    times = [time_s for time_s, _, _ in truth.rows]

    def at(time_s):
        time_s += 1e-3 * CLOCK_OFFSET_MS
        i = bisect.bisect_right(times, time_s)
        if not 0 < i < len(times):
            return None
        (t0, *a0), (t1, *a1) = truth.rows[i - 1:i + 1]
        return [p + (time_s - t0) / (t1 - t0) * (q - p) for p, q in zip(a0, a1)]
    return at


def proxied_link(name, edge, proxy, lost_statuses):
    faults = {"silence": proxy.silence, "reset": proxy.reset, "unplug": proxy.unplug, "garbage": proxy.send_garbage}
    return Link(name, edge, faults, proxy.back_to_normal, lost_statuses)


VIDEO_LOST = {"video lost"}
TELEMETRY_LOST = {"telemetry lost", "telemetry too old", "gap in telemetry", "too little telemetry"}


class LinkSoak(SystemTest):
    def through_proxy(self, url):
        parts = urlsplit(url)
        proxy = FaultProxy((parts.hostname, parts.port))
        self.addCleanup(proxy.close)
        return proxy, parts._replace(netloc=f"127.0.0.1:{proxy.port}").geturl()

    def edge(self, name, video, pan_tilt, true_angles=None, late_s=0, calibration=None):
        """pan_tilt: the keys of that section that tell which head it is and where, as text."""
        wait = {"timeout_s": TIMEOUT_S, "max_backoff_s": MAX_BACKOFF_S}
        file = self.folder / f"{name}.yaml"
        sections = {
            "video": {**video, **wait}, "camera": {"focal_length_px": 2667}, "realtime": {"mode": "PT"},
            "output": {"json": True}, "calibration": {"auto": False, **(calibration or {})}}
        lines = [f"{section}: {json.dumps(keys)}" for section, keys in sections.items()]
        of_every_source = json.dumps({"angle_sigma_rad": 1e-4, "rate_hz": 50, **wait})[1:-1]
        file.write_text("\n".join([*lines, f"pan_tilt: {{{pan_tilt}, {of_every_source}}}", ""]))
        return Edge(name, self.alidade("run", "-c", file), true_angles, late_s)

    def links_of_virtual_camera(self):
        self.virtual_camera = self.camera()
        video, video_url = self.through_proxy(self.virtual_camera.video_url)
        head, head_url = self.through_proxy(self.virtual_camera.pan_tilt_url)
        edge = self.edge("rtsp", {"type": "rtsp", "url": video_url}, f"type: vapix, url: '{head_url}'",
                         late_s=0.1, calibration={"file": str(self.virtual_camera.truth / "truth.yaml")})
        return [proxied_link("rtsp", edge, video, VIDEO_LOST), proxied_link("vapix", edge, head, TELEMETRY_LOST)]

    def links_of_devices(self, head, faults):
        """head: a kind that link_devices knows, faults: those that cost answers only."""
        devices = Process(os.environ["LINK_DEVICES"], head, stdin=True)
        self.processes.append(devices)
        _, url, settings = devices.line().split(maxsplit=2)
        video, video_url = self.through_proxy(url)
        edge = self.edge(head, {"type": "mjpeg", "url": video_url}, settings, angles_of_link_devices)
        faults = {fault: lambda fault=fault: devices.tell(fault) for fault in faults}
        return [proxied_link(f"mjpeg beside {head}", edge, video, VIDEO_LOST),
                Link(head, edge, faults, lambda: devices.tell("none"), TELEMETRY_LOST)]

    def links(self):
        links = self.links_of_virtual_camera()
        kinds = subprocess.run([os.environ["LINK_DEVICES"]], capture_output=True, text=True, check=True).stdout.splitlines()
        for kind in kinds if SECONDS > 60 else kinds[:1]:
            head, *faults = kind.split()
            links += self.links_of_devices(head, faults)
        return links

    def wait_good(self, edge, moment, seconds, what):
        end = time.monotonic() + seconds
        while not edge.good_after(moment):
            self.assertIsNone(edge.process.child.poll(), f"{what}: ended\n{edge.process.error_text()}")
            self.assertLess(time.monotonic(), end, f"{what}: no good record within {seconds} s\n"
                            + "\n".join(edge.process.errors[-20:]))
            time.sleep(0.02)

    def one_fault(self, link, fault, random_):
        lasting = random_.random() < 0.5
        what = f"{link.name}: {fault}"
        begin = time.monotonic()
        link.faults[fault]()
        time.sleep(LASTING_S if lasting else random_.uniform(0.1, 0.6) * TIMEOUT_S)
        end = time.monotonic()
        link.end()
        self.wait_good(link.edge, end, RECOVERY_S, what)
        recovered = time.monotonic()
        records = link.edge.between(begin, recovered)
        if lasting and fault in CUTS:
            said = {r["status"] for r in records if r["mode"] == "none"}
            self.assertTrue(said & link.lost_statuses, f"{what}: for {end - begin:.1f} s, and the records say {said}")
        return what, recovered - end

    def test_soak(self):
        links = self.links()
        edges = list(dict.fromkeys(link.edge for link in links))
        for edge in edges:
            self.wait_good(edge, 0, DEADLINE_S, "start")
        random_ = random.Random(6)
        begin = time.monotonic()
        took_s, settled, faults_since = {}, None, 0
        # Each fault of each link once at least, then as they come.
        todo = [(link, fault) for link in links for fault in link.faults]
        random_.shuffle(todo)
        while todo or time.monotonic() < begin + SECONDS or faults_since < LEAST_FAULTS_SETTLED:
            if not todo:
                link = random_.choice(links)
                todo = [(link, random_.choice(list(link.faults)))]
            what, took = self.one_fault(*todo.pop(), random_)
            took_s.setdefault(what, []).append(took)
            faults_since += settled is not None
            # Everything has been used once: from here on nothing may grow.
            if settled is None and (time.monotonic() > begin + SECONDS / 6 and not todo):
                settled = [Status(edge.process.child.pid) for edge in edges]
            time.sleep(random_.uniform(0.5, 2))
        for edge, before in zip(edges, settled):
            self.wait_good(edge, time.monotonic(), RECOVERY_S, "end")
            after = Status(edge.process.child.pid)
            frames = [r for _, r in edge.records if r["frame"] is not None]
            times = [r["time_s"] for r in frames if r["time_s"] is not None]  # none until the pace is known
            gaps = sum(t1 - t0 > 1.5 * PERIOD_S for t0, t1 in zip(times, times[1:]))
            print(f"{edge.name}: {len(frames)} frames, {gaps} gaps; "
                  f"resident {before.resident_kib} -> {after.resident_kib} KiB, "
                  f"files {before.files} -> {after.files}, threads {before.threads} -> {after.threads}")
            self.assertTrue(all(r0["frame"] < r1["frame"] for r0, r1 in zip(frames, frames[1:])))
            self.assertGreater(gaps, 0)
            self.assertEqual(after.threads, before.threads)
            self.assertLessEqual(after.files, before.files + 1)  # a connection may be about to be replaced
            self.assertLess(after.resident_kib, before.resident_kib + 8192)  # of some 100 MB; a frame leaked is 15 KB
            code, _ = edge.process.end(signal.SIGTERM)
            edge.thread.join()
            self.assertEqual(code, 0, edge.process.error_text())
        self.virtual_camera.end(signal.SIGTERM)
        for what, times in sorted(took_s.items()):
            print(f"{what:28} {len(times):4} times, good again after {statistics.median(times):.2f} s in the median, "
                  f"{max(times):.1f} s at most")
        self.assertLess(statistics.median(sum(took_s.values(), [])), MEDIAN_RECOVERY_S)
        truth = angles_of(Truth(self.virtual_camera.truth))
        for edge in edges:
            edge.true_angles = edge.true_angles or truth
            errors = list(edge.errors_in_sigmas())
            worst, record = max(errors, key=lambda error: error[0])
            mean_square = statistics.fmean(error * error for error, _ in errors)
            print(f"{edge.name}: {len(errors)} angles, error / sigma {math.sqrt(mean_square):.2f} rms, "
                  f"{worst:.2f} at most")
            self.assertGreater(len(errors), 100)
            self.assertLess(worst, MOST_SIGMAS, f"{edge.name}: truth {edge.true_angles(record['time_s'])}, {record}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=0)
