"""The tables of commands and options, from what builds the command line (edge_app/commands/command_line.cpp)."""
import re

from . import cpp

FILE = "edge_app/commands/command_line.cpp"
SIMULATOR = ("alidade-simulate", "test/simulator/main.cpp")
OPTIONS = ("add_option", "add_flag", "add_prior", "add_turn")


def plain(text):
    return text.replace("|", "\\|").replace("\n", " ")


def row(name, help_text, body):
    statement = re.sub(r'"(?:[^"\\]|\\.)*"', "", body[body.index(f'"{name}"'):]).partition(";")[0]
    needed = not name.startswith("-") or "->required()" in statement
    return f"| `{name.replace(',', '`, `')}` | {'yes' if needed else ''} | {plain(help_text.strip())} |".replace("|  |", "| |")


def command(name, text, body):
    rows = []
    for kind, a in cpp.calls(body, (*OPTIONS, "add_zoom_tolerance")):
        if kind == "add_zoom_tolerance":
            helper = dict(cpp.functions(FILE))["add_zoom_tolerance"]
            a = next(a for _, a in cpp.calls(helper, ("add_option",)))
            rows.append((cpp.string(a[0]), cpp.string(a[2]), helper))
        elif a and cpp.string(a[0]) and len(a) > 2 and cpp.string(a[2]) is not None:
            rows.append((cpp.string(a[0]), cpp.string(a[2]), body))
    return name, text, rows


def commands():
    """(name, what it does, rows of options) of each sub-command."""
    out = []
    for function, body in cpp.functions(FILE):
        if not function.startswith("add_") or function == "add_zoom_tolerance":
            continue
        group = "map " if function in ("add_map_build", "add_map") else ""
        subs = [(cpp.string(a[0]), cpp.string(a[1])) for _, a in cpp.calls(body, ("add_subcommand",)) if a and cpp.string(a[0])]
        shows = [(cpp.string(a[0]), cpp.string(a[1])) for _, a in cpp.calls(body, ("add_show",)) if a and cpp.string(a[0])]
        if function == "add_map":
            showing = body[body.index("const auto add_show"):body.index("  };", body.index("const auto add_show"))]
            out += [command("map " + name, text, showing) for name, text in shows]
            rest = body[body.index("  };", body.index("const auto add_show")):]
            out.append(command("map export", dict(subs)["export"], rest))
            continue
        for name, text in subs:
            out.append(command(group + name, text, body))
    return out


def virtual_camera():
    """(name, what it does, rows) of the program that plays a camera."""
    name, file = SIMULATOR
    body = dict(cpp.functions(file))["run"]
    text = cpp.string(re.search(rf"CLI::App app\(({cpp.STRING})\)", body)[1])
    _, _, rows = command(name, text, body)
    flag = next(a for _, a in cpp.calls(body, ("set_version_flag",)))
    return name, text.rstrip("."), [*rows, (cpp.string(flag[0]), "print the version", body)]


def all_commands():
    return [*commands(), virtual_camera()]


def tables():
    """{command: its table}"""
    out = {}
    for name, text, rows in all_commands():
        lines = [text + ".", "", "| option | required | meaning |", "|---|---|---|", *(row(*one) for one in rows)]
        out[name] = "\n".join(lines)
    return out


def option_names():
    return sorted({one for _, _, rows in commands() for name, _, _ in rows for one in name.split(",") if one.startswith("-")})
