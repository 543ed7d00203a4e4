"""A calibration.yaml against the virtual camera's truth.yaml, parameter by parameter, in units that people read.

Shares nothing with the program it judges. The clock offset found live holds the way of a frame through the sockets too, which
the virtual camera's own does not: link_delay_s, see link_delay().
"""
import bisect
import dataclasses
import math
import pathlib
import statistics

import yaml


@dataclasses.dataclass
class Comparison:
    name: str
    unit: str
    estimate: float
    sigma: float
    truth: float

    @property
    def error(self):
        return self.estimate - self.truth

    @property
    def sigmas(self):
        """Error in standard deviations, with its sign; None for what is told to be exact."""
        return self.error / self.sigma if self.sigma > 0 else None


def load(path):
    return yaml.safe_load(pathlib.Path(path).read_text(encoding="utf-8"))


def value_of(node):
    return node["value"] if isinstance(node, dict) else node


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    return [x / math.sqrt(dot(a, a)) for x in a]


def tangent_basis(d):
    """The two directions across d in which a file tells an axis' sigma (PTCEE 9)."""
    least = min(range(3), key=lambda i: abs(d[i]))
    first = unit(cross(d, [float(i == least) for i in range(3)]))
    return first, cross(d, first)


def compare(estimate_file, truth_file, link_delay_s=0.0):
    """Comparisons of all parameters that the calibration has a sigma for, scales apart."""
    estimate, truth = load(estimate_file), load(truth_file)
    rows = []
    for name, unit_name, scale in (("focal_length", "px", 1), ("radial_distortion", "1", 1), ("line_delay", "us/row", 1e6),
                                   ("clock_offset", "ms", 1e3)):
        true_value = value_of(truth[name]) - (link_delay_s if name == "clock_offset" else 0)
        rows.append(Comparison(name, unit_name, scale * estimate[name]["value"], scale * estimate[name]["sigma"],
                               scale * true_value))
    for name in ("pan_axis", "tilt_axis"):
        axis, true_axis = estimate[name]["value"], value_of(truth[name])
        for i, across in enumerate(tangent_basis(axis)):
            # Of the axis itself there is nothing across it: its place is the truth's, seen from it.
            rows.append(Comparison(f"{name} {i}", "mrad", 0.0, 1e3 * estimate[name]["sigma"][i],
                                   1e3 * dot(true_axis, across)))
    return rows


def link_delay(stamps_s, capture_times_s, clock_offset_s):
    """Median of how much later frames are stamped than the camera alone would have it: the way through the sockets.

    stamps_s: time_s of records; capture_times_s: time_s of truth.csv, in order. A stamp t belongs to the capture nearest to
    t + clock_offset_s, of the same clock."""
    delays = []
    for stamp in stamps_s:
        time = stamp + clock_offset_s
        i = bisect.bisect_left(capture_times_s, time)
        nearest = min(capture_times_s[max(i - 1, 0):i + 1], key=lambda t: abs(t - time))
        if abs(time - nearest) < 0.5 * (capture_times_s[-1] - capture_times_s[0]) / (len(capture_times_s) - 1):
            delays.append(time - nearest)
    return statistics.median(delays)
