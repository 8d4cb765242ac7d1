# SPDX-License-Identifier: BSD-3-Clause
"""The package as a whole: what it needs, what it shows, files of records."""
import inspect
import subprocess
import sys

import numpy as np
import pytest

import dynstep

OPTIONAL = ["scipy", "matplotlib", "numba", "cffi", "_cffi_backend", "tqdm"]


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)


def test_numpy_is_enough():
    done = run(f"""
import sys
for name in {OPTIONAL}: sys.modules[name] = None
import numpy as np, dynstep
s = dynstep.solve(dynstep.LinearSystem(np.ones(2), K=dynstep.banded([[2.0, 2.0]], 0, 0)), (0, 1), [1, 2], [0, 0], h=0.1)
assert s.success and dynstep.methods() and repr(s)
for f, extra in ((s.plot, "matplotlib"), (lambda: dynstep.signature("force"), "numba")):
    try: f()
    except ImportError as error: assert extra in str(error)
    else: raise AssertionError(extra)
""")
    assert done.returncode == 0, done.stderr


def test_import_is_light():
    done = run("import sys, dynstep; print(*(m for m in sys.modules if m in %r))" % OPTIONAL)
    assert done.stdout.strip() == "" and done.stderr == ""


def test_public_names_have_docstrings():
    # dynstep.scipy is a module that is there once it was asked for
    assert sorted(dynstep.__all__) == sorted(n for n, x in vars(dynstep).items() if n[0] != "_" and not inspect.ismodule(x))
    for name in dynstep.__all__:
        public = getattr(dynstep, name)
        assert public.__doc__ and len(public.__doc__) > 40, name
        members = vars(public).items() if inspect.isclass(public) else ()
        for member, value in members:
            if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                assert value.__doc__, f"{name}.{member}"
    assert dynstep.__version__.count(".") == 2


def test_the_library_prints_nothing():
    done = run("""
import dynstep, numpy as np
for f in (lambda t, q, v: 1/0, lambda t, q, v: None, lambda t, q, v: q*np.nan):
    try: dynstep.solve(dynstep.MechanicalSystem(1, f), (0, 1), 1, 0, h=0.1)
    except Exception: pass
""")
    assert done.stdout == done.stderr == "" and done.returncode == 0


# ---- Records ----

HEADER = "A RECORD\nOF NOTHING\nUNITS OF G\n"


def write(path, text):
    path.write_text(text)
    return path


@pytest.mark.parametrize("size_line", ["NPTS=  7, DT= .0200 SEC", "   7    0.0200   NPTS, DT"])
def test_read_at2(tmp_path, size_line):
    values = np.array([0.1, -0.25, 3e-3, 0, 1, 2, -1.5])
    path = write(tmp_path / "récord é.AT2", HEADER + size_line + "\n" + " .1 -0.25 3.0E-3 0 1\n 2 -1.5\n")
    for name in (path, str(path)):
        dt, read = dynstep.read_at2(name)
        assert dt == 0.02 and np.array_equal(read, values)


@pytest.mark.parametrize("text, words", [
    ("", "header"),
    ("hello\n", "header"),
    (HEADER + "NPTS=  7, DT= .0200 SEC\n 1 2 3\n", "7"),
    (HEADER + "NPTS=  3, DT= .0200 SEC\n 1 two 3\n", "two"),
    (HEADER + "NPTS=  3, DT= -.0200 SEC\n 1 2 3\n", ""),
    (HEADER + "NPTS=  many, DT= .0200 SEC\n 1 2 3\n", ""),
    (HEADER + "NPTS=  3, DT= .0200 SEC\n 1 nan 3\n", ""),
])
def test_files_that_are_no_records(tmp_path, text, words):
    path = write(tmp_path / "bad.at2", text)
    with pytest.raises(ValueError, match="bad.at2") as caught:
        dynstep.read_at2(path)
    assert words in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileNotFoundError):
        dynstep.read_at2(tmp_path / "none.at2")
    with pytest.raises(OSError):
        dynstep.read_at2(tmp_path)
    with pytest.raises(TypeError):
        dynstep.read_at2(None)
