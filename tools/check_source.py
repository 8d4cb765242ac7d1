#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The rules of the house that a program can read off the Fortran files.

  silence    the library never prints and never stops
  floors     no file uses a module of a later floor
  modules    one module per file, of the file's name
  labels     no C function has the name of a module (both are global: gfortran calls the one for the other), or the file
             does not use that module
  recursive  whatever lies between an entry and a callback is recursive
  length     a file of more than 400 lines wants a reason (told, not failed)

usage: check_source.py PROJECT
"""
import pathlib
import re
import sys

from fortran_text import LABEL, procedures, statements, unquoted_labels

FLOORS = ("core", "linalg", "system", "steppers", "drivers", "analysis", "models", "wrappers")
BETWEEN_ENTRY_AND_CALLBACK = ("src/steppers/", "src/drivers/", "wrappers/")
LIMIT = 400

# at the start of a statement, or after the bracket of an `if (...)`
NOISE = re.compile(
    r"(?:^|\)\s*)(?:print\s*(?:\*|''|\(|\w+\s*,)|print\s+\w+$|(?:error\s+)?stop(?:\s*$|\s+\w|\s*'')|call\s+(?:abort|exit)\b)"
    r"|\b(?:write|read)\s*\(\s*(?:unit\s*=\s*)?\*|\b(?:output|error)_unit\b")


def floor(path):
    """Number of the floor that a file is on; files directly in src/ lie over all of src/."""
    parts = path.split("/")
    if parts[0] == "wrappers":
        return FLOORS.index("wrappers")
    return FLOORS.index(parts[1]) if len(parts) > 2 else FLOORS.index("models")


def silence(path, text, _):
    for number, statement in statements(text):
        if NOISE.search(statement):
            yield f"{path}:{number}: the library must not print, read or stop: {statement}"


def floors(path, text, home):
    for number, statement in statements(text):
        match = re.match(r"use\s*(?:,\s*\w+\s*)?(?:::)?\s*(dynstep\w*)", statement)
        if match and match[1] not in home:
            yield f"{path}:{number}: no file here has the module {match[1]}"
        elif match and floor(home[match[1]]) > floor(path):
            yield f"{path}:{number}: {match[1]} lies on a later floor ({home[match[1]]})"


def modules(path, text, _):
    name = path.rpartition("/")[2].removesuffix(".f90")
    found = [m[1] for _, s in statements(text)
             if (m := re.match(r"(?:sub)?module\s*(?:\([\w:\s]*\))?\s*(?!procedure\b)(\w+)$", s))]
    if not found and path.startswith("wrappers/f77/"):       # an external procedure, for F77
        found = [entry for _, _, entry, _, _ in procedures(text)][:1]
    if found != [name]:
        yield f"{path}: expected one module, {name}; found {', '.join(found) or 'none'}"


def labels(path, text, home):
    text = unquoted_labels(text)
    for number, _, name, _, suffix in procedures(text):
        if not (bound := LABEL.search(suffix)):
            continue
        label = bound[1]
        if name in home:
            yield f"{path}:{number}: {name} is also the name of a module"
        elif label in home and re.search(rf"\buse\b.*\b{label}\b", text):
            yield f"{path}:{number}: the label {label} is also the name of a module that is used here"


def recursive(path, text, _):
    if not path.startswith(BETWEEN_ENTRY_AND_CALLBACK):
        return
    for number, prefix, name, _, _ in procedures(text):
        if not {"recursive", "pure", "elemental"} & set(prefix):
            yield f"{path}:{number}: {name} is neither recursive, pure nor elemental"


RULES = (silence, floors, modules, labels, recursive)


def complaints(files):
    """{rule: complaints} of {path: text}."""
    home = {path.rpartition("/")[2].removesuffix(".f90"): path for path in files}
    return {rule.__name__: [c for path, text in files.items() for c in rule(path, text, home)] for rule in RULES}


def main(root):
    def read(*patterns):
        return {str(path.relative_to(root)): path.read_text()
                for pattern in patterns for path in sorted(root.glob(pattern))}

    files = read("src/**/*.f90", "wrappers/c/**/*.f90", "wrappers/f77/**/*.f90")
    result = complaints(files)
    for rule, found in result.items():
        print(f"{'FAIL' if found else 'ok':<5}{rule} ({len(files)} files)", *found, sep="\n  ")
    others = read("wrappers/python/**/*.[cp]*", "tests/**/*.[cfp]*", "tools/*.py", "examples/**/*.[cfp]*")
    for path, text in {**files, **others}.items():
        lines = text.count("\n")
        if lines > LIMIT:
            print(f"note: {path} has {lines} lines")
    failed = sum(bool(found) for found in result.values())
    print(f"{len(result) - failed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
