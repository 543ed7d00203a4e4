#!/usr/bin/env python3
"""The page of `alidade setup` in a real browser: a camera is added by its address, looked at, tried and written."""
import re
import unittest

from selenium.webdriver.common.by import By

from browser import BrowserTest
from harness import wait_until


class SetupPage(BrowserTest):
    def write_into(self, name, text):
        field = self.browser.find_element(By.ID, name)
        field.clear()
        field.send_keys(text)

    def press(self, selector):
        button = self.browser.find_element(By.CSS_SELECTOR, selector)
        wait_until(button.is_enabled, f"{selector} can be pressed")
        self.browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", button)
        button.click()

    def test_writes_a_camera_that_is_added_by_its_address(self):
        camera = self.camera(codec="h264", settings={"live": {"codec": "h264", "onvif_port": 0}})
        config = self.folder / "camera.yaml"
        process = self.alidade("setup", "--port", "0", "--write", str(config))
        lines = [process.line() for _ in range(5)]
        address = re.search(r"http://\S+#\w+", lines[1] or "")
        self.assertIsNotNone(address, f"{lines}\n{process.error_text()}")
        self.browser.get(address.group())
        self.wait_for_text("file", re.escape(str(config)))
        self.assertFalse(self.browser.find_element(By.ID, "setup").is_displayed())
        self.write_into("address", camera.others["onvif"] + "/onvif/device_service")
        self.press("#add")
        self.assertTrue(self.browser.find_element(By.ID, "setup").is_displayed())
        self.press("#look")
        self.wait_for_text("found", "Virtual PTZ")
        self.assertRegex(self.text("found"), r"take: 160x96 H264.*pan and tilt: onvif, in units of its own: .*pan_range_deg")
        # What is missing is said, and nothing is written.
        self.press("#setup button[type=submit]")
        self.wait_for_text("said", "field of view")
        self.assertFalse(config.exists())
        for name, text in (("field", "3.4"), ("pan", "-180, 180"), ("tilt", "-90, 90"),
                           ("keys", "pan_tilt.pan_positive=left\nrealtime.priority=30\n")):
            self.write_into(name, text)
        for width, name in ((390, "setup_phone.png"), (1280, "setup.png")):
            self.set_size(width)
            self.assertTrue(self.fits_into_width(), width)
            self.screenshot(name)
        self.press("#setup button[type=submit]")
        self.wait_for_text("said", "Written: .*alidade check -c")
        written = config.read_text(encoding="utf-8")
        self.assertRegex(written, r"(?s)pan_positive: left.*priority: 30")
        self.assertIn("pan_range_deg", written)
        # 422 is how the server says what is missing.
        faults = [each["message"] for each in self.browser.get_log("browser") if "status of 422" not in each["message"]]
        self.assertEqual(faults, [])


if __name__ == "__main__":
    unittest.main()
