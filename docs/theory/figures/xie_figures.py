#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Figs. 3.1 to 3.22, 4.2 to 4.5 and 5.1 to 5.4 of Xie (1995), drawn again from what the library computes.

usage: xie_figures.py [FOLDER]      with dynstep and matplotlib; writes PNG files into FOLDER (default: this one)
"""
import pathlib
import sys

import matplotlib
import numpy as np

import dynstep

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ALPHAS = ((0.1, 0.2, 0.3, 0.4), (0.41, 0.42, 0.43, 0.44, 0.45), (0.46, 0.47, 0.48, 0.49, 0.5))
STARTS = ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0))
ANGLES = (0.0, 15.0, 45.0, 75.0, 90.0)


def bi(p, q, alpha):
    return dynstep.BI((p, q), alpha)


def domains(p, numbers):
    """Stability domains: the curves |R| = 1, unstable inside; poles in the left half-plane marked."""
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 4.2), layout="constrained")
    for ax, alphas, number in zip(axes, ALPHAS, numbers):
        for i, alpha in enumerate(alphas):
            domain = dynstep.stability_domain(bi(p, 5, alpha))
            for curve in domain.boundary:
                ax.plot(curve.real, curve.imag, color=f"C{i}", lw=1.0)
            if not domain.boundary:
                ax.axvline(0.0, color=f"C{i}", lw=1.0)
            left = domain.poles[domain.poles.real < 0]
            ax.plot(left.real, left.imag, "x", color=f"C{i}", ms=5)
            ax.plot([], [], color=f"C{i}", label=f"{alpha:g}: A({domain.a_angle:.2f}°)")
        ax.axvline(0.0, color="0.5", lw=0.7, zorder=0)
        ax.set_ylim(-22, 22)
        ax.set_xlim(-4, 40 if p == 5 and alphas[0] > 0.4 else 24)
        ax.set_title(f"Fig. {number}: BI{p}5")
        ax.set_xlabel("Re(h lambda)")
        ax.legend(title="alpha", fontsize=7, title_fontsize=8, loc="lower right")
    axes[0].set_ylabel("Im(h lambda)")
    return figure


def accuracy(p, numbers):
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 4.0), layout="constrained")
    for ax, x0, number in zip(axes, STARTS, numbers):
        for i, alpha in enumerate(ALPHAS[0] + (0.5,)):
            dynstep.accuracy_domain(bi(p, 5, alpha), 1e-4, x0, angles=np.arange(0.0, 180.5, 2.5)).plot(
                ax, color=f"C{i}", lw=1.0, label=f"{alpha:g}")
        ax.set_title(f"Fig. {number}: BI{p}5, x0 = ({x0[0]:g}, {x0[1]:g})")
        ax.axvline(0.0, color="0.5", lw=0.7, zorder=0)
        ax.legend(title="alpha", fontsize=7, title_fontsize=8)
    return figure


def damping(p, numbers):
    figure, axes = plt.subplots(2, 5, figsize=(12.0, 4.8), layout="constrained", sharex=True)
    for column, (angle, number) in enumerate(zip(ANGLES, numbers)):
        for alpha, style in ((0.1, "C0:"), (0.4, "C3-.")):
            result = dynstep.damping_frequency(bi(p, 5, alpha), angle, np.linspace(0.0, 20.0, 801))
            axes[0, column].plot(result.r, result.damping, style, lw=1.2, label=f"alpha {alpha:g}")
            turns = np.where(abs(np.diff(result.frequency, append=np.nan)) > np.pi, np.nan, result.frequency)
            axes[1, column].plot(result.r, turns, style, lw=1.2)
        axes[0, column].plot(result.r, result.exact_damping, "k-", lw=0.8, label="exact")
        exact = result.exact_frequency
        axes[1, column].plot(result.r, np.where(abs(np.diff(exact, append=np.nan)) > np.pi, np.nan, exact), "k-", lw=0.8)
        axes[0, column].set_ylim(-4, 12)
        axes[0, column].set_title(f"Fig. {number}: {angle:g}°", fontsize=10)
        axes[0, column].axhline(0.0, color="0.6", lw=0.6, zorder=0)
        axes[1, column].set_xlabel("r")
    axes[0, 0].set_ylabel(f"damping, BI{p}5")
    axes[1, 0].set_ylabel("frequency")
    axes[0, 0].legend(fontsize=7)
    return figure


def pocket():
    """(4,5) at 0.47, the value that the thesis recommends."""
    figure, axes = plt.subplots(1, 2, figsize=(8.0, 4.2), layout="constrained")
    domain = dynstep.stability_domain(bi(4, 5, 0.47))
    domain.plot(axes[0])
    axes[0].set_title("BI45, alpha = 0.47")
    axes[0].legend(fontsize=7, loc="lower right")
    domain.plot(axes[1], extent=(-1.6, 0.8, 5.0, 8.0))
    axes[1].set_title("the pocket in the left half-plane")
    for angle in np.radians((90.0, 95.0, 100.0)):
        r = np.array([4.5, 9.0])
        axes[1].plot(r*np.cos(angle), r*np.sin(angle), "0.4", lw=0.8, ls="--")
    return figure


INPUTS = (("pulse", lambda t: 0.1*(t < 0.5)), ("step", lambda t: 0.1), ("ramp", lambda t: 0.1*t))


def respond(arm, until, angle=0.0):
    """Times, hub angles in degrees and tip deflections; the step ends where the pulse does."""
    q = arm.straight(angle)
    v = np.zeros(arm.n)
    t, hub, tip = [], [], []
    for span in ((0.0, 0.5), (0.5, until)):
        s = dynstep.solve(arm, span, q, v, "pade", h=0.005)
        q, v = s.q[:, -1], s.v[:, -1]
        t.append(s.t)
        hub.append(np.degrees(arm.hub_angle(s.q)))
        tip.append(arm.tip_deflection(s.q))
    return tuple(map(np.concatenate, (t, hub, tip)))


def responses(beam, segments, variants, numbers):
    """Hub angle and tip deflection: open loop under three torques, closed loop from 90 degrees."""
    figure, axes = plt.subplots(2, 2, figsize=(9.0, 6.0), layout="constrained")
    for variant, style in zip(variants, ("-", "--")):
        for i, (name, torque) in enumerate(INPUTS):
            arm = dynstep.FlexibleArm(segments, beam, variant=variant, input=torque)
            t, *curves = respond(arm, 2.0)
            for ax, values in zip(axes[0], curves):
                ax.plot(t, values, style, color=f"C{i}", lw=1.2 if style == "-" else 0.8,
                        label=name if variant == variants[0] else f"{name}, {variant}")
        closed = dynstep.FlexibleArm(segments, beam, closed_loop=True, variant=variant)
        t, *curves = respond(closed, 5.0, np.pi/2)
        for ax, values in zip(axes[1], curves):
            ax.plot(t, values, style, color="C3", lw=1.2 if style == "-" else 0.8, label=variant)
    for ax, number, label in zip(axes.flat, numbers, ("hub angle [deg]", "tip deflection", "hub angle [deg]", "tip deflection")):
        ax.set_title(f"Fig. {number}")
        ax.set_ylabel(label)
        ax.set_xlabel("t")
        ax.grid(lw=0.3)
        ax.legend(fontsize=7)
    return figure


def main(folder):
    for name, figure in (
            ("xie_03_01_to_03", domains(4, ("3.1", "3.2", "3.3"))), ("xie_03_04_to_06", domains(5, ("3.4", "3.5", "3.6"))),
            ("xie_03_07_to_09", accuracy(4, ("3.7", "3.8", "3.9"))),
            ("xie_03_10_to_12", accuracy(5, ("3.10", "3.11", "3.12"))),
            ("xie_03_13_to_17", damping(4, [f"3.{i}" for i in range(13, 18)])),
            ("xie_03_18_to_22", damping(5, [f"3.{i}" for i in range(18, 23)])), ("xie_pocket", pocket()),
            ("xie_04_02_to_05", responses("euler-bernoulli", 10, ("consistent", "listing"), ("4.2", "4.3", "4.4", "4.5"))),
            ("xie_05_01_to_04", responses("timoshenko", 10, ("consistent",), ("5.1", "5.2", "5.3", "5.4")))):
        figure.savefig(folder/f"{name}.png", dpi=60 if name.startswith("xie_04") else 80, pil_kwargs={"optimize": True})
        plt.close(figure)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent)
