"""The tables of which recording serves what: the words of recordings.yaml with the numbers of recording_needs.h."""
import re

import yaml

from . import cpp

LIST = "docs/manual/reference/recordings.yaml"
NUMBERS = "core/model/recording_needs.h"


# Numbers that other files own.
ELSEWHERE = {"kOtherSpeed": "edge_app/verify/verification.cpp"}
NUMBER = r"constexpr \w+ (k\w+) = ([\d.e+-]+);"


def numbers():
    found = {name: float(value) for name, value in re.findall(NUMBER, cpp.text_of(NUMBERS))}
    return found | {name: float(dict(re.findall(NUMBER, cpp.text_of(file)))[name]) for name, file in ELSEWHERE.items()}


def said(text, used=None):
    """With the numbers for {NAME}, {100 NAME}, {NAME / NUMBER} and {NUMBER / NAME}."""
    known = numbers()

    def number(match):
        factor, name, divisor, dividend, below = match.groups()
        name = name or below
        if name not in known:
            raise cpp.ListError(f"{LIST}: {NUMBERS} has no {name}")
        if used is not None:
            used.add(name)
        if dividend:
            return f"{float(dividend) / known[name]:.2g}"
        return f"{round(float(factor or 1) * known[name] / float(divisor or 1), 9):g}"

    return re.sub(r"\{(?:(?:(\d+) )?(k\w+)(?: / ([\d.]+))?|([\d.]+) / (k\w+))\}", number, text)


def tables():
    used = set()

    def table(part):
        rows = [part["columns"], ["---"] * len(part["columns"]), *part["rows"]]
        return "\n".join("| " + " | ".join(said(cell, used) for cell in row) + " |" for row in rows)

    listed = yaml.safe_load((cpp.TOP / LIST).read_text(encoding="utf-8"))
    out = {"recordings": table(listed["recordings"]), "slowly": said(listed["slowly"], used), "how far": said(listed["how_far"], used),
           "limits of a calibration": table(listed["limits"])}
    if missing := sorted(set(numbers()) - used):
        raise cpp.ListError(f"{LIST}: says nothing of " + ", ".join(missing))
    return out
