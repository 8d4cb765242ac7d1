# SPDX-License-Identifier: BSD-3-Clause
"""The record that the examples read is the one that its script makes."""
import importlib.util
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]


def load_script():
    spec = importlib.util.spec_from_file_location("make_record", ROOT / "tools/make_record.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_shipped_record_is_what_the_script_makes():
    script = load_script()
    shipped = (ROOT / "examples/data/synthetic.AT2").read_text().splitlines()
    made = script.at2(script.motion()).splitlines()
    assert shipped[:4] == made[:4]
    values, again = ([float(word) for line in lines[4:] for word in line.split()] for lines in (shipped, made))
    assert len(values) == script.POINTS
    # another libm may change the last printed digit
    assert max(abs(a - b) for a, b in zip(values, again, strict=True)) < 1e-6
    assert max(map(abs, values)) == script.PEAK


def test_the_ground_comes_to_rest():
    script = load_script()
    values = script.motion()
    velocity = script.DT * sum(values)                                        # g s
    assert abs(velocity) < 1e-3
    assert abs(values[0]) < 1e-12 and max(map(abs, values[-100:])) < 0.02 * script.PEAK
