"""Records: what JSON and CSV write, the OpenAPI schema, the table, the ROS message, its parser and how it is filled."""
import re
import textwrap

from fields.common import (JSON, ListError, bounds, by, description, entries, files_of, flow, known_to_ros, members_text, properties, ros_lines,
                           sentence)

LIST = "edge_app/record/record_fields.yaml"
BY = by(LIST)
KEYS = {"name", "type", "unit", "null_if", "says", "more", "value", "of", "enum", "minimum", "maximum", "absent", "start", "ros", "columns", "members"}
TYPES = {"number", "integer", "boolean", "word", "array", "object"}
# Those of CONVENTIONS.md, and how a name ends: a time in ms or an angle in degrees would be the only one of a record.
UNITS = {"s": "_s", "s/row": "_s", "1/s": "_per_s", "px": ("_px", "_row"), "rad": "_rad", "rad^2": "_rad2", "rad/s": "_rad_s",
         "rad/s^2": "_rad_s2", "grey levels": "_grey"}
CPP = {"number": "double", "integer": "std::int64_t", "boolean": "bool", "word": "std::string"}


def fields_of_list():
    fields = []
    for field, where in entries(LIST, KEYS, ("name", "type", "says", "value", "ros"), TYPES, UNITS):
        for one in (field, *field.get("members", ())):
            ending = UNITS.get(one.get("unit"), "")
            if not one["name"].endswith(ending):
                raise ListError(f"{where}: {one['name']} is in {one['unit']}, so its name ends in {ending if isinstance(ending, str) else ending[0]}")
        if field["type"] == "array" and not field.get("columns"):
            raise ListError(f"{where}: an array has columns")
        # In a ROS message only a float64 and a string can say that there is no value.
        if "null_if" in field and field["type"] == "integer" and field["ros"].get("as") not in ("presence", "none"):
            raise ListError(f"{where}: an integer that may be null has ros: as: presence")
        if "null_if" in field and field["type"] in ("boolean", "array"):
            raise ListError(f"{where}: a field of type {field['type']} cannot be null by itself; see the others")
        fields.append(field)
    return fields


def may_lack(field):
    return "null_if" in field or "of" in field


# ---- C++ of the executable

def cpp(fields):
    out = ["#pragma once", f"// {BY}", "//", "// add_fields(): passes all fields of a record, in their order, to a line: add(name, value),",
           "// add(name, columns, values) or add_object(name, keys, values).", "", "#include <array>", "#include <cmath>", "#include <cstdint>",
           "#include <optional>", "#include <string_view>", "#include <type_traits>", "#include <utility>", "",
           '#include "edge_app/record/record_values.h"', "", "namespace alidade {", ""]
    calls = []
    for field in fields:
        name, value = field["name"], field["value"]
        if field.get("of") == "orientation":
            value = f"of_orientation(&OrientationRecord::Orientation::{value})"
        if field["type"] == "array":
            columns = ", ".join(f'"{column}"' for column in field["columns"])
            size = len(field["columns"])
            out.append(f"inline constexpr Columns<{size}> k_{name} = {{{columns}}};")
            if not may_lack(field):
                value = f"std::optional({value})"
            calls.append(f'  line->add("{name}", k_{name}, {value});')
        elif field["type"] == "object":
            members = field["members"]
            keys = ", ".join(f'"{member["name"]}"' for member in members)
            values = ", ".join(member["value"] for member in members)
            size = len(members)
            out.append(f"inline constexpr Columns<{size}> k_{name} = {{{keys}}};")
            calls += [f"  std::optional<std::array<double, {size}>> {name};", f"  if ({value}) {name} = {{{{{values}}}}};",
                      f'  line->add_object("{name}", k_{name}, {name});']
        else:
            calls.append(f'  line->add("{name}", {value});')
    out += ["", "template <class Line>", "void add_fields(const OrientationRecord& record, Line* line) {",
            "  // A member of the orientation, if there is one.", "  const auto of_orientation = [&record](auto member) {",
            "    using Member = std::decay_t<decltype(std::declval<OrientationRecord::Orientation>().*member)>;",
            "    return record.orientation ? std::optional<Member>((*record.orientation).*member) : std::nullopt;", "  };", *calls, "}", "", "}  // namespace alidade", ""]
    return "\n".join(out)


# ---- OpenAPI

def schema(field):
    parts = []
    if field["type"] == "array":
        size = len(field["columns"])
        parts = ["type: array"] + (["nullable: true"] if may_lack(field) else []) + [f"minItems: {size}, maxItems: {size}"]
        parts.append(f"items: {{{', '.join(['type: number', *bounds(field)])}}}")
    elif field["type"] == "object":
        names = [member["name"] for member in field["members"]]
        parts = ["type: object", "nullable: true", f"required: [{', '.join(names)}]"]
    else:
        parts = [f"type: {JSON[field['type']]}"] + (["nullable: true"] if may_lack(field) else [])
        parts += bounds(field)
        if "enum" in field:
            parts.append(f"enum: [{', '.join(flow(word) for word in field['enum'])}]")
    parts.append(f"description: {flow(description(field))}")
    if field["type"] == "object":
        parts.append(properties(field))
    return f"        {field['name']}: {{{', '.join(parts)}}}"


def openapi(fields):
    required = textwrap.wrap(", ".join(field["name"] for field in fields), 120)
    lines = ["    Record:", "      type: object",
             "      description: One frame, or the news that there is no video. Without an orientation its fields are null.",
             "      required: [" + "\n        ".join(required) + "]", "      properties:"]
    return "\n".join(lines + [schema(field) for field in fields])


# ---- the table

def table(fields):
    rows = ["| field | unit | meaning |", "|---|---|---|"]
    for field in fields:
        parts = [field["says"]]
        if "null_if" in field:
            parts.append(f"`null`: {field['null_if']}")
        elif "of" in field:
            parts.append("`null` in mode `none`")
        text = "; ".join(parts)
        extra = [field["more"].rstrip(".")] if "more" in field else []
        if field["type"] == "object":
            extra.append(f"{members_text(field)}. CSV: " + ", ".join(f"`{field['name']}_{member['name']}`" for member in field["members"]))
        if field["type"] == "array":
            columns = field["columns"]
            extra.append("CSV: " + (", ".join(f"`{column}`" for column in columns) if len(columns) <= 4 else f"`{columns[0]}` to `{columns[-1]}`"))
        if "enum" in field and len(field["enum"]) > 1 and field["name"] != "mode":
            extra.append("One of " + ", ".join(f"`{word}`" for word in field["enum"]))
        unit = field.get("unit", "")
        rows.append(f"| `{field['name']}` | {unit} | {'. '.join([text] + extra)} |".replace("|x|", "\\|x\\|"))
    return "\n".join(rows)


# ---- ROS

def ros_text(field):
    text = field["ros"].get("says", field["says"]).replace("`", "") if not isinstance(field["ros"].get("says"), list) else ""
    unit = field.get("unit")
    if unit and not unit.startswith("the") and not text.startswith(unit):
        text = f"{unit}; {text}" if text else unit
    if field["type"] in ("number", "array", "object") and may_lack(field):
        text += f"; NaN: {field['null_if']}".replace("`", "") if "null_if" in field else "; NaN in MODE_NONE"
    names = {other: kind.get("name", other) for other, kind in ros_names.items() if isinstance(kind, dict)}
    return re.sub(r"\b(" + "|".join(map(re.escape, sorted(names, key=len, reverse=True))) + r")\b", lambda m: names[m[1]] or m[1], text)


ros_names = {}


def message(fields):
    ros_names.clear()
    ros_names.update({field["name"]: field["ros"] for field in fields if field["ros"].get("name")})
    out = []
    for field in fields:
        ros = field["ros"]
        kind = ros.get("as", "same")
        if "heading" in ros:
            out += ["", ros["heading"]]
        out += ros.get("constants", [])
        if kind == "presence":
            out += ros_lines(ros["has"], "bool", ros["has_says"])
        if kind == "pair":
            for name, says in zip(ros["names"], ros["says"]):
                out += ros_lines(name, ros["type"], says)
        elif kind == "members":
            for name, says, member in zip(ros["names"], ros["says"], field["members"]):
                out += ros_lines(name, ros["type"], f"{member['unit']}; {says}; NaN: {field['null_if']}".replace("`", ""))
        else:
            out += ros_lines(ros["name"], ros["type"], ros_text(field))
    return "\n".join(out)


def ros_type(field):
    if field["type"] == "array":
        return f"std::array<double, {len(field['columns'])}>"
    if field["type"] == "object":
        return sentence(field["name"])
    return CPP[field["type"]]


def ros_struct(fields):
    out = ["#pragma once", f"// {BY}", "//",
           "// Record: what the edge executable says about one frame, in its own conventions (record.h).", "",
           "#include <array>", "#include <cstdint>", "#include <optional>", "#include <string>", "",
           "namespace alidade_ros {", "", "struct Record {", "  struct Orientation {"]
    for field in fields:
        if field.get("of") == "orientation":
            kind = ros_type(field)
            start = f"{{{field.get('start', '')}}}" if field["type"] == "array" else " = 0"
            out += [f"    {kind} {field['name']}{start};  // {field.get('unit') or 'x, y, z, w'}"]
    out += ["  };"]
    for field in fields:
        if field["type"] == "object":
            out += [f"  struct {sentence(field['name'])} {{"]
            out += [f"    double {member['name']} = 0;  // {member['unit']}" for member in field["members"]]
            out += ["  };"]
    out += [""]
    for field in fields:
        if "of" in field:
            continue
        kind = ros_type(field)
        comment = f"  // {field['unit']}" if field.get("unit") else ""
        if field["type"] == "word":
            out += [f"  std::string {field['name']};" + ("  // empty: none" if "null_if" in field else "")]
        elif "null_if" in field or field.get("absent") == "none":
            out += [f"  std::optional<{kind}> {field['name']};{comment}"]
        else:
            start = {"boolean": " = false", "array": "{}"}.get(field["type"], f" = {field.get('start', 0)}")
            out += [f"  {kind} {field['name']}{start};{comment}"]
    out += ["  std::optional<Orientation> orientation;  // none in mode none", "};", "", "}  // namespace alidade_ros", ""]
    return "\n".join(out)


def ros_parse_line(field, target, source):
    name, kind = field["name"], ros_type(field)
    if field["type"] == "object":
        members = ", ".join(f'object->at("{member["name"]}").get<double>()' for member in field["members"])
        return [f'  if (const auto object = optional_of<Json>(json, "{name}")) {target}.{name} = Record::{sentence(name)}{{{members}}};']
    if field["type"] == "word" and "null_if" in field:
        return [f'  {target}.{name} = optional_of<std::string>(json, "{name}").value_or("");']
    if "null_if" in field or field.get("absent") == "none":
        return [f'  {target}.{name} = optional_of<{kind}>(json, "{name}");']
    if "absent" in field:
        start = f"{{{field['absent']}}}" if field["type"] == "array" else field["absent"]
        return [f'  {target}.{name} = optional_of<{kind}>(json, "{name}").value_or({kind}{start if field["type"] == "array" else "(" + str(start) + ")"});']
    return [f'  {target}.{name} = json.at("{name}").get<{kind}>();']


def ros_source(fields):
    out = [f"// {BY}", "", '#include "alidade_ros/record_fields.h"', "", "#include <algorithm>", "#include <limits>", "",
           '#include "alidade_ros/conversions.h"', '#include "alidade_ros/record_conversion.h"', "", "namespace alidade_ros {", "",
           "Record record_of(const Json& json) {", "  Record r;"]
    for field in fields:
        if "of" not in field:
            out += ros_parse_line(field, "r", "json")
    out += ['  if (r.mode == "none") return r;', "  Record::Orientation& o = r.orientation.emplace();"]
    for field in fields:
        if "of" in field:
            out += ros_parse_line(field, "o", "json")
    out += ["  return r;", "}", "", "void fill_fields(const Record& record, alidade_msgs::FrameOrientation* message) {",
            "  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();",
            "  const std::optional<Record::Orientation>& o = record.orientation;"]
    for field in fields:
        ros, name = field["ros"], field["name"]
        kind = ros.get("as", "same")
        if kind == "pair":
            out += [f"  message->{one} = record.{name}[{i}];" for i, one in enumerate(ros["names"])]
        elif kind == "members":
            out += [f"  message->{one} = record.{name} ? record.{name}->{member['name']} : kNan;"
                    for one, member in zip(ros["names"], field["members"])]
        elif kind == "presence":
            out += [f"  message->{ros['has']} = record.{name}.has_value();", f"  message->{ros['name']} = record.{name}.value_or(-1);"]
        elif kind == "mode":
            out += [f"  message->{ros['name']} = mode_number(record.{name});"]
        elif kind == "quaternion":
            out += [f"  message->{ros['name']} = o ? ros_orientation(o->{name}) : unknown_orientation();"]
        elif kind == "turned":
            out += [f"  message->{ros['name']} = o ? turned(o->{name}) : kNan;"]
        elif field.get("of"):
            out += [f"  message->{ros['name']}.fill(kNan);", f"  if (o) std::copy(o->{name}.begin(), o->{name}.end(), message->{ros['name']}.begin());"]
        elif field["type"] == "integer":
            out += [f"  message->{ros['name']} = static_cast<std::{ros['type']}_t>(record.{name});"]
        elif field["type"] == "number" and ("null_if" in field or field.get("absent") == "none"):
            out += [f"  message->{ros['name']} = record.{name}.value_or(kNan);"]
        else:
            out += [f"  message->{ros['name']} = record.{name};"]
    out += ["}", "", "}  // namespace alidade_ros", ""]
    return "\n".join(out)


# ---- files

def generated(files):
    fields = fields_of_list()
    to_ros = known_to_ros(fields)
    return files_of(BY, files, {
        "edge_app/record/record_fields.h": cpp(fields),
        "ros_wrapper/alidade_ros/include/alidade_ros/record_fields.h": ros_struct(to_ros),
        "ros_wrapper/alidade_ros/src/record_fields.cpp": ros_source(to_ros),
    }, {
        "edge_app/output/openapi.yaml": openapi(fields),
        "docs/manual/reference/records.md": table(fields),
        "ros_wrapper/alidade_msgs/msg/FrameOrientation.msg": message(to_ros),
    })
