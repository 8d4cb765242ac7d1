# SPDX-License-Identifier: BSD-3-Clause
"""The Python page and the docstrings are true."""
import doctest
import pathlib
import re

import pytest

import dynstep

PAGE = pathlib.Path(__file__).resolve().parents[2]/"docs/python.md"


def test_the_page_runs(capsys):
    pytest.importorskip("numba")
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) > 5
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
    assert "success: True" in capsys.readouterr().out


def test_the_example_of_solve():
    example = doctest.DocTestParser().get_doctest(dynstep.solve.__doc__, {"dynstep": dynstep}, "solve", None, 0)
    assert len(example.examples) == 4
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0


@pytest.mark.parametrize("function", [dynstep.stability_domain, dynstep.alpha_windows])
def test_the_examples_of_stability(function):
    example = doctest.DocTestParser().get_doctest(function.__doc__, {"dynstep": dynstep}, function.__name__, None, 0)
    assert len(example.examples) > 0
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
