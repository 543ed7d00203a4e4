"""The texts that a C++ expression of strings can have: literals, sums, fmt::format(), `a ? b : c`, names of locals and constants, and calls
of functions that return strings. What only the run knows is `…`.
"""
import functools
import itertools
import re

from . import cpp

UNKNOWN = "…"
OPEN, CLOSED = "([{", ")]}"
DEEPEST = 6


def pieces(expression, separator):
    """Split at a separator outside brackets and strings; `::` is no colon."""
    out, piece, depth, place = [], "", 0, 0
    while place < len(expression):
        string = re.match(cpp.STRING, expression[place:])
        token = string[0] if string else "::" if expression.startswith("::", place) else expression[place]
        place += len(token)
        depth += token in OPEN
        depth -= token in CLOSED
        if token == separator and depth == 0:
            out.append(piece.strip())
            piece = ""
        else:
            piece += token
    return [*out, piece.strip()]


def choices(expression):
    """Both ends of `a ? b : c`; None for something else."""
    question = pieces(expression, "?")
    if len(question) < 2:
        return None
    rest = "?".join(question[1:])
    depth = 0
    parts = pieces(rest, ":")
    for i, part in enumerate(parts):  # the colon that belongs to the first question mark
        depth += len(pieces(part, "?")) - 1
        if i == depth:
            return ":".join(parts[:i + 1]), ":".join(parts[i + 1:])
    raise cpp.ListError(f"no end of {expression[:60]}")


@functools.lru_cache(None)
def text_constants():
    found = {}
    for room in ("core", "platform", "edge_app"):
        for path in sorted((cpp.TOP / room).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                for one in re.finditer(rf"constexpr const char\* (k\w+) =\s*((?:{cpp.STRING}\s*)+);", path.read_text(encoding="utf-8")):
                    found[one[1]] = cpp.string(one[2])
    return found


@functools.lru_cache(None)
def string_functions():
    """{(file, name): body} of the free functions of edge_app that return a string; a name alone for any file."""
    found = {}
    for path in sorted((cpp.TOP / "edge_app").rglob("*.cpp")):
        file = path.relative_to(cpp.TOP).as_posix()
        text = cpp.text_of(file)
        for head in re.finditer(r"^(?:std::string|const char\*) (\w+)\([^;{}]*\) \{\n", text, re.MULTILINE):
            found[(file, head[1])] = found[head[1]] = text[head.end():text.index("\n}\n", head.start())]
    return found


def local(body, name):
    """The expression that a local of this function begins with."""
    found = list(re.finditer(rf"std::string {name} =\s*", body))
    return body[found[-1].end():].split(";\n")[0] if found else None


def words_of(expression):
    return len(expression.replace(UNKNOWN, "").split())


def filled(form, arguments, place, bound, depth):
    """The texts of fmt::format(): an argument is said if its own words are a part of the sentence."""
    numbers = itertools.count()
    fields, texts = list(re.finditer(r"\{(\d*)[^}]*\}", form)), []
    for field in fields:
        at = int(field[1]) if field[1] else next(numbers)
        argument = arguments[at] if at < len(arguments) else ""
        said = texts_of(argument, place, bound, depth + 1)
        tells = argument in bound or any(words_of(one) > 1 for one in said)
        texts.append(said if tells and len(said) < 5 else [UNKNOWN])
    plain = re.sub(r"\{(\d*)[^}]*\}", "\0", form).split("\0")
    return ["".join(itertools.chain(*zip(plain, (*chosen, "")))) for chosen in itertools.product(*texts)]


def texts_of(expression, place=("", ""), bound=None, depth=0):
    """place: (file, the function's body). bound: {name: expression}, as of a lambda's parameters at one of its calls."""
    bound = bound or {}
    file, body = place
    expression = expression.strip()
    if depth > DEEPEST or not expression:
        return [UNKNOWN]
    if both := choices(expression):
        return [text for one in both for text in texts_of(one, place, bound, depth + 1)]
    if (sum_of := pieces(expression, "+")) and len(sum_of) > 1:
        return ["".join(chosen) for chosen in itertools.product(*(texts_of(one, place, bound, depth + 1) for one in sum_of))]
    if (text := cpp.string(expression)) is not None:
        return [text]
    if expression.startswith("("):
        return texts_of(expression[1:-1], place, bound, depth + 1)
    if call := re.match(r"([\w:]+)\(", expression):
        arguments = cpp.arguments(expression, call.end() - 1)
        if call[1] == "fmt::format":
            return filled(cpp.string(arguments[0]), arguments[1:], place, bound, depth)
        if call[1] in ("std::string", "std::move"):
            return texts_of(arguments[0], place, bound, depth + 1)
        if inner := string_functions().get((file, call[1]), string_functions().get(call[1])):
            said = [text for one in re.findall(r"return ((?:[^;\"]|\"(?:[^\"\\]|\\.)*\")+);", inner)
                    for text in texts_of(one, (file, inner), {}, depth + 1) if text]
            return list(dict.fromkeys(said)) or [UNKNOWN]
        return [UNKNOWN]
    if expression in bound:
        return texts_of(bound[expression], place, {}, depth + 1)
    if expression in text_constants():
        return [text_constants()[expression]]
    if re.fullmatch(r"\w+", expression) and (begun := local(body, expression)):
        return texts_of(begun, place, bound, depth + 1)
    return [UNKNOWN]
