#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Make examples/data/synthetic.AT2, the ground motion that the examples shake buildings with.

Seeded white noise goes through the ground filter of Kanai and Tajimi (a soil layer: 15 rad/s, 60 %
damping), is shaped by an envelope (3 s rise, 9 s strong motion, decay), loses its slow part in the
filter of Clough and Penzien (1.5 rad/s, 70 % damping), and is scaled to its peak.

usage: make_record.py [FILE]
"""
import math
import pathlib
import random
import sys

SEED, DT, POINTS, PEAK = 1991, 0.01, 3000, 0.35          # peak in g
GROUND, SLOW = (15.0, 0.6), (1.5, 0.7)                   # circular frequency in rad/s, damping ratio


def oscillator(omega, damping, base):
    """Relative displacement, velocity and acceleration of an oscillator on a moving base (average acceleration)."""
    x = v = a = 0.0
    for b in base:
        q, w = x + DT * v + DT**2 / 4 * a, v + DT / 2 * a
        a = (-b - 2 * damping * omega * w - omega**2 * q) / (1 + damping * omega * DT + omega**2 * DT**2 / 4)
        x, v = q + DT**2 / 4 * a, w + DT / 2 * a
        yield x, v, a


def envelope(t):
    if t < 3.0:
        return (t / 3.0) ** 2
    return 1.0 if t < 12.0 else math.exp(-0.3 * (t - 12.0))


def motion():
    """Accelerations in g."""
    noise = random.Random(SEED)
    omega, damping = GROUND
    filtered = [-(2 * damping * omega * v + omega**2 * x)
                for x, v, _ in oscillator(omega, damping, (noise.gauss(0.0, 1.0) for _ in range(POINTS)))]
    shaped = [envelope(DT * i) * a for i, a in enumerate(filtered)]
    result = [a for _, _, a in oscillator(*SLOW, shaped)]
    scale = PEAK / max(map(abs, result))
    return [scale * a for a in result]


def at2(values):
    """The text of a record in PEER's newer layout."""
    lines = ["SYNTHETIC GROUND MOTION OF DYNSTEP, NOT A RECORD OF AN EARTHQUAKE",
             f"FILTERED NOISE, SEED {SEED}, TOOLS/MAKE_RECORD.PY",
             "ACCELERATION TIME SERIES IN UNITS OF G",
             f"{len(values):7d}{DT:10.4f}    NPTS, DT"]
    lines += ["".join(f"{a:15.7E}" for a in values[i:i + 5]) for i in range(0, len(values), 5)]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    default = pathlib.Path(__file__).resolve().parent.parent / "examples/data/synthetic.AT2"
    (pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else default).write_text(at2(motion()))
