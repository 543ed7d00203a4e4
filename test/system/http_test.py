#!/usr/bin/env python3
"""The HTTP API of the edge executable: its answers against its own description, and hostile clients beside records
that must not be lost."""
import base64
import json
import math
import os
import pathlib
import random
import re
import resource
import signal
import socket
import unittest
import urllib.error
import urllib.request

import jsonschema
import yaml

from harness import DEADLINE_S, IMAGE, SystemTest, wait_until

ROOT = pathlib.Path(__file__).resolve().parents[2]
DESCRIPTION = yaml.safe_load((ROOT / "edge_app/output/openapi.yaml").read_text(encoding="utf-8"))
TOKEN = "right-horse-" + base64.b16encode(bytes(range(8))).decode()


def json_schema(schema):
    """OpenAPI 3.0 says `nullable` where JSON Schema has another type."""
    if isinstance(schema, list):
        return [json_schema(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    out = {key: json_schema(value) for key, value in schema.items() if key != "nullable"}
    if schema.get("nullable"):
        return {"anyOf": [{"type": "null"}, out]}
    return out


SCHEMAS = {"components": json_schema(DESCRIPTION["components"])}


def described_members(schema):
    """The members that a schema describes itself, by reference or in the parts that it is made of."""
    if "$ref" in schema:
        schema = DESCRIPTION["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    return set(schema.get("properties", ())).union(*(described_members(part) for part in schema.get("allOf", ())))


def check(instance, schema):
    """Against a schema of the description; what an object holds must be described, too."""
    if "$ref" not in schema:
        schema = json_schema(schema)
    jsonschema.Draft7Validator({**SCHEMAS, "allOf": [schema]}).validate(instance)
    properties = described_members(schema) if "$ref" in schema else None
    if properties:
        unknown = set(instance) - properties
        assert not unknown, f"not described: {unknown}"


class Answer:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        return json.loads(self.body)


class Api:
    def __init__(self, process):
        announced = re.compile(r"HTTP: listening on (http://([^/]*)/)")
        wait_until(lambda: announced.search(process.error_text()) or process.child.poll() is not None, "listening")
        self.url, address = announced.search(process.error_text()).groups()
        host, _, port = address.rpartition(":")
        self.address = (host, int(port))
        self.process = process

    def ask(self, path, body=None, token=TOKEN, method=None, headers=None):
        request = urllib.request.Request(self.url + path, method=method,
                                         data=body if body is None or isinstance(body, bytes) else json.dumps(body).encode())
        if token:
            request.add_header("Authorization", f"Bearer {token}")
        for name, value in (headers or {}).items():
            request.add_header(name, value)
        try:
            with urllib.request.urlopen(request, timeout=DEADLINE_S) as answer:
                return Answer(answer.status, answer.headers, answer.read())
        except urllib.error.HTTPError as error:
            return Answer(error.code, error.headers, error.read())

    def connect(self):
        return socket.create_connection(self.address, timeout=DEADLINE_S)

    def raw(self, request):
        """What comes back for these bytes; None if the connection was dropped."""
        with self.connect() as client:
            try:
                client.sendall(request)
                answer = b""
                while piece := client.recv(65536):
                    answer += piece
                return answer or None
            except ConnectionError:
                return None

    def follow(self):
        """The connection of a new client of the stream, behind the head."""
        client = self.connect()
        client.sendall(f"GET /api/v1/stream HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {TOKEN}\r\n\r\n".encode())
        file = client.makefile("rb")
        assert file.readline().startswith(b"HTTP/1.1 200 ")
        while file.readline() != b"\r\n":
            pass
        return client, file


def events(file):
    """(event, id, data) of a stream, as they come."""
    event = {}
    for line in file:
        line = line.decode().rstrip("\n")
        if line:
            name, _, value = line.partition(": ")
            event[name] = value
        elif "data" in event:
            yield event["event"], event.get("id"), json.loads(event["data"])
            event = {}


class Http(SystemTest):
    def start(self, mode="PT", json_output=True, settings=None, calibration=None, clock_offset_sigma_ms=None, **sections):
        """alidade with the virtual camera, answering. calibration: entries of it that take the place of the truth's.
        clock_offset_sigma_ms: stated, so that in mode PT no picture has to tell the delay."""
        camera = self.camera(settings=settings)
        if calibration:
            file = self.folder / "calibration.yaml"
            truth = yaml.safe_load((camera.truth / "truth.yaml").read_text(encoding="utf-8"))
            file.write_text(json.dumps({**truth, **calibration}))
            sections["calibration"] = {"file": str(file), "auto": False}
        if clock_offset_sigma_ms:
            sections["calibration"] = {"file": str(camera.truth / "truth.yaml"), "auto": False, "clock_offset_sigma_ms": clock_offset_sigma_ms}
        targets = {"targets": str(self.folder / "targets.jsonl")} if "tracking" in sections else {}
        config = self.write_config(camera, output={"json": json_output, "http": "127.0.0.1:0", "token_env": "TEST_TOKEN", **targets},
                                   realtime={"mode": mode}, **sections)
        run = self.alidade("run", "-c", config, TEST_TOKEN=TOKEN)
        api = Api(run)

        def oriented():
            frames = api.ask("api/v1/status").json()["frames"]
            return frames["oe"] + frames["pt"] > 1
        wait_until(oriented, "an orientation")
        return run, api

    def end(self, run):
        code, lines = run.end(signal.SIGINT)
        self.assertEqual(code, 0, run.error_text())
        self.assertNotIn(TOKEN, run.error_text())
        return lines

    def described(self, path, method, status, content="application/json"):
        response = DESCRIPTION["paths"][path][method]["responses"][str(status)]
        if "$ref" in response:
            response = DESCRIPTION["components"]["responses"][response["$ref"].rpartition("/")[2]]
        return response["content"][content]["schema"]

    def check_answer(self, api, path, status=200, body=None, **more):
        method = "get" if body is None else "post"
        answer = api.ask(path.lstrip("/"), body, **more)
        self.assertEqual(answer.status, status, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/json")
        self.assertEqual(answer.body.count(b"\n"), 1)
        check(answer.json(), self.described(path.partition("?")[0], method, status))
        return answer.json()

    def follow_somebody(self, api, place, noise_px=0.5, frames=40):
        """Somebody stands where the camera looks at zero pan and tilt; a detector with noise finds them in each frame."""
        noise = random.Random(7)
        client, file = api.follow()
        seen, last, targets = 0, None, {"targets": []}
        while seen < frames or not targets["targets"] or targets["targets"][0]["pixel"] is None:
            def newer(known=last):
                nonlocal last
                last = api.ask("api/v1/orientation").json().get("frame", known)
                return last != known
            wait_until(newer, "another frame")
            frame = last
            pixel = api.ask("api/v1/pixel", {"frame": frame, "directions": [[1, 0, 0]]}).json().get("pixels", [{}])[0]
            boxes = []
            if pixel.get("inside"):
                u, v = (x + noise.gauss(0, noise_px) for x in pixel["pixel"])
                boxes = [{"u": u - 2, "v": v - 10, "width": 4, "height": 10, "score": 0.8, "class": "person"}]
            answer = api.ask("api/v1/detections", {"frame": frame, "boxes": boxes})
            # A frame that is forgotten or has no orientation.
            if answer.status in (404, 409):
                continue
            self.assertEqual(answer.status, 202, answer.body)
            check(answer.json(), self.described("/api/v1/detections", "post", 202))
            # But for a box whose middle is above the picture.
            seen += answer.json()["boxes"]
            targets = api.ask("api/v1/targets").json()
        data = next(data for name, _, data in events(file) if name == "targets" and data["targets"])
        check(data, {"$ref": "#/components/schemas/Targets"})
        client.close()
        file.close()
        target, = targets["targets"]
        error = [x - y for x, y in zip(target["position_m"], place)]
        (a, b), (c, d) = (row[:2] for row in target["covariance"][:2])
        squared = (d * error[0] ** 2 - (b + c) * error[0] * error[1] + a * error[1] ** 2) / (a * d - b * c)
        self.assertLess(squared, 13.8, f"{error} m: chi-square of two, beyond it 1 in 1000")
        self.assertLess(math.hypot(*error), 1)
        self.assertLess(math.hypot(*target["velocity_m_s"]), 1)
        self.assertEqual((target["identity"], target["class"]), (1, "person"))
        self.assertAlmostEqual(target["latitude_deg"], 48 + target["position_m"][1] / 111.2e3, places=4)
        return target

    def test_answers_as_it_describes(self):
        plane, place = self.ground()
        run, api = self.start(settings={"path": {"type": "triple_cosine", "period_s": 10, "amplitude": 0.2}},
                              tracking={"plane": plane, "detection_sigma_px": 0.5})
        self.assertEqual(self.check_answer(api, "/api/v1/targets")["targets"], [])
        self.assertEqual(yaml.safe_load(api.ask("api/v1/openapi.yaml", token=None).body), DESCRIPTION)
        self.assertEqual(api.ask("healthz", token=None).body, b"ok\n")
        record = self.check_answer(api, "/api/v1/orientation")
        self.check_answer(api, "/api/v1/status")
        history = self.check_answer(api, "/api/v1/history")
        self.assertEqual(1, len({len(column) for column in history.values()}))
        hour = self.check_answer(api, "/api/v1/history?span=hour")
        self.assertEqual(1, len({len(column) for column in hour.values()}))
        self.assertGreater(len(hour["time_s"]), 0)
        calibration = self.check_answer(api, "/api/v1/calibration")
        self.assertEqual(calibration["image"], {key: IMAGE[key] for key in ("width", "height")})
        self.check_answer(api, "/api/v1/calibrate", 409, b"")
        self.check_answer(api, "/api/v1/stream/ticket", body={})
        self.assertEqual(self.check_answer(api, "/api/v1/plane")["height"]["value"], 20)
        known = {"format": 1, "level": {"sigma_deg": 0.1}, "height": {"height_m": 20, "sigma_m": 0.1}}
        self.assertIn("height", self.check_answer(api, "/api/v1/plane/fit", body=known)["plane_yaml"])
        self.assertIsNone(self.check_answer(api, "/api/v1/plane/fit", body={"format": 1})["plane_yaml"])
        self.check_answer(api, "/api/v1/plane/fit", 400, {"format": 1, "houses": []})
        self.check_answer(api, "/api/v1/map", 404)
        self.follow_somebody(api, place)
        targets = self.check_answer(api, "/api/v1/targets")
        self.assertEqual(len(targets["targets"]), 1)
        # One of which no detections have come yet.
        wait_until(lambda: api.ask("api/v1/orientation").json()["frame"] > targets["detected_frame"], "a later frame")
        frame = self.check_answer(api, "/api/v1/orientation")["frame"]
        later = api.ask(f"api/v1/targets?frame={frame}").json()
        self.assertEqual((later["frame"], later["detected_frame"]), (frame, targets["detected_frame"]))
        for body, status in (({"frame": 10**9, "boxes": []}, 404), ({"frame": targets["detected_frame"], "boxes": []}, 409),
                             ({"frame": frame, "boxes": [{"u": 900, "v": 1, "width": 1, "height": 1}]}, 202)):
            self.check_answer(api, "/api/v1/detections", status, body)
        metrics = self.parse_metrics(api.ask("metrics").body.decode())
        self.assertEqual(metrics["alidade_targets", ()], 1)
        self.assertGreaterEqual(metrics["alidade_detection_frames_total", (("outcome", "taken"),)], 40)
        self.assertGreaterEqual(metrics["alidade_detection_boxes_total", (("outcome", "outside"),)], targets["detections"]["boxes"]["outside"])
        record = self.check_answer(api, "/api/v1/orientation")
        frame = record["frame"]
        for which in ({}, {"frame": frame}, {"time_s": record["time_s"] + 0.01}):
            answer = self.check_answer(api, "/api/v1/direction", body={
                **which, "pixels": [[80, 48], [0, 0], [160, 96], [161, 0]], "pixel_sigma_px": 0.1})
            self.assertIn("error", answer["directions"][3])
            if which:
                self.assertEqual(answer["frame"], frame)
            directions = [one["direction"] for one in answer["directions"][:3]]
            back = self.check_answer(api, "/api/v1/pixel", body={
                "frame": answer["frame"], "directions": directions + [[-x for x in directions[0]]]})
            self.assertIn("error", back["pixels"][3])
            for one, pixel in zip(back["pixels"], ([80, 48], [0, 0], [160, 96])):
                self.assertLess(math.dist(one["pixel"], pixel), 1e-6)
        self.assertEqual(self.check_answer(api, "/api/v1/hold", body={"frame": frame})["frame"], frame)
        # The centre of a frame at rest is where its q looks; here it turns, by at most a pixel or so until its row.
        x, y, z, w = record["q_base_from_camera"]
        forward = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
        self.assertLess(math.dist(forward, directions[0]), 3 / record["focal_length_px"])
        for path, body, status in (
                ("/api/v1/direction", {"pixels": []}, 400), ("/api/v1/direction", {"frame": 10**9, "pixels": [[1, 1]]}, 404),
                ("/api/v1/direction", {"pixels": [[1, 1]], "padding": "x" * 70000}, 413),
                ("/api/v1/hold", {"frame": -1}, 400), ("/api/v1/hold", {"frame": 10**9}, 404),
                ("/api/v1/pixel", {"directions": [[0, 0, 0]]}, 400), ("/api/v1/pixel", {"time_s": 0, "directions": [[1, 0, 0]]}, 404)):
            self.check_answer(api, path, status, body)
        for path in ("/api/v1/orientation", "/api/v1/status", "/api/v1/history", "/api/v1/calibration", "/api/v1/targets"):
            self.check_answer(api, path, 401, token="wrong-horse")
            self.check_answer(api, path, 401, token=None)
        for path in ("/api/v1/direction", "/api/v1/pixel", "/api/v1/hold", "/api/v1/calibrate", "/api/v1/detections", "/api/v1/stream/ticket"):
            self.check_answer(api, path, 401, {}, token=None)
        self.end(run)
        told = [json.loads(line) for line in (self.folder / "targets.jsonl").read_text().splitlines()]
        self.assertEqual(len(told), metrics["alidade_detection_frames_total", (("outcome", "taken"),)])
        for one in told:
            check(one, {"$ref": "#/components/schemas/Targets"})
        self.assertEqual(told[-1]["targets"][0]["identity"], 1)

    def test_describes_a_calibration_with_an_optical_centre(self):
        run, api = self.start(calibration={"centre_offset": {"value": [3.5, -2], "sigma": [0.5, 0.25]}})
        calibration = self.check_answer(api, "/api/v1/calibration")
        self.assertEqual(calibration["centre_offset"], {"value": [3.5, -2], "sigma": [0.5, 0.25]})
        names, matrix = (calibration["covariance"][key] for key in ("names", "matrix"))
        self.assertEqual([len(names), *map(len, matrix)], [13] + 13 * [len(names)])
        self.end(run)

    def test_describes_what_it_refuses(self):
        run, api = self.start(tracking={})
        box = {"u": 1, "v": 2, "width": 3, "height": 4}
        pixels, directions = {"pixels": [[80, 48]]}, {"directions": [[1, 0, 0]]}
        for path, bodies in {
                "/api/v1/direction": (
                    pixels, {**pixels, "frame": 0}, {**pixels, "time_s": -1.5}, {**pixels, "pixel_sigma_px": 1000},
                    {}, [], {"pixels": []}, {"pixels": [[1]]}, {"pixels": [[1, 2, 3]]}, {"pixels": [["1", 2]]},
                    {"pixels": [[1, 2]] * 1001}, {**pixels, "frame": -1}, {**pixels, "frame": 1.5}, {**pixels, "frame": "1"},
                    {**pixels, "frame": None}, {**pixels, "frame": 1, "time_s": 1}, {**pixels, "pixel_sigma_px": -1},
                    {**pixels, "pixel_sigma_px": 1001}, {**pixels, "sigma": 1}, {**pixels, **directions}),
                "/api/v1/detections": (
                    {"frame": 0, "boxes": []}, {"time_s": -1, "boxes": [box]}, {"frame": 0, "boxes": [{**box, "score": 1, "class": "a"}]},
                    {}, [], {"boxes": []}, {"frame": 0}, {"frame": 0, "time_s": 1, "boxes": []}, {"frame": -1, "boxes": []},
                    {"frame": 0, "boxes": [1]}, {"frame": 0, "boxes": [{"u": 1}]}, {"frame": 0, "boxes": [{**box, "u": "1"}]},
                    {"frame": 0, "boxes": [{**box, "x": 1}]}, {"frame": 0, "boxes": [{**box, "class": "x" * 33}]},
                    {"frame": 0, "boxes": [{**box, "class": None}]}, {"frame": 0, "boxes": [{**box, "score": None}]},
                    {"frame": 0, "boxes": [], "camera": 1}),
                "/api/v1/hold": ({}, {"frame": 0}, {"time_s": -1.5}, [], {"frame": -1}, {"frame": "1"}, {"frame": 1, "time_s": 1}, pixels),
                "/api/v1/pixel": (
                    directions, {"directions": [[0, 0, -1e-300]]}, {**directions, "time_s": 0}, {"directions": [[0, 0, 0]]},
                    {"directions": [[1, 0, 0], [0, 0, 1e-320]]}, {"directions": [[1, 0]]}, {**directions, "frame": -1},
                    {**directions, "pixel_sigma_px": 1})}.items():
            schema = DESCRIPTION["paths"][path]["post"]["requestBody"]["content"]["application/json"]["schema"]
            validator = jsonschema.Draft7Validator({**SCHEMAS, "allOf": [schema]})
            for body in bodies:
                with self.subTest(path=path, body=str(body)[:80]):
                    self.assertEqual(api.ask(path.lstrip("/"), body).status != 400, validator.is_valid(body))
        for path, operations in DESCRIPTION["paths"].items():
            known = {method.upper() for method in operations}
            for method in {"POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "QUERY", "BREW"} - known:
                with self.subTest(path=path, method=method):
                    answer = api.ask(path.lstrip("/"), method=method)
                    self.assertEqual(answer.status, 405)
                    self.assertEqual(set(answer.headers["Allow"].split(", ")), known | ({"HEAD"} if "GET" in known else set()))
            for operation in operations.values():
                self.assertIn("default", operation["responses"])
        self.assertEqual(api.ask("api/v1/status", headers={"Origin": "http://evil.example"}).status, 403)
        self.end(run)

    def test_streams_every_record_once_as_on_stdout(self):
        run, api = self.start()
        client, file = api.follow()
        names, streamed, ids = [], [], []
        for name, identity, data in events(file):
            names.append(name)
            check(data, DESCRIPTION["paths"]["/api/v1/stream"]["get"]["responses"]["200"]["x-events"][name])
            if name == "orientation":
                streamed.append(data)
                ids.append(int(identity))
            if len(streamed) == 100:
                break
        self.assertEqual(names[:3], ["hello", "clock", "orientation"])
        self.assertNotIn("lost", names)
        self.assertEqual(ids, list(range(ids[0], ids[0] + 100)))
        status = self.check_answer(api, "/api/v1/status")
        self.assertEqual(1, len(status["streams"]["clients"]))
        self.assertGreaterEqual(status["streams"]["clients"][0]["records"], 100)
        printed = [json.loads(line) for line in self.end(run)]
        first = printed.index(streamed[0])
        self.assertEqual(printed[first:first + 100], streamed)
        self.assertEqual(ids[0], first + 1)
        list(events(file))  # it has ended
        client.close()

    def test_writes_nothing_to_stdout_if_only_http_is_wanted(self):
        run, api = self.start(json_output=False)
        self.check_answer(api, "/api/v1/orientation")
        self.assertEqual(self.end(run), [])

    def test_metrics_are_what_prometheus_reads(self):
        run, api = self.start()
        answer = api.ask("metrics")
        self.assertEqual(answer.headers["Content-Type"], "text/plain; version=0.0.4; charset=utf-8")
        values = self.parse_metrics(answer.body.decode())
        status = api.ask("api/v1/status").json()
        frames = values["alidade_frames_total", ()]
        self.assertGreater(frames, 1)
        self.assertLessEqual(frames, status["frames"]["received"])
        self.assertEqual(values["alidade_mode", (("mode", "PT"),)], 1)
        self.assertEqual(values["alidade_mode", (("mode", "OE"),)], 0)
        self.assertEqual(values["alidade_calibrated", ()], 1)
        for stage in ("decoding", "waiting", "computing", "writing"):
            self.assertGreater(values["alidade_stage_duration_seconds_count", (("stage", stage),)], 1)
        self.assertGreater(values["process_resident_memory_bytes", ()], 1e6)
        self.assertEqual(api.ask("metrics", token=None).status, 401)
        self.end(run)

    def test_shows_a_picture_and_what_was_seen_in_it(self):
        run, api = self.start(mode="OE")
        picture = api.ask("api/v1/picture")
        self.assertEqual((picture.status, picture.headers["Content-Type"]), (200, "image/jpeg"))
        self.assertEqual(picture.body[:2], b"\xff\xd8")
        frame = int(picture.headers["X-Alidade-Frame"])
        for which, status in ((f"?frame={frame}", 200), ("", 200), ("?frame=x", 400), (f"?frame={10**9}", 404)):
            overlay = api.ask("api/v1/overlay" + which)
            self.assertEqual(overlay.status, status)
            check(overlay.json(), self.described("/api/v1/overlay", "get", status))
            if status == 200:
                self.assertEqual([overlay.json()[name] for name in ("width", "height", "scale")], [IMAGE["width"], IMAGE["height"], 1])
                self.assertGreaterEqual(overlay.json()["frame"], frame)
        for path in ("/api/v1/picture", "/api/v1/overlay"):
            self.check_answer(api, path, 401, token=None)
        self.end(run)

    def test_says_that_there_is_no_picture_where_none_is_decoded(self):
        run, api = self.start(mode="PT", clock_offset_sigma_ms=1)
        for path in ("/api/v1/picture", "/api/v1/overlay"):
            self.assertIn("mode: PT", self.check_answer(api, path, 503)["error"])
        self.end(run)

    def parse_metrics(self, text):
        """Every line of the text format 0.0.4, strictly; values by name and labels."""
        self.assertTrue(text.endswith("\n"))
        name, label = r"[a-zA-Z_:][a-zA-Z0-9_:]*", r'[a-zA-Z_][a-zA-Z0-9_]*="(?:[^"\\\n]|\\["\\n])*"'
        sample = re.compile(rf"({name})(?:\{{({label}(?:,{label})*)\}})? (\S+)")
        values, types, helped, family = {}, {}, set(), None
        for line in text[:-1].split("\n"):
            if line.startswith("# HELP "):
                _, _, family, words = line.split(" ", 3)
                self.assertNotIn(family, helped, "a family is told once, in one piece")
                self.assertTrue(words)
                helped.add(family)
                continue
            if line.startswith("# TYPE "):
                _, _, named, kind = line.split(" ")
                self.assertEqual(named, family)
                self.assertIn(kind, ("counter", "gauge", "histogram"))
                self.assertEqual(kind == "counter", named.endswith("_total"), named)
                types[named] = kind
                continue
            match = sample.fullmatch(line)
            self.assertIsNotNone(match, line)
            base = match[1]
            if types[family] == "histogram":
                self.assertIn(base, [family + suffix for suffix in ("_bucket", "_sum", "_count")])
            else:
                self.assertEqual(base, family)
            labels = tuple(tuple(pair.split("=", 1)) for pair in re.findall(label, match[2] or ""))
            labels = tuple((key, value[1:-1]) for key, value in labels)
            self.assertNotIn((base, labels), values, "a series is told once")
            values[base, labels] = float(match[3])
        self.assertEqual(set(types), helped)
        for named, kind in types.items():
            if kind == "histogram":
                self.check_histogram(named, values)
        return values

    def check_histogram(self, name, values):
        series = {}
        for (base, labels), value in values.items():
            if base == name + "_bucket":
                series.setdefault(labels[:-1], []).append((float(labels[-1][1]), value))
        self.assertTrue(series)
        for labels, buckets in series.items():
            edges, counts = zip(*buckets)
            self.assertEqual(list(edges), sorted(set(edges)))
            self.assertEqual(list(counts), sorted(counts))
            self.assertEqual(edges[-1], math.inf)
            self.assertEqual(counts[-1], values[name + "_count", labels])

    def test_hostile_clients_cost_no_record_and_little_memory(self):
        run, api = self.start(tracking={})
        before = self.memory(run)
        stalled = [api.follow() for _ in range(5)]  # of which nothing is read from now on
        received = self.check_answer(api, "/api/v1/status")["frames"]["received"]

        for request in self.hostile_requests():
            answer = api.raw(request)
            if answer is not None:
                self.assertRegex(answer, rb"^HTTP/1\.1 [2345]\d\d ", request[:80])
                self.assertNotIn(b"root:", answer)
        # Slow heads, and a thousand connections that say nothing, while one after the other asks.
        _, most_files = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most_files, most_files))
        slow = [api.connect() for _ in range(10)]
        crowd = []
        for _ in range(1000):
            crowd.append(api.connect())
            for client in slow:
                try:
                    client.send(b"X")
                except OSError:
                    pass
        for client in slow + crowd:
            client.close()
        self.stubborn(api, lambda: api.ask("healthz", token=None).status == 200)

        self.stubborn(api, lambda: api.ask("api/v1/status").json()["frames"]["received"] > received + 25)
        status = self.check_answer(api, "/api/v1/status")
        self.assertEqual(status["dropped"], {**status["dropped"], "frames": 0, "telemetry": 0, "records": 0})
        self.assertGreater(status["http"]["refused"], 0)
        after = self.memory(run)
        if not os.environ.get("ALIDADE_SANITIZE"):
            # 128 heads and a few bodies. A thread each for as many clients would take more.
            self.assertLess(after - before, 10e6)
            self.assertLess(self.threads(run), 16)
        for client, file in stalled:
            client.close()
        printed = [json.loads(line)["frame"] for line in self.end(run)]
        self.assertEqual(printed, list(range(printed[0], printed[0] + len(printed))))

    def stubborn(self, api, answered):
        """Waits until the crowd's connections are gone."""
        def tried():
            try:
                return answered()
            except (OSError, KeyError, json.JSONDecodeError):
                return False
        wait_until(tried, "an answer after the crowd")

    @staticmethod
    def memory(process):
        status = pathlib.Path(f"/proc/{process.child.pid}/status").read_text(encoding="ascii")
        return 1024 * int(re.search(r"VmRSS:\s+(\d+) kB", status)[1])

    @staticmethod
    def threads(process):
        return len(os.listdir(f"/proc/{process.child.pid}/task"))

    @staticmethod
    def hostile_requests():
        def post(path, body, length=None, token=TOKEN):
            length = len(body) if length is None else length
            return (f"POST {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {token}\r\n"
                    f"Content-Length: {length}\r\n\r\n").encode() + body

        def get(path, headers=b""):
            return b"GET " + path + b" HTTP/1.1\r\nHost: localhost\r\n" + headers + b"\r\n"

        direction = "/api/v1/direction"
        yield post(direction, b"x" * 10_000_000)
        yield post(direction, b"", 10**18)
        yield post(direction, b"", "-1")
        yield post(direction, b"[" * 60_000)
        yield post(direction, b'{"a":' * 10_000)
        yield post(direction, b'{"pixels":[[' + b"9" * 60_000 + b",1]]}")
        yield post(direction, b'{"pixels":[[1e400,-1e400]]}')
        yield post(direction, b'{"pixels":[[NaN,Infinity]]}')
        yield post(direction, b'{"pixels":' + b"[[0,0]," * 9000 + b"1]}")
        yield post(direction, b'{"pixels":[' + b",".join([b"[1,2]"] * 9000) + b"]}")
        yield post(direction, b'{"frame":"../../etc/passwd","pixels":[[1,2]]}')
        yield post(direction, b"\x00\xff\xfe" * 1000)
        yield post(direction, b'{"pixels":[[1,2]]}', token="x" * 7000)
        yield post("/api/v1/calibrate", b"x" * 1000)
        for box, count in ((b'{"u":9,"v":9,"width":9,"height":9}', 10_000), (b'{"u":9,"v":9,"width":9,"height":9}', 3_700),
                           (b"{}", 10_000), (b"0", 10_000)):
            yield post("/api/v1/detections", b'{"frame":0,"boxes":[' + b",".join([box] * count) + b"]}")
        for path in (b"/../../../etc/passwd", b"/%2e%2e/%2e%2e/etc/passwd", b"/..%2f..%2fetc%2fpasswd", b"/etc/passwd\x00",
                     b"/%00", b"//etc/passwd", b"/" + b"a" * 7000, b"/?" + b"a=b&" * 1500, b"*", b"/\xf0\x28\x8c\x28"):
            yield get(path)
        yield get(b"/healthz", b"Range: bytes=" + b"0-0," * 1900 + b"0-0\r\n")
        yield get(b"/healthz", b"Accept-Encoding: gzip, br\r\n")
        yield get(b"/healthz", b"A: b\r\n" * 1300)
        yield get(b"/healthz", b"A: " + b"b" * 100_000 + b"\r\n")
        yield get(b"/healthz") * 50 + b"garbage\r\n\r\n"
        for method in (b"PUT", b"DELETE", b"PATCH", b"OPTIONS", b"TRACE", b"CONNECT", b"BREW", b"get"):
            yield method + b" /api/v1/orientation HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n"
        yield b"GET /healthz HTTP/1.1\r\nHost: evil.example\r\nOrigin: http://evil.example\r\n\r\n"
        yield b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" * 10 + b"\r\n\r\n"
        yield b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
        yield random.Random(1).randbytes(4000) + b"\r\n\r\n"

    def test_says_that_the_port_is_taken(self):
        camera = self.camera()
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            address = f"127.0.0.1:{taken.getsockname()[1]}"
            run = self.alidade("run", "-c", self.write_config(camera, output={"http": address}))
            code, _ = run.end()
        self.assertEqual(code, 1)
        self.assertTrue(any(address in line and "another program" in line for line in run.errors), run.error_text())


if __name__ == "__main__":
    unittest.main()
