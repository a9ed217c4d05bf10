# SPDX-License-Identifier: Apache-2.0
"""Results as tables: for a notebook (html), for pandas (frame), in one line (line). The compiled part calls these
three."""

import html as markup
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, Union

import numpy as np

from . import _core as core

MOST_ROWS = 60  # that a notebook shows

_Columns = dict[str, Any]


class Row(NamedTuple):
    """What a notebook shows of one thing."""

    what: str
    value: Union[float, str, None] = None
    interval: Union[tuple[Any, Any], None] = None
    unit: str = ""
    verdict: str = ""


class Shown(NamedTuple):
    """A result: what it is in a few words, and its rows."""

    title: str
    rows: Iterable[Row]


def _number(x: Union[float, str, None]) -> str:
    if isinstance(x, str):
        return x
    return "–" if x is None or math.isnan(x) else f"{x:.5g}"


def _columns(names: str, rows: Iterable[Iterable[Any]]) -> _Columns:
    """Rows as columns; `names` apart by blanks."""
    given = [list(row) for row in rows]
    return {name: [row[k] for row in given] for k, name in enumerate(names.split())}


def _fields(names: str, things: Iterable[Any]) -> _Columns:
    return _columns(names, ([getattr(thing, name) for name in names.split()] for thing in things))


def _items(names: str, things: Iterable[dict[str, Any]]) -> _Columns:
    return _columns(names, ([thing[name] for name in names.split()] for thing in things))


# Commission


def _commission(c: core.Commission) -> Shown:
    rows = (Row(p.name, p.estimate, (p.lower, p.upper), p.unit,
                p.warrant if p.excitation == "identified" else f"{p.excitation.replace('_', ' ')}: {p.reason}")
            for p in c.parameters)
    return Shown(f"of {c.robot.name}: {c.status}", rows)


def _commission_frame(c: core.Commission) -> _Columns:
    return _fields("name unit physical estimate standard_error lower upper warrant excitation reason lower_is_prior "
                   "upper_is_prior", c.parameters)


# Detection


def _events(d: core.Detection) -> list[tuple[str, core.Event]]:
    return [("torque", e) for e in d.events] + [("kinematic", e) for e in d.kinematic_events]


def _detection(d: core.Detection) -> Shown:
    incidents = (Row(f"incident {k + 1}", i["alarm"], (i["start"], i["end"]), "s", i["sentence"])
                 for k, i in enumerate(d.incidents))
    found = "fault" if d.fault else f"not decided: {d.undecided}" if d.undecided else "no fault"
    return Shown(f"of {found}: {len(_events(d))} events, {len(d.incidents)} incidents", incidents)


def _detection_frame(d: core.Detection) -> _Columns:
    names = "output start alarm end peak_time peak_residual peak_ratio instants start_row"
    table = _fields(names, (e for _, e in _events(d)))
    incident = [next((k for k, i in enumerate(d.incidents) if i["start"] <= e.start <= i["end"]), None)
                for _, e in _events(d)]
    return {"residual": [residual for residual, _ in _events(d)], **table, "incident": incident}


def _run(r: core.DetectorRun) -> Shown:
    rows = (Row(output, float(np.max(np.abs(r.residual[:, i]), initial=0.0)),
                (float(np.min(r.lower[:, i], initial=0.0)), float(np.max(r.upper[:, i], initial=0.0))), unit,
                f"{int(r.outside[:, i].sum())} of {len(r)} instants outside")
            for i, (output, unit) in enumerate(zip(r.outputs, r.output_units)))
    return Shown(f"of {len(r)} instants: {len(r.events)} events", rows)


def _run_frame(r: core.DetectorRun) -> _Columns:
    n = len(r.outputs)
    table: _Columns = {"t": np.repeat(r.t, n), "row": np.repeat(r.row, n), "output": r.outputs * len(r)}
    for name in ("predicted", "residual", "lower", "upper", "dead_zone", "outside", "alarm"):
        table[name] = getattr(r, name).ravel()
    return table


def _margin_rows(m: core.Margins) -> Iterable[tuple[str, core.FaultMargins]]:
    return ((residual.name, fault) for residual in m.residuals for fault in residual.faults)


def _margins(m: core.Margins) -> Shown:
    window = int(np.searchsorted(m.windows, 1.0, side="right")) - 1 if m.windows[0] <= 1.0 else 0

    def rows() -> Iterable[Row]:
        for residual, f in _margin_rows(m):
            s = f.summarise(window)
            yield Row(f"{f.fault} {'+' if f.side > 0 else '−'} ({residual})", s["median"], (s["best"], s["worst"]),
                      f.unit,
                      f"certain at {s['certain']} of {s['onsets']} onsets")

    return Shown(f"over {m.seconds:.5g} s, within {m.windows[window]:.5g} s", rows())


def _margins_frame(m: core.Margins) -> _Columns:
    rows = []
    for residual, f in _margin_rows(m):
        for manoeuvre in dict.fromkeys(f.manoeuvres):
            for w, window in enumerate(m.windows):
                s = f.summarise(w, manoeuvre)
                rows.append([residual, f.fault, f.side, f.unit, manoeuvre, window, s["onsets"], s["certain"], s["best"],
                             s["median"], s["worst"]])
    return _columns("residual fault side unit manoeuvre window onsets certain best median worst", rows)


# Gap and design


def _gap(d: core.Diagnosis) -> Shown:
    def rows() -> Iterable[Row]:
        for cause in d.causes:
            yield Row(cause.effect, 100.0 * cause.share, None, "% of the gap", cause.sentence)
            for e in cause.parameters.values():
                yield Row(f"{cause.effect}.{e.name}", e.estimate, (e.lower, e.upper), e.unit)

    return Shown(d.verdict, rows())


def _gap_frame(d: core.Diagnosis) -> _Columns:
    rows = ([cause.effect, e.name, e.unit, e.estimate, e.lower, e.upper, cause.share, cause.parametric]
            for cause in d.causes for e in cause.parameters.values())
    return _columns("effect parameter unit estimate lower upper share parametric", rows)


def _design(d: core.Design) -> Shown:
    result = d.to_dict()
    aim, warrant = result["for"], result["warrant"]

    def rows() -> Iterable[Row]:
        for p in result.get("parameters", []):
            yield Row(p["name"], p["believed"], (p["promised"]["lower"], p["promised"]["upper"]), p["unit"], warrant)
        for f in result.get("faults", []):
            side = "+" if f["side"] == "positive" else "−"
            yield Row(f"{f['fault']} {side}", f["promised"]["smallest"], None, f["unit"], f"asked: {f['asked']:.5g}")
        for p in result.get("pairs", []):
            yield Row(f"{p['true']}, not {p['other']}", p["promised"]["deviations"], None, "standard deviations",
                      "" if p["decidable"] else "no motion tells them apart")

    return Shown(f"for {aim}: {result['limits']['duration']:.5g} s", rows())


def _design_frame(d: core.Design) -> _Columns:
    return dict(d.commands)


# A log before it is used


def _identification_rows(i: core.Identification) -> list[list[Any]]:
    result = i.to_dict()
    method = next((m for m in result["regions"]["methods"] if m["available"]), None)
    rows = []
    for k, p in enumerate(result["parameters"]):
        ends = (method["lower"][k], method["upper"][k]) if method else (None, None)
        rows.append([p["name"], p["unit"], p["estimate"], p["standard_error"], *ends,
                     method["method"] if method else "", p["excitation"], p["reason"]])
    return rows


def _identification(i: core.Identification) -> Shown:
    rows = (Row(name, estimate, (lower, upper), unit, reason or excitation.replace("_", " "))
            for name, unit, estimate, _, lower, upper, _, excitation, reason in _identification_rows(i))
    result = i.to_dict()
    return Shown(f"of {result['robot']['name']}: {result['message']}", rows)


def _identification_frame(i: core.Identification) -> _Columns:
    return _columns("name unit estimate standard_error lower upper method excitation reason", _identification_rows(i))


def _regression(r: core.Regression) -> Shown:
    rows = (Row(name, float(np.sqrt(np.mean(np.square(r.Y[:, :, j])))), None, "", "root mean square of the column")
            for j, name in enumerate(r.parameters))
    return Shown(f"of {len(r.t)} instants, {len(r.outputs)} outputs, {len(r.parameters)} parameters", rows)


def _regression_frame(r: core.Regression) -> _Columns:
    n = len(r.outputs)
    table: _Columns = {"t": np.repeat(r.t, n), "row": np.repeat(r.row, n), "output": r.outputs * len(r.t),
                       "y": r.y.ravel(), "dy": r.dy.ravel()}
    for j, name in enumerate(r.parameters):
        table[f"Y.{name}"] = r.Y[:, :, j].ravel()
        table[f"dY.{name}"] = r.dY[:, :, j].ravel()
    return table


def _doctor(h: core.LogHealth) -> Shown:
    rows = (Row(f["id"], f["value"], None, f["unit"], f"{f['severity']}: {f['sentence']} {f['next']}")
            for f in h.findings)
    return Shown(h.sentence, rows)


def _doctor_frame(h: core.LogHealth) -> _Columns:
    return _items("severity id topic sentence next columns value unit when stretches", h.findings)


# Choice, check


def _choice(c: core.DetectorChoice) -> Shown:
    rows = (Row(f"order {a['filter']['order']}, β = {a['filter']['beta']:.5g} 1/s, {a['persistence']['k']} of "
                f"{a['persistence']['n']}", a["size"], None, "of the stated size",
                a["failure"] or ("chosen" if k == 0 and c.chosen else a["origin"])) for k, a in enumerate(c.candidates))
    return Shown(f"of {len(c.candidates)} candidates: {c.robot_file or 'none is certain'}", rows)


def _choice_frame(c: core.DetectorChoice) -> _Columns:
    rows = ([a["filter"]["order"], a["filter"]["alpha"], a["filter"]["beta"], a["persistence"]["k"],
             a["persistence"]["n"],
             a["guarantee"], a["warrant"], a["size"], a["delay"], a["size_at_risk"], a["origin"], a["failure"],
             k == 0 and c.chosen is not None] for k, a in enumerate(c.candidates))
    return _columns("order alpha beta k n guarantee warrant size delay size_at_risk origin failure chosen", rows)


def _check(c: core.ModelCheck) -> Shown:
    rows = (Row(f"{b['parameter']} {'≤' if b['side'] == 'upper' else '≥'}", b["stated"], None, b["unit"],
                "proved" if b["proved"] else f"not proved: {b['reason']}") for b in c.bounds)
    return Shown(c.message, rows)


def _check_frame(c: core.ModelCheck) -> _Columns:
    return _items("parameter unit side stated shown proved shortfall rows reason", c.bounds)


def _comparison_rows(c: core.ModelComparison) -> Iterable[tuple[dict[str, Any], dict[str, Any]]]:
    for each in c.sets:
        for parameter in each["parameters"]:
            yield each, parameter


def _comparison(c: core.ModelComparison) -> Shown:
    rows = (Row(f"{p['quantity']} ({s['of']}{'' if s['risk'] is None else ', at a risk'})", None,
                (p["change"][0], p["change"][1]), p["unit"], "changed" if p["certain"] else "")
            for s, p in _comparison_rows(c))
    return Shown(c.message, rows)


def _comparison_frame(c: core.ModelComparison) -> _Columns:
    rows = ([s["of"], s["risk"], p["quantity"], p["unit"], *p["before"], *p["after"], *p["change"], p["certain"]]
            for s, p in _comparison_rows(c))
    return _columns("of risk quantity unit before_lower before_upper after_lower after_upper change_lower change_upper "
                    "certain",
                    rows)


# Fleet, sensitivity


def _fleet(f: core.Fleet) -> Shown:
    def rows() -> Iterable[Row]:
        for record in f.records:
            first = record["commissioning"]
            events = sum(check["events"] for check in record["checks"])
            yield Row(record["robot"], float(events), None, "events", f"{first['status']}: {first['message']}")

    return Shown(f"of {len(f)} robots: {'well' if f.well else 'not well'}", rows())


def _fleet_frame(f: core.Fleet) -> _Columns:
    names = "name unit estimate standard_error lower upper lower_is_prior upper_is_prior warrant"
    none = dict.fromkeys(names.split())
    rows = []
    for record in f.records:
        first = record["commissioning"]
        rows += [[record["robot"], first["status"], *(p.get(name) for name in names.split())]
                 for p in first["parameters"] or [none]]
    return _columns("robot status " + names.replace("name", "parameter", 1), rows)


def _sensitivity(s: core.Sensitivity) -> Shown:
    without = sum(bool(finding) for finding in s.findings)

    def rows() -> Iterable[Row]:
        for q, quantity in enumerate(s.quantities):
            known = s.values[np.isfinite(s.values[:, q]), q]
            if len(known) > 0:
                yield Row(quantity["name"], float(np.median(known)), (float(known.min()), float(known.max())),
                          quantity["unit"], f"over {len(known)} of {len(s)} cases")
            else:
                yield Row(quantity["name"], None, None, quantity["unit"], "no value")

    return Shown(f"of {s.name or 'a study'}: {len(s)} cases, {without} of them without a model", rows())


def _sensitivity_frame(s: core.Sensitivity) -> _Columns:
    table: _Columns = {each["name"]: s.points[:, k] for k, each in enumerate(s.inputs)}
    table.update({each["name"]: s.values[:, k] for k, each in enumerate(s.quantities)})
    return {**table, "finding": s.findings}


def _flat(value: Any, key: str = "") -> Iterable[tuple[str, Any]]:
    if isinstance(value, dict):
        for name, member in value.items():
            yield from _flat(member, f"{key}.{name}" if key else name)
    else:
        yield key, value


def _robot_file(r: core.RobotFile) -> Shown:
    rows = (Row(key, value if isinstance(value, (int, float)) else str(value), None, "", r.origins.get(key, ""))
            for key, value in _flat(r.robot.to_dict()))
    return Shown(f"of {r.robot.name}", rows)


def _robot_file_frame(r: core.RobotFile) -> _Columns:
    return _columns("key value origin",
                    ([key, value, r.origins.get(key, "")] for key, value in _flat(r.robot.to_dict())))


_SHOWN: dict[type, Callable[[Any], Shown]] = {
    core.Commission: _commission, core.Detection: _detection, core.DetectorRun: _run, core.Margins: _margins,
    core.Diagnosis: _gap, core.Design: _design, core.Identification: _identification, core.Regression: _regression,
    core.LogHealth: _doctor, core.DetectorChoice: _choice, core.ModelCheck: _check,
    core.ModelComparison: _comparison, core.Fleet: _fleet,
    core.Sensitivity: _sensitivity, core.RobotFile: _robot_file,
}

_FRAME: dict[type, Callable[[Any], _Columns]] = {
    core.Commission: _commission_frame, core.Detection: _detection_frame, core.DetectorRun: _run_frame,
    core.Margins: _margins_frame, core.Diagnosis: _gap_frame, core.Design: _design_frame,
    core.Identification: _identification_frame, core.Regression: _regression_frame, core.LogHealth: _doctor_frame,
    core.DetectorChoice: _choice_frame, core.ModelCheck: _check_frame,
    core.ModelComparison: _comparison_frame, core.Fleet: _fleet_frame,
    core.Sensitivity: _sensitivity_frame, core.RobotFile: _robot_file_frame,
}


def _plain(text: str) -> str:
    """In one line, without control characters."""
    return "".join(c if c.isprintable() else " " for c in text)


def _title(result: Any, title: str) -> str:
    return _plain(f"{type(result).__name__} {title}")


def line(result: Any) -> str:
    return f"<wheelwright.{_title(result, _SHOWN[type(result)](result).title)}>"


def html(result: Any) -> str:
    shown = _SHOWN[type(result)](result)
    rows = list(shown.rows)
    text = [f"<table><caption>{markup.escape(_title(result, shown.title))}</caption><thead><tr>",
            *(f"<th>{head}</th>" for head in Row._fields), "</tr></thead><tbody>"]
    for row in rows[:MOST_ROWS]:
        interval = "" if row.interval is None else f"[{_number(row.interval[0])}, {_number(row.interval[1])}]"
        value = "" if row.value is None and row.interval is None else _number(row.value)
        cells = (row.what, value, interval, "" if row.unit == "1" else row.unit, row.verdict)
        text += ["<tr>", *(f'<td style="text-align: left">{markup.escape(_plain(cell))}</td>' for cell in cells),
                 "</tr>"]
    if len(rows) > MOST_ROWS:
        text.append(f'<tr><td colspan="{len(Row._fields)}">… and {len(rows) - MOST_ROWS} more</td></tr>')
    return "".join([*text, "</tbody></table>"])


def frame(result: Any) -> Any:
    try:
        import pandas
    except ImportError as error:
        raise core.Error("to_dataframe: pandas cannot be imported: expected it to be installed "
                         "(Debian: apt install python3-pandas; else: pip install pandas)") from error
    return pandas.DataFrame(_FRAME[type(result)](result))
