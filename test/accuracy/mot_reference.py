#!/usr/bin/env python3
"""What PyPI's motmetrics says of tracks, beside alidade_mot. HOTA, which motmetrics has not, is written down here once more with numpy.

    mot_reference.py                    writes mot_reference/: small sequences and expected.json
    mot_reference.py --check PROGRAM    compares PROGRAM (alidade_mot) on 40 sequences; exit 0: equal, 1: not, 77: motmetrics is not installed
Needs `pip install motmetrics` (1.4.0 made the table).
"""
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

try:
    import motmetrics
    import numpy as np
    from scipy.optimize import linear_sum_assignment
except ImportError:
    print("motmetrics is not installed")
    sys.exit(77)

# numpy 2 has dropped what motmetrics 1.4 calls.
if not hasattr(np, "asfarray"):
    np.asfarray = lambda values: np.asarray(values, dtype=float)

FOLDER = pathlib.Path(__file__).with_suffix("")
NAMES = ["num_frames", "num_objects", "num_predictions", "num_unique_objects", "num_matches", "num_misses",
         "num_false_positives", "num_switches", "num_fragmentations", "num_transfer", "num_ascend", "num_migrate",
         "mostly_tracked", "partially_tracked", "mostly_lost", "mota", "motp", "precision", "recall", "idf1", "idp", "idr"]


def random_boxes(dice, frames, objects, chance):
    """Boxes anywhere: hardly anything fits twice."""
    return [(k, i, dice.uniform(0, 60), dice.uniform(0, 60), dice.uniform(20, 40), dice.uniform(20, 40))
            for k in range(1, frames + 1) for i in range(1, objects + 1) if dice.random() < chance]


def tracked(dice, frames, objects):
    """People who walk past each other, and a tracker that misses some, is off by pixels, mixes them up, and sees ghosts."""
    truth, result = [], []
    walkers = [[dice.uniform(0, 600), dice.uniform(0, 200), dice.gauss(0, 6), dice.gauss(0, 2), dice.randint(1, frames // 2)]
               for _ in range(objects)]
    names = list(range(1, objects + 1))
    missing = [0] * objects
    for k in range(1, frames + 1):
        if objects > 1 and dice.random() < 0.05:
            a, b = dice.sample(range(objects), 2)
            names[a], names[b] = names[b], names[a]
        for i, (x, y, vx, vy, start) in enumerate(walkers):
            if not start <= k < start + frames * 3 // 4:
                continue
            box = [x + vx * k, y + vy * k, 30, 75]
            truth.append((k, i + 1, *box))
            missing[i] = dice.randint(2, 8) if dice.random() < 0.03 else max(missing[i] - 1, 0)
            if missing[i] == 1:
                names[i] = max(names) + 1 if dice.random() < 0.5 else names[i]
            if missing[i] == 0:
                result.append((k, names[i], *(c + dice.gauss(0, 3) for c in box)))
        if dice.random() < 0.1:
            result.append((k, 1000 + k, dice.uniform(0, 600), dice.uniform(0, 200), 30, 75))
    return truth, result


def sequence(seed, frames):
    dice = random.Random(seed)
    if seed % 2 == 0:
        return random_boxes(dice, frames, 4, 0.7), random_boxes(dice, frames, 5, 0.6)
    return tracked(dice, frames, 1 + seed % 9)


def write(path, boxes, truth):
    lines = [",".join([f"{b[0]}", f"{b[1]}", *(f"{c:.3f}" for c in b[2:]), "1", "1", "1"]) for b in boxes]
    if truth:  # what does not count
        lines.insert(1, "1,999,0,0,50,50,0,1,1")
    path.write_text("\n".join(lines) + "\n")


def iou(a, b):
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(width, 0) * max(height, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)


def hota(truth, result):
    """Luiten et al. 2020, with the matching of TrackEval."""
    frames = []
    for k in sorted(set(truth.index.get_level_values(0)) | set(result.index.get_level_values(0))):
        def boxes(table):
            return {i: row for (f, i), row in zip(table.index, table[["X", "Y", "Width", "Height"]].values) if f == k}
        objects, tracks = boxes(truth), boxes(result)
        frames.append((list(objects), list(tracks),
                       np.array([[iou(a, b) for b in tracks.values()] for a in objects.values()]).reshape(len(objects), len(tracks))))
    of_object, of_track, potential = {}, {}, {}
    for objects, tracks, similar in frames:
        for o in objects:
            of_object[o] = of_object.get(o, 0) + 1
        for t in tracks:
            of_track[t] = of_track.get(t, 0) + 1
        for i, o in enumerate(objects):
            for j, t in enumerate(tracks):
                if similar[i, j] > 0:
                    share = similar[i, j] / (similar[i].sum() + similar[:, j].sum() - similar[i, j])
                    potential[o, t] = potential.get((o, t), 0) + share
    scores = {"hota": [], "deta": [], "assa": [], "loca": []}
    for step in range(1, 20):
        matches, located = {}, []
        for objects, tracks, similar in frames:
            score = np.array([[potential.get((o, t), 0) / (of_object[o] + of_track[t] - potential.get((o, t), 0)) * similar[i, j]
                               for j, t in enumerate(tracks)] for i, o in enumerate(objects)]).reshape(similar.shape)
            for i, j in zip(*linear_sum_assignment(-score)):
                if similar[i, j] >= 0.05 * step - np.finfo(float).eps:
                    matches[objects[i], tracks[j]] = matches.get((objects[i], tracks[j]), 0) + 1
                    located.append(similar[i, j])
        tp = len(located)
        deta = tp / max(sum(of_object.values()) + sum(of_track.values()) - tp, 1)
        assa = sum(n * n / (of_object[o] + of_track[t] - n) for (o, t), n in matches.items()) / max(tp, 1)
        for name, value in (("hota", math.sqrt(deta * assa)), ("deta", deta), ("assa", assa), ("loca", np.mean(located) if tp else 1)):
            scores[name].append(value)
    return {name: float(np.mean(values)) for name, values in scores.items()}


def expected(truth_path, result_path):
    truth = motmetrics.io.load_motchallenge(truth_path, min_confidence=1)
    result = motmetrics.io.load_motchallenge(result_path)
    accumulator = motmetrics.utils.compare_to_groundtruth(truth, result, "iou", distth=0.5)
    row = motmetrics.metrics.create().compute(accumulator, metrics=NAMES).iloc[0]
    values = {name: float(row[name]) for name in NAMES}
    values["faf"] = values["num_false_positives"] / values["num_frames"]
    return {**values, **hota(truth, result)}


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--check":
        wrong = 0
        with tempfile.TemporaryDirectory() as folder:
            truth, result = pathlib.Path(folder, "truth.txt"), pathlib.Path(folder, "result.txt")
            for seed in range(100, 140):
                boxes = sequence(seed, 120)
                write(truth, boxes[0], True)
                write(result, boxes[1], False)
                answer = json.loads(subprocess.run([sys.argv[2], truth, result, "--json"], check=True, capture_output=True).stdout)
                for name, value in expected(truth, result).items():
                    if not math.isclose(answer[name], value, rel_tol=1e-9, abs_tol=1e-9):
                        print(f"seed {seed}: {name} is {answer[name]}, motmetrics has {value}")
                        wrong += 1
        print("equal on 40 sequences" if wrong == 0 else f"{wrong} differ")
        return 0 if wrong == 0 else 1
    FOLDER.mkdir(exist_ok=True)
    table = {}
    for seed in range(1, 7):
        truth, result = FOLDER / f"{seed}.truth.txt", FOLDER / f"{seed}.result.txt"
        boxes = sequence(seed, 40)
        write(truth, boxes[0], True)
        write(result, boxes[1], False)
        table[str(seed)] = expected(truth, result)
    (FOLDER / "expected.json").write_text(json.dumps(table, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
