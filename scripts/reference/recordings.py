"""The tables of which recording serves what: the words of recordings.yaml with the numbers of recording_needs.h."""
import re

import yaml

from . import cpp

LIST = "docs/manual/reference/recordings.yaml"
NUMBERS = "core/model/recording_needs.h"


def numbers():
    return {name: float(value) for name, value in re.findall(r"constexpr \w+ (k\w+) = ([\d.e+-]+);", cpp.text_of(NUMBERS))}


def tables():
    known, used = numbers(), set()

    def number(match):
        factor, name, divisor = match.groups()
        if name not in known:
            raise cpp.ListError(f"{LIST}: {NUMBERS} has no {name}")
        used.add(name)
        return f"{round(float(factor or 1) * known[name] / float(divisor or 1), 9):g}"

    def said(text):
        return re.sub(r"\{(?:(\d+) )?(k\w+)(?: / ([\d.]+))?\}", number, text)

    def table(part):
        rows = [part["columns"], ["---"] * len(part["columns"]), *part["rows"]]
        return "\n".join("| " + " | ".join(said(cell) for cell in row) + " |" for row in rows)

    listed = yaml.safe_load((cpp.TOP / LIST).read_text(encoding="utf-8"))
    out = {"recordings": table(listed["recordings"]), "slowly": said(listed["slowly"]), "limits of a calibration": table(listed["limits"])}
    if missing := sorted(set(known) - used):
        raise cpp.ListError(f"{LIST}: says nothing of " + ", ".join(missing))
    return out
