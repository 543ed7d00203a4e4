"""The tables of words and lines that a user meets: words that the program says of itself, with the help of messages.yaml; lines of the
log; findings of `alidade check` (findings.py), which say what helps themselves."""
import re

import yaml

from . import cpp, findings, recordings

LIST = "docs/manual/reference/messages.yaml"
# Group of words: the functions that say them, and their files.
WORDS = {
    "activities of the calibration": ("edge_app/record/published_calibration.cpp", r"to_string\(CalibrationActivity"),
    "needs of the calibration": ("edge_app/record/published_calibration.cpp", r"to_string\(CalibrationNeed",
                                 "core/calibration/calibration_goals.cpp", r"to_string\(HelpfulMotion"),
    "refusals of a calibration": ("core/calibration/calibration_types.cpp", r"to_string\(CalibrationStatus"),
    "localization": ("core/mapping/localization.cpp", r"to_string\(LocalizationStatus"),
    "building a map": ("core/mapping/map_building.cpp", r"to_string\(MapBuild"),
    "fitting a plane": ("core/ground/plane_fit.cpp", r"to_string\(PlaneFit"),
    "places on the ground": ("core/ground/world_plane.cpp", r"to_string\(PlaneStatus"),
    "detections": ("edge_app/tracking/detected_frame.cpp", r"words_of\(DetectionStatus"),
    "boxes": ("edge_app/tracking/detected_frame.cpp", r"words_of\(BoxFault"),
    "verdicts of verify": ("edge_app/verify/verification_words.cpp", r"to_string\(Verdict"),
}
UNTOLD = ("unknown", "")


def body_of(file, head):
    text = cpp.text_of(file)
    match = re.search(head, text)
    if not match:
        raise cpp.ListError(f"{file}: no function {head}; say in WORDS of scripts/reference/messages.py where its words are")
    return text[match.start():text.index("\n}", match.start())]


def words(group):
    files_and_heads = iter(WORDS[group])
    bodies = "".join(body_of(file, head) for file, head in zip(files_and_heads, files_and_heads))
    # `return "words";`, or with a label before them: `return {"label", "words"};`
    said = [cpp.string(one) for one in re.findall(r'return (?:\{"\w+",\s*)?((?:"(?:[^"\\]|\\.)*"\s*)+)\}?;', bodies)]
    return [word for word in dict.fromkeys(said) if not word.startswith(UNTOLD[0]) and word != ""]


def line(text):
    text = re.sub(r"\{[^}]*\}", "…", text)
    return re.sub(r"\s+", " ", text).replace("|", "\\|").strip()


def said(argument):
    """Of a literal, a literal and more, or fmt::format() of one; None for something else."""
    if argument.startswith("fmt::format("):
        argument = cpp.arguments(argument, argument.index("("))[0]
    begin, plus, _ = argument.partition('" +')
    return cpp.string(begin + '"') + "…" if plus else cpp.string(argument)


# What the calibration thread has for the log, and its name there.
OF_CALIBRATION = {"messages_.warn": "calibration: ", "messages_.warn_once": "calibration: "}


def log_lines():
    """The texts of warnings and errors."""
    found = {}
    for path in sorted((cpp.TOP / "edge_app").rglob("*")):
        if path.suffix in (".h", ".cpp"):
            name = path.relative_to(cpp.TOP).as_posix()
            text_of_file = cpp.text_of(name)
            for kind, a in cpp.calls(text_of_file, ("spdlog::warn", "spdlog::error")):
                text = cpp.string(a[0]) if a else None
                if text and re.search(r"[a-z]{3}", re.sub(r"\{[^}]*\}", "", text)):
                    found[line(text)] = kind.rpartition(":")[2]
            for kind, a in cpp.calls(text_of_file, tuple(OF_CALIBRATION)):
                if text := said(a[0]):
                    found[line(OF_CALIBRATION[kind] + text)] = "warn"
    return found


def helps(group, needed):
    listed = yaml.safe_load((cpp.TOP / LIST).read_text(encoding="utf-8")).get(group, {})
    for what, missing in (("lacks", [one for one in needed if one not in listed]), ("has what no code says:", [one for one in listed if one not in needed])):
        if missing:
            raise cpp.ListError(f"{LIST}: {group}: {what} " + "; ".join(map(repr, missing)))
    return {words: recordings.said(text) for words, text in listed.items()}


def tables():
    out = {}
    for group in WORDS:
        needed = words(group)
        listed = helps(group, needed)
        out[group] = "\n".join(["| words | meaning, and what helps |", "|---|---|", *(f"| `{word}` | {listed[word]} |" for word in needed)])
    lines = log_lines()
    listed = helps("lines of the log", lines)
    out["lines of the log"] = "\n".join(["| line | level | meaning, and what helps |", "|---|---|---|",
                                         *(f"| {text} | {kind} | {listed[text]} |" for text, kind in sorted(lines.items()))])
    out["findings of check"] = findings.table()
    return out
