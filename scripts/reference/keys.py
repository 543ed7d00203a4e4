"""The tables of configuration keys: type, unit and range from what reads a key (edge_app/config), default and meaning from keys.yaml."""
import re

import yaml

from . import cpp

LIST = "docs/manual/reference/keys.yaml"
FILES = [f"edge_app/config/{name}.cpp" for name in
         ("config", "video_config", "pan_tilt_config", "head_config", "tracking_config", "detectors_config", "mqtt_config", "link_keys")]
READERS = {"text": "text", "number": "number", "numbers": "numbers", "integer": "whole number", "truth": "true or false", "choice": "word"}
# Whose keys a function reads. A key of several sections is read by a function that they share.
SECTIONS = {
    "read_focal_lengths": ["camera.focal_length_px"], "read_camera": ["camera"], "read_scene": ["scene"], "read_calibration": ["calibration"],
    "read_scene_map": ["scene_map"], "read_realtime": ["realtime"], "read_tokens": ["output"], "read_tls": ["output.tls"], "read_output": ["output"],
    "read_rtsp": ["video"], "read_rtp": ["video"], "read_mjpeg": ["video"], "read_v4l2": ["video"], "read_recording": ["video"],
    "read_live_keys": ["video"], "read_video": ["video"],
    "read_onvif": ["pan_tilt"], "read_range": [], "read_scale": [], "read_pan_tilt_type": ["pan_tilt"], "read_http_device": ["pan_tilt"],
    "read_device": ["pan_tilt"], "read_pan_tilt": ["pan_tilt"], "read_link": ["pan_tilt"], "read_axis": [], "read_axes": ["pan_tilt"],
    "read_pelco_d": ["pan_tilt"], "read_visca": ["pan_tilt"], "read_ptu": ["pan_tilt"], "read_head": ["pan_tilt"],
    "read_space_keys": ["tracking"], "read_space": ["tracking"], "read_tracking": ["tracking"],
    "read_motion": ["detectors.motion"], "read_people": ["detectors.people"], "read_onnx": ["detectors.onnx"],
    "read_sizes": [], "read_detectors": [],
    "read_broker": ["mqtt"], "read_tls_files": ["mqtt"], "read_prefix": ["mqtt"], "read_mqtt": ["mqtt"],
    "read_login": ["video", "pan_tilt", "mqtt"], "read_link_rules": ["video", "pan_tilt"],
    "required_text": [], "required_choice": [], "required_url": [], "read_config": [], "first_line_of": [],
    "read_address": [], "token_of_environment": [],
}


def number(text):
    text = cpp.constants().get(text, text)
    sign = -1 if text.startswith("-") and not re.match(r"-[\d.]", text) else 1
    text = cpp.constants().get(text.lstrip("-"), text) if sign < 0 else text
    return f"{sign * float(text):g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def range_of(argument, body, file):
    """(lowest, highest, unit) of a NumberRange, named or written out."""
    if not argument.startswith("{"):
        name = argument
        for text in (body, cpp.text_of(file), cpp.text_of("edge_app/config/link_keys.h")):
            if named := re.search(rf"NumberRange {name}(?:\{{| =\s*)", text):
                argument = text[named.end() - 1:] if text[named.end() - 1] == "{" else None
                break
        else:
            return None
    low, high, unit = cpp.arguments(argument, 0)
    return number(low), number(high), cpp.string(unit)


# Units that say nothing beside the name of the key.
NO_UNITS = {"1", "SCHED_FIFO priority", "processor number", "camera number", "address", "quality of service", "frames", "targets", "boxes a frame",
            "baud"}


def unit_of(text):
    return "" if text in NO_UNITS else "the device's" if "device" in text else text


def cells(kind, arguments, body, file):
    """(type, unit, range) of one key's reader."""
    if kind in ("number", "integer"):
        found = range_of(arguments[1], body, file)
        return (READERS[kind], *(("", "") if found is None else (unit_of(found[2]), f"{found[0]} to {found[1]}")))
    if kind == "numbers":
        low, high, unit = range_of(arguments[2], body, file)
        return f"list of {arguments[1]} numbers", unit_of(unit), f"{low} to {high}"
    if kind == "choice":
        words = re.findall(cpp.STRING, arguments[1])
        return "word", "", " ".join(f"`{word}`" for word in words)
    return READERS[kind], "", ""


def add(found, which, new):
    """A word that two types read may have the words of both."""
    if which in found and new[0] == "word":
        words = dict.fromkeys((found[which][2] + " " + new[2]).split())
        new = (*new[:2], " ".join(words))
    elif which in found:
        return
    found[which] = new


def read_by_code():
    """{(section, key): (type, unit, range)}"""
    found = {}
    for file in FILES:
        for name, body in cpp.functions(file):
            uses = [*cpp.calls(body, READERS), *((kind, [a[1], *a[2:]]) for kind, a in cpp.calls(body, ("required_text",)) if len(a) > 1)]
            uses = [("text" if kind == "required_text" else kind, a) for kind, a in uses if a]
            sections = SECTIONS.get(name)
            if sections is None:
                if any(cpp.string(a[0]) for _, a in uses):
                    raise cpp.ListError(f"{file}: {name}() reads keys; say whose in SECTIONS of scripts/reference/keys.py")
                continue
            if list(cpp.calls(body, ("required_url",))):
                for section in sections:
                    found.setdefault((section, "url"), ("text", "", ""))
            for kind, a in uses:
                key = cpp.string(a[0])
                if key and re.fullmatch(r"\w+", key):
                    for section in sections:
                        add(found, (section, key), cells(kind, a, body, file))
    types = {"video": re.findall(r'\{VideoConfig::Type::k\w+, "(\w+)"', cpp.text_of("edge_app/config/video_config.cpp")),
             "pan_tilt": [*re.findall(r'\{"(\w+)", Type::k\w+', cpp.text_of("edge_app/config/pan_tilt_config.cpp")),
                          *re.findall(r'\{HeadType::k\w+, "(\w+)"', cpp.text_of("platform/pan_tilt/heads.h"))]}
    body = dict(cpp.functions("edge_app/config/config.cpp"))["read_focal_lengths"]
    for key in re.findall(r'\bend\("(\w+)"\)', body):
        found[("camera.focal_length_px", key)] = cells("number", [key, "kFocalLengths"], body, "edge_app/config/config.cpp")
    for section, words in types.items():
        found[(section, "type")] = ("word", "", " ".join(f"`{word}`" for word in words))
    for file in FILES:
        for name, body in cpp.functions(file):
            for _, a in cpp.calls(body, ("read_sizes",)):  # two keys, of one range
                if len(a) > 3 and cpp.string(a[1]):
                    for key in a[1:3]:
                        found[(SECTIONS[name][0], cpp.string(key))] = cells("number", [key, a[3]], body, file)
            for kind, a in cpp.calls(body, ("read_range", "read_scale")):
                if cpp.string(a[1]):
                    found[("pan_tilt", cpp.string(a[1]))] = of_helper("edge_app/config/pan_tilt_config.cpp", kind, "numbers")
            for _, a in cpp.calls(body, ("read_axis",)):  # axis, the two ways in which it may count
                if cpp.string(a[1]):
                    axis = cpp.string(a[1])
                    found[("pan_tilt", f"{axis}_positive")] = ("word", "", " ".join(f"`{cpp.string(way)}`" for way in a[2:4]))
                    found[("pan_tilt", f"{axis}_zero_deg")] = of_helper("edge_app/config/head_config.cpp", "read_axis", "number")
    files = dict(cpp.functions("edge_app/config/mqtt_config.cpp"))["read_tls_files"]
    for key in re.findall(r'\{(?:std::pair\{)?"(\w+)", &mqtt', files):
        found[("mqtt", key)] = ("text", "", "")
    text = cpp.text_of("edge_app/config/tracking_config.cpp")
    spaces = [re.findall(cpp.STRING, keys) for keys in re.findall(r"SpaceKeys k\w+\{(.*?)\};", text, re.DOTALL)]
    ranges = [cpp.arguments(one, 0) for one in re.findall(r"NumberRange(\{[^}]*\})", text)]
    for i, keys in enumerate(spaces):  # a range for the plane stands before that for the sphere
        for j, key in enumerate(keys):
            low, high, unit = ranges[2 * j + i]
            found[("tracking", key)] = ("number", unit_of(cpp.string(unit)), f"{number(low)} to {number(high)}")
    return found


def defaults():
    """{(section, key): values} of `.value_or(...)` behind what reads a key: a literal, or what a member of that name begins with."""
    found = {}
    for file in FILES:
        for name, body in cpp.functions(file):
            for reader in re.finditer(rf"\b({'|'.join(READERS)})\(", body):
                arguments = cpp.arguments(body, reader.end() - 1)
                if not arguments or not (key := cpp.string(arguments[0])):
                    continue
                rest = after_call(body, reader.end() - 1)
                if not (given := re.match(r"\s*\.value_or\(", rest)):
                    continue
                default = cpp.arguments(rest, given.end() - 1)[0]
                literal = re.fullmatch(r'"(.*)"|(-?[\d.]+(?:e-?\d+)?|true|false)', default)
                values = {literal[1] or literal[2]} if literal else cpp.member_values().get(re.sub(r"^.*\W", "", default), set())
                for section in SECTIONS.get(name) or []:
                    found.setdefault((section, key), set()).update(values)
    return found


def after_call(text, begin):
    """What follows the call whose bracket opens at `begin`."""
    depth, place = 0, begin
    while True:
        string = re.match(cpp.STRING, text[place:])
        depth += 0 if string else (text[place] in "([{") - (text[place] in ")]}")
        place += len(string[0]) if string else 1
        if depth == 0:
            return text[place:]


def of_helper(file, name, kind):
    """The cells of the one reader in a function that takes the key's name from its caller."""
    body = dict(cpp.functions(file))[name]
    reader = next(a for _, a in cpp.calls(body, (kind,)))
    return cells(kind, reader, body, file)


def said():
    """{(section, key): (default, types that have it, meaning)} of the list."""
    listed = yaml.safe_load((cpp.TOP / LIST).read_text(encoding="utf-8"))
    out = {}
    for section, keys in listed.items():
        for key, line in keys.items():
            parts = [part.strip() for part in line.split("|")]
            if len(parts) != 3:
                raise cpp.ListError(f"{LIST}: {section}.{key}: expected DEFAULT | TYPES | MEANING")
            out[(section, key)] = parts
    return out


def tables():
    """{section: table}"""
    code, listed = read_by_code(), said()
    for what, missing in ((f"{LIST} lacks", sorted(set(code) - set(listed))), (f"no code reads, but {LIST} has", sorted(set(listed) - set(code)))):
        if missing:
            raise cpp.ListError(f"{what} " + ", ".join(map(".".join, missing)))
    out = {}
    for (section, key), (default, types, meaning) in listed.items():
        kind, unit, span = code[(section, key)]
        meaning = meaning + (f" Only {types}." if types else "")
        default = f"`{default}`" if default not in ("required", "none") and " " not in default else default
        out.setdefault(section, ["| key | type | unit | range | default | meaning |", "|---|---|---|---|---|---|"]).append(
            f"| `{key}` | {kind} | {unit} | {span} | {default} | {meaning} |".replace("|  |", "| |").replace("|  |", "| |"))
    return {section: "\n".join(rows) for section, rows in out.items()}
