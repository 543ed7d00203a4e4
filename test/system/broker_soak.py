#!/usr/bin/env python3
"""`alidade run` whose MQTT broker is away for long: `broker_soak.py [seconds]` (3600).

Two edge executables on a mosquitto each. One broker is suspended, a black hole that takes connections and answers none, the other is
killed. Meanwhile detections come five times a second, so that there is always something new to tell. No record may be lost, neither
memory nor files nor threads may grow, and when the brokers are back they must have the newest targets, and `online`, within the longest
pause between two attempts. Prints a line a minute.
"""
import http.client
import json
import math
import os
import pathlib
import re
import shutil
import signal
import sys
import threading
import time
import unittest

from harness import IMAGE, Process, SystemTest, free_port, wait_until

SECONDS = float(sys.argv.pop(1)) if len(sys.argv) > 1 and sys.argv[1].replace(".", "").isdigit() else 3600
BROKER = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")
PERIOD_S = min(60.0, SECONDS / 3)  # of a line
TIMEOUT_S, MAX_BACKOFF_S, KEEP_ALIVE_S = 2, 2, 5
# A pause, an attempt that a black hole swallows, one that succeeds; the rest is the machine's.
RETURN_S = 2 * (TIMEOUT_S + MAX_BACKOFF_S) + 10
# What the allocator may take for itself: of states one an interval of 0.2 s, kept, would be a hundred times as much in an hour.
MOST_GROWTH_KIB = 2048
LATENCY = re.compile(r'alidade_latency_seconds_bucket\{le="([^"]+)"\} (\d+)')


class Broker:
    def __init__(self, test):
        self.test, self.port = test, free_port()
        self.settings = test.folder / f"mosquitto-{self.port}.conf"
        self.settings.write_text(f"user root\nlistener {self.port} 127.0.0.1\nallow_anonymous true\n")
        self.start()

    def start(self):
        self.process = Process(BROKER, "-c", self.settings)
        self.test.processes.append(self.process)

    def newest(self, topic):
        """What the broker tells of a topic to one who comes now."""
        client = Process("mosquitto_sub", "-h", "127.0.0.1", "-p", self.port, "-t", f"alidade/{topic}", "-C", "1", "-W", "10")
        _, lines = client.end()
        return lines[0] if lines else None


class Edge:
    """A run that is told of a box in each fifth frame, and whose records are counted as they come."""

    def __init__(self, test, name, seed):
        self.name, self.broker = name, Broker(test)
        camera = test.camera(seed=seed, settings={"path": {"type": "triple_cosine", "period_s": 10, "amplitude": 0.2}})
        mqtt = {"url": f"mqtt://127.0.0.1:{self.broker.port}", "timeout_s": TIMEOUT_S, "max_backoff_s": MAX_BACKOFF_S,
                "keep_alive_s": KEEP_ALIVE_S, "orientation_rate_hz": 5}
        config = test.write_config(camera, output={"json": True, "http": "127.0.0.1:0"}, mqtt=mqtt, tracking={})
        self.run = test.alidade("run", "-c", config)
        wait_until(lambda: "HTTP: listening" in self.run.error_text(), "listening")
        self.address = re.search(r"listening on http://([^/]+)/", self.run.error_text())[1]
        self.records, self.frames_left_out, self.longest_pause_s, self.refused = 0, 0, 0.0, 0
        self.telling = threading.Event()
        self.telling.set()
        self.told = {}
        self.api = http.client.HTTPConnection(self.address, timeout=30)
        self.thread = threading.Thread(target=self._follow)
        self.thread.start()

    def _follow(self):
        last_frame, last_s = None, time.monotonic()
        while (line := self.run.lines.get()) is not None:
            now_s, record = time.monotonic(), json.loads(line)
            frame = record["frame"]
            if frame is None:  # the camera ends before the run
                continue
            self.longest_pause_s = max(self.longest_pause_s, now_s - last_s)
            self.frames_left_out += frame - last_frame - 1 if last_frame is not None else 0
            self.records, last_frame, last_s = self.records + 1, frame, now_s
            if self.telling.is_set() and frame % 5 == 0 and record["mode"] != "none":
                self._tell(frame)

    def _tell(self, frame):
        # It goes round slowly, so that no state is that of before.
        u = 80 + 20 * math.cos(frame / 500)
        body = {"frame": frame, "boxes": [{"u": u, "v": 40, "width": 6, "height": 12, "score": 0.9}]}
        self.api.request("POST", "/api/v1/detections", json.dumps(body))
        answer = self.api.getresponse()
        answer.read()
        self.refused += answer.status != 202

    def ask(self, path):
        api = http.client.HTTPConnection(self.address, timeout=30)
        api.request("GET", path)
        body = api.getresponse().read().decode()
        api.close()
        return body

    def sample(self):
        metrics = self.ask("/metrics")
        status = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{self.run.child.pid}/status").read_text().splitlines())

        def value(name, labels=""):
            return float(re.search(rf"^{re.escape(name + labels)} (\S+)$", metrics, re.M)[1])
        return {
            "rss_kib": int(status["VmRSS"].split()[0]), "threads": int(status["Threads"]),
            "files": len(os.listdir(f"/proc/{self.run.child.pid}/fd")), "records": self.records,
            "connected": value("alidade_mqtt_connected"), "published": value("alidade_mqtt_published_total"),
            "replaced": value("alidade_mqtt_replaced_total"), "waiting": value("alidade_detection_frames_waiting"),
            "dropped": sum(float(x) for x in re.findall(r"^alidade_queue_dropped_total\{.*\} (\S+)$", metrics, re.M)),
            "buckets": [(float(le), int(count)) for le, count in LATENCY.findall(metrics)]}


def quantile_ms(before, after, part):
    """Upper end of the bucket that holds it, of the records between two samples."""
    counts = [(le, late - early) for (le, late), (_, early) in zip(after["buckets"], before["buckets"])]
    return next(1e3 * le for le, count in counts if count >= part * counts[-1][1])


class BrokerSoak(SystemTest):
    def line(self, edge, what, before, after, seconds):
        print(f"{time.strftime('%H:%M:%S')} {edge.name:9} {what:7} "
              f"{after['rss_kib']:6d} KiB, {after['threads']} threads, {after['files']} files, "
              f"{(after['records'] - before['records']) / seconds:.2f} records/s, latency p50 {quantile_ms(before, after, 0.5):.2f} "
              f"p99 {quantile_ms(before, after, 0.99):.2f} ms, longest pause {edge.longest_pause_s:.2f} s, dropped {after['dropped']:.0f}, "
              f"detections waiting {after['waiting']:.0f}, published {after['published'] - before['published']:.0f}, "
              f"replaced {after['replaced'] - before['replaced']:.0f}", flush=True)
        edge.longest_pause_s = 0.0

    def watch(self, edges, what, seconds):
        """Samples of each edge at the beginning and after each period."""
        samples = {edge.name: [edge.sample()] for edge in edges}
        begin_s = last_s = time.monotonic()
        while (left_s := begin_s + seconds - time.monotonic()) > 0.1:
            time.sleep(min(PERIOD_S, left_s))
            now_s = time.monotonic()
            for edge in edges:
                samples[edge.name].append(edge.sample())
                self.line(edge, what, *samples[edge.name][-2:], now_s - last_s)
                self.assertIsNone(edge.run.child.poll(), edge.run.error_text())
            last_s = now_s
        return samples

    def test_a_broker_that_is_away(self):
        edges = [Edge(self, "suspended", 1), Edge(self, "killed", 2)]
        self.addCleanup(lambda: [edge.thread.join() for edge in edges])
        self.addCleanup(self._kill_all)
        for edge in edges:
            wait_until(lambda edge=edge: edge.records > 0 and edge.sample()["connected"] == 1, "records and the broker's connection")
        before = self.watch(edges, "there", 2 * PERIOD_S)
        edges[0].broker.process.child.send_signal(signal.SIGSTOP)
        edges[1].broker.process.child.kill()
        for edge in edges:
            wait_until(lambda edge=edge: edge.sample()["connected"] == 0, "the loss")
        away = self.watch(edges, "away", SECONDS)
        for edge in edges:
            edge.telling.clear()
        for edge in edges:
            newest = json.loads(edge.ask("/api/v1/targets"))
            self.assertTrue(newest["targets"])
            begin_s = time.monotonic()
            if edge.name == "suspended":
                edge.broker.process.child.send_signal(signal.SIGCONT)
            else:
                edge.broker.start()

            def told(edge=edge, newest=newest):
                text = edge.broker.newest("targets")
                return bool(text) and json.loads(text)["detected_frame"] == newest["detected_frame"]
            wait_until(lambda edge=edge: edge.sample()["connected"] == 1, "the connection")
            wait_until(told, "the newest targets")
            print(f"{edge.name}: newest targets after {time.monotonic() - begin_s:.1f} s", flush=True)
            self.assertLess(time.monotonic() - begin_s, RETURN_S)
            edge.telling.set()
        back = self.watch(edges, "back", PERIOD_S)
        for edge in edges:
            with self.subTest(edge.name):
                self.assertEqual(edge.broker.newest("status"), "online")
                self.assertEqual((edge.frames_left_out, edge.refused), (0, 0))
                of_all = before[edge.name] + away[edge.name] + back[edge.name]
                self.assertEqual(of_all[-1]["dropped"], 0)
                rate_hz = (away[edge.name][-1]["records"] - away[edge.name][0]["records"]) / SECONDS
                self.assertAlmostEqual(rate_hz, IMAGE["rate_hz"], delta=0.02 * IMAGE["rate_hz"])
                settled = before[edge.name][-1]
                self.assertLess(max(s["rss_kib"] for s in of_all) - settled["rss_kib"], MOST_GROWTH_KIB)
                self.assertLessEqual(max(s["files"] for s in of_all), settled["files"] + 2)
                self.assertLessEqual(max(s["threads"] for s in of_all), settled["threads"])
                code, _ = edge.run.end(signal.SIGTERM)
                self.assertEqual(code, 0, edge.run.error_text())
                self.assertEqual(edge.run.error_text().count("MQTT: lost"), 1, edge.run.error_text())


if __name__ == "__main__":
    unittest.main()
