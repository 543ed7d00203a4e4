#!/usr/bin/env python3
"""The status page of `alidade run` in a real browser: what it shows, what a click says, and what it does when the
program goes away and comes back."""
import json
import math
import re
import signal
import subprocess
import unittest
import urllib.error
import urllib.request

from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.common.by import By

from browser import BrowserTest
from harness import ALIDADE, CLOCK_OFFSET_MS, DEADLINE_S, free_port, wait_until

SETTINGS = {
    "image": {"width": 640, "height": 480, "rate_hz": 10},
    "camera": {"focal_length_px": 10669.3, "radial_distortion": 55.4, "line_delay_us": -32.0,
               "clock_offset_ms": CLOCK_OFFSET_MS},
    "sensor": {"exposure_ms": 1, "read_noise": 1, "jpeg_quality": 90},
}
TOKEN = "right-horse"
# What a browser says of frames that are late on a busy machine, and of a manual that is not there,
LATE = r"/api/v1/picture.*status of 503|/api/v1/(direction|pixel|hold|targets).*status of (404|409)|/manual/.*status of 404"
# and of a server that is not there or wants a token: it is what these tests do to it.
AWAY = r"ERR_CONNECTION_REFUSED|ERR_CONNECTION_RESET|ERR_EMPTY_RESPONSE|ERR_INCOMPLETE_CHUNKED_ENCODING|status of 401"


# What is drawn on a canvas as text, and what of it does not fit into it.
TELL_CLIPPED_TEXT = """
    window.drawn = new Set();
    window.clipped = new Set();
    const draw = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, u, v) {
      const size = this.measureText(text);
      drawn.add(text);
      if (u - size.actualBoundingBoxLeft < 0 || u + size.actualBoundingBoxRight > this.canvas.clientWidth) clipped.add(text);
      return draw.call(this, text, u, v);
    };"""

# A server with a manual, for whoever asks for its head without a token.
SERVE_A_MANUAL = """
    const ask = window.fetch;
    window.fetch = (path, options) => path === '/manual/' && options.method === 'HEAD' && !options.headers
      ? Promise.resolve(new Response(null, {status: 200})) : ask(path, options);"""

# Thirty on few metres of ground and in a part of the picture, and one at a pole whose place was known before: the names on plan and
# picture, what is drawn over those on the picture, and the plan's caption.
NAMES_OF_A_CROWD = """
    const crowd = {space: 'plane', time_s: 10, detected_frame: 1, targets: []};
    for (let i = 1; i <= 30; ++i) {
      const [u, v] = [i % 6 * 60, i * i % 7 * 40];
      crowd.targets.push({identity: i, class: `of class ${'x'.repeat(i)}`, seen_s: i / 10, position_m: [i % 6 * 1.7, i * i % 7 * 1.3],
        covariance: [[.01, 0], [0, .04]], covariance_px2: [[1, 0], [0, 1]], pixel: [u + 10, v + 50], box: {u, v, width: 20, height: 50}});
    }
    const kept = {targets, trails};
    trails = new Map();
    onTargets(crowd);
    crowd.targets.push({identity: 31, seen_s: 0, position_m: null, azimuth_rad: null, covariance: null, box: null});
    trails.set(31, [[2, 2]]);
    const names = {plan: [], picture: []};
    let over = 0;
    const {fillText, strokeRect} = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.fillText = function (text, u, v) {
      const {width} = this.measureText(text);
      const left = u - (this.textAlign === 'right' ? width : 0);
      if (text.startsWith('#')) names[this.canvas.id].push({text, left, right: left + width, v, width: this.canvas.clientWidth});
      return fillText.call(this, text, u, v);
    };
    CanvasRenderingContext2D.prototype.strokeRect = function (...rectangle) {
      over += names.picture.length;
      return strokeRect.apply(this, rectangle);
    };
    drawPlan();
    drawTargets(document.getElementById('picture').getContext('2d'), crowd.targets, document.getElementById('picture').clientWidth / 640);
    Object.assign(CanvasRenderingContext2D.prototype, {fillText, strokeRect});
    ({targets, trails} = kept);
    return [names.plan, names.picture, over, document.getElementById('plan-caption').textContent];"""


# What is said of azimuths on ground with an origin on Earth, and without one; on ground that the server does not tell.
REFERENCES = """
    const ask = window.fetch;
    const told = [];
    for (const plane of [{origin: {latitude_deg: 48}, heading: {value: -.5, sigma: .001}}, {origin: null, heading: {value: 1, sigma: .1}}, null]) {
      window.fetch = async (path, options) => path !== '/api/v1/plane' ? ask(path, options)
        : plane ? new Response(JSON.stringify(plane)) : new Response('{}', {status: 503});
      north = null;
      await sayReference({plane: {error: 'above the horizon'}}, plane !== null);
      told.push(document.getElementById('reference').textContent);
    }
    window.fetch = ask;
    north = null;
    return told;"""


# An hour: sigmas over three decades, no row from 30 to 20 minutes ago, no value from 10 to 5 minutes ago, and one row alone within
# that. Of each plot: its words, and the minutes in which something is drawn over the grid.
SHOW_AN_HOUR = """
    const times = [...Array(361).keys()].filter((i) => i < 180 || i > 240).map((i) => 10 * i);
    const column = (value) => times.map((t, i) => t > 3000 && t < 3300 && t !== 3150 ? null : value(t));
    const names = ['sigma', 'offset', 'error'];
    const pixels = (name) => {
      const canvas = document.getElementById(`${name}-plot`);
      return canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    };
    showHour({time_s: times, sigma_rad: column((t) => 2e-6 * 10 ** (t / 1500)), clock_offset_s: column(() => -.0844),
      clock_offset_sigma_s: column(() => 2e-4), pan_error_rad: column((t) => 1e-4 + 2e-8 * t), tilt_error_rad: column(() => 5e-5)});
    return Object.fromEntries(names.map((name) => {
      const {data, width, height} = pixels(name);
      const ratio = window.devicePixelRatio;
      const drawn = new Set();
      for (let u = Math.round(60 * ratio); u < width - 8 * ratio; ++u) {
        for (let v = Math.round(24 * ratio); v < height - 34 * ratio; ++v) {
          const [r, g, b, a] = data.slice(4 * (v * width + u), 4 * (v * width + u) + 4);
          // Coloured, as lines and bands are; the grid is grey.
          if (a > 40 && Math.max(r, g, b) - Math.min(r, g, b) > 40) drawn.add(Math.round((u / ratio - 58) / (width / ratio - 66) * 60 - 60));
        }
      }
      return [name, [document.getElementById(`${name}-caption`).textContent, [...drawn]]];
    }));"""


# A calibration whose distortion is not known well enough yet, while a focal length is.
TOO_UNCERTAIN = {
    "attempts": 3, "refusal": "not calibrated yet (too uncertain): radial distortion known to 8.2 % of the radius only: let landmarks cross the whole image",
    "parameters": [
        {"name": "focal_length", "unit": "px", "sigma": 53.3, "wanted": 533, "reached": True, "helps": "move farther on both axes"},
        {"name": "clock_offset", "unit": "s", "sigma": .021, "wanted": .01, "reached": False, "helps": "change speed and direction more and faster"},
        {"name": "line_delay", "unit": "s/row", "sigma": None, "wanted": 1.04e-5, "reached": False, "helps": "move faster while the image is read out"},
        {"name": "radial_distortion", "unit": "1", "sigma": 1420, "wanted": 14.2, "reached": False, "helps": "let landmarks cross the whole image"}],
    "span_s": 14.2, "least_range_rad": .0018, "asked_range_rad": .015,
    "coverage": {"columns": 8, "rows": 6, "points": [0] * 8 + [30] * 40, "pan_rad": [-.12, .12], "tilt_rad": [-.02, .02],
                 "path_rad": [[-.12, -.02], [0, .02], [.12, -.02]], "largest_rate_rad_s": .05}}


class StatusPage(BrowserTest):
    def start(self, config, **environment):
        """`alidade run`; gives back the process and the page's address, once it listens."""
        run = self.alidade("run", "-c", config, **environment)

        def address():
            self.assertIsNone(run.child.poll(), run.error_text())
            return re.search(r"listening on (http://[\d.]+:\d+/)", run.error_text())
        wait_until(address, "the address of the page in the log")
        return run, address().group(1)

    def config(self, camera, mode="OE", detectors=None, **output):
        image = SETTINGS["image"]
        sections = {}
        if mode == "PT":
            # Stated, so that no picture has to tell the delay.
            sections["calibration"] = {"file": str(camera.truth / "truth.yaml"), "auto": False, "clock_offset_sigma_ms": 1}
        return self.write_config(camera, **sections, video={"width": image["width"], "height": image["height"]},
                                 focal_length_px=SETTINGS["camera"]["focal_length_px"], realtime={"mode": mode},
                                 output={"json": True, "http": "127.0.0.1:0", **output}, tracking={}, detectors=detectors or {})

    def assert_no_errors_but(self, expected):
        for entry in self.browser.get_log("browser"):
            if not re.search(expected, entry["message"]):
                self.assertNotIn(entry["level"], ("SEVERE", "WARNING"), entry["message"])

    def shows_telemetry_error(self):
        """Curve and loop as soon as a calibration has them, and not before."""
        def shown(calibration):
            return self.browser.execute_script("""
                showTelemetryError(arguments[0]);
                return ['angle-error', 'play'].map((id) => {
                  const canvas = document.getElementById(`${id}-plot`);
                  if (document.getElementById(id).hidden) return null;
                  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
                  return [document.getElementById(`${id}-caption`).textContent, data.some((value) => value > 0)];
                });""", calibration)
        self.assertEqual(shown({}), [None, None])
        self.assertEqual(shown({"tilt_error": {"length_rad": 0, "unseen_sigma_rad": 1e-3}}), [None, None])
        curve = {"length_rad": .1, "unseen_sigma_rad": 3e-4, "samples": {
            "angle_rad": [-.1, 0, .1], "error_rad": [2e-4, -2e-4, 2e-4], "sigma_rad": [1e-5, 1e-5, 1e-5]}}
        play = {"value": 5e-4, "sigma": 2e-5, "kind": "output"}
        (error, drawn_error), (loop, drawn_loop) = shown({"pan_error": curve, "tilt_play_rad": play})
        self.assertIn("pan 0.200 mrad, known to 0.010, elsewhere to 0.300", error)
        self.assertIn("tilt 0.500 \u00b1 0.020 mrad, encoder behind the gear", loop)
        self.assertTrue(drawn_error and drawn_loop)
        self.assertEqual(shown({}), [None, None])

    def colours(self):
        """Of the picture's canvas: how many grey levels there are, and how many pixels of the landmarks' green."""
        return self.browser.execute_script("""
            const canvas = document.getElementById('picture');
            const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', {willReadFrequently: true});
            copy.drawImage(canvas, 0, 0);
            const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);
            const greys = new Set();
            let green = 0;
            for (let i = 0; i < data.length; i += 4) {
              const [r, g, b] = [data[i], data[i + 1], data[i + 2]];
              if (r === g && g === b) greys.add(r);
              if (g > 220 && r < 100 && b < 160) ++green;
            }
            return [greys.size, green];""")

    def direction_of(self, choose, address):
        """What the page says of the pixel that `choose` chooses, to all digits: the same as the interface. Chooses anew
        if the frame was forgotten meanwhile, ten seconds after it came."""
        told = []

        def tell():
            self.browser.execute_script("forgetDirection('')")
            choose()
            wait_until(lambda: self.text("pointing-hint") != "", "an answer")
            said = self.browser.execute_script("return {...document.getElementById('pointing').dataset}")
            if not said:
                self.assertRegex(self.text("pointing-hint"), "^No direction: ")
                return False
            told.append({name: float(value) for name, value in said.items()})
            return self.is_the_interfaces(told[-1], address)
        wait_until(tell, "a direction of a frame that is still known")
        return told[-1]

    def is_the_interfaces(self, said, address):
        """False: the frame was forgotten."""
        question = {"frame": int(said["frame"]), "pixels": [[said["u"], said["v"]]]}
        request = urllib.request.Request(address + "api/v1/direction", json.dumps(question).encode(),
                                         {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=DEADLINE_S) as answer:
                direction = json.load(answer)["directions"][0]
        except urllib.error.HTTPError as error:
            self.assertEqual(error.code, 404)
            return False
        self.assertEqual(said["azimuth"], direction["azimuth_rad"])
        self.assertEqual(said["elevation"], direction["elevation_rad"])
        self.assertEqual(said["sigma"], direction["sigma_rad"])
        return True

    def test_shows_what_goes_on_and_the_direction_of_a_click(self):
        _, address = self.start(self.config(self.camera(settings=SETTINGS)))
        self.browser.get(address)
        self.wait_for_text("link", "^live$")
        self.wait_for_text("mode", "^OE$")
        self.wait_for_text("seen", r"frame \d+: [1-9]\d+ landmarks used")
        wait_until(lambda: self.colours()[0] > 30 and self.colours()[1] > 300, "a picture with landmarks")
        before = self.text("pan"), self.text("seen")
        wait_until(lambda: self.text("pan") != before[0] and self.text("seen") != before[1], "an update")
        self.wait_for_text("pan-caption", r"Pan: now .*°, from .* to ")
        self.wait_for_text("residual-caption", r"Residual: now 0\.\d+ px")
        self.wait_for_text("latency-caption", r"p50 \d.* p90 .* p99 ")
        self.wait_for_text("calibration", r"Focal length10669\.3\spx")
        self.wait_for_text("camera", r"rtsp://127\.0\.0\.1")
        self.wait_for_text("health", r"Frames[1-9]")
        self.assertNotIn("Scene map", self.text("health"))
        self.assertFalse(self.browser.find_element(By.ID, "progress").is_displayed())
        with urllib.request.urlopen(address + "api/v1/status", timeout=DEADLINE_S) as answer:
            status = json.load(answer)
        self.assertIsNone(status["scene_map"])
        status["scene_map"] = {
            "landmarks": 4901, "ready": True, "pictures": {"found": 34, "looked_at": 40},
            "last": {"status": "not in the map", "age_s": 7}, "upkeep": {"born": 12, "died": 3, "stopped": False}}
        health = self.browser.execute_script(
            "showStatus(arguments[0]); return document.getElementById('health').textContent", status)
        self.assertRegex(health, r"Scene map4901 landmarks; found in 34 of 40 pictures; last not in the map, 7 s ago; 12 born, 3 died")

        for state, said in (("open", r"0 ms later, \u00b1 150 ms; open for 7 s: turn the camera"),
                            ("found", r"0 ms later, \u00b1 150 ms; found 7 s ago"),
                            ("calibrated", "calibrated through this connection")):
            status["link_delay"] = {"state": state, "delay_s": 0, "sigma_s": .15, "age_s": 7}
            self.assertRegex(self.browser.execute_script(
                "showStatus(arguments[0]); return document.getElementById('health').textContent", status),
                "Telemetry against the calibration" + said)
        self.shows_telemetry_error()

        picture = self.browser.find_element(By.ID, "picture")
        clicked = self.direction_of(
            ActionChains(self.browser).move_to_element_with_offset(picture, 100, -50).click().perform, address)
        scale = SETTINGS["image"]["width"] / picture.size["width"]
        self.assertAlmostEqual(clicked["u"], SETTINGS["image"]["width"] / 2 + 100 * scale, delta=2)
        self.assertAlmostEqual(clicked["v"], SETTINGS["image"]["height"] / 2 - 50 * scale, delta=2)
        self.assertRegex(self.text("azimuth"), r"^−?\d+\.\d{5}°$")
        self.assertRegex(self.text("sigma"), r"rad$")
        self.says_from_what_azimuth_is_counted()

        picture.send_keys(Keys.ARROW_LEFT, Keys.ARROW_UP)
        crossed = self.direction_of(lambda: picture.send_keys(Keys.ENTER), address)
        step = SETTINGS["image"]["width"] / 100
        self.assertAlmostEqual(crossed["u"], SETTINGS["image"]["width"] / 2 - step)
        self.assertAlmostEqual(crossed["v"], SETTINGS["image"]["height"] / 2 - step)

        self.freezes_the_picture(picture, address)
        self.shows_the_last_hour()

        # While the clock filter warms up and the links' delay is open, sigma is as large as the head is fast.
        wait_until(lambda: self.browser.execute_script("return record.mode === 'OE' && Math.max(...record.orientation_sigma_rad) < 1e-4"),
                   "a sure orientation")
        self.fits_the_ground(picture)
        self.shows_targets(address)

        shown_s = self.browser.execute_script("return record.time_s")
        self.browser.refresh()
        self.wait_for_text("link", "^live$")
        wait_until(lambda: self.browser.execute_script("return samples.length > 0 && samples[0].t < arguments[0]", shown_s),
                   "the minute before the page was opened")
        self.assert_no_errors_but(LATE)

    def freezes_the_picture(self, picture, address):
        """By keyboard; a pixel's direction is that in the frozen frame, also once the frames beside it are forgotten."""
        button = self.browser.find_element(By.ID, "freeze")
        self.assertEqual((self.text("freeze"), self.text("picture-title")), ("Freeze the picture", "Live picture"))
        live = picture.value_of_css_property("box-shadow")

        def froze():
            self.browser.execute_script("say('frozen', '')")
            button.send_keys(Keys.ENTER)
            wait_until(lambda: self.text("frozen") != "", "an answer")
            return self.text("frozen").startswith("Frozen")  # not: that frame was forgotten already
        wait_until(froze, "a frozen picture")
        said = self.wait_for_text("frozen", r"^Frozen at frame \d+: mode (OE|PT), pan −?\d+\.\d{4}°, tilt −?\d+\.\d{4}°\. A click gives the direction in this frame\.$")
        frame = int(re.search(r"\d+", said)[0])
        self.assertEqual((self.text("freeze"), self.text("picture-title")), ("Back to the live picture", "Frozen picture"))
        self.assertNotEqual(picture.value_of_css_property("box-shadow"), live)
        self.assertEqual(self.browser.switch_to.active_element, button)
        self.assertRegex(self.text("seen"), f"^frame {frame}: ")

        def beside():
            body = json.dumps({"frame": frame + 1, "pixels": [[1, 1]]}).encode()
            try:
                with urllib.request.urlopen(urllib.request.Request(address + "api/v1/direction", body), timeout=DEADLINE_S):
                    return True
            except urllib.error.HTTPError as error:
                return error.code != 404
        wait_until(lambda: not beside(), "the next frame to be forgotten")
        picture.send_keys(Keys.ARROW_RIGHT)
        self.browser.execute_script("forgetDirection('')")
        picture.send_keys(Keys.ENTER)
        wait_until(lambda: self.text("pointing-hint") != "", "an answer")
        told = {name: float(value) for name, value in self.browser.execute_script("return {...document.getElementById('pointing').dataset}").items()}
        self.assertEqual(told["frame"], frame)
        self.assertTrue(self.is_the_interfaces(told, address))
        self.assertRegex(self.text("seen"), f"^frame {frame}: ")
        self.screenshot("frozen.png")
        button.send_keys(Keys.SPACE)
        self.wait_for_text("frozen", "^Live: the picture goes on.$")
        self.assertEqual((self.text("freeze"), self.text("picture-title")), ("Freeze the picture", "Live picture"))
        wait_until(lambda: not re.search(f"^frame {frame}: ", self.text("seen")), "a live picture")

    def shows_the_last_hour(self):
        self.wait_for_text("sigma-caption", r"^Sigma: now [\d.]+ (µ|m)rad, from ")
        self.wait_for_text("offset-caption", rf"^Clock offset: now −{-CLOCK_OFFSET_MS:.1f}\d\d ± 0\.\d{{3}} ms")
        self.wait_for_text("error-caption", r"^Telemetry’s error: pan \d+\.\d{3} mrad, at most .*; tilt \d")
        shown = self.browser.execute_script(SHOW_AN_HOUR)
        self.assertEqual(shown["sigma"][0], "Sigma: now 502 µrad, from 2 µrad to 502 µrad")
        self.assertEqual(shown["offset"][0], "Clock offset: now −84.400 ± 0.200 ms; the band is two standard deviations")
        self.assertEqual(shown["error"][0], "Telemetry’s error: pan 0.172 mrad, at most 0.172; tilt 0.050 mrad, at most 0.050")
        for name, (_, minutes) in shown.items():
            self.assertTrue({*range(-59, -30), *range(-19, -10), *range(-4, -1)} <= {*minutes}, (name, minutes))
            self.assertFalse({*range(-28, -21), -9, -6} & {*minutes}, (name, minutes))
            self.assertTrue({-8, -7} & {*minutes}, (name, minutes))
        self.screenshot("hour.png")

    def says_from_what_azimuth_is_counted(self):
        from_platform = "Azimuth: from the platform’s forward axis, where pan is 0; positive to the right. Elevation: positive upwards. "
        from_scene = from_platform.replace("the platform’s forward axis, where pan is 0", "the forward axis of the scene map’s base")
        self.wait_for_text("reference", f"^{from_platform}Nothing says where true north is.$")
        north = r"That axis points 331\.35\d*\s±\s0\.057\d*\s° clockwise from true north.$"
        on_earth, anywhere, untold = self.browser.execute_script(REFERENCES)
        self.assertRegex(on_earth, f"^{from_scene}{north}")
        self.assertEqual(anywhere, f"{from_scene}Nothing says where true north is.")
        self.assertEqual(untold, f"{from_platform}Nothing says where true north is.")

    def fits_the_ground(self, picture):
        """Pixels are chosen and told to lie on ground 10 m below; three of them, and what is missing with fewer. The page tells what fits."""
        self.browser.find_element(By.ID, "ground-title").click()

        def fill(name, value):
            self.browser.execute_script("document.getElementById(arguments[0]).value = arguments[1]", name, value)

        def press(name):
            # By key: on a busy machine a live page can move between the choice of a place to click at and the click.
            self.browser.find_element(By.ID, name).send_keys(Keys.ENTER)

        added = []

        def add(u, v, name, off=0):
            # Where the direction meets the ground, as the test has it: the camera looks along the horizon. Apart from the others,
            # as points of one view may leave the plane open.
            told = []
            apart = 0.04  # rad

            def chosen():
                self.browser.execute_script("forgetDirection(''); arguments[0].scrollIntoView({block: 'center'})", picture)
                ActionChains(self.browser).move_to_element_with_offset(picture, u, v).click().perform()
                wait_until(lambda: self.text("pointing-hint") != "", "an answer")
                told[:] = [self.browser.execute_script("return marker?.direction")]
                return told[0] is not None and all(math.dist(told[0], other) > apart for other in added)
            wait_until(chosen, "a direction")
            added.append(told[0])
            forward, right, down = told[0]
            # Tilted by 20 degrees: the picture looks near the horizon, and ground is what a base that leans sees.
            lean = 0.35
            below = down * math.cos(lean) + forward * math.sin(lean)
            ahead = forward * math.cos(lean) - down * math.sin(lean)
            fill("point-name", name)
            fill("point-x", str(round(10 * right / below + off, 4)))
            fill("point-y", str(round(10 * ahead / below, 4)))
            press("point-add")
        fill("point-sigma", "0.01")
        fill("ground-height", "10")
        add(-200, -120, "kerb")
        press("ground-fit")
        self.wait_for_text("ground-said", ".{20}")
        self.assertFalse(self.browser.find_element(By.ID, "ground-file").is_displayed())
        add(200, -100, "drain")
        add(-150, 120, "post")
        add(180, 110, "gate")
        press("ground-fit")
        self.wait_for_text("ground-said", "^Fits: ")
        self.assertRegex(self.text("points"), r"^kerb.*misfit \d.*drain.*post.*gate")
        self.assertRegex(self.text("ground-values"), r"pitch−20\.\d+\s±.*height(9\.9|10\.0)\d*\s±\s0\.0\d+\sm")
        file = self.browser.find_element(By.ID, "ground-yaml")
        self.assertTrue(file.is_displayed())
        self.assertRegex(file.get_attribute("value"), r"(?m)^height: \{value: (9\.9|10)")
        self.screenshot("ground.png")
        for width in (390, 1280):
            self.set_size(width)
            self.assertTrue(self.fits_into_width(), width)
            if width == 390:
                self.screenshot("ground_phone.png")
        self.clear_size()
        self.browser.find_element(By.ID, "ground-title").click()

    def shows_targets(self, address):
        """Something flies where the middle of the picture is: its box, its name, the plan and the table."""
        self.assertFalse(self.browser.find_element(By.ID, "targets").is_displayed())
        size = SETTINGS["image"]

        def ask(path, body=None):
            request = urllib.request.Request(address + path, body and json.dumps(body).encode())
            try:
                with urllib.request.urlopen(request, timeout=DEADLINE_S) as answer:
                    return json.load(answer)
            except urllib.error.HTTPError as error:
                self.assertIn(error.code, (404, 409))  # late, or the same frame again
                return None

        def shown():
            record = ask("api/v1/orientation")
            if record and record["frame"] is not None:
                ask("api/v1/detections", {"frame": record["frame"], "boxes": [
                    {"u": size["width"] / 2 - 30, "v": size["height"] / 2 - 20, "width": 60, "height": 40, "class": "drone"}]})
            return self.text("target-rows") and self.browser.execute_script(
                "return picture?.targets?.targets.length > 0 && picture.targets.targets[0].box !== null")
        wait_until(shown, "a target on the page")
        self.assertRegex(self.text("target-rows"), r"^#1 drone−?[\d.]+\s±\s[\d.]+, −?[\d.]+\s±\s[\d.]+\s°")
        self.wait_for_text("plan-caption", r"1 target after frame \d+")
        self.browser.set_window_size(1280, 1800)
        self.screenshot("targets.png")
        self.names_of_a_crowd_can_be_read()

    def names_of_a_crowd_can_be_read(self):
        """No name lies on another or is cut off, no box is drawn over one, and a target at a pole stops nothing."""
        for width in (1280, 390):
            self.set_size(width)
            plan, picture, over, caption = self.browser.execute_script(NAMES_OF_A_CROWD)
            self.assertRegex(caption, "^31 targets .*the first 20 are listed$")
            self.assertEqual(over, 0)
            for names in (plan, picture):
                self.assertGreater(len(names), 8, width)
                # Who was seen last is named first.
                self.assertEqual(names[0]["text"].split()[0], "#30")
                for i, one in enumerate(names):
                    self.assertGreaterEqual(one["left"], 0, one)
                    self.assertLessEqual(one["right"], one["width"], one)
                    for other in names[:i]:
                        apart = one["left"] >= other["right"] or one["right"] <= other["left"] or abs(one["v"] - other["v"]) >= 10
                        self.assertTrue(apart, (one, other))
            if width == 1280:  # a phone has room for numbers alone
                self.assertTrue(any("of class" in name["text"] for name in plan), plan)
            self.screenshot(f"crowd_{width}.png")
        self.clear_size()

    def test_shows_how_far_a_calibration_is_and_what_motion_is_missing(self):
        # Over 7 % of the picture in pan, and 2.3 % in tilt, where 3 % are the least.
        camera = self.camera(settings={**SETTINGS, "path": {"type": "triple_cosine", "amplitude": 0.024, "period_s": 6}})
        image = SETTINGS["image"]
        config = self.write_config(
            camera, video={"width": image["width"], "height": image["height"]}, focal_length_px=SETTINGS["camera"]["focal_length_px"],
            calibration={"file": str(self.folder / "calibration.yaml")}, realtime={"mode": "OE"},
            output={"json": True, "http": "127.0.0.1:0", "recordings": str(self.folder / "recordings")})
        _, address = self.start(config)
        self.browser.get(address)
        self.wait_for_text("link", "^live$")
        wait_until(lambda: self.browser.find_element(By.ID, "progress").is_displayed(), "the progress")
        self.wait_for_text("calibrating", "Please tilt the camera more")
        self.wait_for_text("motion-caption", "^Please tilt the camera more.$")
        self.assertEqual(self.browser.find_element(By.ID, "motion").get_attribute("aria-label"), "Drawing: tilt more")
        self.wait_for_text("refusal", r"^not calibrated yet \(one axis only\): tilt moves the image by ")
        self.assertRegex(self.text("progress-caption"), r"^[1-9]\d* attempts?; \d+ s of motion are at hand$")
        self.assertRegex(self.text("progress-rows"), r"^Focal length–\d+\spxClock offset–10\smsLine delay–10\sµs/rowRadial distortion–\d+$")
        self.wait_for_text("cells-caption", r"^Points were seen in [1-9]\d* of 48 parts of the picture\.$")
        self.wait_for_text("angles-caption", r"^Pan 0\.2\d° and tilt 0\.(0|1)\d° of the 0\.86° that are asked for\.$")
        self.screenshot("calibrating.png")

        self.browser.find_element(By.ID, "anew").send_keys(Keys.ENTER)
        self.wait_for_text("anew-said", "^A fresh calibration is under way: move the camera; status says what it needs, and when it is done.$")
        self.browser.find_element(By.ID, "anew").send_keys(Keys.ENTER)
        self.wait_for_text("anew-said", r"^Not begun: a fresh calibration was begun \d+ s ago; the next may be in \d+ s.$")
        self.shows_goals()
        self.records(camera)
        self.assert_no_errors_but(f"{LATE}|/api/v1/calibrate.*status of 429|/api/v1/recording.*status of 400")

    def records(self, camera):
        """The button stores so many seconds of both streams, and ends a recording that is under way; meanwhile records go on."""
        button, seconds = self.browser.find_element(By.ID, "record"), self.browser.find_element(By.ID, "record-seconds")
        self.assertTrue(button.is_displayed())

        def record_for(text):
            self.browser.execute_script("arguments[0].value = arguments[1]", seconds, text)
            button.send_keys(Keys.ENTER)

        record_for("")
        self.wait_for_text("recorded", r"^Not done: how many seconds\?\.$")
        record_for("5000")
        self.wait_for_text("recorded", "^Not done: a recording lasts from 1 to 3600 s.$")
        record_for("2")
        self.wait_for_text("recorded", r"recordings/\d{4}-\d\d-\d\dT[-\d]+Z: (1\.9|2\.0|2\.1) s, \d+ frames and \d+ samples of telemetry\.$")
        record_for("600")
        self.wait_for_text("record", "^End$")
        self.wait_for_text("recorded", r": \d+ of 600 s, [1-9]\d* frames and ")
        self.screenshot("recording.png")
        button.send_keys(Keys.ENTER)
        self.wait_for_text("record", "^Record$")
        verify = self.browser.find_element(By.ID, "verify")
        wait_until(verify.is_displayed, "the button Verify")
        verify.send_keys(Keys.ENTER)
        self.wait_for_text("verified", r"^Not verified: .*: has no calibration .*alidade/calibration\.yaml")
        recordings = sorted((self.folder / "recordings").iterdir())
        self.assertEqual(len(recordings), 2)
        for recording in recordings:
            done = subprocess.run([ALIDADE, "replay", recording, "--mode", "PT", "--json", "--calibration", camera.truth / "truth.yaml"],
                                  capture_output=True, text=True, check=True, timeout=60)
            rows = (recording / "frames.csv").read_text(encoding="utf-8").splitlines()[1:]
            self.assertEqual(len(done.stdout.splitlines()), len(rows), recording)
            self.assertTrue((recording / "guess.yaml").is_file())
            self.assertFalse((recording / "alidade" / "calibration.yaml").exists(), "there is no calibration yet")

    def shows_goals(self):
        """Bars end left of the line, in the middle, where a sigma is small enough; at a phone's width nothing is cut off."""
        bars = self.browser.execute_script("""
            showProgress({needs: 'let landmarks cross the whole image', progress: arguments[0]});
            return [...document.querySelectorAll('#progress-rows .bar')].map((bar) => {
              const rect = bar.querySelector('rect');
              return [Number(rect.getAttribute('width')), rect.getAttribute('class'), bar.getAttribute('aria-label')];
            });""", TOO_UNCERTAIN)
        self.assertEqual([(row[1], row[2]) for row in bars], [
            ("good", "0.1 times what is wanted: reached"), ("fair", "2.1 times what is wanted"), ("fair", "not known yet"), ("fair", "100 times what is wanted")])
        for (width, *_), expected in zip(bars, (25, 58.06, 0, 100)):
            self.assertAlmostEqual(width, expected, places=1)
        for width in (1280, 375):
            self.set_size(width, 1400)
            self.browser.execute_script("showProgress({needs: 'let landmarks cross the whole image', progress: arguments[0]})", TOO_UNCERTAIN)
            self.screenshot(f"progress_{width}.png")
            self.assertTrue(self.fits_into_width(), width)
            self.assertEqual(self.browser.execute_script("""
                return [...document.querySelectorAll('#progress *')].filter((one) => one.getBoundingClientRect().right > innerWidth).length"""), 0, width)
        self.clear_size()
        self.assertTrue(self.browser.execute_script(
            "showProgress({needs: null, progress: null}); return document.getElementById('progress').hidden"))

    def test_says_that_the_program_is_gone_and_follows_the_next_one(self):
        camera = self.camera(settings=SETTINGS)
        config = self.config(camera, http=f"127.0.0.1:{free_port()}")
        run, address = self.start(config)
        self.browser.get(address)
        self.wait_for_text("seen", r"frame \d+: .*used")
        self.browser.find_element(By.ID, "freeze").send_keys(Keys.ENTER)
        self.wait_for_text("frozen", "^Frozen at frame ")
        run.end(signal.SIGKILL)
        self.wait_for_text("link", r"disconnected: data is \d+ s old")
        wait_until(lambda: "grayscale(1)" in self.browser.find_element(By.ID, "mode").find_element(
            By.XPATH, "ancestor::*[contains(@class, 'live')]").value_of_css_property("filter"), "grey data")
        first_id = self.browser.execute_script("return startId")
        _, again = self.start(config)
        self.assertEqual(again, address)
        wait_until(lambda: self.browser.execute_script("return startId") != first_id, "the new program")
        self.wait_for_text("frozen", "^Live: the program has begun anew")
        self.wait_for_text("link", "^live$")
        self.wait_for_text("seen", r"frame \d+: .*used")
        self.assert_no_errors_but(f"{LATE}|{AWAY}")

    def test_says_which_link_is_lost_and_why_and_that_it_is_back(self):
        ports = {"rtsp_port": free_port(), "http_port": free_port()}
        camera = self.camera(settings=SETTINGS, **ports)
        _, address = self.start(self.config(camera, detectors={"motion": {}}))
        self.browser.get(address)
        self.wait_for_text("link", "^live$")
        self.wait_for_text("health", r"Detector motion[1-9]\d* pictures judged, \d+ not; \d+ boxesPictures that detectors left out\d")
        self.wait_for_text("health", r"Video link[\d.]+ a second; newest now; back again 0 times"
                                     r"Pan/tilt link[\d.]+ a second; newest now; back again 0 times")
        camera.end(signal.SIGKILL)
        self.wait_for_text("link", "^video lost$")
        self.assertEqual(self.browser.execute_script("return document.body.dataset.link"), "lost")
        self.wait_for_text("mode", "^none$")
        self.wait_for_text("why", r"There is no connection to the video: rtsp://127\.0\.0\.1:\d+/.*refused")
        self.wait_for_text("health", r"Pan/tilt linkhttp://127\.0\.0\.1:\d+/.*; newest \d+ s old")
        for width in (1280, 390):
            self.set_size(width, 844)
            self.assertTrue(self.fits_into_width(), width)
        self.camera(settings=SETTINGS, seed=2, **ports)
        self.wait_for_text("link", "^live$")
        self.wait_for_text("health", r"Video link[\d.]+ a second; newest now; back again 1 times")
        self.assert_no_errors_but(LATE)

    def test_asks_for_the_token_and_keeps_it_for_this_tab(self):
        _, address = self.start(self.config(self.camera(settings=SETTINGS), token_env="TEST_TOKEN"),
                                TEST_TOKEN=TOKEN)
        self.browser.get(address)
        field = self.browser.find_element(By.ID, "token")
        wait_until(field.is_displayed, "the question for the token")
        field.send_keys("wrong-horse", Keys.ENTER)
        self.wait_for_text("login-error", "refused")
        wait_until(field.is_displayed, "the question for the token, again")
        field.send_keys(TOKEN, Keys.ENTER)
        self.wait_for_text("link", "^live$")
        self.wait_for_text("seen", r"frame \d+: ")
        self.browser.refresh()
        self.wait_for_text("link", "^live$")
        self.assertFalse(self.browser.find_element(By.ID, "login").is_displayed())
        self.assertEqual(self.browser.execute_script("return [localStorage.length, document.cookie, location.href]"),
                         [0, "", address])
        self.assert_no_errors_but(f"{LATE}|{AWAY}")

    def test_leads_to_the_manual_if_there_is_one_and_to_the_description_of_the_interface(self):
        _, address = self.start(self.config(self.camera(settings=SETTINGS), token_env="TEST_TOKEN"), TEST_TOKEN=TOKEN)
        request = urllib.request.Request(address + "manual/", method="HEAD")
        try:
            with urllib.request.urlopen(request, timeout=DEADLINE_S) as answer:
                served = answer.status == 200
        except urllib.error.HTTPError:
            served = False
        # Both before anybody has given the token.
        self.browser.get(address)
        wait_until(lambda: self.browser.find_element(By.ID, "token").is_displayed(), "the question for the token")
        wait_until(lambda: self.browser.execute_script("return performance.getEntriesByName(location.origin + '/manual/').length > 0"),
                   "the answer about the manual")
        manual = self.browser.find_element(By.ID, "manual")
        wait_until(lambda: manual.is_displayed() == served, f"a link to the manual: {served}")
        description = self.browser.find_element(By.ID, "description")
        with urllib.request.urlopen(description.get_attribute("href"), timeout=DEADLINE_S) as answer:
            self.assertIn(b"openapi: 3", answer.read())

        self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": SERVE_A_MANUAL})
        self.browser.refresh()
        wait_until(lambda: self.browser.find_element(By.ID, "manual").is_displayed(), "the link to the manual")
        self.assertEqual(self.browser.find_element(By.ID, "manual").get_attribute("href"), address + "manual/")
        self.assert_no_errors_but(f"{LATE}|{AWAY}")

    def test_fits_a_phone_and_says_why_there_is_no_picture(self):
        self.set_size(390, 844, factor=3)
        self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": TELL_CLIPPED_TEXT})
        _, address = self.start(self.config(self.camera(settings=SETTINGS), mode="PT"))
        self.browser.get(address)
        self.wait_for_text("link", "^live$")
        self.wait_for_text("mode", "^PT$")
        self.wait_for_text("seen", "^no picture: ")
        self.wait_for_text("calibration", "Focal length")
        # The longest there can be: all of its sigmas are known.
        self.browser.execute_script("showCalibration(arguments[0])", {
            "focal_length": {"value": 10669.123, "sigma": 0.77}, "line_delay": {"value": -3.2e-5, "sigma": 1.7e-9},
            "pan_axis": {"value": [-0.012044, -0.000047, 1], "sigma": [5.9e-5, 4e-5]},
            "tilt_axis": {"value": [-0.00009, 1, -0.014056], "sigma": [1.2e-6, 6.9e-7]},
            "pan_scale": {"value": 1, "sigma": 1.2e-8}, "clock_offset": {"value": -0.0844, "sigma": 8.2e-5}})
        self.browser.execute_script(SHOW_AN_HOUR)
        self.screenshot("phone.png")
        self.assertEqual(self.browser.execute_script("return [innerWidth, document.documentElement.scrollWidth]"),
                         [390, 390])
        too_wide = self.browser.execute_script("""
            return [...document.querySelectorAll('body *')].filter((one) => !one.classList.contains('unseen') &&
              (one.getBoundingClientRect().right > innerWidth || one.getBoundingClientRect().left < 0)).map((one) => one.id || one.tagName)""")
        self.assertEqual(too_wide, [])
        self.assertEqual(self.browser.execute_script("return [...clipped]"), [])
        self.assertGreater(self.browser.execute_script("return drawn.size"), 10)
        self.assert_no_errors_but(LATE)


if __name__ == "__main__":
    unittest.main()
