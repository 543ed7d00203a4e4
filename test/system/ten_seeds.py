#!/usr/bin/env python3
"""The paper's camera, live over RTSP and VAPIX, from the data sheet, once for each seed: when it was calibrated and in OE
mode, and how far what it found lies from the truth.

    ALIDADE=.../alidade ALIDADE_SIMULATE=.../alidade-simulate ten_seeds.py [--seeds 1-10] [--json FILE]

A seed changes noise, texture, jitter and telemetry, and where on its path the camera is at the first frame (the k-th of ten seeds
begins k tenths of a period later). Minutes a seed: run by hand. Exit status 1: a seed misses what must hold
(OE mode within 20 s of the first frame, each parameter within 3 sigma, the clock offset besides within what sockets wander by).
"""
import argparse
import json
import math
import pathlib
import shutil
import signal
import sys
import tempfile
import time

import yaml

import harness
from harness import ALIDADE, Camera, Process
from self_calibration import Watch, comparisons, stored_calibration

EXAMPLE = pathlib.Path(__file__).resolve().parent.parent / "simulator" / "examples" / "paper_camera.yaml"
LATEST_S = 20
SOCKETS_MS = 0.5


def settings_of_paper_camera():
    settings = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    for photo in settings["scene"]["photos"]:
        photo["file"] = str((EXAMPLE.parent / photo["file"]).resolve())
    settings.pop("truth_dir")
    return settings


def configure(folder, camera, settings, file):
    config = {
        "video": {"type": "rtsp", "url": camera.video_url, "width": settings["image"]["width"],
                  "height": settings["image"]["height"]},
        "pan_tilt": {"type": "vapix", "url": camera.pan_tilt_url, "rate_hz": 50,
                     "angle_sigma_rad": settings["telemetry"]["sigma_rad"],
                     "angle_quantum_rad": math.radians(settings["telemetry"]["quantum_deg"])},
        "camera": {"focal_length_px": settings["guess"]["focal_length_px"]},
        "calibration": {"file": str(file), "auto": True}, "realtime": {"mode": "OE"}, "output": {"json": True}}
    path = folder / "alidade.yaml"
    path.write_text(json.dumps(config))
    return path


def run_seed(seed, seconds, folder):
    """What one seed gave; the calibration is compared as it was first stored, and as it was at the end."""
    settings = settings_of_paper_camera()
    clock_offset_s = 1e-3 * settings["camera"]["clock_offset_ms"]
    camera = Camera(folder, seed=seed, settings=settings)
    run = None
    try:
        time.sleep((seed - 1) % 10 / 10 * settings["path"]["period_s"])
        file = folder / "live" / "calibration.yaml"
        run = Process(ALIDADE, "run", "-c", configure(folder, camera, settings, file))
        watch = Watch(run)
        result = {"seed": seed}
        first = None
        if watch.until_oe(seconds) is not None:
            first = shutil.copy(stored_calibration(file), folder / "first.yaml") if stored_calibration(file) else None
            watch.read_for(max(0.0, seconds - watch.since_first_frame(watch.records[-1])))
        run.end(signal.SIGINT)
        camera.end(signal.SIGINT)
        result["heard"] = watch.heard
        result["log"] = run.errors
        for name, record in (("calibrated_s", watch.first_calibrated), ("oe_s", watch.first_oe)):
            result[name] = watch.since_first_frame(record) if record else None
        calibrated = [r for r in watch.records if r["calibrated"] and r["mode"] != "none"]
        result["oe_share"] = sum(r["mode"] == "OE" for r in calibrated) / len(calibrated) if calibrated else 0
        for name, stored in (("first", first), ("last", stored_calibration(file))):
            if stored is not None and calibrated:
                rows, delay_s = comparisons(stored, camera.truth, calibrated, clock_offset_s)
                result["link_delay_ms"] = 1e3 * delay_s
                result[name] = [{"name": r.name, "unit": r.unit, "error": r.error, "sigma": r.sigma} for r in rows]
        return result
    finally:
        for process in (run, camera):
            if process is not None and process.child.poll() is None:
                process.end(signal.SIGKILL)


def missed(result):
    """What this seed misses, in words."""
    if result["oe_s"] is None:
        return ["never in OE mode"]
    words = [] if result["oe_s"] <= LATEST_S else [f"OE mode after {result['oe_s']:.1f} s"]
    for which in ("first", "last"):
        for row in result.get(which, []):
            if abs(row["error"]) > 3 * row["sigma"] + (SOCKETS_MS if row["name"] == "clock_offset" else 0):
                words.append(f"{which} {row['name']} by {row['error'] / row['sigma']:+.1f} sigma")
    return words


def print_table(results, which):
    names = next(([row["name"] for row in r[which]] for r in results if which in r), [])
    print(f"\n{which} calibration stored: error ({', '.join(n for n in names)}) and in brackets error / sigma")
    for result in results:
        times = "  ".join(f"{result[n]:6.2f}" if result[n] is not None else "     -" for n in ("calibrated_s", "oe_s"))
        cells = "  ".join(f"{row['error']:+9.4f} ({row['error'] / row['sigma']:+5.1f})" for row in result.get(which, []))
        print(f"seed {result['seed']:2d}  calibrated, OE after {times} s, then OE {100 * result['oe_share']:5.1f} %  {cells}")
    for i, name in enumerate(names):
        rows = [r[which][i] for r in results if which in r]
        print(f"  {name}: root mean square of error / sigma {math.sqrt(sum((r['error'] / r['sigma'])**2 for r in rows) / len(rows)):.2f}, "
              f"of the error {math.sqrt(sum(r['error']**2 for r in rows) / len(rows)):.4g} {rows[0]['unit']}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="1-10", help="FIRST-LAST")
    parser.add_argument("--seconds", type=float, default=30, help="of each run")
    parser.add_argument("--json", type=pathlib.Path, help="keeps everything")
    arguments = parser.parse_args()
    harness.DEADLINE_S = 900  # rendering a whole period on a busy machine
    first, _, last = arguments.seeds.partition("-")
    results = []
    for seed in range(int(first), int(last or first) + 1):
        with tempfile.TemporaryDirectory() as folder:
            results.append(run_seed(seed, arguments.seconds, pathlib.Path(folder)))
        print(f"seed {seed}: {'; '.join(missed(results[-1])) or 'good'}", file=sys.stderr, flush=True)
        if arguments.json:
            arguments.json.write_text(json.dumps(results, indent=1))
    for which in ("first", "last"):
        print_table(results, which)
    return 1 if any(missed(result) for result in results) else 0


if __name__ == "__main__":
    sys.exit(main())
