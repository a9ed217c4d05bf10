# SPDX-License-Identifier: Apache-2.0
"""Pictures of results with matplotlib, which is imported when the first one is drawn.

Each function draws into `ax` (by default a new figure's) and returns it. Lines differ in dashes, points in their shape
and areas in hatching, so that pictures say the same without colour.
"""

import math
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from ._core import Commission, DetectorRun, Diagnosis, Error, InvalidArgument, Margins, Model

__all__ = ["efforts", "feasible_set", "gap", "margins", "parameters", "residuals"]

Axes = Any  # matplotlib.axes.Axes; matplotlib 3.6 has no types


def _axes(ax: Axes) -> Axes:
    if ax is not None:
        return ax
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise Error("plot: matplotlib cannot be imported: expected it to be installed "
                    "(Debian: apt install python3-matplotlib; else: pip install matplotlib)") from error
    return plt.subplots(layout="constrained")[1]


def _with_unit(name: str, unit: str) -> str:
    return name if unit in ("", "1") else f"{name}, {unit}"


def _number_of(names: list[str], wanted: Union[int, str], what: str) -> int:
    if isinstance(wanted, str) and wanted in names:
        return names.index(wanted)
    if isinstance(wanted, int) and 0 <= wanted < len(names):
        return wanted
    raise InvalidArgument(f"{what} {wanted!r}: expected one of {', '.join(names)}, or its number below {len(names)}")


def parameters(result: Commission, ax: Axes = None) -> Axes:
    """Bounds and best guess of each parameter, relative to the best guess (to the set's centre where the log shows
    none).

    A bound that is the prior's, and not the log's, is an open circle.
    """
    ax = _axes(ax)
    for k, p in enumerate(result.parameters):
        scale = abs(p.chebyshev if p.estimate is None else p.estimate) or 1.0
        middle = p.chebyshev if p.estimate is None else p.estimate
        ends = [100.0 * (end - middle) / scale for end in (p.lower, p.upper)]
        ax.plot(ends, [k, k], "-", color="0.3")
        for end, is_prior in zip(ends, (p.lower_is_prior, p.upper_is_prior)):
            ax.plot([end], [k], "o" if is_prior else "|", color="0.3", fillstyle="none", markersize=8)
        ax.plot([0.0], [k], "k+" if p.estimate is None else "kx")
    widest = max((abs(x) for each in ax.lines for x in each.get_xdata() if math.isfinite(x)), default=0.0)
    if widest > 200.0:
        ax.set_xscale("symlog", linthresh=1.0)
    ax.set_yticks(range(len(result.parameters)), [_with_unit(p.name, p.unit) for p in result.parameters])
    ax.set(xlabel="deviation from the best guess, %", ylabel="parameter", title=f"Bounds ({result.warrant})")
    ax.invert_yaxis()
    return ax


def residuals(run: DetectorRun, output: Union[int, str] = 0, ax: Axes = None) -> Axes:
    """Residual of one output against its threshold; crosses where it is outside, a dashed line at each alarm."""
    i = _number_of(run.outputs, output, "output")
    ax = _axes(ax)
    ax.fill_between(run.t, run.lower[:, i], run.upper[:, i], facecolor="0.9", edgecolor="0.6", hatch="///",
                    linewidth=0.5,
                    label="threshold")
    ax.plot(run.t, run.residual[:, i], "k-", linewidth=0.8, label="residual")
    outside = run.outside[:, i]
    if outside.any():
        ax.plot(run.t[outside], run.residual[outside, i], "x", color="tab:red", markersize=3,
                markeredgewidth=0.4, label="outside")
    for k, event in enumerate(e for e in run.events if e.output == run.outputs[i]):
        ax.axvline(event.alarm, color="tab:red", linestyle="--", linewidth=0.8, label=None if k > 0 else "alarm")
    ax.set(xlabel="t, s", ylabel=_with_unit(f"residual of {run.outputs[i]}", run.output_units[i]))
    ax.legend(loc="best")
    return ax


def efforts(run: DetectorRun, output: Union[int, str] = 0, ax: Axes = None) -> Axes:
    """Filtered effort of one output: measured (solid) and predicted by the model (dashed)."""
    i = _number_of(run.outputs, output, "output")
    ax = _axes(ax)
    ax.plot(run.t, run.predicted[:, i] + run.residual[:, i], "-", color="0.5", linewidth=1.6, label="measured")
    ax.plot(run.t, run.predicted[:, i], "k--", linewidth=0.9, label="predicted")
    ax.set(xlabel="t, s", ylabel=_with_unit(f"filtered {run.outputs[i]}", run.output_units[i]))
    ax.legend(loc="best")
    return ax


def _outline(result: Union[Commission, Model], i: int, j: int) -> NDArray[np.float64]:
    """Corners of the set's projection: where neighbouring tangents of 720 directions meet."""
    found = result.feasible_set
    width = np.maximum(found.hull[:, 1] - found.hull[:, 0], np.finfo(float).tiny)
    angles = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    directions = np.zeros((len(angles), found.dimension))
    directions[:, i], directions[:, j] = np.cos(angles) / width[i], np.sin(angles) / width[j]
    reach = np.array([found.support(d) for d in directions])
    plane = directions[:, [i, j]]
    pairs = np.stack([plane, np.roll(plane, -1, axis=0)], axis=1)
    corners: NDArray[np.float64] = np.linalg.solve(pairs,
                                                   np.stack([reach, np.roll(reach, -1)], axis=1)[..., None])[..., 0]
    return corners


def feasible_set(result: Union[Commission, Model], x: Union[int, str] = 0, y: Union[int, str] = 1,
                 ax: Axes = None) -> Axes:
    """All pairs of two parameters that the log allows, whatever the others are, in the box of their bounds (dashed)."""
    if isinstance(result, Commission):
        units = {p.name: p.unit for p in result.parameters}
    else:
        units = {p["name"]: p["unit"] for p in result.robot.parameters}
        units = {name: units.get(name, "") for name in result.parameters}
    names = list(units)
    i, j = _number_of(names, x, "parameter"), _number_of(names, y, "parameter")
    if i == j:
        raise InvalidArgument(f"parameter {names[i]} twice: expected two different ones")
    corners, hull = _outline(result, i, j), result.feasible_set.hull
    ax = _axes(ax)
    ax.fill(corners[:, 0], corners[:, 1], facecolor="0.9", edgecolor="k", hatch="///", linewidth=0.8,
            label="all that the log allows")
    (left, right), (low, high) = hull[i], hull[j]
    ax.plot([left, right, right, left, left], [low, low, high, high, low], "k--", linewidth=0.8, label="bounds")
    ax.plot([result.estimate[i]], [result.estimate[j]], "kx", label="best guess")
    ax.set(xlabel=_with_unit(names[i], units[names[i]]), ylabel=_with_unit(names[j], units[names[j]]))
    ax.legend(loc="best")
    return ax


def margins(result: Margins, window: Union[int, None] = None, ax: Axes = None) -> Axes:
    """Faults × manoeuvres: the smallest size that is certain to be seen within a window, median over its onsets.

    window: number in result.windows, by default the longest up to 1 s. Grey: share of the onsets at which some size is
    certain.
    """
    if window is None:
        window = max(int(np.searchsorted(result.windows, 1.0, side="right")) - 1, 0)
    elif not 0 <= window < len(result.windows):
        raise InvalidArgument(f"window {window}: expected a number below {len(result.windows)}")
    faults = [(residual.name, fault) for residual in result.residuals for fault in residual.faults]
    if not faults:
        raise InvalidArgument("margins: no fault leaves a trace in any residual: expected one at least")
    kinds = list(dict.fromkeys(kind for _, fault in faults for kind in fault.manoeuvres))
    share = np.zeros((len(faults), len(kinds)))
    ax = _axes(ax)
    for row, (_, fault) in enumerate(faults):
        for column, kind in enumerate(kinds):
            s = fault.summarise(window, kind)
            share[row, column] = s["certain"] / s["onsets"] if s["onsets"] else 0.0
            text = f"{s['median']:.3g}" if math.isfinite(s["median"]) else "–"
            ax.text(column, row, text, ha="center", va="center", fontsize="small",
                    color="w" if share[row, column] > 0.5 else "k")
    picture = ax.imshow(share, cmap="Greys", vmin=0.0, vmax=1.0, aspect="auto")
    ax.figure.colorbar(picture, ax=ax, label="share of onsets with a certain size")
    ax.set_xticks(range(len(kinds)), kinds, rotation=30, ha="right")
    ax.set_yticks(range(len(faults)),
                  [_with_unit(f"{fault.fault} {'+' if fault.side > 0 else '−'} ({name})", fault.unit)
                                       for name, fault in faults])
    ax.set(xlabel="manoeuvre", ylabel="fault, unit of its size",
           title=f"Smallest certain size within {result.windows[window]:.3g} s")
    return ax


def gap(diagnosis: Diagnosis, channel: Union[int, str] = 0, ax: Axes = None) -> Axes:
    """Residual of one channel before (solid grey) and after the causes are in the model (dashed), and the noise
    floor."""
    i = _number_of([s.channel for s in diagnosis.series], channel, "channel")
    series = diagnosis.series[i]
    ax = _axes(ax)
    ax.axhspan(-series.floor, series.floor, facecolor="none", edgecolor="0.6", hatch="...", linewidth=0.0,
               label="noise, ± 1 standard deviation")
    ax.plot(series.t, series.nominal, "-", color="0.5", linewidth=1.4, label="before")
    if len(series.after) > 0:
        ax.plot(series.t, series.after, "k--", linewidth=0.8, label="with the causes")
    ax.set(xlabel="t, s", ylabel=_with_unit(f"residual of {series.channel}", series.unit), title=diagnosis.verdict)
    ax.legend(loc="best")
    return ax
