#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a program can check of the pages: README.md, CONTRIBUTING.md, CHANGELOG.md, docs/.

  snippets   a block of code after a line `<!-- from FILE -->` stands in FILE, line for line
  links      relative links lead to files, and to headings that exist
  paths      files of the project that a page names exist
  codes      docs/howto/errors.md has a section for each status code of the library, which says
             "Reserved" just where no file of the library gives the code

usage: check_docs.py PROJECT
"""
import pathlib
import re
import sys

BLOCK = re.compile(r"<!-- from (\S+) -->\n+```\w*\n(.*?)```", re.DOTALL)
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)")
PATH = re.compile(r"`((?:src|wrappers|tests|tools|examples|benchmarks|docs)/[\w./-]*\w)`")


def anchor(heading):
    """The anchor that a heading gets on the usual hosts."""
    text = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip().lower())
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def anchors(text):
    return {anchor(h) for h in re.findall(r"^#+ (.*)$", FENCE.sub("", text), re.MULTILINE)}


def snippets(pages, root):
    for page, text in pages.items():
        for name, block in BLOCK.findall(text):
            file = root / name
            if not file.is_file():
                yield f"{page}: there is no {name}"
            elif "\n" + block not in "\n" + file.read_text():
                yield f"{page}: the block from {name} is not in that file line for line"


def links(pages, root):
    for page, text in pages.items():
        for target in LINK.findall(FENCE.sub("", text)):
            if re.match(r"[a-z]+:", target):
                continue
            name, _, place = target.partition("#")
            file = (page.parent / name).resolve() if name else page.resolve()
            if not file.exists():
                yield f"{page}: the link {target} leads nowhere"
            elif place and file.suffix == ".md" and place not in anchors(file.read_text()):
                yield f"{page}: {name or page.name} has no heading #{place}"


def paths(pages, root):
    for page, text in pages.items():
        for name in sorted(set(PATH.findall(FENCE.sub("", text)))):
            if not (root / name).exists():
                yield f"{page}: there is no {name}"


def codes(pages, root):
    page = root / "docs/howto/errors.md"
    if page not in pages:
        return
    status = root / "src/core/dynstep_status.f90"
    listing = root / "src/dynstep.f90"
    library = "".join(file.read_text() for folder in ("src", "wrappers") for file in (root / folder).rglob("*.f90")
                      if file not in (status, listing))
    for name, number in re.findall(r"parameter, public :: dynstep_(\w+) = (-?\d+)", status.read_text()):
        section = re.search(rf"^## {number} `{name}`\n(.*?)(?=^## |\Z)", pages[page], re.MULTILINE | re.DOTALL)
        if not section:
            yield f"{page}: there is no heading '## {number} `{name}`'"
        elif ("Reserved" in section[1]) == bool(re.search(rf"\bdynstep_{name}\b", library)) and name != "success":
            yield f"{page}: {name} is said to be reserved and is given, or neither"


def main(root):
    names = [root / "README.md", root / "CONTRIBUTING.md", root / "CHANGELOG.md", *sorted((root / "docs").rglob("*.md"))]
    pages = {name: name.read_text() for name in names if name.exists()}
    failed = 0
    for rule in (snippets, links, paths, codes):
        found = list(rule(pages, root))
        failed += bool(found)
        print(f"{'FAIL' if found else 'ok':<5}{rule.__name__} ({len(pages)} pages)", *found, sep="\n  ")
    print(f"{4 - failed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
