#!/usr/bin/env python3
"""Compares the records of `alidade run` with the virtual camera's truth: a table and pictures.

    demo_report.py --truth DIR --output DIR NAME=RECORDS.csv:CALIBRATION.yaml ...

For every record and every pixel of a grid it takes the direction that the record gives the pixel (its own angles,
rates, accelerations and camera, the calibration's axes) and the true direction of that pixel at its own row's true time; the angle
between them times the true focal length is the error in px. The forward model here is written with numpy for this
comparison alone: it shares nothing with the program it judges, nor with the virtual camera.
"""
import argparse
import csv
import math
import pathlib
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import yaml

R_FRD_FROM_RDF = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
GRID_COLUMNS, GRID_ROWS = 9, 7


class Calibration:
    """Parameters of calibration.yaml or truth.yaml (MODEL's names)."""

    def __init__(self, path):
        tree = yaml.safe_load(pathlib.Path(path).read_text(encoding="utf-8"))

        def value(name, default=None):
            node = tree.get(name, default)
            return node["value"] if isinstance(node, dict) else node
        self.width, self.height = tree["image"]["width"], tree["image"]["height"]
        self.focal_length = value("focal_length")
        self.aspect = value("aspect", 1.0)
        self.radial_distortion = value("radial_distortion", 0.0)
        self.line_delay = value("line_delay", 0.0)
        self.pan_axis = np.array(value("pan_axis", [0.0, 0.0, 1.0]))
        self.tilt_axis = np.array(value("tilt_axis", [0.0, 1.0, 0.0]))
        self.clock_offset = value("clock_offset", 0.0)


def rotations(axis, angles):
    """Rodrigues' formula for many angles about one axis: (n, 3, 3)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + s * cross + (1 - c) * (cross @ cross)


def directions(camera, axes, pixels, pan, tilt):
    """Base-frame directions (n, 3) of pixels (n, 2) seen with angles pan, tilt (n)."""
    xd = (pixels[:, 0] - camera.width / 2) / camera.focal_length
    yd = (pixels[:, 1] - camera.height / 2) / (camera.focal_length * camera.aspect)
    rd = np.hypot(xd, yd)
    r = rd.copy()
    for _ in range(50):  # Newton on r + k r^3 = rd; grid and distortion are mild
        r -= (r + camera.radial_distortion * r**3 - rd) / (1 + 3 * camera.radial_distortion * r**2)
    factor = np.where(rd > 0, r / np.where(rd > 0, rd, 1), 1)
    d_c = np.stack([xd * factor, yd * factor, np.ones_like(xd)], axis=1)
    d_c /= np.linalg.norm(d_c, axis=1)[:, None]
    R = rotations(axes.pan_axis, pan) @ rotations(axes.tilt_axis, tilt) @ R_FRD_FROM_RDF
    return np.einsum("nij,nj->ni", R, d_c)


class Path:
    """True angles at any time near a frame: each frame's value, rate and acceleration by central differences of
    truth.csv (fourth order: at 25 frames a second their error is far below a thousandth of a pixel)."""

    def __init__(self, path):
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.time = np.array([float(row["time_s"]) for row in rows])
        self.angle = np.array([[float(row["pan_rad"]), float(row["tilt_rad"])] for row in rows])
        h = np.median(np.diff(self.time))
        a = self.angle
        self.rate = np.full_like(a, np.nan)
        self.acceleration = np.full_like(a, np.nan)
        self.rate[2:-2] = (a[:-4] - 8 * a[1:-3] + 8 * a[3:-1] - a[4:]) / (12 * h)
        self.acceleration[2:-2] = (-a[:-4] + 16 * a[1:-3] - 30 * a[2:-2] + 16 * a[3:-1] - a[4:]) / (12 * h * h)
        even = np.abs(np.diff(self.time) - h) < 0.01 * h  # a lost frame leaves no even neighbourhood
        for i in range(2, len(a) - 2):
            if not even[i - 2:i + 2].all():
                self.rate[i] = np.nan

    def nearest(self, time):
        i = int(np.clip(np.searchsorted(self.time, time), 1, len(self.time) - 1))
        return i - 1 if time - self.time[i - 1] < self.time[i] - time else i

    def at(self, i, dt):
        return self.angle[i] + np.outer(dt, self.rate[i]) + 0.5 * np.outer(dt**2, self.acceleration[i])


def read_records(path):
    """Records with an orientation, and the count of all by mode."""
    modes, records = {}, []
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            modes[row["mode"]] = modes.get(row["mode"], 0) + 1
            if row["mode"] != "none":
                records.append(row)
    return records, modes


def compare(records, calibration, truth, path, link_delay=0.0):
    """Errors of one run: time (n), stamp minus true capture time (n), error vector on the grid in px (n, grid, 2),
    latency (n), normalised error (n), grid. link_delay: compare with the truth so much later, that is, with a clock
    offset that knows of the delay."""
    u = (np.arange(GRID_COLUMNS) + 0.5) * truth.width / GRID_COLUMNS
    v = (np.arange(GRID_ROWS) + 0.5) * truth.height / GRID_ROWS
    pixels = np.stack([a.ravel() for a in np.meshgrid(u, v)], axis=1)
    times, delays, errors, latencies, normalised = [], [], [], [], []
    for row in records:
        time = float(row["time_s"])
        # Stamps carry the link's delay: image time = capture time - d (telemetry arrives undelayed).
        i = path.nearest(time + truth.clock_offset)
        if abs(path.time[i] - (time + truth.clock_offset)) > 0.02 or not np.isfinite(path.rate[i]).all():
            continue
        record = Calibration.__new__(Calibration)
        record.__dict__.update(calibration.__dict__)
        record.focal_length = float(row["focal_length_px"])
        record.aspect = float(row["aspect"])
        record.radial_distortion = float(row["radial_distortion"])
        dt = pixels[:, 1] * float(row["line_delay_s"])
        d_record = directions(record, calibration, pixels,
                              *(float(row[f"{angle}_rad"]) + dt * float(row[f"{angle}_rate_rad_s"])
                                + dt**2 / 2 * float(row[f"{angle}_acceleration_rad_s2"]) for angle in ("pan", "tilt")))
        true_angles = path.at(i, pixels[:, 1] * truth.line_delay + link_delay)
        d_true = directions(truth, truth, pixels, true_angles[:, 0], true_angles[:, 1])
        # Tangent components: to the right and downwards as seen by the true camera.
        down = np.cross(d_true, np.cross([0.0, 0.0, 1.0], d_true))
        down /= np.linalg.norm(down, axis=1)[:, None]
        right = np.cross(down, d_true)
        difference = (d_record - d_true) * truth.focal_length
        errors.append(np.stack([np.sum(difference * right, 1), np.sum(difference * down, 1)], axis=1))
        times.append(time)
        delays.append(time + truth.clock_offset - path.time[i])
        latencies.append(float(row["latency_s"]))
        if calibration.focal_length == truth.focal_length:
            normalised.append(normalised_error(row, truth, path.at(i, np.full(1, link_delay))[0]))
    return (np.array(times), np.array(delays), np.array(errors), np.array(latencies), np.array(normalised),
            pixels)


def normalised_error(row, truth, true_angles):
    """Mean over the three axes of (orientation error / its reported sigma)^2 at row 0."""
    x, y, z, w = (float(row[f"q_{c}"]) for c in "xyzw")
    R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                  [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                  [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    true_R = (rotations(truth.pan_axis, true_angles[:1]) @ rotations(truth.tilt_axis, true_angles[1:]))[0] @ R_FRD_FROM_RDF
    E = true_R.T @ R
    xi = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
    sigma = np.array([float(row[f"orientation_sigma_rad_{i}"]) for i in range(3)])
    # About the axes that the mechanism turns; the third is fixed by the mechanism and has no freedom.
    return float(np.mean((xi[:2] / sigma[:2])**2))


def plots(results, truth, path, output):
    colours = plt.rcParams["axes.prop_cycle"].by_key()["color"]
    t0 = min(r["times"][0] for r in results)

    figure, axis = plt.subplots(figsize=(10, 4.2))
    for result, colour in zip(results, colours):
        axis.semilogy(result["times"] - t0, result["per_frame"], ".-", lw=0.6, ms=3, color=colour, label=result["name"])
    axis.set(xlabel="time (s)", ylabel="direction error, RMS over the image (px)", title="Error of every frame against truth")
    axis.grid(True, which="both", alpha=0.3)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncol=len(results), fontsize=8)
    figure.tight_layout()
    figure.savefig(output / "error-over-time.png", dpi=110)

    runs = [result for result in results if not result["same_records"]]
    best = results[-1]
    figure, axes = plt.subplots(2, 1, figsize=(10, 5.5), sharex=True)
    for component, (axis, name) in enumerate(zip(axes, ("pan", "tilt"))):
        axis.plot(path.time - truth.clock_offset - t0, np.degrees(path.angle[:, component]), color="0.6", lw=3, label="truth")
        for result, colour in zip(runs, colours):
            axis.plot(result["times"] - t0, np.degrees([float(r[f"{name}_rad"]) for r in result["records"]]),
                      lw=1, color=colour, label=result["name"])
        axis.set(ylabel=f"{name} (deg)")
        axis.grid(True, alpha=0.3)
    axes[0].set(title="Angles at row 0, at each frame's own stamp")
    axes[0].legend(loc="upper right", fontsize=8)
    axes[1].set(xlabel="time (s)", xlim=(0, best["times"][-1] - t0))
    figure.tight_layout()
    figure.savefig(output / "angles.png", dpi=110)

    figure, axis = plt.subplots(figsize=(8, 4.8))
    mean = best["errors"].mean(axis=0)
    spread = np.sqrt((best["errors"]**2).sum(2).mean(0))
    pixels = best["pixels"]
    scatter = axis.scatter(pixels[:, 0], pixels[:, 1], c=spread, s=70, cmap="viridis")
    axis.quiver(pixels[:, 0], pixels[:, 1], mean[:, 0], mean[:, 1], angles="xy", color="crimson", width=0.003)
    figure.colorbar(scatter, label="RMS error (px)")
    axis.set(xlim=(0, truth.width), ylim=(truth.height, 0), aspect="equal", xlabel="u (px)", ylabel="v (px)",
             title=f"{best['name']}: mean error (arrows, longest {np.hypot(*mean.T).max():.2f} px) and RMS")
    figure.tight_layout()
    figure.savefig(output / "error-over-image.png", dpi=110)

    figure, axis = plt.subplots(figsize=(8, 3.6))
    for result, colour in zip(runs, colours):
        axis.hist(1e3 * result["latency"], bins=60, histtype="step", color=colour, label=result["name"])
    axis.set(xlabel="frame received to record made (ms)", ylabel="frames", title="Latency")
    axis.legend()
    axis.grid(True, alpha=0.3)
    figure.tight_layout()
    figure.savefig(output / "latency.png", dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--truth", required=True, type=pathlib.Path, help="folder with truth.yaml and truth.csv")
    parser.add_argument("--output", required=True, type=pathlib.Path, help="folder for the report")
    parser.add_argument("run", nargs="+", help="NAME=RECORDS.csv:CALIBRATION.yaml")
    arguments = parser.parse_args()
    truth, path = Calibration(arguments.truth / "truth.yaml"), Path(arguments.truth / "truth.csv")

    results = []
    for run in arguments.run:
        name, _, files = run.partition("=")
        records_file, _, calibration_file = files.partition(":")
        calibration = Calibration(calibration_file)
        records, modes = read_records(records_file)
        link_delay = 0.0
        for row_name in (name, f"{name}, link delay known"):
            times, delays, errors, latency, normalised, pixels = compare(records, calibration, truth, path, link_delay)
            if len(times) == 0:
                print(f"demo_report: no record of {records_file} matches a frame of {arguments.truth}/truth.csv",
                      file=sys.stderr)
                return 1
            matched = set(times)
            results.append({
                "name": row_name, "same_records": row_name != name, "modes": modes, "times": times, "errors": errors, "latency": latency,
                "normalised": normalised, "pixels": pixels,
                "records": [r for r in records if float(r["time_s"]) in matched],
                "per_frame": np.sqrt((errors**2).sum(2).mean(1))})
            if calibration.clock_offset != truth.clock_offset:
                break
            link_delay = float(np.median(delays))

    header = ["", "frames", "RMS error px", "median px", "worst frame px", "mean error (u, v) px",
              "NEES", "latency p50 / p99 ms"]
    rows = []
    for r in results:
        mean = r["errors"].mean(axis=(0, 1))
        rows.append([r["name"], str(len(r["times"])), f"{math.sqrt((r['per_frame']**2).mean()):.2f}",
                     f"{np.median(r['per_frame']):.2f}", f"{r['per_frame'].max():.2f}", f"{mean[0]:+.2f}, {mean[1]:+.2f}",
                     f"{r['normalised'].mean():.2f}" if len(r["normalised"]) else "-",
                     f"{1e3 * np.percentile(r['latency'], 50):.2f} / {1e3 * np.percentile(r['latency'], 99):.2f}"])
    widths = [max(len(row[i]) for row in [header] + rows) for i in range(len(header))]
    lines = ["| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths)) + " |" for row in [header] + rows]
    lines.insert(1, "|" + "|".join("-" * (width + 2) for width in widths) + "|")
    table = "\n".join(lines)

    note = (f"Stamps lie {1e3 * link_delay:.2f} ms behind the camera's own: the way of a frame through the sockets. It is constant, so "
            "that a calibration from video finds it as part of the clock offset; the true calibration of the camera alone does "
            "not know of it.")
    arguments.output.mkdir(parents=True, exist_ok=True)
    plots(results, truth, path, arguments.output)
    pictures = "\n\n".join(f"![{name}]({name}.png)" for name in ("error-over-time", "angles", "error-over-image", "latency"))
    (arguments.output / "report.md").write_text(
        "# Alidade against its virtual camera\n\n"
        f"{truth.width}x{truth.height}, f {truth.focal_length:.0f} px, k {truth.radial_distortion:g}, "
        f"line delay {1e6 * truth.line_delay:+.2f} us, clock offset {1e3 * truth.clock_offset:+.1f} ms.\n\n"
        f"Error of the direction of {GRID_COLUMNS * GRID_ROWS} pixels a frame, against truth. NEES is the normalised squared error of "
        "the orientation: 1 when the reported sigma is honest.\n\n"
        f"{table}\n\n{note}\n\n{pictures}\n", encoding="utf-8")
    print(f"{table}\n\n{note}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
