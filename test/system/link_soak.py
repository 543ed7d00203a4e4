#!/usr/bin/env python3
"""Two edge executables on four links, with a fault every few seconds: `link_soak.py [seconds]` (1800).

RTSP and HTTP from the virtual camera, MJPEG over HTTP and Pelco-D on a serial line from link_devices; the network
links go through a proxy that resets, falls silent, puts in garbage and refuses. After each fault the records must be
good again within what the configuration gives a source to notice and to try again; while a link is away the records
must say so; what a process uses must not grow; and it must end as it should.
"""
import json
import os
import pathlib
import random
import signal
import sys
import threading
import time
import unittest
from urllib.parse import urlsplit

from fault_proxy import FaultProxy
from harness import DEADLINE_S, Process, SystemTest

SECONDS = float(sys.argv.pop(1)) if len(sys.argv) > 1 and sys.argv[1].replace(".", "").isdigit() else 1800
TIMEOUT_S, MAX_BACKOFF_S = 1.0, 0.5
# To notice, to wait, to connect and log in; the rest is the machine's, whose two cores render the camera, too.
RECOVERY_S = TIMEOUT_S + MAX_BACKOFF_S + 10
PERIOD_S = 0.04  # of both cameras
LASTING_S = 3 * TIMEOUT_S  # a fault that must show as a loss


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

    def __init__(self, process):
        self.process = process
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


class Link:
    """A link of an edge executable, and its faults: name -> function that begins it. end() ends it."""

    def __init__(self, name, edge, faults, end, lost_statuses):
        self.name, self.edge, self.faults, self.end, self.lost_statuses = name, edge, faults, end, lost_statuses


# Faults by which nothing passes while they last.
CUTS = {"silence", "unplug", "unplugged", "babble"}


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

    def edge(self, name, video, pan_tilt):
        wait = {"timeout_s": TIMEOUT_S, "max_backoff_s": MAX_BACKOFF_S}
        file = self.folder / f"{name}.yaml"
        file.write_text(json.dumps({
            "video": {**video, **wait}, "pan_tilt": {"angle_sigma_rad": 1e-4, **pan_tilt, **wait},
            "camera": {"focal_length_px": 2667}, "realtime": {"mode": "PT"}, "output": {"json": True},
            "calibration": {"auto": False}}))
        return Edge(self.alidade("run", "-c", file))

    def links(self):
        camera = self.camera()
        video, video_url = self.through_proxy(camera.video_url)
        head, head_url = self.through_proxy(camera.pan_tilt_url)
        rtsp = self.edge("rtsp", {"type": "rtsp", "url": video_url},
                         {"type": "vapix", "url": head_url, "rate_hz": 50})

        devices = Process(os.environ["LINK_DEVICES"], stdin=True)
        self.processes.append(devices)
        _, url, line = devices.line().split()
        mjpeg, mjpeg_url = self.through_proxy(url)
        serial = self.edge("mjpeg", {"type": "mjpeg", "url": mjpeg_url},
                           {"type": "pelco_d", "device": line, "baud": 115200, "rate_hz": 50})

        def head_has(fault):
            return lambda: devices.tell(fault)
        head_faults = {fault: head_has(fault) for fault in
                       ("unplugged", "silence", "babble", "noise", "lost_byte", "changed_byte", "merged", "repeated",
                        "unsolicited", "late")}
        return [proxied_link("rtsp", rtsp, video, VIDEO_LOST), proxied_link("vapix", rtsp, head, TELEMETRY_LOST),
                proxied_link("mjpeg", serial, mjpeg, VIDEO_LOST),
                Link("pelco_d", serial, head_faults, head_has("none"), TELEMETRY_LOST)]

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
        counts, slowest, settled = {}, {}, None
        # Each fault of each link once at least, then as they come.
        todo = [(link, fault) for link in links for fault in link.faults]
        random_.shuffle(todo)
        while todo or time.monotonic() < begin + SECONDS:
            if not todo:
                link = random_.choice(links)
                todo = [(link, random_.choice(list(link.faults)))]
            what, took = self.one_fault(*todo.pop(), random_)
            counts[what] = counts.get(what, 0) + 1
            slowest[what] = max(slowest.get(what, 0), took)
            # Everything has been used once: from here on nothing may grow.
            if settled is None and (time.monotonic() > begin + SECONDS / 6 and not todo):
                settled = [Status(edge.process.child.pid) for edge in edges]
            time.sleep(random_.uniform(0.5, 2))
        self.assertIsNotNone(settled)
        for edge, before in zip(edges, settled):
            self.wait_good(edge, time.monotonic(), RECOVERY_S, "end")
            after = Status(edge.process.child.pid)
            frames = [r for _, r in edge.records if r["frame"] is not None]
            times = [r["time_s"] for r in frames]
            gaps = sum(t1 - t0 > 1.5 * PERIOD_S for t0, t1 in zip(times, times[1:]))
            print(f"{len(frames)} frames, {gaps} gaps; resident {before.resident_kib} -> {after.resident_kib} KiB, "
                  f"files {before.files} -> {after.files}, threads {before.threads} -> {after.threads}")
            self.assertTrue(all(r0["frame"] < r1["frame"] for r0, r1 in zip(frames, frames[1:])))
            self.assertGreater(gaps, 0)
            self.assertEqual(after.threads, before.threads)
            self.assertLessEqual(after.files, before.files + 1)  # a connection may be about to be replaced
            self.assertLess(after.resident_kib, before.resident_kib + 8192)  # of some 100 MB; a frame leaked is 15 KB
            code, _ = edge.process.end(signal.SIGTERM)
            edge.thread.join()
            self.assertEqual(code, 0, edge.process.error_text())
        for what in sorted(counts):
            print(f"{what:22} {counts[what]:4} times, good again after {slowest[what]:.1f} s at most")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=0)
