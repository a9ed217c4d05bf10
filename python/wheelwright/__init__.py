# SPDX-License-Identifier: Apache-2.0
"""Tight model-based fault detection for wheeled robots.

    import wheelwright as ww

    robot = ww.read_robot("robot.yaml")
    result = ww.commission(ww.read_log("drive.csv", robot), robot)
    run = ww.Detector(result.model).run(ww.read_log("another.csv", robot))
    run.residual, run.lower, run.upper, run.events

SI units everywhere; numbers of equations are those of Dixon, Walker and Dawson (2001). See docs/python.md.
"""

from . import bounds
from ._core import (
    Column,
    Commission,
    Decision,
    Design,
    Detection,
    Detector,
    DetectorRun,
    Diagnosis,
    Drive,
    Effect,
    EffectParameter,
    Error,
    Event,
    FaultMargins,
    FeasibleSet,
    GapCause,
    GapEstimate,
    Identification,
    InputError,
    InvalidArgument,
    LeastSquaresFit,
    Log,
    Margins,
    Model,
    ParameterResult,
    Regression,
    ResidualMargins,
    ResidualSeries,
    Robot,
    ShapeParameter,
    commission,
    design,
    detect,
    effect_catalogue,
    filter_log,
    gap,
    identify,
    least_squares,
    margins,
    read_log,
    read_model,
    read_robot,
    simulate,
    software,
)

__version__: str = software.split()[-1]

__all__ = [
    "bounds",
    "Column",
    "Commission",
    "Decision",
    "Design",
    "Detection",
    "Detector",
    "DetectorRun",
    "Diagnosis",
    "Drive",
    "Effect",
    "EffectParameter",
    "Error",
    "Event",
    "FaultMargins",
    "FeasibleSet",
    "GapCause",
    "GapEstimate",
    "Identification",
    "InputError",
    "InvalidArgument",
    "LeastSquaresFit",
    "Log",
    "Margins",
    "Model",
    "ParameterResult",
    "Regression",
    "ResidualMargins",
    "ResidualSeries",
    "Robot",
    "ShapeParameter",
    "commission",
    "design",
    "detect",
    "effect_catalogue",
    "filter_log",
    "gap",
    "identify",
    "least_squares",
    "margins",
    "read_log",
    "read_model",
    "read_robot",
    "simulate",
]
