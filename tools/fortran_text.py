# SPDX-License-Identifier: BSD-3-Clause
"""Free-form Fortran, just well enough for the checks: statements and procedure headers."""
import re


def statements(text):
    """Yield (line number, statement): no comments, continuations joined, strings emptied, lower case."""
    joined, start = "", 0
    for number, line in enumerate(text.splitlines(), 1):
        line = re.sub(r"'(?:[^']|'')*'|\"(?:[^\"]|\"\")*\"", "''", line)
        line = line.partition("!")[0].strip().lower()
        if not line:
            continue
        if not joined:
            start = number
        joined += line.removeprefix("&") if joined else line
        if joined.endswith("&"):
            joined = joined[:-1].rstrip() + " "
            continue
        for statement in joined.split(";"):
            if statement.strip():
                yield start, statement.strip()
        joined = ""


PROCEDURE = re.compile(
    r"(?!end\b)(?P<prefix>(?:[\w*]+(?:\s*\([^()]*\))?\s+)*?)(?P<kind>subroutine|function)\s+(?P<name>\w+)"
    r"\s*(?:\((?P<args>[^()]*)\))?(?P<suffix>.*)$")


#: bind(c) and the C name that it may tell, of a text without the quotes of these names
LABEL = re.compile(r"\bbind\s*\(\s*c\b(?:\s*,\s*name\s*=\s*(\w+))?")


def unquoted_labels(text):
    """Let the names of bind(c, name='...') survive the emptying of strings."""
    return re.sub(r"""(\bbind\s*\(\s*c\s*,\s*name\s*=\s*)['"](\w+)['"]""", r"\1\2", text)


def procedures(text):
    """Yield (line number, prefix, name, arguments, suffix) of every procedure that has a body here."""
    interface = False
    for number, statement in statements(text):
        if re.match(r"(abstract\s+)?interface\b(?!\s*=)", statement):
            interface = True
        elif re.match(r"end\s*interface\b", statement):
            interface = False
        elif not interface:
            match = PROCEDURE.match(statement)
            if match:
                arguments = [a.strip() for a in (match["args"] or "").split(",") if a.strip()]
                yield number, match["prefix"].split(), match["name"], arguments, match["suffix"]
