"""The object that has a frame's targets: what JSON writes, the OpenAPI schema, the table, the ROS message and how the ROS node reads it."""
from fields.common import JSON, ListError, by, description, entries, files_of, flow, known_to_ros, ros_lines, target_reader_source
from fields.targets import READ, UNITS

LIST = "edge_app/tracking/target_list_fields.yaml"
BY = by(LIST)
KEYS = {"name", "type", "unit", "null_if", "enum", "says", "more", "value", "ros"}
TYPES = {"number", "integer", "word", "targets"}
HEADER = "std_msgs/Header"


def fields_of_list():
    fields = []
    for field, where in entries(LIST, KEYS, ("name", "type", "says", "value", "ros"), TYPES, UNITS):
        if field["type"] == "targets" and "null_if" in field:
            raise ListError(f"{where}: targets cannot be null")
        if "as" not in field["ros"] and field["type"] not in READ:
            raise ListError(f"{where}: ros: as is missing, the function of TargetListReader that reads {field['type']}")
        fields.append(field)
    return fields


# ---- C++ of the executable

def cpp(fields):
    calls = [f'line->add_targets("{field["name"]}", {field["value"]}, list.space);' if field["type"] == "targets"
             else f'line->add("{field["name"]}", {field["value"]});' for field in fields]
    out = ["#pragma once", f"// {BY}", "//", "// add_fields(): passes all fields of the object that has a frame's targets, in their order, to a",
           "// line: add(name, value) or add_targets(name, targets, space).", "", '#include "edge_app/tracking/target_values.h"', "",
           "namespace alidade {", "", "template <class Line>", "void add_fields(const TargetList& list, Line* line) {", *calls, "}", "",
           "}  // namespace alidade", ""]
    return "\n".join(out)


# ---- OpenAPI

def schema(field):
    told = flow(description(field))
    if field["type"] == "targets":
        return f'        {field["name"]}: {{type: array, items: {{$ref: "#/components/schemas/Target"}}, description: {told}}}'
    parts = [f"type: {JSON[field['type']]}"] + (["nullable: true"] if "null_if" in field else [])
    if "enum" in field:
        parts.append(f"enum: [{', '.join(flow(word) for word in field['enum'])}]")
    return f"        {field['name']}: {{{', '.join([*parts, f'description: {told}'])}}}"


def openapi(fields):
    lines = ["    Targets:", "      type: object", "      description: The targets of one frame.",
             f"      required: [{', '.join(field['name'] for field in fields)}]", "      properties:"]
    return "\n".join(lines + [schema(field) for field in fields])


# ---- the table

def table(fields):
    rows = ["| field | unit | meaning |", "|---|---|---|"]
    for field in fields:
        text = field["says"] + (f"; `null`: {field['null_if']}" if "null_if" in field else "")
        text += f". {field['more'].rstrip('.')}" if "more" in field else ""
        rows.append(f"| `{field['name']}` | {field.get('unit', '')} | {text} |")
    return "\n".join(rows)


# ---- ROS

def message(fields):
    out = []
    for field in sorted(fields, key=lambda one: one["ros"]["type"] != HEADER):
        ros = field["ros"]
        text = ros.get("says", field["says"]).replace("`", "")
        if ros["type"] == "float64":
            text = (f"{field['unit']}; {text}" if "unit" in field else text) + (f"; NaN: {field['null_if']}" if "null_if" in field else "")
        out += [*ros.get("constants", []), *ros_lines(ros["name"], ros["type"], text)]
    return "\n".join(out)


def ros_source(fields):
    lines = [f'message->{field["ros"]["name"]} = read.{field["ros"].get("as", READ.get(field["type"]))}("{field["name"]}");' for field in fields]
    return target_reader_source(BY, "TargetListReader", "Targets", lines)


# ---- files

def generated(files):
    fields = fields_of_list()
    return files_of(BY, files, {
        "edge_app/tracking/target_list_fields.h": cpp(fields),
        "ros_wrapper/alidade_ros/src/target_list_fields.cpp": ros_source(known_to_ros(fields)),
    }, {
        "edge_app/output/openapi.yaml": openapi(fields),
        "docs/manual/reference/targets.md": table(fields),
        "ros_wrapper/alidade_msgs/msg/Targets.msg": message(known_to_ros(fields)),
    })
