# SPDX-License-Identifier: Apache-2.0
"""Sets of parameters from rows of numbers: knows no robot and no file.

A row says lower <= Y theta <= upper; `prior` (p, 2) is a finite box. All bounds are rounded outward.
"""

from ._core import FeasibleSet, IntervalHull, MinimaxFit, ThresholdRule, interval_hull, minimax_fit

__all__ = ["FeasibleSet", "IntervalHull", "MinimaxFit", "ThresholdRule", "interval_hull", "minimax_fit"]
