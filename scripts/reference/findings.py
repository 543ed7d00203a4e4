"""The findings of `alidade check`: each place in the code that adds one, with the texts that it may have."""
import re

from . import cpp
from .sentences import UNKNOWN, choices, texts_of

ADDS = r"\badd_(problem|advice)\(|\bfindings(?:\.|->)push_back\(\s*\{"
# What others say, in short.
OTHERS_SAY = {
    "connection.error": f"{UNKNOWN}: {UNKNOWN} (the link's own words: it is refused, wants another login, or sends nothing)",
    "report.broker_error": f"{UNKNOWN}: {UNKNOWN} (the broker's own words, or what is wrong with the files for TLS)",
    "scene.error": f"{UNKNOWN} (the file is missing, damaged, or of another size)",
}
# Where others say it: the files, and what begins a text there.
PASSED_ON = {
    "connection.waited": ("platform/video/rtp_source.cpp", r"snprintf\(text, sizeof text,\s*"),
    "note": ("platform/video/rtp_source.cpp", r"remarks_\.say\(k\w+, of \+\s*", "platform/video/remarks.h", r"snprintf\(text, sizeof text,\s*"),
}


def line(text):
    """One cell of a table. Values next to each other are one."""
    text = re.sub(r"%[-+.\d]*[a-z]|\{[^}]*\}", UNKNOWN, text)
    text = re.sub(rf"{UNKNOWN}(?:{UNKNOWN})+", UNKNOWN, re.sub(r"\s+", " ", text))
    return text.replace("|", "\\|").strip()


def severities(expression, body, bound):
    """("problem", "advice"), or one of them: of `Severity::kX`, `a ? b : c`, and of names."""
    expression = expression.strip()
    if both := choices(expression):
        found = [one for part in both for one in severities(part, body, bound)]
        return [one for one in ("problem", "advice") if one in found]
    if word := re.fullmatch(r"Severity::k(Problem|Advice)", expression):
        return [word[1].lower()]
    if expression in bound:
        return severities(bound[expression], body, {})
    if begun := re.search(rf"\bSeverity {expression} =\s*([^;]*);", body):
        return severities(begun[1], body, bound)
    raise cpp.ListError(f"findings of check: how severe is {expression}?")


def lambdas(body):
    """(name, parameters with what they are if left out, begin, end) of each in a function."""
    for head in re.finditer(r"const auto (\w+) = \[[^\]]*\]\(([^{]*?)\) \{\n", body):
        parameters = [re.sub(r"^.*?(\w+)(?: = .*)?$", r"\1", one.strip(), flags=re.DOTALL) for one in head[2].split(",")]
        defaults = [one.partition(" = ")[2].strip() for one in head[2].split(",")]
        yield head[1], parameters, defaults, head.start(), body.index("\n  };", head.end())


def uses(body, place):
    """{parameter: argument} for each call of the lambda around this place; one without any for a place in none."""
    for name, parameters, defaults, begin, end in lambdas(body):
        if begin < place < end:
            rest = body[end:]
            for _, given in cpp.calls(rest, (name,)):
                given = [*given, *defaults[len(given):]]
                yield dict(zip(parameters, given))
            return
    yield {}


def passed_on(argument):
    places, out = iter(PASSED_ON[argument]), []
    for file, begin in zip(places, places):
        text = cpp.text_of(file)
        for match in re.finditer(begin, text):
            parts = re.match(r'(?:"(?:[^"\\]|\\.)*"\s*|(?:\+ )?[\w.]+\(\) \+\s*|\+\s*)+', text[match.end():])
            if parts:
                out += [f"video {UNKNOWN}: " + one for one in texts_of(parts[0].strip(" \n+"))]
    return out


def sites():
    """(file, [(problem or advice, text)]) of each place that adds a finding."""
    others = {name: f'"{text}"' for name, text in OTHERS_SAY.items()}
    for path in sorted((cpp.TOP / "edge_app").rglob("*.cpp")):
        file = path.relative_to(cpp.TOP).as_posix()
        if not re.search(ADDS, cpp.text_of(file)):
            continue
        for name, body in cpp.functions(file):
            for call in re.finditer(ADDS, body):
                is_push = call[1] is None
                given = cpp.arguments(body, call.end() - 1)
                if is_push and len(given) != 2:
                    raise cpp.ListError(f"{file}: {name}(): a finding has a severity and a text")
                rows = []
                for bound in uses(body, call.start()):
                    kinds = severities(given[0], body, bound) if is_push else [call[1]]
                    said = passed_on(given[1]) if given[1] in PASSED_ON else \
                        texts_of(given[1], (file, body), others | bound)
                    rows += [(" or ".join(kinds), line(one)) for one in said]
                yield file, list(dict.fromkeys(rows))


def table():
    order = ("video", "pan/tilt", "scene map", "")
    rows = list(dict.fromkeys(row for _, rows in sites() for row in rows))
    rows.sort(key=lambda row: next(i for i, begin in enumerate(order) if row[1].startswith(begin)))
    return "\n".join(["| kind | text |", "|---|---|", *(f"| {kind} | {text} |" for kind, text in rows)])
