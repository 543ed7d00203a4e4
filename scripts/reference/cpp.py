"""What the parts read of C++: functions, calls with their arguments, strings, constants."""
import functools
import pathlib
import re

TOP = pathlib.Path(__file__).resolve().parents[2]
STRING = r'"((?:[^"\\]|\\.)*)"'


class ListError(Exception):
    pass


@functools.lru_cache(None)
def text_of(path):
    """Without comments."""
    return re.sub(r"^\s*//.*$|\s//[^\n\"]*$", "", (TOP / path).read_text(encoding="utf-8"), flags=re.MULTILINE)


@functools.lru_cache(None)
def text_of_file(path):
    return (TOP / path).read_text(encoding="utf-8")


def functions(path):
    """(name, body) of each function that begins in the first column."""
    text = text_of(path)
    heads = list(re.finditer(r"^(?! )[\w:<>,&* \[\]]*?\b(\w+)\([^;{}]*\)(?: const)? \{\n", text, re.MULTILINE))
    for head in heads:
        end = text.index("\n}\n", head.start())
        yield head[1], text[head.end():end]


def arguments(text, begin):
    """Those of the call whose bracket opens at `begin`: strings stay whole."""
    depth, argument, out, place = 0, "", [], begin
    while True:
        string = re.match(STRING, text[place:])
        piece = string[0] if string else text[place]
        place += len(piece)
        if not string and piece in "([{":
            depth += 1
            if depth == 1:
                continue
        if not string and piece in ")]}":
            depth -= 1
            if depth == 0:
                return [*out, argument.strip()] if argument.strip() or out else []
        if depth == 1 and piece == ",":
            out.append(argument.strip())
            argument = ""
        else:
            argument += piece


def calls(text, names):
    """(name, arguments) of each call of one of these, in order."""
    for call in re.finditer(rf"\b({'|'.join(names)})\(", text):
        yield call[1], arguments(text, call.end() - 1)


def string(argument):
    """Of adjacent literals; None for something else."""
    parts = re.findall(STRING, argument)
    if not parts or re.sub(STRING, "", argument).strip():
        return None
    return "".join(parts).replace('\\"', '"').replace("\\n", "\n")


@functools.lru_cache(None)
def member_values():
    """{name: values} with which members of that name begin, or which a function of edge_app gives them: numbers, truths, texts."""
    found = {}
    value = rf'(-?[\d.]+(?:e-?\d+)?|true|false|"[^"]*")'
    for room in ("core", "platform", "edge_app"):
        for path in sorted((TOP / room).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                text = text_of(path.relative_to(TOP).as_posix())
                for name, one in re.findall(rf"^ *[\w:]+ (\w+) = {value};", text, re.MULTILINE) if path.suffix == ".h" else \
                        re.findall(rf"\boptions\.(?:\w+\.)?(\w+) = {value};", text):
                    found.setdefault(name, set()).add(one.strip('"'))
    return found


@functools.lru_cache(None)
def constants():
    """Numbers that are named in headers and sources."""
    found = {}
    for room in ("core", "platform", "edge_app"):
        for path in sorted((TOP / room).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                found.update(re.findall(r"constexpr (?:int|double|std::size_t|auto) (k\w+) = ([\d.e+-]+);", path.read_text(encoding="utf-8")))
    return found
