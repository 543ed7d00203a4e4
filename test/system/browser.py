"""A browser without a window, for the tests of pages."""
import os
import re

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

from harness import DEADLINE_S, SystemTest, wait_until


class BrowserTest(SystemTest):
    def setUp(self):
        super().setUp()
        options = Options()
        for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu",
                         "--window-size=1280,900"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.browser = webdriver.Chrome(service=Service(os.environ["CHROMIUM_DRIVER"]), options=options)
        self.addCleanup(self.browser.quit)
        self.browser.set_script_timeout(DEADLINE_S)

    def text(self, name):
        return self.browser.execute_script("return document.getElementById(arguments[0]).textContent", name)

    def wait_for_text(self, name, pattern):
        wait_until(lambda: re.search(pattern, self.text(name)), f"{pattern!r} in #{name}, where {self.text(name)!r} is")
        return self.text(name)

    def set_size(self, width, height=1800, factor=1):
        """px, as of a phone (390) or a desk (1280). Until clear_size()."""
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": width, "height": height, "deviceScaleFactor": factor, "mobile": width < 500})

    def clear_size(self):
        self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

    def fits_into_width(self):
        return not self.browser.execute_script("return document.documentElement.scrollWidth > innerWidth")

    def screenshot(self, name):
        if "ALIDADE_SCREENSHOTS" in os.environ:
            self.browser.save_screenshot(os.path.join(os.environ["ALIDADE_SCREENSHOTS"], name))
