"""The HTTP API from openapi.yaml, and the metrics from what writes them."""
import re

import yaml

from . import cpp

DESCRIPTION = "edge_app/output/openapi.yaml"
METRICS = "edge_app/output/service_metrics.cpp"


def line(text):
    return re.sub(r"\s+", " ", str(text)).strip().replace("|", "\\|")


def type_of(schema):
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    for kind in ("oneOf", "anyOf", "allOf"):
        if kind in schema:
            return " or ".join(type_of(one) for one in schema[kind])
    if "enum" in schema:
        return " ".join(f"`{str(word).strip()}`" for word in schema["enum"])
    kind = schema.get("type", "")
    if kind == "array":
        return f"list of {type_of(schema.get('items', {})) or 'anything'}"
    return kind + (" or null" if schema.get("nullable") and kind else "")


def properties(schema, required, prefix=""):
    rows = []
    for name, one in schema.get("properties", {}).items():
        rows.append(f"| `{prefix}{name}` | {type_of(one)} | {'yes' if name in required else ''} | {line(one.get('description', ''))} |")
        inner = one.get("items", one) if one.get("type") == "array" else one
        if "properties" in inner:
            rows += properties(inner, inner.get("required", []), f"{prefix}{name}.")
    return rows


def schema_table(schema):
    rows, parts = [], [schema, *schema.get("allOf", [])]
    for part in parts:
        rows += properties(part, part.get("required", []))
    return ["| value | type | always | meaning |", "|---|---|---|---|", *rows] if rows else []


def endpoints():
    description = yaml.safe_load(cpp.text_of_file(DESCRIPTION))
    out = []
    for path, methods in description["paths"].items():
        for method, one in methods.items():
            answers = []
            for code, answer in one["responses"].items():
                if code != "default" and "$ref" not in answer:
                    of = [type_of(content["schema"]) for content in answer.get("content", {}).values() if "$ref" in content.get("schema", {})]
                    answers.append(f"{code}: {line(answer['description'])}" + (f" ({of[0]})" if of else ""))
            refused = [code for code, answer in one["responses"].items() if "$ref" in answer and code != "default"]
            out += [f"### {method.upper()} {path}", "", line(one["summary"]) + "."]
            if "description" in one:
                out += ["", line(one["description"])]
            if body := one.get("requestBody"):
                for content in body["content"].values():
                    schema = content["schema"]
                    out += ["", f"Body: {type_of(schema)}." if "$ref" in schema else "Body:"]
                    out += [] if "$ref" in schema else ["", *schema_table(schema)]
            if asked := one.get("parameters"):
                out += ["", *(f"- `{p['name']}` ({p['in']}): {line(p.get('description', ''))}" for p in asked)]
            out += ["", "Answers: " + ". ".join(answer.rstrip(".") for answer in answers) + "." + (f" Errors: {', '.join(refused)}." if refused else ""), ""]
    return "\n".join(out)


def schemas():
    description = yaml.safe_load(cpp.text_of_file(DESCRIPTION))
    out = []
    for name, schema in description["components"]["schemas"].items():
        rows = schema_table(schema)
        text = line(schema.get("description", ""))
        out += [f"### {name}", "", *([text, ""] if text else []), *(rows or [f"{type_of(schema).capitalize()}."]), ""]
    return "\n".join(out)


def metrics():
    """(name, kind, help) of each."""
    out = []
    for kind, a in cpp.calls(cpp.text_of(METRICS), ("gauge", "counter", "histogram")):
        if len(a) == 2 and cpp.string(a[0]):
            out.append((cpp.string(a[0]), kind, cpp.string(a[1])))
        elif a:
            raise cpp.ListError(f"{METRICS}: the name or help of {a[0]} is no plain text")
    return out


def metrics_table():
    rows = [f"| `{name}` | {kind} | {line(text)} |" for name, kind, text in metrics()]
    return "\n".join(["| metric | kind | meaning |", "|---|---|---|", *rows])
