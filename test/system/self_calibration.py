"""`alidade run` from the data sheet to OE mode, followed record by record: what the test and the ten seeds share."""
import csv
import io
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "support"))
import calibration_errors  # pylint: disable=wrong-import-position


class Watch:
    """The records of one process, and the first of each kind that matters."""

    def __init__(self, process):
        self.process = process
        self.records = []  # of frames
        self.first_calibrated = self.first_oe = None
        self.heard = []  # (activity, need), each change of them

    def next(self):
        """The next record of a frame; None at the end of the output."""
        while True:
            line = self.process.line()
            if line is None:
                return None
            record = json.loads(line)
            said = record["calibration"], record["needs"]
            if not self.heard or self.heard[-1] != said:
                self.heard.append(said)
            if record["frame"] is None:
                continue
            self.records.append(record)
            if record["calibrated"] and self.first_calibrated is None:
                self.first_calibrated = record
            if record["calibrated"] and record["mode"] == "OE" and self.first_oe is None:
                self.first_oe = record
            return record

    def since_first_frame(self, record):
        return record["receive_time_s"] - self.records[0]["receive_time_s"]

    def until_oe(self, longest_s):
        """Reads on to the first calibrated record in OE mode; None if the records go on for longer without one."""
        while self.first_oe is None:
            record = self.next()
            if record is None or self.since_first_frame(record) > longest_s:
                return None
        return self.first_oe

    def until_heard(self, activity, longest_s):
        """Reads on until a record tells of this activity; False if the records go on for longer without it."""
        while activity not in (heard for heard, _ in self.heard):
            record = self.next()
            if record is None or self.since_first_frame(record) > longest_s:
                return False
        return True

    def read_for(self, seconds):
        """Reads on for so long, by the records' own times."""
        end_s = self.records[-1]["receive_time_s"] + seconds
        while (record := self.next()) is not None and record["receive_time_s"] < end_s:
            pass


def stored_calibration(file):
    """The file that was stored: a camera that tells its zoom gets one for that zoom, beside the one of that name."""
    found = sorted(file.parent.glob(f"{file.stem}*{file.suffix}")) if file.parent.exists() else []
    return found[0] if found else None


def true_path(truth_dir):
    """time_s, pan, tilt of each frame in truth.csv, whose last row may not be finished."""
    with open(truth_dir / "truth.csv", newline="", encoding="utf-8") as file:
        whole = file.read().rpartition("\n")[0]
    return [(float(r["time_s"]), float(r["pan_rad"]), float(r["tilt_rad"])) for r in csv.DictReader(io.StringIO(whole))]


def comparisons(calibration_file, truth_dir, records, clock_offset_s):
    """Parameters against the truth, with the way through the sockets as these records met it."""
    delay_s = calibration_errors.link_delay([r["time_s"] for r in records if r["time_s"] is not None],
                                            [row[0] for row in true_path(truth_dir)], clock_offset_s)
    return calibration_errors.compare(calibration_file, truth_dir / "truth.yaml", delay_s), delay_s
