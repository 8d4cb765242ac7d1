#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compare the three descriptions of the flat C layer: function names and numbers of arguments.

  wrappers/c/include/dynstep.h     what a C program includes
  wrappers/c/*.f90                 the procedures with bind(c)
  wrappers/python/_core.pyf        what f2py wraps; it may add functions of wrappers/python/*.c

usage: check_interfaces.py PROJECT
"""
import pathlib
import re
import sys

from fortran_text import LABEL, PROCEDURE, procedures, statements, unquoted_labels

SKIPPED = 77        # meson's exit code of a skipped test


def number_of_arguments(text):
    """Of a C parameter list: the commas outside inner brackets."""
    while (flat := re.sub(r"\([^()]*\)", "", text)) != text:
        text = flat
    return 0 if text.strip() in ("", "void") else text.count(",") + 1


def of_header(text):
    text = re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.DOTALL)
    text = re.sub(r"^\s*#(?:\\\n|.)*", " ", text, flags=re.MULTILINE)
    text = re.sub(r'extern\s+"C"\s*\{', " ", text)
    result = {}
    for declaration in text.split(";"):
        match = re.match(r"(?!typedef\b)[\w\s*]*?\b(\w+)\s*\((.*)\)$", declaration.strip(), re.DOTALL)
        if match:
            result[match[1]] = number_of_arguments(match[2])
    return result


def of_fortran(text):
    result = {}
    for _, _, name, arguments, suffix in procedures(unquoted_labels(text)):
        if bound := LABEL.search(suffix):
            result[bound[1] or name] = len(arguments)
    return result


def of_pyf(text):
    matches = (PROCEDURE.match(statement) for _, statement in statements(text))
    return {m["name"]: len([a for a in (m["args"] or "").split(",") if a.strip()]) for m in matches if m}


def differences(first, second, first_name, second_name):
    """Yield a line for each name or number of arguments on which two descriptions differ."""
    for name in sorted(first.keys() | second.keys()):
        if name not in second:
            yield f"{name} is in {first_name}, not in {second_name}"
        elif name not in first:
            yield f"{name} is in {second_name}, not in {first_name}"
        elif first[name] != second[name]:
            yield f"{name} has {first[name]} arguments in {first_name}, {second[name]} in {second_name}"


def main(root):
    header = root / "wrappers/c/include/dynstep.h"
    sources = sorted((root / "wrappers/c").glob("*.f90"))
    pyf = root / "wrappers/python/_core.pyf"
    if not header.exists() and not sources:
        print("skipped: there is no C layer yet")
        return SKIPPED
    declared = of_header(header.read_text()) if header.exists() else {}
    defined = {}
    for path in sources:
        defined.update(of_fortran(path.read_text()))
    found = list(differences(declared, defined, "dynstep.h", "wrappers/c"))
    compared = 1
    if pyf.exists():
        compared = 2
        helpers = "".join(path.read_text() for path in (root / "wrappers/python").glob("*.c"))
        wrapped = {name: n for name, n in of_pyf(pyf.read_text()).items()
                   if name in declared or not re.search(rf"\b{name}\s*\(", helpers)}
        found += differences(declared, wrapped, "dynstep.h", "_core.pyf")
    else:
        print("note: there is no _core.pyf yet")
    print(f"{len(declared)} functions in dynstep.h", *found, sep="\n  ")
    failed = min(len(found), compared)
    print(f"{compared - failed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
