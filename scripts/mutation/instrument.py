"""Puts all mutants of a file into its text at once, each behind a switch that is read when the program starts.

One build then serves them all ("mutant schemata"): a mutated expression becomes `(switch ? (mutated) : (original))`, a
mutated statement `{ if (switch) { mutated } else { original } }`.
"""
import re

from .catalogue import ListError

HEADER_NAME = "alidade_mutant_switch.h"
VARIABLE = "ALIDADE_MUTANT"
HEADER = f"""#pragma once
#include <cstdlib>
inline const unsigned long alidade_mutant = [] {{
  const char* number = std::getenv("{VARIABLE}");
  return number != nullptr ? std::strtoul(number, nullptr, 10) : 0UL;
}}();
// A switch brings conversions, empty branches and values that nobody reads: the project's own warnings are errors.
// Clang, which compiles the tests, does not know all of them.
#ifdef __clang__
#pragma clang diagnostic ignored "-Wunknown-warning-option"
#endif
""" + "".join(f'#pragma GCC diagnostic ignored "-W{name}"\n' for name in (
    "conversion", "sign-conversion", "float-conversion", "sign-compare", "unused-variable", "unused-parameter",
    "unused-but-set-variable", "unused-value", "unused-function", "null-dereference", "maybe-uninitialized", "parentheses", "type-limits",
    "duplicated-branches", "empty-body", "bool-compare", "int-in-bool-context", "extra", "unused-but-set-parameter"))

# How tightly C++ binds; the higher, the tighter.
BINDING = {"?": 1, ":": 1, "=": 1, "+=": 1, "-=": 1, "*=": 1, "/=": 1, "||": 2, "&&": 3, "|": 4, "^": 5, "&": 6, "==": 7, "!=": 7,
           "<": 8, ">": 8, "<=": 8, ">=": 8, "<<": 9, ">>": 9, "+": 10, "-": 10, "*": 11, "/": 11, "%": 11}
UNARY = 20
OPERATOR = re.compile(r"<<|>>|<=|>=|==|!=|&&|\|\||[-+*/]=|->|\+\+|--|::|[-+*/%<>=!&|^?:.~]")
TEMPLATE = re.compile(r"(?<=\w)<[\w:, *&]*>(?=[\s({&>:)]|$)")
NUMBER = re.compile(r"(?<![\w.])(?:\d[\d']*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?[fFuUlL]*")


def pattern_of(text):
    """Line breaks and indentation belong to clang-format, not to the mutant; half a name is none."""
    words = r"\s+".join(re.escape(word) for word in text.split())
    return re.compile((r"\b" if re.match(r"\w", text.strip()) else "") + words + (r"\b" if re.search(r"\w$", text.strip()) else ""))


def one_match(text, wanted, what, mutant):
    found = list(pattern_of(wanted).finditer(text))
    if len(found) != 1:
        times = "is not" if not found else f"stands {len(found)} times"
        raise ListError(f"{mutant.id}: {what} {times} in {mutant.file}: {' '.join(wanted.split())}")
    return found[0].span()


def place_of(text, mutant):
    """First and last character of the original."""
    if not mutant.within:
        return one_match(text, mutant.original, "its original", mutant)
    begin, end = one_match(text, mutant.within, "what it is within", mutant)
    first, last = one_match(text[begin:end], mutant.original, "its original", mutant)
    return begin + first, begin + last


def flat(text):
    """The text with brackets, strings and numbers emptied: what binds at its own level remains."""
    text = re.sub(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])\'', "s", text)
    text = TEMPLATE.sub("", NUMBER.sub("n", text))
    while True:
        shorter = re.sub(r"\([^()\[\]{}]*\)|\[[^()\[\]{}]*\]|\{[^()\[\]{}]*\}", "@", text)
        if shorter == text:
            return text
        text = shorter


def operators(text):
    """Binary operators of one level, with their binding; unary ones as UNARY."""
    previous = "("
    for token in re.findall(OPERATOR.pattern + r"|[\w@]+|\S", text):
        if token in ("->", ".", "::", "++", "--"):
            pass
        elif OPERATOR.fullmatch(token):
            yield UNARY if token in "!~" or re.fullmatch(r"\W+|return", previous) and previous not in ")]@" else BINDING[token]
        previous = token


def check_binding(text, begin, end, mutant):
    """An expression gets brackets of its own, and they must not change what the original means."""
    inside = flat(text[begin:end])
    if not mutant.mutated.strip() or re.match(r"(?:else|case|default)\b", mutant.original) or OPERATOR.fullmatch(inside.split()[-1]):
        raise ListError(f"{mutant.id}: its original, or what it becomes, is neither an expression nor a statement: {mutant.original}")
    if text[end:end + 1] == "(":
        raise ListError(f"{mutant.id}: its original ends with the name of a function: take in its arguments in {mutant.file}")
    if "," in inside:
        raise ListError(f"{mutant.id}: its original is a list, and no expression: {mutant.original}")
    if re.search(r"[()\[\]{}]", inside):
        raise ListError(f"{mutant.id}: its original has a bracket that is not closed, or opened, there: take in more of {mutant.file}")
    own = [binding for binding in operators(inside)]
    loosest = min(own, default=UNARY + 1)
    before = re.search(r"([\w)\]]?)\s*(" + OPERATOR.pattern + r")\s*$", text[max(0, begin - 40):begin])
    after = re.match(r"\s*(" + OPERATOR.pattern + ")", text[end:end + 40])
    tightest = 0
    if before and before[2] not in ("::", "->", "."):
        tightest = max(tightest, BINDING.get(before[2], UNARY) if before[1] and before[2] not in "!~" else UNARY)
        if before[2] in ("=", "?", ":", "<<") or re.match(r"[-+*/]=", before[2]):
            tightest = BINDING[before[2]] - 1  # binds from the right, or ends there
    bound = before and before[2] in ("::", "->", ".")
    if after and after[1] in ("->", ".", "::", "++", "--"):
        bound = bound or (own and after[1] in ("->", "."))
    elif after and BINDING.get(after[1], 0) > loosest:
        bound = True
    if bound or tightest >= loosest and own:
        raise ListError(f"{mutant.id}: brackets around its original would change {mutant.file}: take in the whole expression")


def check_statement(text, begin, mutant):
    """A statement must begin where one can, and declare nothing: its name would end with the switch's brackets."""
    if re.match(r"(?:else|case|default)\b", mutant.original):
        raise ListError(f"{mutant.id}: its original is part of a statement of {mutant.file}: take the statement behind it")
    if re.match(r"(?:static|const|constexpr|auto|using)\b", mutant.original):
        raise ListError(f"{mutant.id}: its original declares a name: take the value, or where it is used, in {mutant.file}")
    before = re.sub(r"//[^\n]*", "", text[max(0, begin - 400):begin]).rstrip()
    if not (before.endswith((";", "{", "}", ")", ":")) or before.endswith("else")) or before.endswith("= {"):
        raise ListError(f"{mutant.id}: ends like a statement and does not begin like one in {mutant.file}")


def switched(mutants, original):
    """One place of the text with all its mutants; `original` may hold switches of its own."""
    if mutants[0].is_statement:
        branches = "".join(f"if (::alidade_mutant == {mutant.number}UL) {{ {mutant.mutated} }} else " for mutant in mutants)
        return f"{{ {branches}{{ {original} }} }}"
    kind = next((mutant.type for mutant in mutants if mutant.type), "")
    branches = "".join(f"::alidade_mutant == {mutant.number}UL ? {kind}({mutant.mutated}) : " for mutant in mutants)
    return f"({branches}{kind}({original}))"


def instrumented(text, mutants, rebuilt=None):
    """The text with a switch for each mutant; the one that is `rebuilt`, if it is of this file, takes its place for good."""
    places = {}
    for mutant in mutants:
        begin, end = place_of(text, mutant)
        if mutant.is_statement:
            check_statement(text, begin, mutant)
        else:
            check_binding(text, begin, end, mutant)
        if not mutant.rebuild or mutant is rebuilt:
            places.setdefault((begin, end), []).append(mutant)
    order = sorted(places, key=lambda place: (place[0], -place[1]))
    for (begin, end), (later, latest) in zip(order, order[1:]):
        if later < end < latest:
            raise ListError(f"{places[begin, end][0].id} and {places[later, latest][0].id} overlap: let one hold the other")

    def render(begin, end, inner):
        parts, at = [], begin
        while inner:
            place = inner.pop(0)
            held = []
            while inner and inner[0][1] <= place[1]:
                held.append(inner.pop(0))
            parts.append(text[at:place[0]])
            if rebuilt in places[place]:
                parts.append(rebuilt.mutated)
            else:
                parts.append(switched(places[place], render(*place, held)))
            at = place[1]
        return "".join(parts) + text[at:end]

    changed = render(0, len(text), order)
    return f'#include "{HEADER_NAME}"\n{changed}' if places else text
