"""Targets: what JSON writes, the OpenAPI schema, the table, the ROS message and how the ROS node reads it."""
import textwrap

from fields.common import (JSON, ListError, bounds, by, description, entries, files_of, flow, known_to_ros, members_text, properties, ros_lines,
                           target_reader_source)

LIST = "edge_app/tracking/target_fields.yaml"
BY = by(LIST)
KEYS = {"name", "type", "unit", "space", "null_if", "left_out_if", "says", "more", "value", "minimum", "maximum", "size", "members", "ros"}
TYPES = {"number", "integer", "word", "vector", "matrix", "object"}
UNITS = ("s", "m", "m/s", "px", "px^2", "rad", "rad/s", "deg")  # degrees: latitude and longitude
SPACES = ("plane", "sphere")
READ = {"number": "number", "integer": "integer", "word": "word"}


def fields_of_list():
    fields = []
    for field, where in entries(LIST, KEYS, ("name", "type", "says", "value", "ros"), TYPES, UNITS):
        if field["type"] in ("vector", "matrix") and "size" not in field:
            raise ListError(f"{where}: a {field['type']} has a size")
        if field.get("space", "plane") not in SPACES:
            raise ListError(f"{where}: space is {field['space']}; it may be plane or sphere")
        if "left_out_if" in field and field["type"] != "number":
            raise ListError(f"{where}: only a number may be left out")
        ros = field["ros"]
        if "as" not in ros and field["type"] not in READ:
            raise ListError(f"{where}: ros: as is missing, the function of TargetReader that reads a {field['type']}")
        if field["type"] == "integer" and {"null_if", "space"} & field.keys() and ros.get("as") != "none":
            raise ListError(f"{where}: a ROS message cannot say that an integer is missing")
        fields.append(field)
    return fields


# ---- C++ of the executable

def cpp(fields):
    out = ["#pragma once", f"// {BY}", "//",
           "// add_fields(): passes all fields that a target of this space has, in their order, to a line:",
           "// add(name, value), add_if(name, value), which is left out without a value, or",
           "// add_object(name, keys, values).", "", "#include <array>", "#include <optional>", "",
           '#include "edge_app/tracking/target_values.h"', "", "namespace alidade {", ""]
    calls = []
    for field in fields:
        name, value = field["name"], field["value"]
        lines = [f'line->{"add_if" if "left_out_if" in field else "add"}("{name}", {value});']
        if field["type"] == "object":
            members = field["members"]
            keys = ", ".join(f'"{member["name"]}"' for member in members)
            values = ", ".join(member["value"] for member in members)
            out += [f"inline constexpr TargetKeys<{len(members)}> k_target_{name} = {{{keys}}};", ""]
            lines = [f"std::optional<std::array<double, {len(members)}>> {name};", f"if ({value}) {name} = {{{{{values}}}}};",
                     f'line->add_object("{name}", k_target_{name}, {name});']
        if "space" in field:
            condition = "on_plane" if field["space"] == "plane" else "!on_plane"
            lines = [f"if ({condition}) {{", *lines, "}"] if len(lines) > 1 else [f"if ({condition}) {lines[0]}"]
        calls += lines
    out += ["template <class Line>", "void add_fields(const TargetReport& target, TargetSpace space, Line* line) {",
            "const bool on_plane = space == TargetSpace::kPlane;", *calls, "}", "", "}  // namespace alidade", ""]
    return "\n".join(out)


# ---- OpenAPI

def schema(field):
    nullable = ["nullable: true"] if "null_if" in field else []
    if field["type"] in ("vector", "matrix"):
        size = f"minItems: {field['size']}, maxItems: {field['size']}"
        items = "{type: number}" if field["type"] == "vector" else f"{{type: array, {size}, items: {{type: number}}}}"
        parts = ["type: array", *nullable, size, f"items: {items}"]
    elif field["type"] == "object":
        parts = ["type: object", *nullable, f"required: [{', '.join(member['name'] for member in field['members'])}]"]
    else:
        parts = [f"type: {JSON[field['type']]}", *nullable, *bounds(field)]
    told = dict(field)
    if "left_out_if" in field:
        told["says"] = f"{field['says']}; left out: {field['left_out_if']}"
    parts.append(f"description: {flow(description(told))}")
    if field["type"] == "object":
        parts.append(properties(field))
    return f"        {field['name']}: {{{', '.join(parts)}}}"


def openapi(fields):
    def required(space):
        return ", ".join(field["name"] for field in fields if field.get("space") == space and "left_out_if" not in field)
    always = "\n        ".join(textwrap.wrap(required(None), 120))
    lines = ["    Target:", "      type: object",
             "      description: A tracked target. Its place and rates are on the plane, or angles on the sphere.",
             f"      required: [{always}]", "      oneOf:", *(f"        - required: [{required(space)}]" for space in SPACES), "      properties:"]
    return "\n".join(lines + [schema(field) for field in fields])


# ---- the table

def table(fields):
    rows = ["| field | unit | meaning |", "|---|---|---|"]
    for field in fields:
        parts = [field["says"]]
        if "space" in field:
            parts.append(f"only on the {field['space']}")
        if "left_out_if" in field:
            parts.append(f"left out: {field['left_out_if']}")
        if "null_if" in field:
            parts.append(f"`null`: {field['null_if']}")
        extra = [field["more"].rstrip(".")] if "more" in field else []
        if field["type"] == "object":
            extra.append(members_text(field))
        if field["type"] == "matrix":
            extra.append(f"{field['size']} rows of {field['size']}")
        rows.append(f"| `{field['name']}` | {field.get('unit', '')} | {'. '.join(['; '.join(parts)] + extra)} |")
    return "\n".join(rows)


# ---- ROS

def message(fields):
    out = []
    for field in fields:
        ros = field["ros"]
        if "heading" in ros:
            out += ["", ros["heading"]]
        if "has" in ros:
            out += ["", *ros_lines(ros["has"], "bool", ros["has_says"])]
        text = ros.get("says", f"{field['says']}. {field['more'].rstrip('.')}" if "more" in field else field["says"])
        if ros["type"] == "float64" or ros["type"].startswith("geometry_msgs"):
            text = f"{field['unit']}; {text}" if "unit" in field else text
        missing = field.get("null_if", field.get("left_out_if"))
        if missing:
            text += f"; {'empty' if field['type'] == 'word' else 'NaN'}: {missing}"
        out += ros_lines(ros["name"], ros["type"], text)
    return "\n".join(out)


def ros_source(fields):
    lines = []
    for field in fields:
        ros = field["ros"]
        kind = ros.get("as", READ.get(field["type"]))
        if "as" not in ros and field["type"] == "number" and {"null_if", "left_out_if", "space"} & field.keys():
            kind = "number_or_nan"
        if "has" in ros:
            lines += [f"message->{ros['has']} = read.{ros['has']}();"]
        lines += [f'message->{ros["name"]} = read.{kind}("{field["name"]}");']
    return target_reader_source(BY, "TargetReader", "Target", lines)


# ---- files

def generated(files):
    fields = fields_of_list()
    return files_of(BY, files, {
        "edge_app/tracking/target_fields.h": cpp(fields),
        "ros_wrapper/alidade_ros/src/target_fields.cpp": ros_source(known_to_ros(fields)),
    }, {
        "edge_app/output/openapi.yaml": openapi(fields),
        "docs/manual/reference/targets.md": table(fields),
        "ros_wrapper/alidade_msgs/msg/Target.msg": message(known_to_ros(fields)),
    })
