# SPDX-License-Identifier: Apache-2.0
"""The kinds of tests/campaigns/ordinary_logs.py: what may be odd about a log, and what an answer may say of it."""

from dataclasses import dataclass, field

import numpy as np

import ordinary_world as world

RATES = (10, 20, 25, 30, 40, 50, 60, 100, 100, 125, 200, 250, 400, 500)
COUNTS = (20, 48, 100, 360, 500, 1000, 1024, 2048, 4096, 8192, 16384, 32768)
KINDS = {}


@dataclass
class Kind:
    """What is odd about a log, and what an answer may say of it."""
    name: str
    make: object  # changes a Log
    reasons: str = ""  # regular expression: a refusal that it matches names the true reason; empty: there is none
    false: str = ""  # likewise a cause that is false; counts where `reasons` is not matched
    possible: bool = True  # a right model can be made
    doubt: bool = False  # an extrapolated model that names the reason is no wrong one
    robot: dict = field(default_factory=dict)  # for draw_robot
    sensors: dict = field(default_factory=dict)  # for Log


def kind(reasons="", sensors=None, false="", possible=True, doubt=False, **robot):
    """Registers a function that changes a Log as a kind."""
    def register(make):
        KINDS[make.__name__] = Kind(make.__name__, make, reasons, false, possible, doubt, robot, sensors or {})
        return make
    return register


class Log:
    """A log with honest sensors, which a kind then changes: `columns` (arrays by name), `file` (the robot file),
    `truth` (by parameter of model.json; a tuple: all of them; None: no model is right), `sizes` (how large what is odd
    is, by dimension), how it is written."""

    def __init__(self, robot, true, g, motion="", counts=0, declared=None, gyro=None, pose=None, nominal=None,
                 bag=None):
        self.robot, self.true, self.g = robot, true, g
        self.step = 1.0 / robot.rate
        draw = lambda wish, chance: bool(g.uniform() < chance) if wish is None else wish
        self.motion = motion or str(g.choice(["angles", "speeds", "both"]))
        self.counts = counts or int(g.choice(COUNTS[5:]))
        self.declared, gyro, pose = draw(declared, 0.5), draw(gyro, 0.5), draw(pose, 0.25)
        nominal, self.bag = draw(nominal, 0.5), draw(bag, 0.25)
        rms = lambda stem: float(np.sqrt(np.mean(true[stem + "_r"]**2 + true[stem + "_l"]**2) / 2))
        self.bounds = {"omega": rms("omega") * g.uniform(0.003, 0.02), "tau": rms("tau") * g.uniform(0.003, 0.03),
                       "x": 1e-3, "y": 1e-3, "theta": 1e-3, "gyro_z": g.uniform(0.001, 0.005)}
        true.update(world.body(true, robot))
        self.rows = np.arange(0, len(true["t"]), robot.fine)
        self.columns = {"t": true["t"][self.rows]}
        stems = {"angles": ["phi"], "speeds": ["omega"], "both": ["phi", "omega"]}[self.motion] + ["tau"]
        names = [f"{stem}_{side}" for stem in stems for side in "rl"]
        for name in names + ["gyro_z"] * gyro + ["x", "y", "theta"] * pose:
            self.sense(name, true[name][self.rows])
        self.file = {"name": "drawn", "model": "differential_drive", "wheel_radius": robot.radius,
                     "track_width": robot.track, "effort": {"kind": "torque", "hold": "first_order"}
                     if robot.hold == "linear" else {"kind": "torque", "hold": "zero_order", "changes": robot.hold},
                     "noise": "estimate"}
        self.truth = {"mass": robot.mass, "yaw_inertia": robot.inertia, "viscous_linear": robot.viscous,
                      "viscous_yaw": robot.viscous_yaw, "coulomb": robot.coulomb, "radius_right": robot.radius,
                      "radius_left": robot.radius * robot.worn, "yaw_gain_right": robot.radius / robot.track,
                      "yaw_gain_left": robot.radius * robot.worn / robot.track, "gyro_bias": 0.0}
        basic = ["mass", "yaw_inertia", "viscous_linear", "viscous_yaw"]
        if self.declared:
            self.file["noise"] = {"effort": self.bounds["tau"] * 1.01}
            if "omega" in stems:
                self.file["noise"]["wheel_speed"] = self.bounds["omega"] * 1.01
            if pose:
                self.file["noise"].update(position=1.01e-3, heading=1.01e-3)
        if "phi" in stems and (self.declared or g.uniform() < 0.5):
            self.file["encoder_counts_per_turn"] = self.counts
        if robot.coulomb and (self.declared or g.uniform() < 0.5):
            self.file["parameters"] = basic + ["coulomb"]
        if nominal:
            self.file["nominal"] = {name: self.truth[name] * g.uniform(0.85, 1.15) for name in basic}
        self.dialect, self.joints, self.unequal, self.own = world.Dialect(), ["left", "right"], False, None
        self.sizes = {"rate, Hz": robot.rate}

    def sense(self, name, values):
        """Sets a column to `values` as its sensor gives them: counted, or with noise within the bound."""
        stem = name.split("_")[0] if name != "gyro_z" else name
        if stem == "phi":
            self.columns[name] = np.floor(values * self.counts / (2 * np.pi)) * (2 * np.pi / self.counts)
        else:
            self.columns[name] = values + self.bounds[stem] * self.g.uniform(-1, 1, len(values))

    def of(self, *stems):
        """Names of the columns of these stems, of both wheels."""
        return [name for name in self.columns if name.rsplit("_", 1)[0] in stems and name[-2:] in ("_r", "_l")]

    def late(self, names, delay):
        """Senses columns `delay` s late."""
        self.sizes["lag, steps"] = delay * self.robot.rate
        at = np.floor((self.columns["t"] - delay) * self.robot.rate * self.robot.fine + 1e-6).astype(int).clip(0)
        for name in names:
            self.sense(name, self.true[name][at])

    def smooth(self, names, tau):
        """Passes columns through a low-pass of the driver: of what is logged, or of what is 1 kHz and faster."""
        logged = self.g.uniform() < 0.5
        self.sizes["time constant, steps"] = tau * self.robot.rate
        for name in names:
            if logged:
                self.columns[name] = world.low_pass(self.columns[name], self.step, tau)
            else:
                self.sense(name, world.low_pass(self.true[name], self.step / self.robot.fine, tau)[self.rows])

    def scatter(self, deviation):
        """Stamps of even samples with Gaussian errors of `deviation` s."""
        self.sizes["jitter, % of a step"] = 100 * deviation * self.robot.rate
        t = self.columns["t"]
        self.columns["t"] = np.maximum.accumulate(t + deviation * self.g.normal(size=len(t)))

    def keep(self, rows):
        """Keeps these rows alone."""
        self.columns = {name: values[rows] for name, values in self.columns.items()}

    def lose(self, share, longest=1):
        """Loses a share of the rows, up to `longest` in a row."""
        self.sizes["lost rows, %"] = 100 * share
        lost = np.zeros(len(self.columns["t"]), dtype=bool)
        while lost.mean() < share:
            at = self.g.integers(1, len(lost) - longest)
            lost[at:at + self.g.integers(1, longest + 1)] = True
        self.keep(~lost)

    def stretch(self, seconds):
        """Rows of a stretch of `seconds` in which much is going on."""
        many = int(seconds * self.robot.rate) + 2
        speed = np.abs(self.true["omega_r"][self.rows]) + np.abs(self.true["omega_l"][self.rows])
        starts = self.g.integers(0, max(1, len(speed) - many), 20)
        at = max(starts, key=lambda k: speed[k:k + many].mean())
        return slice(int(at), int(at) + many)

    def joint_states(self):
        """The joints of a bag, in order: (position, velocity, effort) of each, None where it lacks."""
        if self.own:
            return self.own
        c, zero, joints = self.columns, np.zeros(len(self.columns["t"])), {}
        side_of = {name: next((word[0] for word in ("left", "right") if word in name and "caster" not in name), None)
                   for name in self.joints}
        sides = list(side_of.values())
        for name, side in side_of.items():
            if side is None:  # casters swivel, arms stand
                swing = zero + 0.3 if "caster" not in name else np.cumsum(c.get("gyro_z", zero)) * self.step
                joint = (swing, np.gradient(swing) / self.step, None if self.unequal else zero)
            else:
                joint = (c.get("phi_" + side), c.get("omega_" + side), c["tau_" + side] / sides.count(side))
            joints[name if side is None else name.removesuffix("_wheel") + "_wheel_joint"] = joint
        lacks = [k < 2 and any(joint[k] is None for joint in joints.values()) for k in range(3)]
        return {name: tuple(None if lack else x for lack, x in zip(lacks, joint)) for name, joint in joints.items()}

    def write(self, folder):
        """Writes robot file and log into `folder`; returns the path of the log."""
        world.write_robot(folder / "robot.yaml", self.file)
        path = folder / ("log.mcap" if self.bag else "log.csv")
        if self.bag:
            world.write_mcap(path, self.columns, self.joint_states())
        else:
            world.write_csv(path, self.columns, self.dialect)
        return path


# The kinds, by what they touch: rows and clocks, speeds and angles, efforts, joints, poses, the robot, files.

LATE = r"\blate\b|\blag|\bdelay|\bshift|latency"
CLOCK = r"stamps? (?:that )?(?:scatter|are not|of)|scatter|jitter|even(?:ly)? (?:sampl|spaced)|burst"


@kind(rates=(100,), hold="at_samples", sensors={"motion": "angles", "counts": 2048})
def ordinary(log):
    """What any robot logs: 1 % lost, 200 µs of jitter, efforts through 5 ms, 2,048 counts, casters in the bag."""
    for name in log.of("tau"):
        log.columns[name] = world.low_pass(log.columns[name], log.step, 0.005)
    log.scatter(200e-6)
    log.lose(0.01)
    if log.bag:
        log.joints = log.joints + ["caster_left_swivel_joint", "caster_left_wheel_joint", "caster_right_swivel_joint"]
        log.g.shuffle(log.joints)


@kind()
def clean(log):
    """Nothing is odd."""


@kind()
def lost_rows(log):
    """0.1 to 10 % of the rows are lost, alone or up to five in a row."""
    log.lose(world.log_uniform(log.g, 0.001, 0.1), int(log.g.choice([1, 1, 5])))


@kind(CLOCK)
def jitter(log):
    """Even samples whose stamps scatter by 0.2 to 10 % of a step."""
    log.scatter(log.step * world.log_uniform(log.g, 0.002, 0.1))


@kind(hold="between")
def uneven(log):
    """Samples that are uneven by up to 10 % of a step, with true stamps."""
    rows = log.rows + np.round(log.g.uniform(-0.1, 0.1, len(log.rows)) * log.robot.fine).astype(int)
    log.rows = np.clip(rows, 0, len(log.true["t"]) - 1)
    log.columns["t"] = log.true["t"][log.rows]
    for name in list(log.columns)[1:]:
        log.sense(name, log.true[name][log.rows])


@kind(CLOCK + "|coarse stamps|duplicate|same time|arrive", false="deg/s|unit of the efforts")
def bursts(log):
    """Stamps of two to five messages that arrive together: 2 % of a step apart."""
    many = int(log.g.integers(2, 6))
    k = np.arange(len(log.columns["t"]))
    log.columns["t"] = log.columns["t"][np.minimum(k // many * many + many - 1, k[-1])] + k % many * 0.02 * log.step


@kind(LATE)
def late_effort(log):
    """Efforts 0 to 20 ms late."""
    log.late(log.of("tau"), log.g.uniform(0, 0.02))


@kind(LATE, {"gyro": True, "pose": False})
def late_gyro(log):
    """A gyro 30 to 150 ms late."""
    log.late(["gyro_z"], log.g.uniform(0.03, 0.15))


@kind(LATE, {"pose": True})
def late_pose(log):
    """A pose 30 to 150 ms late."""
    log.late(["x", "y", "theta"], log.g.uniform(0.03, 0.15))


SMOOTHED = r"smooth|low.?pass|(?:speeds?|efforts?|driver)\b[^.;]*\b(?:filter|averag|mean of)"


@kind(SMOOTHED, {"motion": "speeds"}, false=r"delay: ")
def smoothed_speeds(log):
    """Speeds through a low-pass of 5 to 100 ms."""
    log.smooth(log.of("omega"), world.log_uniform(log.g, 0.005, 0.1))


@kind(SMOOTHED, {"motion": "speeds"}, false=r"delay: ")
def averaged_speeds(log):
    """Speeds that are means of the last two to ten samples."""
    many = int(log.g.integers(2, 11))
    log.sizes["samples averaged"] = many
    for name in log.of("omega"):
        x = np.concatenate([np.full(many - 1, log.columns[name][0]), log.columns[name]])
        log.columns[name] = np.convolve(x, np.full(many, 1.0 / many), "valid")


@kind(LATE + r"|differen|coarse|counts?\b|quant", {"motion": "speeds"})
def differenced(log):
    """Speeds are differences of 20 to 32,768 counts a turn, stamped at their end."""
    counts = int(log.g.choice(COUNTS))
    log.sizes["counts a turn"] = counts
    if log.declared:
        log.file["encoder_counts_per_turn"] = counts
        log.file["noise"].pop("wheel_speed")
        log.file["speed_source"] = "encoder_difference"
    for name in log.of("omega"):
        n = np.floor(log.true["phi" + name[-2:]][log.rows] * counts / (2 * np.pi))
        log.columns[name] = np.diff(n, prepend=n[0]) * 2 * np.pi / counts / log.step


@kind(sensors={"motion": "angles", "declared": False})
def coarse_angles(log):
    """Angles of 20 to 32,768 counts a turn."""
    log.counts = int(log.g.choice(COUNTS))
    log.sizes["counts a turn"] = log.counts
    for name in log.of("phi"):
        log.sense(name, log.true[name][log.rows])
    if "encoder_counts_per_turn" in log.file:
        log.file["encoder_counts_per_turn"] = log.counts


@kind(r"round|cut off|truncat|whole|rpm|coarse|quant|resolution", {"motion": "speeds", "declared": False})
def rpm(log):
    """Speeds rounded or cut off to whole rpm or tenths of it."""
    unit = 2 * np.pi / 60 * float(log.g.choice([1.0, 0.1]))
    cut = np.trunc if log.g.uniform() < 0.5 else np.round
    for name in log.of("omega"):
        log.columns[name] = cut(log.true[name][log.rows] / unit) * unit


DIRECTION = (r"no_direction|does not see the direction|without (?:a )?direction|no direction|"
             r"direction of (?:its|their) own|sign of (?:the|its|their) command|never (?:falls|turns back)")


@kind(DIRECTION, {"motion": "both"}, possible=False, false=LATE, drive="speed")
def no_direction(log):
    """Speeds and angles have the sign of the command, which is wrong at reversals."""
    at = np.minimum((log.columns["t"] / world.TABLE).astype(int), len(log.robot.speed) - 1)
    for k, side in enumerate("rl"):
        sign = np.where(log.robot.speed[at, k] < 0, -1.0, 1.0)
        phi = log.columns["phi_" + side]
        log.columns["phi_" + side] = np.cumsum(np.abs(np.diff(phi, prepend=phi[0])) * sign)
        log.columns["omega_" + side] = np.abs(log.columns["omega_" + side]) * sign


@kind(DIRECTION, {"motion": "angles", "declared": False}, possible=False)
def unsigned_counts(log):
    """Counts that never fall: encoders without direction, 20 to 2,048 a turn."""
    log.counts = int(log.g.choice(COUNTS[:8]))
    for name in log.of("phi"):
        log.sense(name, np.cumsum(np.abs(np.diff(log.true[name], prepend=0.0)))[log.rows])
    log.file.pop("encoder_counts_per_turn", None)


@kind(r"jump|spike|impossible|single|outlier|no wheel", {"motion": "speeds"})
def spikes(log):
    """Three to twenty single speeds that no wheel has."""
    for name in log.of("omega"):
        at = log.g.integers(10, len(log.columns[name]) - 10, log.g.integers(3, 21))
        top = np.abs(log.columns[name]).max()
        log.columns[name][at] = top * log.g.uniform(5, 50, len(at)) * log.g.choice([-1, 1], len(at))


STILL = (r"frozen|stand(?:s|ing)? still|stood still|(?:does|do|did) not change|signals\.constant|one value|stuck|"
         r"always (?:0|zero|the same)|same value")


@kind(STILL + "|(?:position|speed)_zero", {"motion": "both"})
def dead_motion(log):
    """Angles that are always 0 beside good speeds, or the other way round."""
    for name in log.of(str(log.g.choice(["phi", "omega"]))):
        log.columns[name] = np.zeros_like(log.columns[name])


@kind(r"wrap|overflow|jump|turn over|rolls? over", {"motion": "angles"})
def wrapped(log):
    """Angles that wrap at a turn, at 2^16 or at 2^32 counts."""
    span = 2 * np.pi * float(log.g.choice([1, 2**16 / log.counts, 2**32 / log.counts]))
    low = 0.0 if log.g.uniform() < 0.5 else -span / 2
    for name in log.of("phi"):
        phi = log.columns[name]
        start = low + span * log.g.uniform()
        if span > np.ptp(phi):  # so that it wraps all the same
            start = low + span - log.g.uniform(0.2, 0.8) * np.ptp(phi) - phi.min()
        log.columns[name] = np.mod(phi + start - low, span) + low


@kind(STILL + r"|clamp|saturat|reads? zero|is zero")
def frozen_effort(log):
    """For 1 to 20 s efforts of one or both wheels keep a value, are zero, or are clamped."""
    at, how = log.stretch(log.g.uniform(1, 20)), str(log.g.choice(["frozen", "zero", "clamped"]))
    for name in log.of("tau")[:int(log.g.integers(1, 3))]:
        x = log.columns[name]
        bound = 0.3 * np.abs(x[at]).max()
        x[at] = x[at.start] if how == "frozen" else 0.0 if how == "zero" else np.clip(x[at], -bound, bound)


UNIT = r"per ?cent|unit|nominal|N·m|times as|scale"


@kind(UNIT, {"nominal": True, "declared": False}, possible=False, doubt=True)
def percent_effort(log):
    """Efforts in per cent (per mille, where that is near N·m) of a largest torque, beside a nominal mass."""
    factor = 100.0 / (np.abs(log.true["tau_r"]).max() * log.g.uniform(1.2, 5))
    factor *= 10 if 0.3 < factor < 3 else 1
    for name in log.of("tau"):
        log.columns[name] *= factor


@kind(UNIT, {"nominal": True, "declared": False}, possible=False, doubt=True)
def effort_unit(log):
    """Efforts in mN·m, N·cm, kgf·cm, ozf·in, lbf·in or at the motor, beside a nominal mass."""
    factor = float(log.g.choice([1000, 100, 10.197, 141.6, 8.851, 1 / 12, 1 / 30]))
    for name in log.of("tau"):
        log.columns[name] *= factor


@kind(r"cop(?:y|ies|ied)\b|same (?:values?|column|effort|numbers)|identical", possible=False)
def copied_effort(log):
    """The effort of one wheel in both columns."""
    one, other = log.g.permutation(log.of("tau"))
    log.columns[other] = log.columns[one].copy()


@kind(SMOOTHED + "|" + LATE)
def smoothed_effort(log):
    """Efforts through a low-pass of up to 50 ms."""
    log.smooth(log.of("tau"), log.g.uniform(0, 0.05))


@kind(r"held|stale|repeat|new value|fresh|rate|" + LATE, drive="speed", rates=(40, 50, 100, 200, 250))
def held_effort(log):
    """Efforts that are new in every second to eighth row only."""
    many = int(log.g.integers(2, 9))
    log.sizes["rows held"] = many
    for name in log.of("tau"):
        log.columns[name] = log.columns[name][np.arange(len(log.columns["t"])) // many * many]


@kind(r"publisher|second source|sources|jump|zeros", {"bag": False})
def second_publisher(log):
    """Beside every second to twentieth row another, 0.3 steps later, in which the wheels are 0."""
    t = log.columns["t"]
    at = np.arange(0, len(t) - 1, log.g.integers(2, 21))
    order = np.argsort(np.concatenate([t, t[at] + 0.3 * log.step]), kind="stable")
    for name, x in log.columns.items():
        other = t[at] + 0.3 * log.step if name == "t" else x[at] if name in ("x", "y", "theta", "gyro_z") else 0 * x[at]
        log.columns[name] = np.concatenate([x, other])[order]


@kind(sensors={"bag": True})
def many_joints(log):
    """A bag with casters, an arm, or four wheels, in any order."""
    log.joints = [*log.g.permutation(["front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"])
                  ] if log.g.uniform() < 0.5 else ["left", "right"]
    log.joints += ["arm_1", "caster_left_swivel_joint"][:int(log.g.integers(0, 3))]
    log.joints = [str(name) for name in log.g.permutation(log.joints)]


@kind(r"names?\b.*effort|effort.*names?\b|as many|arrays?|--map", {"bag": True})
def unequal_arrays(log):
    """A bag in which only the wheels have an effort, and an arm is among the joints."""
    log.joints, log.unequal = ["arm_1", "left", "right", "arm_2"], True


NO_DRIVE = (r"steer|sideways|not a differential|no differential|do not turn together|mecanum|lateral|\bcar\b|"
            r"do not roll together")


@kind(NO_DRIVE, {"bag": True, "gyro": True, "pose": False}, possible=False, drive="speed")
def car(log):
    """A car: rear wheels driven with equal torque, front wheels free, two steering joints."""
    r, g, t = log.robot, log.g, log.columns["t"]
    v = np.abs(world.multisine(g, t, r.top, 0.3)) + 0.1
    steer = world.multisine(g, t, 0.4, 0.2)
    turn = v * np.tan(steer) / (1.3 * r.track)
    push = (r.mass * np.gradient(v, t) + r.viscous * v) * r.radius / 2
    wheels = {"rear_left_wheel_joint": v - r.track / 2 * turn, "rear_right_wheel_joint": v + r.track / 2 * turn,
              "front_left_wheel_joint": v / np.cos(steer), "front_right_wheel_joint": v / np.cos(steer)}
    log.sense("gyro_z", turn)
    log.truth, log.own = None, {
        name: (np.cumsum(s) * log.step / r.radius, s / r.radius,
               push * ("rear" in name) + log.bounds["tau"] * g.uniform(-1, 1, len(t))) for name, s in wheels.items()}
    log.own |= {f"front_{side}_steer_joint": (steer, np.gradient(steer, t), 0 * t) for side in ("left", "right")}


@kind(NO_DRIVE, {"bag": True, "gyro": True, "pose": True}, possible=False, drive="speed")
def mecanum(log):
    """Four mecanum wheels that also move the body sideways."""
    r, g, t = log.robot, log.g, log.columns["t"]
    v, u, turn = (world.multisine(g, t, top, 0.3) for top in (r.top, 0.7 * r.top, 1.0))
    arm, theta = r.track, np.cumsum(turn) * log.step
    force = [m * np.gradient(s, t) + b * s for m, b, s in ((r.mass, r.viscous, v), (r.mass, 2 * r.viscous, u),
                                                           (r.inertia, r.viscous_yaw, turn))]
    joints = {}
    for name, left, cross in (("front_left", -1, -1), ("front_right", 1, 1), ("rear_left", -1, 1),
                              ("rear_right", 1, -1)):
        s = (v + cross * u + left * arm * turn) / r.radius
        tau = (force[0] + cross * force[1] + left * force[2] / arm) * r.radius / 4
        joints[name + "_wheel_joint"] = (np.cumsum(s) * log.step, s, tau + log.bounds["tau"] * g.uniform(-1, 1, len(t)))
    for name, x in (("gyro_z", turn), ("theta", theta),
                    ("x", np.cumsum(v * np.cos(theta) - u * np.sin(theta)) * log.step),
                    ("y", np.cumsum(v * np.sin(theta) + u * np.cos(theta)) * log.step)):
        log.sense(name, x)
    log.truth, log.own = None, joints


@kind(r"heading_offset|driving direction|turned (?:by|against)|pose_frame", {"pose": True})
def turned_pose(log):
    """A heading that is up to 180 degrees away from the driving direction."""
    log.columns["theta"] = log.columns["theta"] + log.g.uniform(-np.pi, np.pi)


@kind(r"mirror|counts? backwards|turned round|other way round", {"gyro": False, "pose": False}, possible=False,
      doubt=True)
def mirrored_wheel(log):
    """A wheel that counts and pushes the other way, without gyro and pose."""
    side = str(log.g.choice(["r", "l"]))
    for name in log.of("phi", "omega", "tau"):
        log.columns[name] *= -1 if name.endswith(side) else 1


@kind(r"sign|swap|sides|backwards|against", {"gyro": True}, possible=False)
def wrong_side(log):
    """Wheels, efforts or one wheel's effort swapped or with the wrong sign, with a gyro."""
    how, names = int(log.g.integers(3)), log.of("tau")
    if how == 0:
        log.columns[names[0]], log.columns[names[1]] = log.columns[names[1]], log.columns[names[0]]
    for name in names if how == 1 else names[:1] if how == 2 else []:
        log.columns[name] = -log.columns[name]


@kind(r"rpm|deg|unit|turns/s|too large|radius", {"motion": "speeds", "gyro": True, "declared": False}, possible=False)
def speed_unit(log):
    """Speeds in rpm, deg/s or turns/s, beside a gyro."""
    factor = float(log.g.choice([60 / (2 * np.pi), 180 / np.pi, 1 / (2 * np.pi)]))
    for name in log.of("omega"):
        log.columns[name] *= factor


@kind(r"halves|thirds|parts? of (?:the|a|this) log|mass[^.]*chang|constant_parameters", {"declared": True}, possible=False, doubt=True,
      heavier=(1.05, 1.3))
def heavier(log):
    """From the middle on the robot has 5 to 30 % more mass."""
    log.truth["mass"] = (log.robot.mass, log.robot.mass * log.robot.heavier)


@kind(r"offset|bias|mean", {"declared": True})
def effort_offset(log):
    """An offset of one effort of 5 to 10 times its declared bias, within its declared bound."""
    bias = log.bounds["tau"] * 0.1
    log.file["noise"]["effort"] = {"bound": 2.2 * log.bounds["tau"], "bias": bias}
    name = str(log.g.choice(log.of("tau")))
    log.columns[name] = log.columns[name] + bias * log.g.uniform(5, 10) * log.g.choice([-1, 1])


@kind(r"radius|radii|geometry|wheels? differ", {"pose": True}, possible=False, doubt=True, worn=(0.96, 0.99))
def worn_wheel(log):
    """The left wheel is 1 to 4 % smaller than in the robot file; a pose shows it."""


@kind(dry=(0.4, 0.7), rates=(50, 100, 200))
def hard_friction(log):
    """Dry friction of 40 to 70 % of the torque, with reversals."""


@kind(memory=(0.05, 0.1), rates=(50, 100, 200))
def fast_robot(log):
    """Mass over friction of a few steps."""


@kind(sensors={"bag": False})
def dialect(log):
    """A CSV file as programs write them."""
    g = log.g
    separator = str(g.choice([",", ";", "\t"]))
    log.dialect = world.Dialect(separator, separator == ";" and g.uniform() < 0.7, str(g.choice(["", "line", "name"])),
                                str(g.choice(["s", "ms", "us", "ns", "iso"])), g.uniform() < 0.3, g.uniform() < 0.3,
                                str(g.choice(["\n", "\r\n"])))
    if log.dialect.time != "s" and log.dialect.units:
        log.dialect.units = ""
    if log.dialect.time == "ms":  # whole ms need a step of whole ms
        log.dialect.time = "us"


@kind(r"\bdays|units\.time", {"bag": False}, possible=False)
def days(log):
    """Times in days, as a spreadsheet has them."""
    log.columns["t"] = 46110.0 + log.columns["t"] / 86400
