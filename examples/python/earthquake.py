# SPDX-License-Identifier: BSD-3-Clause
"""A ten-storey building in an earthquake: Newmark-extrapolation against plain Newmark.

    python earthquake.py RECORD.AT2

Peaks of the roof displacement and of the storey drifts at the samples of the record, with two errors each: an
estimate that needs no better solution, and the true one, against a refined run.  Both methods make the same number
of substeps; the extrapolation solves once more in each base step, for the acceleration at its end.

The ground motion is piecewise linear between its samples.  A base step that ends on samples sees a smooth load and
keeps its order 8; a longer one would fall back to order 2.  With matplotlib the picture earthquake.png is drawn.
"""
import sys

import numpy as np

import dynstep
from dynstep import Newmark, NewmarkExtrapolation

STOREYS, HEIGHT, GRAVITY = 10, 3.5, 9.80665         # -, m, m/s^2
MASS, STIFFNESS, DAMPING = 1.0e5, 1.8e8, 0.05       # kg and N/m of a storey, ratio in modes 1 and 2
SUBSTEPS = 10                                       # harmonic sequence: 1 + 2 + 3 + 4


def building(dt, acceleration):
    """LinearSystem of the building on the moving ground, and its natural frequencies."""
    k = np.zeros((3, STOREYS))
    k[0, 1:] = k[2, :-1] = -STIFFNESS
    k[1] = 2*STIFFNESS
    k[1, -1] = STIFFNESS                                        # the roof is free
    m, stiffness = np.full(STOREYS, MASS), dynstep.banded(k, 1, 1)
    omega = np.sqrt(np.linalg.eigvalsh(stiffness.toarray()/MASS))
    # C = alpha M + beta K with alpha/omega + beta omega = 2 * damping ratio in modes 1 and 2
    alpha, beta = 2*DAMPING/(omega[0] + omega[1])*np.array([omega[0]*omega[1], 1.0])
    c = beta*k
    c[1] += alpha*m
    load = dynstep.ground_motion(m, dt, acceleration)
    return dynstep.LinearSystem(m, dynstep.banded(c, 1, 1), stiffness, load), omega


def response(system, duration, dt, method, parts):
    """Solution at the samples of the record, by steps of dt/parts, from rest."""
    rest = np.zeros(STOREYS)
    solution = dynstep.solve(system, (0, duration), rest, rest, method, h=dt/parts, every=parts)
    if not solution.success:
        sys.exit(f"earthquake: {solution.message}")
    return solution


def drifts(q):
    """Displacement of each floor relative to the floor below."""
    return np.diff(q, axis=0, prepend=0)


def peaks(solution):
    """Largest roof displacement, then the storey drifts from below, in mm."""
    return 1e3*np.append(np.abs(solution.q[-1]).max(), np.abs(drifts(solution.q)).max(axis=1))


def print_summary(path, dt, record, omega, runs):
    plain, finer, high, higher, reference = (peaks(run) for run in runs)
    print(f"Ground motion  {path}")
    print(f"{'':15}{record.size} samples, one every {dt:.4f} s, peak {np.abs(record).max():.3f} g")
    print("Building       10 storeys of 100 t and 180 kN/mm, periods", *(f"{2*np.pi/w:.3f}" for w in omega[:3]),
          "... s, damping 5 %\n")
    print(f"{'':27}{'peak':18}{'plain Newmark, h = dt/10':26}extrapolation, base step dt")
    print(f"{'':27}{'[mm]':18}{'estimate':12}{'true error':14}{'estimate':12}true error")
    # halving h takes 3/4 of an error of order 2; a further level takes nearly all of one of order 8
    columns = reference, 4*(plain - finer)/3, plain - reference, high - higher, high - reference
    for i in (0, *range(STOREYS, 0, -1)):
        label = f"drift of storey {i:2}" if i else "roof displacement"
        p, *errors = (column[i] for column in columns)
        print(f"{label:21}{p:12.6f}{'':10}{errors[0]:10.1E}{errors[1]:14.1E}{errors[2]:12.1E}{errors[3]:14.1E}")
    print(f"\nLargest drift: {reference[1:].max()/HEIGHT/10:5.2f} % of the storey height")
    print(f"Linear solves: plain Newmark {runs[0].counts['solves']}, extrapolation {runs[2].counts['solves']}")
    print(f"Largest error: plain Newmark {np.abs(plain - reference).max():.1E} mm, "
          f"extrapolation {np.abs(high - reference).max():.1E} mm")


def draw(path, record, runs):
    import matplotlib.pyplot as plt

    plain, _, high, _, reference = runs
    t = reference.t
    figure, axes = plt.subplot_mosaic([["ground", "drift"], ["roof", "drift"], ["error", "drift"]], figsize=(11, 8),
                                      width_ratios=[2.2, 1], sharex=False, layout="constrained")
    figure.suptitle(f"Ten-storey building, ground motion {path.rpartition('/')[2]}")
    axes["ground"].plot(t, record, color="0.3", linewidth=0.7)
    axes["ground"].set_ylabel("ground acceleration [g]")
    axes["roof"].plot(t, 1e3*plain.q[-1], color="C1", linewidth=2.5, label="plain Newmark, h = dt/10")
    axes["roof"].plot(t, 1e3*high.q[-1], color="C0", linewidth=0.9, label="extrapolation, base step dt")
    axes["roof"].set_ylabel("roof displacement [mm]")
    axes["roof"].legend(loc="upper right")
    for run, colour, label in ((plain, "C1", "plain Newmark"), (high, "C0", "extrapolation")):
        error = 1e3*np.abs(run.q[-1] - reference.q[-1])[1:]
        axes["error"].semilogy(t[1:], np.maximum(error, 1e-14), colour, linewidth=0.7, label=label)
    axes["error"].set_ylabel("error of the roof [mm]")
    axes["error"].set_ylim(1e-15, 10)
    axes["error"].set_xlabel("time [s]")
    axes["error"].legend(loc="upper right", ncols=2)
    for name in ("ground", "roof", "error"):
        axes[name].set_xlim(0, t[-1])
        axes[name].grid(alpha=0.3)
    axes["drift"].barh(np.arange(1, STOREYS + 1), peaks(reference)[1:], color="C0")
    axes["drift"].set_yticks(np.arange(1, STOREYS + 1))
    axes["drift"].set_xlabel("largest drift [mm]")
    axes["drift"].set_ylabel("storey")
    axes["drift"].set_title("Storey drifts")
    axes["drift"].grid(axis="x", alpha=0.3)
    figure.savefig("earthquake.png", dpi=110)


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: python earthquake.py RECORD.AT2, for example examples/data/synthetic.AT2")
    path = sys.argv[1]
    try:
        dt, record = dynstep.read_at2(path)
    except (OSError, ValueError) as error:
        sys.exit(f"earthquake: {error}")
    system, omega = building(dt, GRAVITY*record)
    runs = [response(system, (record.size - 1)*dt, dt, method, parts) for method, parts in [
        (Newmark(), SUBSTEPS),                                           # h = dt/10
        (Newmark(), 2*SUBSTEPS),                                         # h = dt/20, for the estimate
        (NewmarkExtrapolation(4, "harmonic"), 1),                        # base step dt, order 8
        (NewmarkExtrapolation(5, "harmonic"), 1),                        # order 10, for the estimate
        (NewmarkExtrapolation(8, "double-harmonic"), 2)]]                # order 16, base step dt/2
    print_summary(path, dt, record, omega, runs)
    try:
        draw(path, record, runs)
    except ImportError:
        print("No picture: matplotlib is not installed")
    else:
        print("Picture: earthquake.png")


if __name__ == "__main__":
    main()
