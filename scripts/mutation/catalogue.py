"""The lists of mutants, test/mutants/*.yaml: what each changes, where, and which tests should notice."""
import dataclasses
import zlib

import yaml


class ListError(Exception):
    """One line for whoever keeps the lists: which mutant, what is wrong, what would be right."""


@dataclasses.dataclass(frozen=True)
class Mutant:
    id: str
    room: str  # the list's name
    file: str  # path below the top folder
    original: str
    mutated: str  # nothing: the statement is left out
    breaks: str  # the property that does not hold with it
    tests: tuple  # programs of its room, run whole
    then: tuple  # programs of the rooms that use it, run as long as there is time
    filter: str = "*"  # the tests to try first
    within: str = ""  # a longer text that is unique and holds the original once
    type: str = ""  # of an expression whose two forms have types of their own
    rebuild: bool = False  # cannot be switched at run time
    survives: str = ""  # why no test can tell

    @property
    def number(self):
        """What switches it on. It follows from the id alone, so that a new mutant rebuilds its own file only."""
        return zlib.crc32(self.id.encode()) & 0x7FFFFFFF

    @property
    def is_statement(self):
        return self.original.rstrip().endswith((";", "}"))


class UniqueKeys(yaml.SafeLoader):
    """YAML takes the last of two equal keys without a word: a mutant would be lost."""


def unique_mapping(loader, node):
    keys = [loader.construct_object(key) for key, _ in node.value]
    for key in keys:
        if keys.count(key) > 1:
            raise ListError(f"{node.start_mark.name}:{node.start_mark.line + 1}: {key} stands there twice")
    return loader.construct_mapping(node, deep=True)


UniqueKeys.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, unique_mapping)

OF_LIST = {"folder", "tests", "then", "files"}
OF_FILE = {"filter", "tests", "then", "mutants"}
OF_MUTANT = {"original", "mutated", "breaks", "filter", "within", "type", "rebuild", "survives", "tests", "then"}


def known(where, given, allowed):
    if not isinstance(given, dict):
        raise ListError(f"{where}: should hold keys and values")
    for key in given:
        if key not in allowed:
            raise ListError(f"{where}: {key} is unknown; known are {', '.join(sorted(allowed))}")
    return given


def path_of(top, folder, name, where):
    """Where the file lies; floors of a room may change, the file's name says enough."""
    found = sorted(path for path in (top / folder).rglob(name.rsplit("/", 1)[-1])
                   if path.relative_to(top / folder).as_posix().endswith(name))
    if len(found) != 1:
        raise ListError(f"{where}: {folder} has {len(found)} files {name}, and it should be one")
    return found[0].relative_to(top).as_posix()


def read_list(top, file):
    text = yaml.load(file.read_text(encoding="utf-8"), UniqueKeys)
    room = file.stem
    head = known(file.name, text, OF_LIST)
    for name, part in head.get("files", {}).items():
        where = f"{file.name}: {name}"
        known(where, part, OF_FILE)
        path = path_of(top, head["folder"], name, where)
        for key, given in part.get("mutants", {}).items():
            known(f"{file.name}: {key}", given, OF_MUTANT)
            for field in ("original", "mutated", "breaks"):
                if not isinstance(given.get(field), str) or not given[field] and field != "mutated":
                    raise ListError(f"{file.name}: {key}: {field} should be a text")
            merged = {"tests": head.get("tests", []), "then": head.get("then", []), "filter": part.get("filter", "*"),
                      **{field: part[field] for field in ("tests", "then") if field in part}, **given}
            yield Mutant(id=key, room=room, file=path,
                         **{field: tuple(value) if field in ("tests", "then") else value for field, value in merged.items()})


def read_lists(top, folder):
    """All mutants, in the order of the lists."""
    mutants, numbers = [], {}
    for file in sorted(folder.glob("*.yaml")):
        try:
            mutants += read_list(top, file)
        except (yaml.YAMLError, KeyError) as error:
            raise ListError(f"{file}: {error}") from None
    for mutant in mutants:
        other = numbers.setdefault(mutant.number, mutant)
        if other is not mutant:
            raise ListError(f"{mutant.id}: {other.id} of {other.room}.yaml has the same name or number: choose another")
    if not mutants:
        raise ListError(f"{folder}: no mutants in *.yaml there")
    return mutants
