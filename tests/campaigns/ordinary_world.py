# SPDX-License-Identifier: Apache-2.0
"""Random differential drives and their logs, for tests/campaigns/ordinary_logs.py. Shares nothing with model/sim.

The integrator steps many robots at once. Between two steps it is exact for the linear part (exponentials in the body's
speeds); dry friction of the wheels is an impulse within its limit that stops a wheel where it can (Moreau's time
stepping), so that a wheel sticks, and reverses within a step. True values are those of the model: with F the force of
both wheels' torques, m dv/dt = F - viscous v, I dw/dt = M - viscous_yaw w, dry friction at each wheel.
"""

import datetime
import json
import struct
from dataclasses import dataclass, field

import numpy as np

TABLE = 0.005  # s between entries of a reference
# What may change over time, with the value that changes nothing: factors on radii, on what a wheel rolls of its way
# (the rest slips), on mass, viscous friction of both kinds, N m of dry friction more at a wheel, and slip of the whole
# robot: m/s along its heading and to its left, rad/s about the vertical.
COURSES = {"radius_right": 1.0, "radius_left": 1.0, "rolls_right": 1.0, "rolls_left": 1.0, "mass": 1.0, "friction": 1.0,
           "brake_right": 0.0, "brake_left": 0.0, "along": 0.0, "across": 0.0, "about": 0.0}
SIDES = ("r", "l")


@dataclass
class Robot:
    """Robot, drive and control of one log, in SI units. `torque` and `speed` are tables every TABLE s: torques that are
    applied open loop, and wheel speeds that a PI controller of the wheels follows; one column a wheel, right first."""
    mass: float
    inertia: float
    viscous: float
    viscous_yaw: float
    coulomb: float  # N m at each wheel
    radius: float
    track: float
    rate: float  # Hz of the log
    seconds: float
    hold: str  # at_samples: torques change at stamps; between: `phase` of a step before them; linear: all the time
    speed: np.ndarray = None
    torque: np.ndarray = None
    kp: float = 0.0
    ki: float = 0.0
    heavier: float = 1.0  # factor on the mass from the middle of the log on
    worn: float = 1.0  # factor on the radius of the left wheel
    worn_late: float = 1.0  # another one, from the middle of the log on
    courses: dict = field(default_factory=dict)  # what changes over time, every TABLE s, by a name of COURSES
    phase: float = 0.0
    top: float = 0.0  # m/s that is meant to be reached
    fine: int = 0  # integration steps a sample


def log_uniform(g, low, high):
    return float(np.exp(g.uniform(np.log(low), np.log(high))))


def multisine(g, t, top, fastest):
    """A sum of five sines with peaks near `top`, at rest for 2 s at both ends."""
    waves = [np.sin(2 * np.pi * (g.uniform(0.03, fastest) * t + g.uniform())) for _ in range(5)]
    edge = np.clip((t - 2.0) / 1.0, 0, 1) * np.clip((t[-1] - 2.0 - t) / 1.0, 0, 1)
    return top * edge * sum(waves) / 3.2


def knots(g, t, top, longest, rest, ramp):
    """Levels that are held for 0.5 s to `longest`, a share `rest` of them zero, with ramps of `ramp` s between them."""
    ends = np.cumsum(g.uniform(0.5, longest, int(t[-1] / 0.5) + 2))
    level = top * g.uniform(0.3, 1.0, len(ends)) * g.choice([-1, 1], len(ends)) * (g.uniform(size=len(ends)) >= rest)
    level[0] = 0.0
    times = np.ravel(np.column_stack([ends, ends + ramp]))
    return np.interp(t, times, np.ravel(np.column_stack([level, np.roll(level, -1)])))


def draw_robot(g, rates, seconds, drive="", hold="", dry=None, memory=(1.0, 8.0), heavier=(1.0, 1.0),
               worn=(1.0, 1.0)):
    """A robot and its drive. `rates`: those to choose from, Hz; `drive`: speed, joystick or steps, else drawn; `dry`:
    range of dry friction over the typical torque, else none in half of all robots; `memory`: range of m / viscous, s;
    `heavier`, `worn`: ranges of those of Robot."""
    mass = log_uniform(g, 2, 200)
    radius = 0.03 * (mass / 2) ** (1 / 3) * g.uniform(0.8, 1.5)
    track = radius * g.uniform(3, 7)
    inertia = mass * track**2 * g.uniform(0.15, 0.45)
    viscous, viscous_yaw = mass / log_uniform(g, *memory), inertia / log_uniform(g, *np.multiply(memory, 0.7))
    rate = float(g.choice(rates))
    drive = drive or str(g.choice(["speed", "speed", "joystick", "steps"]))
    hold = hold or str(g.choice(["at_samples", "at_samples", "between"] +
                                ["linear"] * (drive == "speed" and rate >= 50)))
    top, turn = g.uniform(0.4, 1.2), g.uniform(0.6, 2.0)
    force = viscous * top + mass * top * 1.5  # N, typical
    share = g.uniform(*dry) if dry else g.uniform(0.03, 0.2) * (g.uniform() < 0.5 and hold != "linear")
    out = Robot(mass, inertia, viscous, viscous_yaw, share * force * radius / 2, radius, track, rate,
                float(g.uniform(*seconds)), hold, heavier=g.uniform(*heavier), worn=g.uniform(*worn), phase=g.uniform(0.15, 0.85),
                top=top)
    t = np.arange(0, out.seconds + 2 * TABLE, TABLE)
    if drive == "steps":
        both = knots(g, t, viscous * top * radius / 2, 2.5, 0.2, 1e-6)
        apart = knots(g, t, viscous_yaw * turn * radius / track, 2.5, 0.2, 1e-6)
        out.torque = np.column_stack([both + apart, both - apart])
        out.torque += out.coulomb * np.sign(out.torque)
        out.torque[t > t[-1] - 2] = 0.0
        return out
    fastest = min(0.5, rate / 25)
    v, w = ((multisine(g, t, top, fastest), multisine(g, t, turn, fastest)) if drive == "speed" else
            (knots(g, t, top, 4.0, 0.3, 0.6), knots(g, t, turn, 4.0, 0.3, 0.6)))
    out.speed = np.column_stack([v + track / 2 * w, v - track / 2 * w]) / radius
    band = min(g.uniform(3, 8), 0.2 * rate)
    out.kp = band * mass * radius**2 / 2
    out.ki = out.kp * band / 4
    return out


def refine(robots):
    """Sets `fine` of each: integration steps to a sample, even, of 2 ms at most."""
    for robot in robots:
        robot.fine = int(np.ceil(1.0 / robot.rate / 0.002)) * 2


def simulate(robots):
    """Drives `robots` and sets `fine` of each. Returns for each a dict of arrays over integration steps: t, phi_r,
    phi_l (rad), omega_r, omega_l (rad/s), tau_r, tau_l (N m, acting from t on; of efforts that change all the time, the
    mean of the integration steps before and after t)."""
    refine(robots)
    of = {name: np.array([getattr(r, name) for r in robots]) for name in
          "mass inertia viscous viscous_yaw coulomb radius track rate seconds kp ki fine heavier worn worn_late".split()}
    many, h = len(robots), 1.0 / of["rate"] / of["fine"]
    last = np.ceil(of["seconds"] / h).astype(int)
    size = max(max(len(r.speed if r.torque is None else r.torque) for r in robots), 1)
    tables = np.zeros((2, size, many, 2))  # speeds, torques
    for i, r in enumerate(robots):
        for table, values in zip(tables, (r.speed, r.torque)):
            if values is not None:
                table[:len(values), i] = values
    each = np.arange(many)
    period = np.where([r.hold == "linear" for r in robots], 1, of["fine"])
    phase = np.where([r.hold == "between" for r in robots], np.round(of["fine"] * [r.phase for r in robots]), 0)

    def coefficients(mass, friction=1.0):
        """Decay of both speeds over a step, and their change by a unit of force or moment."""
        b, b_yaw = friction * of["viscous"], friction * of["viscous_yaw"]
        d_v, d_w = np.exp(-b * h / mass), np.exp(-b_yaw * h / of["inertia"])
        return d_v, d_w, (1 - d_v) / b, (1 - d_w) / b_yaw

    d_v, d_w, g_v, g_w = coefficients(of["mass"])
    radii, half = of["radius"] * np.array([np.ones(many), of["worn"]]), of["track"] / 2
    courses = {name: np.array([table_of(r, name, size) for r in robots]).T for name in COURSES
               if any(name in r.courses for r in robots)}
    now_of = dict(COURSES)
    record = np.empty((last.max(), 6, many))
    v, w = np.zeros(many), np.zeros(many)
    angle, sum_e, u = np.zeros((2, many)), np.zeros((2, many)), np.zeros((2, many))
    limit = of["coulomb"] / radii
    dry = bool(of["coulomb"].any()) or not {"brake_right", "brake_left"}.isdisjoint(courses)
    rolls, along, about = np.ones((2, many)), 0.0, 0.0

    def turning():
        """Speeds of the wheels."""
        return np.array([v - along + half * (w - about), v - along - half * (w - about)]) / (radii * rolls)

    omega = np.zeros((2, many))
    halves = last // 2
    for k in range(last.max()):
        if (k == halves).any():
            now = k >= halves
            d_v, d_w, g_v, g_w = coefficients(np.where(now, of["mass"] * of["heavier"], of["mass"]))
            radii = of["radius"] * np.array([np.ones(many), of["worn"] * np.where(now, of["worn_late"], 1.0)])
            limit = of["coulomb"] / radii
            omega = turning()
        if courses:
            at = np.minimum(k * h / TABLE, size - 1.001)
            i, part = at.astype(int), at % 1.0
            now_of.update({name: (1 - part) * table[i, each] + part * table[i + 1, each]
                           for name, table in courses.items()})
            late = np.where(k >= halves, of["worn_late"], 1.0)
            radii = of["radius"] * np.array([now_of["radius_right"] * np.ones(many),
                                             of["worn"] * late * now_of["radius_left"]])
            rolls = np.array([now_of["rolls_right"] * np.ones(many), now_of["rolls_left"] * np.ones(many)])
            along, about = now_of["along"], now_of["about"]
            limit = (of["coulomb"] + np.array([now_of["brake_right"] * np.ones(many),
                                               now_of["brake_left"] * np.ones(many)])) / radii
            if "mass" in courses or "friction" in courses:
                heavier = np.where(k >= halves, of["heavier"], 1.0)
                d_v, d_w, g_v, g_w = coefficients(of["mass"] * heavier * now_of["mass"], now_of["friction"])
            if "across" in courses:  # the body turns under what slips to its left
                v = v + h * w * now_of["across"]
            omega = turning()
        due = (k + phase) % period == 0
        if due.any():
            at = np.minimum(k * h / TABLE + 1e-6, size - 1.001)
            i, part = at.astype(int), (at % 1.0)[:, None]
            error = ((1 - part) * tables[0, i, each] + part * tables[0, i + 1, each]).T - omega
            sum_e += np.where(due, error * h * period, 0.0)
            u = np.where(due, tables[1, i, each].T + of["kp"] * error + of["ki"] * sum_e, u)
        record[k, 0:2], record[k, 2:4], record[k, 4:6] = angle, omega, u
        push = u / radii
        v = d_v * v + g_v * (push[0] + push[1])
        w = d_w * w + g_w * half * (push[0] - push[1])
        if dry:
            own, other = g_v + g_w * half * half, g_v - g_w * half * half
            free = np.array([v - along + half * (w - about), v - along - half * (w - about)])
            grip = (own * free - other * free[::-1]) / (own * own - other * other)  # if both wheels stick
            grip = np.clip(grip, -limit, limit)
            for _ in range(3):
                for a, b in ((0, 1), (1, 0)):
                    grip[a] = np.clip((free[a] - other * grip[b]) / own, -limit[a], limit[a])
            v = v - g_v * (grip[0] + grip[1])
            w = w - g_w * half * (grip[0] - grip[1])
        new = turning()
        angle = angle + h / 2 * (omega + new)
        omega = new
    linear = np.array([r.hold == "linear" for r in robots])
    record[1:, 4:6, linear] = 0.5 * (record[:-1, 4:6, linear] + record[1:, 4:6, linear])
    names = ("phi_r", "phi_l", "omega_r", "omega_l", "tau_r", "tau_l")
    return [{"t": np.arange(last[i]) * h[i], **{name: record[:last[i], j, i].copy() for j, name in enumerate(names)}}
            for i in range(many)]


def table_of(robot, name, size):
    """A course of a robot as `size` entries, its last one from its end on."""
    table = robot.courses.get(name, np.array([COURSES[name]]))
    return table[np.minimum(np.arange(size), len(table) - 1)]


def body(true, robot):
    """x, y (m), theta (rad), yaw rate (rad/s) of the true motion."""
    t = true["t"]
    course = lambda name: (np.interp(t, TABLE * np.arange(len(robot.courses[name])), robot.courses[name])
                           if name in robot.courses else COURSES[name] + 0 * t)
    late = np.arange(len(t)) >= len(t) // 2
    right = course("radius_right") * course("rolls_right")
    left = robot.worn * np.where(late, robot.worn_late, 1.0) * course("radius_left") * course("rolls_left")
    h = np.diff(t, prepend=t[0])
    rolled = {side: np.cumsum(np.diff(true["phi_" + side[0]], prepend=0.0) * np.roll(factor, 1)) * robot.radius
              for side, factor in (("right", right), ("left", left))}
    theta = (rolled["right"] - rolled["left"]) / robot.track + np.cumsum(course("about") * h)
    way = (rolled["right"] + rolled["left"]) / 2 + np.cumsum(course("along") * h)
    step, mean = np.diff(way, prepend=way[0]), theta - np.diff(theta, prepend=theta[0]) / 2
    aside = course("across") * h
    return {"x": np.cumsum(step * np.cos(mean) - aside * np.sin(mean)),
            "y": np.cumsum(step * np.sin(mean) + aside * np.cos(mean)), "theta": theta,
            "gyro_z": (right * true["omega_r"] - left * true["omega_l"]) * robot.radius / robot.track + course("about")}


def low_pass(x, step, tau):
    """First-order low-pass of time constant `tau` over samples every `step` s."""
    if tau <= 0:
        return x.copy()
    out, y, a = np.empty_like(x), x[0], 1 - np.exp(-step / tau)
    for k, value in enumerate(x.tolist()):
        y += a * (value - y)
        out[k] = y
    return out


@dataclass
class Dialect:
    """How a CSV file is written."""
    separator: str = ","
    comma: bool = False  # decimal commas
    units: str = ""  # line: in a second line; name: behind each name
    time: str = "s"  # s, ms, us, ns or iso: of a wall clock, but for s
    quoted: bool = False
    mark: bool = False  # of byte order
    end: str = "\n"
    names: dict = field(default_factory=dict)  # by canonical name


UNITS = {"t": "s", "phi": "rad", "omega": "rad/s", "tau": "Nm", "x": "m", "y": "m", "theta": "rad", "gyro": "rad/s"}
EPOCH = 1_760_000_000


def stamp(t, how):
    """A time as text."""
    if how == "s":
        return f"{t:.9f}"
    if how == "iso":
        return (datetime.datetime.fromtimestamp(EPOCH, datetime.timezone.utc) +
                datetime.timedelta(microseconds=round(t * 1e6))).strftime("%Y-%m-%dT%H:%M:%S.%fZ")
    return str(EPOCH * 10 ** {"ms": 3, "us": 6, "ns": 9}[how] + round(t * 10 ** {"ms": 3, "us": 6, "ns": 9}[how]))


def write_csv(path, columns, dialect=Dialect()):
    """Writes `columns` (arrays by name, t first). NaN is an empty field."""
    names = [dialect.names.get(name, name) for name in columns]
    units = [UNITS.get(name.split("_")[0], "") for name in columns]
    if dialect.units == "name":
        names = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units)]
    quote = (lambda text: f'"{text}"') if dialect.quoted else str
    lines = [dialect.separator.join(map(quote, names))]
    if dialect.units == "line":
        lines.append(dialect.separator.join(map(quote, units)))
    point = (lambda text: text.replace(".", ",")) if dialect.comma else str
    for row in zip(*(values.tolist() for values in columns.values())):
        lines.append(dialect.separator.join([point(stamp(row[0], dialect.time))] +
                                            ["" if value != value else point(f"{value:.9g}") for value in row[1:]]))
    with open(path, "w", encoding="utf-8-sig" if dialect.mark else "utf-8", newline="") as file:
        file.write(dialect.end.join(lines) + dialect.end)


def cdr(*parts):
    """A message in CDR, little endian: int (32 bits), str, list of str or of float (a sequence), tuple of float."""
    out = bytearray()

    def aligned(size):
        out.extend(bytes(-len(out) % size))

    def text(value):
        aligned(4)
        out.extend(struct.pack("<I", len(value.encode()) + 1) + value.encode() + b"\0")

    for part in parts:
        if isinstance(part, int):
            aligned(4)
            out.extend(struct.pack("<I", part))
        elif isinstance(part, str):
            text(part)
        else:
            if isinstance(part, list):
                aligned(4)
                out.extend(struct.pack("<I", len(part)))
            if len(part) and isinstance(part[0], str):
                for value in part:
                    text(value)
            elif len(part):
                aligned(8)
                out.extend(struct.pack(f"<{len(part)}d", *part))
    return b"\0\1\0\0" + bytes(out)


TYPES = {"/joint_states": "sensor_msgs/msg/JointState", "/imu": "sensor_msgs/msg/Imu",
         "/mocap": "geometry_msgs/msg/PoseStamped"}


def write_mcap(path, columns, joints):
    """A recording of JointState, and of Imu and PoseStamped where `columns` has gyro_z, theta. `joints`: a dict by
    topic's joint, in the order of its arrays, of (position, velocity, effort), each an array or None where it lacks."""
    messages = []
    names = list(joints)
    arrays = [[values.tolist() for joint in joints.values() if (values := joint[k]) is not None] for k in range(3)]
    for k, t in enumerate(columns["t"].tolist()):
        ns = EPOCH * 10**9 + round(t * 1e9)
        head = (ns // 10**9, ns % 10**9)
        joint = cdr(*head, "", names, *([values[k] for values in kind] for kind in arrays))
        messages.append(("/joint_states", ns, joint))
        if "gyro_z" in columns:
            messages.append(("/imu", ns, cdr(*head, "imu", (0.0, 0.0, 0.0, 1.0) + (0.0,) * 9, (
                0.0, 0.0, float(columns["gyro_z"][k])) + (1e-4,) + (0.0,) * 8, (0.0, 0.0, 9.81) + (0.0,) * 9)))
        if "theta" in columns:
            half = float(columns["theta"][k]) / 2
            messages.append(("/mocap", ns, cdr(*head, "map", (float(columns["x"][k]), float(columns["y"][k]), 0.0, 0.0,
                                                              0.0, float(np.sin(half)), float(np.cos(half))))))

    def string(text):
        return struct.pack("<I", len(text)) + text.encode()

    def record(kind, content):
        return struct.pack("<BQ", kind, len(content)) + content

    topics = sorted({topic for topic, _, _ in messages})
    magic = b"\x89MCAP0\r\n"
    out = [magic, record(1, string("ros2") + string("campaign"))]
    for number, topic in enumerate(topics, 1):
        out.append(record(3, struct.pack("<H", number) + string(TYPES[topic]) + string("") + struct.pack("<I", 0)))
        out.append(record(4, struct.pack("<HH", number, number) + string(topic) + string("cdr") + struct.pack("<I", 0)))
    for k, (topic, ns, data) in enumerate(messages):
        out.append(record(5, struct.pack("<HIQQ", topics.index(topic) + 1, k, ns, ns) + data))
    out += [record(15, struct.pack("<I", 0)), record(2, struct.pack("<QQI", 0, 0, 0)), magic]
    with open(path, "wb") as file:
        file.write(b"".join(out))


def write_robot(path, robot):
    """A robot file; JSON is YAML."""
    with open(path, "w", encoding="utf-8") as file:
        json.dump(robot, file, indent=1)
