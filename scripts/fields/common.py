"""What both lists share: reading them, OpenAPI, comments of ROS messages, files of which a part is generated."""
import pathlib
import re
import subprocess
import textwrap

import yaml

TOP = pathlib.Path(__file__).resolve().parents[2]
JSON = {"number": "number", "integer": "integer", "boolean": "boolean", "word": "string"}


class ListError(Exception):
    pass


def by(file):
    return f"Generated from {file} by scripts/generate-fields: change the list instead."


def entries(file, known, needed, types):
    """The fields of a list, each with a place for messages."""
    seen = set()
    for field in yaml.safe_load((TOP / file).read_text(encoding="utf-8")):
        name = field.get("name", "?")
        where = f"{file}: {name}"
        for key in field:
            if key not in known:
                raise ListError(f"{where}: {key} is unknown; known are {', '.join(sorted(known))}")
        for key in needed:
            if key not in field:
                raise ListError(f"{where}: {key} is missing")
        if field["type"] not in types:
            raise ListError(f"{where}: type is {field['type']}; it may be {', '.join(sorted(types))}")
        if name in seen:
            raise ListError(f"{where} stands there twice")
        seen.add(name)
        if field["type"] == "object" and not field.get("members"):
            raise ListError(f"{where}: an object has members")
        yield field, where


def sentence(text):
    return text[0].upper() + text[1:]


def flow(value):
    """A word as YAML's flow style has it, quoted where it must be."""
    text = str(value)
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"' if isinstance(value, str) and re.search(r"[^\w ./()-]|^(off|on|no|yes)$", text) \
        else text


def description(field):
    parts = [field["says"]]
    if "null_if" in field:
        parts.append(f"null: {field['null_if']}")
    text = "; ".join(parts).replace("`", "")
    unit = field.get("unit")
    if unit and not unit.startswith("the"):
        text = f"{unit}; {text}"
    return text + (". " + field["more"].replace("`", "") if "more" in field else "")


def bounds(field):
    return [f"{key}: {field[key]}" for key in ("minimum", "maximum") if key in field]


def ros_lines(name, type_, text):
    """A line of a message: what it is in comments behind it, wrapped."""
    head = f"{type_} {name}"
    pad = max(29, len(head) + 1)
    lines = textwrap.wrap(text, 128 - pad) or [""]
    return [(f"{head:<{pad - 1}} # {lines[0]}").rstrip()] + [" " * pad + "# " + line for line in lines[1:]]


def text_of(path, files):
    """files: those that are generated already, by path."""
    if path not in files:
        return (TOP / path).read_text(encoding="utf-8") if (TOP / path).is_file() else ""
    return files[path]


def between(path, files, begin, end, text):
    """The file with what stands between two lines replaced."""
    lines = text_of(path, files).split("\n")
    try:
        first = next(i for i, line in enumerate(lines) if line.strip() == begin)
        last = next(i for i in range(first, len(lines)) if lines[i].strip() == end)
    except StopIteration:
        raise ListError(f"{path}: should have a line '{begin}' and behind it '{end}'") from None
    return "\n".join(lines[:first + 1] + [text] + lines[last:])


def clang_formatted(path, text):
    return subprocess.run(["clang-format", f"--assume-filename={TOP / path}"], input=text, capture_output=True, text=True, check=True).stdout
