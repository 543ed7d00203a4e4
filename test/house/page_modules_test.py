#!/usr/bin/env python3
"""Do the modules of the status page import what they use, and only from those before them? The build joins them into one script, in
which a forgotten import would go unnoticed."""
import pathlib
import re
import sys
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
PAGE = TOP / "edge_app/output/page"
IMPORT = re.compile(r"^import \{([^}]*)\} from '\./(\w+)\.js';$", re.MULTILINE)
DECLARATION = re.compile(r"^(export )?(?:async )?(?:function|class|const|let) (\w+)", re.MULTILINE)


def code_of(text):
    """Without comments and what is quoted; of a template, what stands in its ${}."""
    out = []
    depths = []  # of braces, within each ${}
    i = 0
    while i < len(text):
        template = bool(depths) and depths[-1] is None
        if template and text.startswith("${", i):
            depths.append(0)
            i += 2
        elif template and text[i] == "`":
            depths.pop()
            i += 1
        elif template:
            i += 2 if text[i] == "\\" else 1
        elif text.startswith("//", i):
            i = text.index("\n", i)
        elif text[i] == "'":
            i = re.compile(r"'(?:[^'\\]|\\.)*'").match(text, i).end()
            out.append("''")
        elif text[i] == "`":
            depths.append(None)
            i += 1
        elif text[i] == "}" and depths and depths[-1] == 0:
            depths.pop()
            i += 1
            out.append(" ")
        else:
            if depths:
                depths[-1] += {"{": 1, "}": -1}.get(text[i], 0)
            out.append(text[i])
            i += 1
    return "".join(out)


class Module:
    def __init__(self, name, text):
        self.name = name
        self.lines = text.count("\n")
        self.head = text.split("\n")[:2]
        self.imports = {word: source for words, source in IMPORT.findall(text) for word in re.split(r",\s*", words.strip().rstrip(","))}
        self.declared = [word for _, word in DECLARATION.findall(text)]
        self.exports = {word for exported, word in DECLARATION.findall(text) if exported}
        code = code_of(IMPORT.sub("", text)).replace("...", " ")
        code = re.sub(r"([{,]\s*)[\w$]+(?=\s*:)", r"\1", code)  # keys of objects
        self.used = set(re.findall(r"(?<![\w$.])[A-Za-z_]\w*", code))


def slips_of(modules):
    slips = []
    exports = {word: module.name for module in modules for word in module.exports}
    before = set()
    imported = set()
    for module in modules:
        for word, source in module.imports.items():
            imported.add(word)
            if source not in before:
                slips.append(f"{module.name}: imports {word} from {source}, which does not stand before it")
            elif exports.get(word) != source:
                slips.append(f"{module.name}: {source} does not export {word}")
            if word not in module.used:
                slips.append(f"{module.name}: imports {word}, which it does not use")
        for word in module.used & exports.keys() - module.imports.keys() - set(module.declared):
            slips.append(f"{module.name}: uses {word} of {exports[word]} without an import, or has another thing of that name")
        before.add(module.name)
    declared = [word for module in modules for word in module.declared]
    slips += [f"{word} is declared twice: all modules share one scope" for word in sorted(set(declared)) if declared.count(word) > 1]
    slips += [f"{exports[word]}: nobody imports {word}" for word in exports if word not in imported]
    return slips


def modules_of_the_build():
    listed = re.search(r"set\(page_modules ([\w\s]*)\)", (TOP / "edge_app/CMakeLists.txt").read_text())[1].split()
    return [Module(name, (PAGE / f"{name}.js").read_text()) for name in listed]


class PageModules(unittest.TestCase):
    def test_import_what_they_use(self):
        self.assertEqual(slips_of(modules_of_the_build()), [])

    def test_all_are_built_in_and_each_says_what_it_is(self):
        modules = modules_of_the_build()
        self.assertEqual(sorted(module.name for module in modules), sorted(path.stem for path in PAGE.glob("*.js")))
        for module in modules:
            self.assertTrue(all(line.startswith("// ") for line in module.head), module.name)
            self.assertLess(module.lines, 200, module.name)

    def test_slips_are_named(self):
        first = "export const angle = 1;\nexport const width = 2;\n"
        for second, told in (("say(angle, width);", "second: uses angle of first without an import"),
                             ("import {angle} from './first.js';\nsay(angle);", "first: nobody imports width"),
                             ("import {angle, width} from './first.js';\nsay(`${{angle: 1}} width`, angle);",
                              "second: imports width, which it does not use"),
                             ("import {angel} from './first.js';\nsay(angel);", "second: first does not export angel"),
                             ("import {late} from './third.js';\nsay(late);", "second: imports late from third, which does not stand before it"),
                             ("let width = 3;", "width is declared twice")):
            with self.subTest(told=told):
                slips = slips_of([Module("first", first), Module("second", second + "\n")])
                self.assertTrue(any(told in slip for slip in slips), slips)

    def test_what_is_quoted_or_a_key_is_not_used(self):
        text = "a(b.angle, {angle: c}, 'angle', `angle ${d + `${e}`} angle`, ...f);  // angle\n"
        self.assertEqual(Module("one", text).used, {"a", "b", "c", "d", "e", "f"})


if __name__ == "__main__":
    unittest.main()
