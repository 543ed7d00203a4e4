#!/usr/bin/env python3
"""Weights of Stone Soup's JPDA on fixed scenes, as the table that the test of core/tracking compares with.

    stone_soup_weights.py            writes stone_soup_weights.h beside this file
    stone_soup_weights.py --check    exit 0: Stone Soup still gives the table's numbers, 1: it does not, 77: it is not installed
Needs `pip install stonesoup` (1.9.1 made the table).
"""
import datetime
import pathlib
import random
import re
import sys

try:
    import numpy as np
    from stonesoup.dataassociator.probability import JPDA
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.updater.kalman import KalmanUpdater
except ImportError:
    print("stonesoup is not installed")
    sys.exit(77)

TABLE = pathlib.Path(__file__).with_suffix(".h")
TARGETS, DETECTIONS = 5, 5  # most of a scene
DT, Q, SIGMA, DETECTED, GATE, CLUTTER = 0.2, 0.5, 0.3, 0.9, 0.999, 0.05


def scene(seed):
    """Targets (mean, variances of place and velocity) and detections in a few square metres."""
    dice = random.Random(seed)
    extent = dice.choice([1.0, 2.0, 6.0])
    targets = [[round(dice.uniform(0, extent), 3), round(dice.uniform(0, extent), 3), round(dice.gauss(0, 1), 3),
                round(dice.gauss(0, 1), 3), round(dice.uniform(0.02, 0.3), 3), round(dice.uniform(0.1, 1), 3)]
               for _ in range(dice.randint(1, TARGETS))]
    detections = [[round(dice.uniform(0, extent), 3), round(dice.uniform(0, extent), 3)]
                  for _ in range(dice.randint(1, DETECTIONS))]
    return targets, detections


def weights(targets, detections):
    start = datetime.datetime(2020, 1, 1)
    now = start + datetime.timedelta(seconds=DT)
    measured = LinearGaussian(4, (0, 2), np.eye(2) * SIGMA**2)
    tracks = [Track([GaussianState([[x], [vx], [y], [vy]], np.diag([p, v, p, v]), timestamp=start)])
              for x, y, vx, vy, p, v in targets]
    found = [Detection(np.array([[x], [y]]), timestamp=now, measurement_model=measured) for x, y in detections]
    model = CombinedLinearGaussianTransitionModel([ConstantVelocity(Q), ConstantVelocity(Q)])
    hypothesiser = PDAHypothesiser(KalmanPredictor(model), KalmanUpdater(measured), clutter_spatial_density=CLUTTER,
                                   prob_detect=DETECTED, prob_gate=GATE)
    answer = JPDA(hypothesiser).associate(tracks, set(found), now)
    table = [[0.0] * len(found) for _ in tracks]
    for row, track in enumerate(tracks):
        for hypothesis in answer[track]:
            if hypothesis.measurement:
                column = next(i for i, d in enumerate(found) if d is hypothesis.measurement)
                table[row][column] += float(hypothesis.probability)
    return table


def cells(rows, width, count):
    padded = [list(row) + [0.0] * (width - len(row)) for row in rows] + [[0.0] * width] * (count - len(rows))
    return "{" + ", ".join("{" + ", ".join(f"{value:.12g}" for value in row) + "}" for row in padded) + "}"


def text():
    lines = []
    for seed in range(24):
        targets, detections = scene(seed)
        lines.append("    {%d, %d,\n     {%s},\n     {%s},\n     {%s}}," % (
            len(targets), len(detections), cells(targets, 6, TARGETS), cells(detections, 2, DETECTIONS),
            cells(weights(targets, detections), DETECTIONS, TARGETS)))
    return f"""#pragma once
// What Stone Soup's JPDA gives on fixed scenes; made by stone_soup_weights.py.
// Targets: x, y, x', y' (m, m/s), variance of place and of velocity; after {DT} s with acceleration density {Q}, places measured
// with sigma {SIGMA}; detected with {DETECTED}, gate {GATE}, false alarms {CLUTTER} per square metre.

#include <array>

namespace alidade::test {{

inline constexpr double kSceneDt = {DT}, kSceneAcceleration = {Q}, kSceneSigma = {SIGMA};
inline constexpr double kSceneDetected = {DETECTED}, kSceneGate = {GATE}, kSceneClutter = {CLUTTER};

struct StoneSoupScene {{
  int targets;
  int detections;
  std::array<std::array<double, 6>, {TARGETS}> target;
  std::array<std::array<double, 2>, {DETECTIONS}> detection;
  std::array<std::array<double, {DETECTIONS}>, {TARGETS}> weight;
}};

// clang-format off
inline constexpr StoneSoupScene kStoneSoupScenes[] = {{
{chr(10).join(lines)}
}};
// clang-format on

}}  // namespace alidade::test
"""


def main():
    if sys.argv[1:] == ["--check"]:
        numbers = [[float(n) for n in re.findall(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?", t)] for t in (text(), TABLE.read_text())]
        same = len(numbers[0]) == len(numbers[1]) and np.allclose(numbers[0], numbers[1], rtol=0, atol=1e-9)
        print("Stone Soup gives the table's numbers" if same else "Stone Soup gives other numbers than the table")
        return 0 if same else 1
    TABLE.write_text(text())
    return 0


if __name__ == "__main__":
    sys.exit(main())
