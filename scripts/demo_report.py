#!/usr/bin/env python3
"""The report of scripts/demo: what `alidade run` found out by itself, held against the virtual camera's truth.

    demo_report.py --truth DIR --live RUN.jsonl --data-sheet CALIBRATION --calibration CALIBRATION
                   --tags TAGS.json --dome REALITY.json --output DIR NAME=RECORDS.jsonl:CALIBRATION ...

For every record and every pixel of a grid it takes the direction that the record gives the pixel (its own angles,
rates, accelerations and camera, the calibration's axes) and the true direction of that pixel at its own row's true time; the angle
between them times the true focal length is the error in px. The forward model here is written with numpy for this
comparison alone: it shares nothing with the program it judges, nor with the virtual camera.
"""
import argparse
import csv
import json
import math
import pathlib
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy as np
import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "test" / "support"))
import calibration_errors

R_FRD_FROM_RDF = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
GRID_COLUMNS, GRID_ROWS = 9, 7
COLOURS = plt.rcParams["axes.prop_cycle"].by_key()["color"]
# Their records' sigmas are those of a calibration that is wrong on purpose.
UNTOLD = ("uncalibrated", "OE without rolling shutter")


class Camera:
    """Image size, lens, read-out and axes of a calibration.yaml or truth.yaml."""

    def __init__(self, path):
        tree = yaml.safe_load(pathlib.Path(path).read_text(encoding="utf-8"))

        def value(name, default):
            return calibration_errors.value_of(tree.get(name, default))
        self.width, self.height = tree["image"]["width"], tree["image"]["height"]
        self.focal_length = value("focal_length", None)
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


def directions(size, focal_length, aspect, k, axes, pixels, pan, tilt):
    """Base-frame directions (n, 3) of pixels (n, 2) seen with angles pan, tilt (n)."""
    xd = (pixels[:, 0] - size.width / 2) / focal_length
    yd = (pixels[:, 1] - size.height / 2) / (focal_length * aspect)
    rd = np.hypot(xd, yd)
    r = rd.copy()
    for _ in range(10):  # Newton on r + k r^3 = rd; grid and distortion are mild
        r -= (r + k * r**3 - rd) / (1 + 3 * k * r**2)
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


def telemetry_lead(file, path):
    """How much later than the middle of their polls telemetry's samples were true, s: the shift in time that brings them to the
    true path, by least squares."""
    along, square = 0.0, 0.0
    with open(file, newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            time = (float(row["earliest_time_s"]) + float(row["receive_time_s"])) / 2
            i = path.nearest(time)
            dt = time - path.time[i]
            if abs(dt) > 0.05 or not np.isfinite(path.rate[i]).all():
                continue
            rate = path.rate[i] + dt * path.acceleration[i]
            measured = np.array([float(row["pan_rad"]), float(row["tilt_rad"])])
            along += float((measured - path.at(i, np.array([dt]))[0]) @ rate)
            square += float(rate @ rate)
    return along / square


def read_records(path):
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file]


class Errors:
    """Records of one kind against the truth, frame by frame."""

    def __init__(self, name, records, axes, truth, path):
        self.name = name
        u = (np.arange(GRID_COLUMNS) + 0.5) * truth.width / GRID_COLUMNS
        v = (np.arange(GRID_ROWS) + 0.5) * truth.height / GRID_ROWS
        self.pixels = np.stack([a.ravel() for a in np.meshgrid(u, v)], axis=1)
        self.records, times, errors, normalised = [], [], [], []
        for record in records:
            # Stamps carry the link's delay: image time = capture time - d (telemetry arrives undelayed).
            time = record["time_s"] + truth.clock_offset
            i = path.nearest(time)
            if abs(path.time[i] - time) > 0.02 or not np.isfinite(path.rate[i]).all():
                continue
            dt = self.pixels[:, 1] * record["line_delay_s"]
            angles = [record[f"{angle}_rad"] + dt * record[f"{angle}_rate_rad_s"] +
                      dt**2 / 2 * record[f"{angle}_acceleration_rad_s2"] for angle in ("pan", "tilt")]
            d_record = directions(truth, record["focal_length_px"], record["aspect"], record["radial_distortion"], axes,
                                  self.pixels, *angles)
            true_angles = path.at(i, self.pixels[:, 1] * truth.line_delay)
            d_true = directions(truth, truth.focal_length, truth.aspect, truth.radial_distortion, truth, self.pixels,
                                true_angles[:, 0], true_angles[:, 1])
            # Tangent components: to the right and downwards as seen by the true camera.
            down = np.cross(d_true, np.cross([0.0, 0.0, 1.0], d_true))
            down /= np.linalg.norm(down, axis=1)[:, None]
            right = np.cross(down, d_true)
            difference = (d_record - d_true) * truth.focal_length
            errors.append(np.stack([np.sum(difference * right, 1), np.sum(difference * down, 1)], axis=1))
            normalised.append(normalised_error(record, truth, path.angle[i]))
            self.records.append(record)
            times.append(record["time_s"])
        self.times, self.errors, self.normalised = np.array(times), np.array(errors), np.array(normalised)
        if len(times):
            self.per_frame = np.sqrt((self.errors**2).sum(2).mean(1))


def normalised_error(record, truth, true_angles):
    """(Orientation error / its reported sigma) at row 0 about the camera's x and y axes; the third is fixed by the
    mechanism and has no freedom."""
    x, y, z, w = record["q_base_from_camera"]
    R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                  [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                  [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    true_R = (rotations(truth.pan_axis, true_angles[:1]) @ rotations(truth.tilt_axis, true_angles[1:]))[0] @ R_FRD_FROM_RDF
    E = true_R.T @ R
    xi = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0]])
    return xi / np.array(record["orientation_sigma_rad"][:2])


def table(header, rows):
    widths = [max(len(row[i]) for row in [header] + rows) for i in range(len(header))]
    lines = ["| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths)) + " |" for row in [header] + rows]
    lines.insert(1, "|" + "|".join("-" * (width + 2) for width in widths) + "|")
    return "\n".join(lines)


def state_of(record):
    return record["mode"], record["calibrated"], record.get("calibration"), record.get("needs")


def switch_over(records):
    """The first record of each kind that matters, and every change of state on the way; seconds since the first frame."""
    first_s = records[0]["receive_time_s"]
    events = {}
    for name, holds in (("first frame", lambda r: True), ("first orientation", lambda r: r["mode"] != "none"),
                        ("first calibrated record", lambda r: r["calibrated"]),
                        ("first record in OE mode", lambda r: r["mode"] == "OE")):
        record = next((r for r in records if holds(r)), None)
        if record is not None:
            events[name] = record
    for before, record in zip(records, records[1:]):
        if before["calibrated"] and record["calibrated"] and before["focal_length_px"] != record["focal_length_px"]:
            events.setdefault("first refined calibration", record)
    changes = [record for before, record in zip(records, records[1:]) if state_of(before) != state_of(record)]
    shown = {id(record): (record, "") for record in changes}
    for name, record in events.items():
        label = shown.get(id(record), (record, ""))[1]
        shown[id(record)] = (record, f"{label}, {name}" if label else name)
    rows = []
    for record, label in sorted(shown.values(), key=lambda item: item[0]["receive_time_s"]):
        mode, calibrated, activity, needs = state_of(record)
        rows.append([f"{record['receive_time_s'] - first_s:.2f}", label, mode, "yes" if calibrated else "no", activity or "",
                     needs or "", record["status"]])
    most = 24  # of a camera that falters; the first and last tell the story
    if len(rows) > most:
        left_out = len(rows) - most
        rows = rows[:most // 2] + [["", f"({left_out} more changes)"] + [""] * 5] + rows[-most // 2:]
    return events, table(["s", "", "mode", "calibrated", "calibration", "needs", "status"], rows)


def parameter_table(arguments, delay_s):
    rows = []
    for row in calibration_errors.compare(arguments.calibration, arguments.truth / "truth.yaml", delay_s):
        digits = 3 if abs(row.truth) < 1e4 else 2
        axis = row.name[:-2].endswith("_axis")
        rows.append([row.name, "" if axis else f"{row.estimate:.{digits + 1}f}", "" if axis else f"{row.truth:.{digits + 1}f}",
                     f"{row.error:+.4f}", f"{row.sigma:.4f}", f"{row.sigmas:+.1f}" if row.sigmas is not None else "-", row.unit])
    return table(["", "found live", "truth", "error", "sigma", "error / sigma", "unit"], rows)


def error_table(results):
    rows = []
    for r in results:
        mean = r.errors.mean(axis=(0, 1))
        rows.append([r.name, str(len(r.times)), f"{math.sqrt((r.per_frame**2).mean()):.2f}", f"{np.median(r.per_frame):.2f}",
                     f"{r.per_frame.max():.2f}", f"{mean[0]:+.2f}, {mean[1]:+.2f}", f"{(r.normalised**2).mean():.2f}",
                     f"{np.abs(r.normalised).max():.1f}"])
    return table(["", "frames", "RMS px", "median px", "worst frame px", "mean (u, v) px", "NEES", "worst, sigmas"], rows)


def latency_table(records):
    """Received to record made, by what the calibration was doing."""
    by_activity = {}
    for record in records:
        if record["latency_s"] is not None:
            by_activity.setdefault((record.get("calibration") or "-", record["mode"]), []).append(record["latency_s"])
    rows = [[activity, mode, str(len(values)), f"{1e3 * np.percentile(values, 50):.2f}", f"{1e3 * np.percentile(values, 99):.2f}",
             f"{1e3 * max(values):.2f}"] for (activity, mode), values in by_activity.items()]
    return table(["calibration", "mode", "frames", "p50 ms", "p99 ms", "worst ms"], rows)


def tag_table(tags):
    rows = []
    for row in tags["rows"]:
        beyond = row.get("beyond_detector_px")
        rows.append([row["name"], str(row["frames"]), f"{row['std_u_px']:.3f}", f"{row['std_v_px']:.3f}", f"{row['total_px']:.3f}",
                     f"{row['median_distance_px']:.3f}", f"{beyond:.3f}" if beyond is not None else "",
                     f"{math.hypot(row['told_u_px'], row['told_v_px']):.3g}" if beyond is not None else ""])
    return table(["tag of every frame in one frame", "frames", "std u px", "std v px", "total px", "median px",
                  "beyond detector px", "sigma told px"], rows)


def tag_passes(tags, records):
    """The tag's times in the picture: (indices into tags["frames"], whether the camera turns to the right meanwhile)."""
    rate = {record["frame"]: record["pan_rate_rad_s"] for record in records}
    frames = np.array(tags["frames"])
    apart = np.flatnonzero(np.diff(frames) > 10) + 1  # more than some frames in which it was not found
    return [(part, bool(np.median([rate[frame] for frame in frames[part] if frame in rate] or [0]) > 0))
            for part in np.split(np.arange(len(frames)), apart)]


def tag_clusters(tags, passes):
    """Why the places lie in clusters, in numbers of this run."""
    def apart(row):
        places = np.array(row["places"])
        means = [places[np.concatenate(parts)].mean(axis=0) for parts in
                 ([part for part, right in passes if right == wanted] for wanted in (True, False)) if parts]
        return f"{np.hypot(*(means[0] - means[1])):.3g} px in the row {row['name']}" if len(means) == 2 else ""
    to_right = sum(right for _, right in passes)
    text = (f"Of the tag's {len(passes)} passes through the picture {to_right} come while the camera turns to the right (dots) and "
            f"{len(passes) - to_right} while it turns to the left (crosses), at another place in the picture. ")
    if said := [one for one in map(apart, tags["rows"]) if one]:
        text += ("What a row has late, or scaled, moves the tag along the motion or with its place. So the two ways are two clusters, whose "
                 f"means are apart by {', '.join(said)}. The detector itself errs differently at the two places.")
    return text


def dome_tables(reality):
    """What alidade_reality says of one film of each camera: their calibrations, and OE mode with these."""
    cameras = {row["row"]: row["seeds"][0] for row in reality["rows"]}
    refused = {name: seed["refusal"] for name, seed in cameras.items() if "refusal" in seed}
    cameras = {name: seed for name, seed in cameras.items() if name not in refused}
    rows = []
    for name in sorted({name for seed in cameras.values() for name in seed["calibration"]}):
        row = [name]
        for seed in cameras.values():
            found = seed["calibration"][name]
            row += [f"{found['error']:+.2e}", f"{found['sigma']:.2e}", f"{found['sigmas']:+.1f}"]
        rows.append(row)
    header = [""] + [f"{name}: {what}" for name in cameras for what in ("error", "sigma", "error / sigma")]
    summary = [[name, f"{seed['anees']:.2f}", f"{seed['oe']} of {seed['frames']}", f"{seed['rms_px']:.2f}",
                f"{seed['sigma_over_error']:.1f}", f"{seed['oe_nees']:.2f}", f"{math.sqrt(seed['worst_frame']):.1f}"]
               for name, seed in cameras.items()]
    said = [f"{name}: no calibration; {why}" for name, why in refused.items()]
    return "\n\n".join([table(header, rows), table(
        ["", "NEES of the calibration", "frames in OE mode", "RMS px", "sigma / error", "NEES of OE mode", "worst frame, sigmas"],
        summary)] + said)


def mark(axis, events, first_s):
    for name, style in (("first calibrated record", ":"), ("first record in OE mode", "--"),
                        ("first refined calibration", "-.")):
        if name in events:
            axis.axvline(events[name]["receive_time_s"] - first_s, color="k", ls=style, lw=1, label=name)


def plain_axis(axis, numbers, unit=""):
    """A logarithmic axis with numbers as people write them (0.05, 2, 100) at its ticks, in place of powers of ten."""
    axis.set_major_locator(matplotlib.ticker.LogLocator(base=10, subs=numbers))
    axis.set_major_formatter(lambda value, _: f"{value:g}{unit}")
    axis.set_minor_formatter(matplotlib.ticker.NullFormatter())


def told_band(result, truth):
    """Between which errors (px) nine of ten frames should lie by the orientation sigmas that their records tell: the 5th and the 95th
    percentile of the length of a Gaussian vector, as the median of a second."""
    sigma_px = np.array([np.sqrt(np.mean(np.square(r["orientation_sigma_rad"][:2]))) for r in result.records]) * truth.focal_length
    half = 12
    smooth = np.array([np.median(sigma_px[max(0, i - half):i + half + 1]) for i in range(len(sigma_px))])
    return smooth * math.sqrt(-2 * math.log(0.95)), smooth * math.sqrt(-2 * math.log(0.05))


def plot_errors(results, events, first_s, truth, output):
    """Replays above, `alidade run` below; the colour of a mode is the same in both."""
    colour_of = {"uncalibrated": COLOURS[0], "PT": COLOURS[1], "OE without rolling shutter": COLOURS[2],
                 "OE with rolling shutter": COLOURS[3], "live, before": COLOURS[0], "live, calibrated, PT": COLOURS[1],
                 "live, calibrated, OE": COLOURS[3]}
    figure, axes = plt.subplots(2, 1, figsize=(10, 8.4), sharex=True, sharey=True)
    for axis, is_live in zip(axes, (False, True)):
        for result in results:
            if result.name.startswith("live") != is_live:
                continue
            colour = colour_of[result.name]
            axis.semilogy(result.times - first_s, result.per_frame, ".", ms=3, color=colour, label=result.name)
            if all(record["calibrated"] for record in result.records) and result.name not in UNTOLD:
                axis.fill_between(result.times - first_s, *told_band(result, truth), color=colour, alpha=0.18, lw=0)
        if is_live:
            mark(axis, events, first_s)
        plain_axis(axis.yaxis, (1.0, 3.0))
        axis.set(ylabel="direction error (px)", title="alidade run, live" if is_live else "Replays of a recording")
        axis.grid(True, alpha=0.3)
        axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, title="band: 9 of 10 frames\nby the told sigma",
                    title_fontsize=8)
    axes[1].set(xlabel="s since the first frame")
    figure.suptitle("Error of every frame against truth, RMS over the image")
    figure.tight_layout()
    figure.savefig(output / "error-over-time.png", dpi=110)


def plot_angles(live, events, truth, path, first_s, output):
    figure, axes = plt.subplots(2, 1, figsize=(10, 5.5), sharex=True)
    for component, (axis, name) in enumerate(zip(axes, ("pan", "tilt"))):
        axis.plot(path.time - truth.clock_offset - first_s, np.degrees(path.angle[:, component]), color="0.6", lw=3, label="truth")
        axis.plot([r["time_s"] - first_s for r in live], np.degrees([r[f"{name}_rad"] for r in live]), lw=1, color=COLOURS[3],
                  label="alidade run")
        mark(axis, events, first_s)
        axis.set(ylabel=f"{name} (deg)")
        axis.grid(True, alpha=0.3)
    axes[0].set(title="Angles at row 0, at each frame's own stamp")
    axes[0].legend(loc="upper right", fontsize=8)
    axes[1].set(xlabel="s since the first frame", xlim=(0, live[-1]["time_s"] - first_s))
    figure.tight_layout()
    figure.savefig(output / "angles.png", dpi=110)


def plot_error_over_image(result, truth, output):
    figure, axis = plt.subplots(figsize=(8, 4.8))
    mean = result.errors.mean(axis=0)
    spread = np.sqrt((result.errors**2).sum(2).mean(0))
    # From 0 on, so that a colour means a size: a scale from the least to the largest would show hundredths of a pixel as extremes.
    scatter = axis.scatter(result.pixels[:, 0], result.pixels[:, 1], c=spread, s=70, cmap="viridis", vmin=0, vmax=1.25 * spread.max())
    # An arrow as long as the largest RMS is as long as the pixels of the grid are apart.
    arrows = axis.quiver(result.pixels[:, 0], result.pixels[:, 1], mean[:, 0], mean[:, 1], angles="xy", scale_units="xy",
                         scale=spread.max() * GRID_COLUMNS / truth.width, color="crimson", width=0.003)
    axis.quiverkey(arrows, 0.86, 1.04, spread.max(), f"{spread.max():.2f} px", labelpos="E", coordinates="axes")
    figure.colorbar(scatter, label="RMS error (px)")
    axis.set(xlim=(0, truth.width), ylim=(truth.height, 0), aspect="equal", xlabel="u (px)", ylabel="v (px)")
    axis.set_title(f"{result.name}: mean error (arrows) and RMS (colour)", loc="left", fontsize=10)
    figure.tight_layout()
    figure.savefig(output / "error-over-image.png", dpi=110)


def plot_latency(records, period_s, output):
    figure, axis = plt.subplots(figsize=(9, 4))
    kinds = {}
    for record in records:
        if record["latency_s"] is not None:
            kinds.setdefault(f"{record['mode']}, {record.get('calibration') or 'no calibration thread'}", []).append(
                1e3 * record["latency_s"])
    for name, values in kinds.items():
        if len(values) >= 5:
            later = 1 - np.arange(len(values)) / len(values)
            axis.step(np.sort(values), 100 * later, where="post", label=f"{name} ({len(values)} frames)")
    axis.axvline(1e3 * period_s, color="0.5", ls=":", lw=1, label=f"the next frame comes ({1e3 * period_s:.0f} ms)")
    axis.set(xscale="log", yscale="log", xlabel="from the frame's arrival to its record", ylabel="frames that take longer",
             title="Latency")
    plain_axis(axis.xaxis, (1.0, 2.0, 5.0), " ms")
    plain_axis(axis.yaxis, (1.0, 3.0), " %")
    axis.legend(fontsize=8)
    axis.grid(True, alpha=0.3)
    figure.tight_layout()
    figure.savefig(output / "latency.png", dpi=110)


def plot_tags(tags, passes, output):
    """Every row's places about their median, each in a scale of its own; dots and crosses: passes to the right and to the left."""
    rows = tags["rows"]
    figure, axes = plt.subplots(2, (len(rows) + 1) // 2, figsize=(11, 7.4))
    for axis in axes.ravel()[len(rows):]:
        axis.axis("off")
    for row, axis, colour in zip(rows, axes.ravel(), COLOURS):
        places = np.array(row["places"])
        places = places - np.median(places, axis=0)
        reach = 1.1 * np.abs(places).max()
        for part, right in passes:
            axis.plot(places[part, 0], places[part, 1], "." if right else "x", ms=4 if right else 5, color=colour)
        axis.set(aspect="equal", xlim=(-reach, reach), ylim=(reach, -reach), xlabel="u (px)", ylabel="v (px)")
        axis.set_title(f"{row['name']}\ntotal {row['total_px']:.2f} px", fontsize=9)
        axis.grid(True, alpha=0.3)
    figure.suptitle("The tag of every frame, carried into one frame (scales differ); dots: the camera turns right, crosses: left")
    figure.tight_layout()
    figure.savefig(output / "tag.png", dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--truth", required=True, type=pathlib.Path, help="folder with truth.yaml and truth.csv")
    parser.add_argument("--live", required=True, help="records of `alidade run`, JSON Lines")
    parser.add_argument("--data-sheet", required=True, help="what run began with, as a calibration file")
    parser.add_argument("--calibration", required=True, help="what run found and stored")
    parser.add_argument("--telemetry", required=True, help="telemetry.csv of the recording made meanwhile")
    parser.add_argument("--tags", required=True, help="what alidade_tag_table wrote")
    parser.add_argument("--dome", required=True, type=pathlib.Path, help="what alidade_reality wrote of the second camera")
    parser.add_argument("--output", required=True, type=pathlib.Path, help="folder for the report")
    parser.add_argument("replay", nargs="*", help="NAME=RECORDS.jsonl:CALIBRATION")
    arguments = parser.parse_args()
    truth, path = Camera(arguments.truth / "truth.yaml"), Path(arguments.truth / "truth.csv")
    live = [record for record in read_records(arguments.live) if record["frame"] is not None]
    events, events_table = switch_over(live)
    if "first calibrated record" not in events:
        print(f"demo_report: {arguments.live}: no calibrated record", file=sys.stderr)
        return 1
    first_s = live[0]["receive_time_s"]
    with_orientation = [record for record in live if record["mode"] != "none"]
    calibrated = [record for record in with_orientation if record["calibrated"]]
    delay_s = calibration_errors.link_delay([record["time_s"] for record in calibrated], path.time.tolist(), truth.clock_offset)

    lead_s = telemetry_lead(arguments.telemetry, path)

    found = Camera(arguments.calibration)
    results = []
    for run in arguments.replay:
        name, _, files = run.partition("=")
        records_file, _, calibration_file = files.partition(":")
        records = [record for record in read_records(records_file) if record["mode"] != "none"]
        results.append(Errors(name, records, Camera(calibration_file), truth, path))
    for name, records, axes in (
            ("live, before", [r for r in with_orientation if not r["calibrated"]], Camera(arguments.data_sheet)),
            ("live, calibrated, PT", [r for r in calibrated if r["mode"] == "PT"], found),
            ("live, calibrated, OE", [r for r in calibrated if r["mode"] == "OE"], found)):
        results.append(Errors(name, records, axes, truth, path))
    results = [result for result in results if len(result.times)]
    tags = json.loads(pathlib.Path(arguments.tags).read_text(encoding="utf-8"))

    # The records whose frames are numbered as the recording's, in which the tag was looked for.
    tags_reference = "OE with rolling shutter"

    arguments.output.mkdir(parents=True, exist_ok=True)
    plot_errors(results, events, first_s, truth, arguments.output)
    plot_angles(with_orientation, events, truth, path, first_s, arguments.output)
    plot_error_over_image(results[-1], truth, arguments.output)
    plot_latency(live, float(np.median(np.diff(path.time))), arguments.output)
    passes = tag_passes(tags, next(result.records for result in results if result.name == tags_reference))
    plot_tags(tags, passes, arguments.output)

    sections = [
        ("From the data sheet to OE mode, by itself",
         "What `alidade run` said of itself, seconds after its first frame. It was given the focal length of the data sheet, and nothing "
         "else of the camera. A line for each change.", events_table, None),
        ("What it found out",
         f"Against the virtual camera. Frames need {1e3 * delay_s:.2f} ms (median) through the sockets, and answers about pan and tilt "
         f"are true {1e3 * lead_s:.2f} ms after the middle of their polls: a calibration finds both as part of the clock offset, and "
         "the truth is shifted by them here. Both wander by some tenths of a millisecond with the load of the machine, and "
         "the sigma of the clock offset knows of the polls alone.",
         parameter_table(arguments, delay_s + lead_s), None),
        ("The tag: Table VI of the PTCEE paper",
         f"A tag 64 px wide is found in {len(tags['frames'])} frames of the recording by the AprilTag library, and its centre carried into frame "
         f"{tags['common_frame']}, by what each row says of the two. `beyond detector`: root of the square of the total less "
         "that of the detector's own noise, which the true orientation of every frame shows. `sigma told`: what the records' own sigmas "
         "let expect. The rows but the live one are replays of a recording of the same streams, with the calibration found last; the live one "
         "has whatever was in force. A frame counts where all rows have it. "
         "The virtual camera repeats its 250 pictures, so that noise is the same each time round. " + tag_clusters(tags, passes),
         tag_table(tags), "tag"),
        ("All directions against the truth",
         f"Error of the direction of {GRID_COLUMNS * GRID_ROWS} pixels a frame. NEES is the normalised squared error of the "
         "orientation at row 0: 1 when the reported sigma is honest, below it when errors are smaller than told. "
         "The bands of the picture say where nine of ten frames should lie by the sigmas that the records tell.",
         error_table(results), "error-over-time"),
        ("Latency", "From the arrival of a frame's last packet to its record, live, by what the calibration thread did meanwhile.",
         latency_table(live), "latency"),
        ("A dome of 300 euros",
         "Another virtual camera, recorded for 12 s: a gear with an error, play and steps in its telemetry, an entrance pupil off the axes "
         "before a scene that is near, a lens of the fifth order with its centre off, a focus that breathes, haze, noise reduction, "
         "sharpening, H.264 (docs/simulator.md). `none` is a camera beside it with nothing of that. Calibrated from the recording, then "
         "replayed in OE mode with what was found. The direction of the picture's middle is compared: errors may be larger, "
         "but they have to be as large as the sigmas say (NEES near 1).",
         dome_tables(json.loads(arguments.dome.read_text(encoding="utf-8"))), None),
    ]
    text = ("# Alidade calibrates itself on its virtual camera\n\n"
            f"The camera: {truth.width}x{truth.height}, f {truth.focal_length:.0f} px, k {truth.radial_distortion:g}, line delay "
            f"{1e6 * truth.line_delay:+.2f} us, clock offset {1e3 * truth.clock_offset:+.1f} ms, axes "
            f"{1e3 * math.acos(truth.pan_axis[2]):.0f} and {1e3 * math.acos(truth.tilt_axis[1]):.0f} mrad off.\n")
    for title, note, body, picture in sections:
        print(f"\n{title}\n{body}")
        text += f"\n## {title}\n{note}\n\n{body}\n" + (f"\n![{picture}]({picture}.png)\n" if picture else "")
    text += "\n## More pictures\n![angles](angles.png)\n\n![error over the image](error-over-image.png)\n"
    (arguments.output / "report.md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
