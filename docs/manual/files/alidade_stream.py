#!/usr/bin/env python3
"""Prints each record of a running `alidade run`: time of day, mode, pan, tilt and sigma. Needs Python 3 alone.

    python3 alidade_stream.py http://127.0.0.1:8080 [--token-env NAME] [--records N]
"""
import argparse
import datetime
import json
import math
import os
import sys
import time
import urllib.error
import urllib.request


def events(url, token=None):
    """(event, data) of the stream, until the connection ends. Every few seconds something comes, so 15 s of silence are an error."""
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    with urllib.request.urlopen(urllib.request.Request(url + "/api/v1/stream", headers=headers), timeout=15) as answer:
        name, data = "message", []
        for line in answer:
            field, _, value = line.decode("utf-8").rstrip("\r\n").partition(":")
            value = value.removeprefix(" ")
            if field == "event":
                name = value
            elif field == "data":
                data.append(value)
            elif not field and not value and data:  # an empty line ends an event; a line that begins with a colon is a comment
                yield name, json.loads("\n".join(data))
                name, data = "message", []


def text_of(record, clock):
    """clock: the wall clock less the monotonic one, s; None: it has not come yet."""
    when = "-"
    if clock is not None and record["time_s"] is not None:
        when = datetime.datetime.fromtimestamp(record["time_s"] + clock).isoformat(timespec="milliseconds")
    if record["mode"] == "none":
        return f"{when}  none  {record['status']}"
    sigma = max(record["orientation_sigma_rad"])
    return (f"{when}  {record['mode']:4}  pan {math.degrees(record['pan_rad']):9.4f} deg  tilt {math.degrees(record['tilt_rad']):9.4f} deg  "
            f"sigma {math.degrees(sigma):.4f} deg  {record['status']}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("url")
    parser.add_argument("--token-env", help="name of the environment variable that holds the token")
    parser.add_argument("--records", type=int, help="end after so many")
    options = parser.parse_args()
    token = os.environ[options.token_env] if options.token_env else None
    clock, left = None, options.records
    while True:
        try:
            for name, data in events(options.url.rstrip("/"), token):
                if name == "clock":
                    clock = data["wall_s"] - data["monotonic_s"]
                elif name == "lost":
                    print("lost:", data, file=sys.stderr)
                elif name == "orientation":
                    print(text_of(data, clock), flush=True)
                    if left is not None:
                        left -= 1
                        if left == 0:
                            return
        except (OSError, urllib.error.URLError) as error:
            print(f"{error}; trying again", file=sys.stderr)
        time.sleep(1)


if __name__ == "__main__":
    main()
