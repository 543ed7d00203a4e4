#!/usr/bin/env python3
"""A picture of the status page of a running `alidade run`, once it is in OE mode.

    demo_page.py RUN_LOG PICTURE      RUN_LOG: where the program says which address it listens on

Without a browser (chromium-driver and python3-selenium, which `scripts/install-deps page` installs) there is no picture: exit status 0.
"""
import re
import shutil
import sys
import time

DEADLINE_S = 36.0


def main():
    log, picture = sys.argv[1:3]
    driver = shutil.which("chromedriver")
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.options import Options
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        driver = None
    if driver is None:
        print("no picture of the status page: no browser (scripts/install-deps page installs one)", file=sys.stderr)
        return
    end = time.monotonic() + DEADLINE_S
    address = None
    while address is None and time.monotonic() < end:
        with open(log, encoding="utf-8") as file:
            address = re.search(r"listening on (http://[\d.]+:\d+/)", file.read())
        time.sleep(0.1)
    if address is None:
        sys.exit(f"demo_page: {log} names no address")
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--window-size=1180,920"):
        options.add_argument(argument)
    browser = webdriver.Chrome(service=Service(driver), options=options)
    try:
        browser.get(address.group(1))
        mode = ""
        while mode != "OE" and time.monotonic() < end:
            mode = browser.execute_script("return document.getElementById('mode').textContent")
            time.sleep(0.2)
        time.sleep(6)  # for the page's curves to show something
        browser.save_screenshot(picture)
    finally:
        browser.quit()


if __name__ == "__main__":
    main()
