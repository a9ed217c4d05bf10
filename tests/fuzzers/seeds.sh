#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Makes seeds for the fuzzers with our own writers, and for those of text a dictionary: the words in the sources that
# read it.
#
#   tests/fuzzers/seeds.sh PROGRAM FOLDER     FOLDER/NAME/* for every fuzzer NAME, and FOLDER/NAME.dict
set -eu
program=$(realpath "${1:?usage: tests/fuzzers/seeds.sh PROGRAM FOLDER}")
folder=${2:?usage: tests/fuzzers/seeds.sh PROGRAM FOLDER}
house=$(realpath "$(dirname "$0")/../..")
examples=$house/examples
rm -rf "$folder"
for name in bag claims columns controllers csv db3 fleet follow gap hdf5 journal mcap messages metadata model packed \
  record \
  robot scenario simulator store study urdf; do
  mkdir -p "$folder/$name"
done
cd "$folder"
folder=$PWD

# A short drive, in every format.
cat > drive.yaml <<EOF
robot: $examples/robot.yaml
parameters: {mass: 21, yaw_inertia: 0.9, viscous_linear: 4, viscous_yaw: 0.5}
trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 1}
duration: 0.5
rate: 50
EOF
"$program" simulate drive.yaml --out csv/drive.csv --quiet
cp drive.yaml scenario/
robot='{model: differential_drive, wheel_radius: 0.1, track_width: 0.4, effort: {kind: torque, hold: zero_order}}'
sed "s/^robot:.*/robot: $robot/" \
  drive.yaml > scenario/inline.yaml
cat >> scenario/inline.yaml <<EOF
start: {pose: [0, 1, 0.2], error: [0, 0.1, 0]}
faults: [{kind: slip_yaw, magnitude: 0.1, onset: 0.2, shape: ramp, rise_time: 0.1, end: 0.4}]
sensors: {sampling: interval, noise: two_point, wheel_angle: 0.01, effort: 0.02, log: [angles, pose]}
effects: [{effect: coulomb, right: 0.1, left: 0.1}]
time_jitter: 0.1
gaps: [[0.2, 0.3]]
seed: 4
EOF
cp csv/drive.csv follow/
sed 's/,/;/g; 5s/^.*$/# a remark/; 9s/;[^;]*$/;nan/' csv/drive.csv > csv/semicolons.csv
awk 'BEGIN {
  print "stamp\tomega_r\ttheta\tx"
  for (k = 0; k < 60; ++k) {
    printf "%d%09d\t%g\t%g\t%s\n", 1700000000 + int(k / 50), k % 50 * 20000000, k % 7, k % 6, k % 3 ? "" : k / 10
  }
}' > csv/streams.tsv
gzip -c csv/drive.csv > csv/drive.csv.gz
"$program" convert csv/drive.csv csv/drive.csv.zst --quiet
"$program" convert csv/drive.csv hdf5/drive.h5 --quiet
"$program" convert csv/drive.csv db3/drive.db3 --quiet
for compression in none zstd lz4; do
  "$program" convert csv/drive.csv "mcap/$compression.mcap" --compression "$compression" --quiet
done

# Short ones, by the writers of the second reader: bytes of little else than what is read.
python3 - "$house/tests/second_reader" "$folder" <<'EOF'
import pathlib
import sqlite3
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
import hdf5
import run

folder = pathlib.Path(sys.argv[2])
stamps = [1_700_000_000 * 10**9 + k * 10_000_000 for k in range(6)]
speeds = [(stamp, run.encode(stamp, (), (k, -k), (0.5, k))) for k, stamp in enumerate(stamps)]
angles = [(stamp, run.encode(stamp, (2.5 * k, -k), (), (0.5, k), ">")) for k, stamp in enumerate(stamps)]
others = (("/chatter", "std_msgs/msg/String", "string data\n", b"\0\1\0\0\3\0\0\0hi\0"),)
run.write_mcap(folder / "mcap/speeds.mcap", speeds, False)
run.write_mcap(folder / "mcap/angles.mcap", angles, True, others)
for name, messages in ("speeds", speeds), ("angles", angles):
    path = folder / f"db3/{name}.db3"
    run.write_db3(path, messages, others)
    base = sqlite3.connect(path, isolation_level=None)
    base.executescript("PRAGMA page_size=512; VACUUM;")
    base.close()
columns = {name: [0.25 * k for k in range(6)] for name in ("t", "omega_r", "omega_l", "tau_r", "tau_l")}
hdf5.write(folder / "hdf5/plain.h5", columns)
hdf5.write(folder / "hdf5/pieces.h5", columns, 4)
EOF

# What SQLite leaves beside a recording: a write-ahead log (after an even byte), a journal (after an odd one).
python3 - "$folder" <<'EOF'
import pathlib
import shutil
import sqlite3
import sys

folder = pathlib.Path(sys.argv[1])
for mode, ending, first in (("WAL", "-wal", b"\0"), ("DELETE", "-journal", b"\1")):
    shutil.copy(folder / "db3/drive.db3", folder / "open.db3")
    base = sqlite3.connect(folder / "open.db3", isolation_level=None)
    base.execute(f"PRAGMA journal_mode={mode}")
    base.execute("PRAGMA cache_size=1")
    base.execute("BEGIN IMMEDIATE")
    base.execute("UPDATE messages SET timestamp = timestamp + 1")
    if mode == "WAL":
        base.execute("COMMIT")
    (folder / f"journal/{mode.lower()}").write_bytes(first + (folder / f"open.db3{ending}").read_bytes())
    base.close()
(folder / "open.db3").unlink()
EOF

# A folder as rosbag2 records it: metadata and, behind a zero byte, a file that is plain or packed, or whose messages
# are.
"$program" convert csv/drive.csv recorded --quiet
cp recorded/metadata.yaml metadata/
rm -r recorded
python3 - "$folder" <<'EOF'
import ctypes
import pathlib
import sqlite3
import sys

folder = pathlib.Path(sys.argv[1])
zstd = ctypes.CDLL("libzstd.so.1")
zstd.ZSTD_compress.restype = ctypes.c_size_t


def packed(data):
    to = ctypes.create_string_buffer(len(data) + 1024)
    size = zstd.ZSTD_compress(to, ctypes.c_size_t(len(to)), data, ctypes.c_size_t(len(data)), 19)
    return to.raw[:size]


metadata = b"rosbag2_bagfile_information: {relative_file_paths: [a_0.mcap.zstd]}\n\0"
(folder / "bag/plain").write_bytes(metadata + (folder / "mcap/zstd.mcap").read_bytes())
for name in "mcap/none.mcap", "db3/drive.db3":
    file = folder / name
    (folder / "bag" / file.suffix[1:]).write_bytes(metadata + packed(file.read_bytes()))
base = sqlite3.connect(":memory:", isolation_level=None)
base.deserialize((folder / "db3/drive.db3").read_bytes())
base.create_function("packed", 1, packed)
base.execute("UPDATE messages SET data = packed(data) WHERE id % 3 > 0")
(folder / "bag/messages").write_bytes(metadata + packed(base.serialize()))
base.close()
for name, data in ("text", b"a,b\n1,2\n" * 9), ("nothing", b""), ("long", b"\0" * 2000000):
    (folder / f"packed/{name}.zst").write_bytes(packed(data))
skipped = b"\x50\x2a\x4d\x18\3\0\0\0abc"
(folder / "packed/two.zst").write_bytes(packed(b"one") + skipped + packed(b"two"))

# A store with two results out of four.
base = sqlite3.connect(folder / "store/results.sqlite", isolation_level=None)
base.executescript("""PRAGMA page_size=512; PRAGMA application_id=1464357425; PRAGMA user_version=1;
CREATE TABLE plan(name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE results(number INTEGER PRIMARY KEY, key TEXT UNIQUE NOT NULL, result BLOB NOT NULL);
INSERT INTO plan VALUES ('--beta', '40');
INSERT INTO results (key, result) VALUES ('item 1', 'a result'), ('item 2', zeroblob(600));""")
base.close()
EOF
cp csv/drive.csv.gz csv/drive.csv.zst packed/
{
  printf 'one' | gzip -c
  printf 'two' | gzip -c
} > packed/two.gz
printf 'plain\n' > packed/plain
printf '%s\n' 'rosbag2_bagfile_information:' '  message_count: 3' \
  '  relative_file_paths: [a_0.mcap, ../secret.mcap, a_1.mcap]' \
  > metadata/two.yaml
printf '%s\n' robot,log,when,robot_file,role a,one.csv,2026-03-01,,commission a,two.csv,2026-03-02,,check \
  b,c.csv,3,r.yaml, \
  > fleet/list.csv
cat > controllers/controllers.yaml <<EOF
controller_manager: {ros__parameters: {update_rate: 50}}
diff_drive_controller:
  ros__parameters:
    left_wheel_names: [left]
    right_wheel_names: [right]
    wheel_separation: 0.4
    wheel_radius: 0.05
    wheel_separation_multiplier: 1.02
    linear.x.has_velocity_limits: true
    linear.x.max_velocity: 1.0
    angular: {z: {max_velocity: 2.0, max_acceleration: .nan}}
    publish_rate: 50.0
EOF

# Definitions, and behind a zero byte messages.
printf 'float64 x\nint32[] n\nstring name\n\0\0\1\0\0' > messages/plain
head -c 64 csv/drive.csv >> messages/plain
printf '%s\n' 'string[] name' 'float64[] velocity' 'Inner[2] deep' === 'MSG: fuzz/Inner' 'uint8 LEVEL=3' \
  'wstring<=5 w' 'bool[<=3] b' \
  > messages/nested

cp "$examples/robot.yaml" robot/
cat > robot/all.yaml <<EOF
name: all
model: single_axis
effort: {kind: voltage, hold: first_order, unsigned: false, delay: [0, 0.02]}
motor: {torque_constant: 0.02, resistance: 1.5, back_emf: 0.02, gear_ratio: 20}
parameters: [inertia, viscous, coulomb]
prior: {inertia: [0.1, 2]}
noise: {wheel_speed: {bound: 0.1, deviation: 0.02}, effort: estimate}
filter: {order: 2, alpha: 5, beta: 5}
limits: {effort: 2, speed: 10, acceleration: 20}
EOF
sed 's/^scenario:.*/scenario: scenario.yaml/' "$examples/studies/better_sensor.yaml" > study/better_sensor.yaml
cat > study/all.yaml <<EOF
name: all
scenario: scenario.yaml
inputs: {noise.effort: [0.01, 0.02], prior.mass: {relative: [-0.1, 0.1]}, duration: {range: [0.2, 0.4], nominal: 0.3}}
window: 2
methods: {morris: {trajectories: 3, levels: 4}, sobol: {points: 8, replicates: 2, confidence: 0.9},
  grid: {levels: {duration: 3}}}
seed: 7
EOF
cat > urdf/robot.urdf <<EOF
<robot name="r">
  <link name="base"><inertial><mass value="9"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="right_wheel"><collision><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>
  <joint name="right" type="continuous"><parent link="base"/><child link="right_wheel"/><axis xyz="0 1 0"/>
    <origin xyz="0 -0.2 0" rpy="0 0 0"/><limit effort="2" velocity="9"/><dynamics damping="0.1" friction="0.2"/></joint>
  <ros2_control name="c" type="system"><joint name="right"><command_interface name="effort"/></joint></ros2_control>
</robot>
EOF
# The same with two wheels; an MJCF with classes and densities; an SDF with poses.
sed '$d; s/name="r"/name="two"/' urdf/robot.urdf > urdf/two.urdf
cat >> urdf/two.urdf <<EOF
  <link name="left_wheel"><inertial><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision></link>
  <joint name="left" type="continuous"><parent link="base"/><child link="left_wheel"/><axis xyz="0 1 0"/>
    <origin xyz="0 0.2 0" rpy="0 0 0"/><limit effort="2" velocity="9"/></joint>
</robot>
EOF
cp urdf/two.urdf simulator/
cat > simulator/cart.xml <<EOF
<mujoco model="cart"><compiler angle="degree"/><default><default class="wheel"><joint axis="0 0 1" damping="0.02"/>
<geom type="cylinder" size="0.1 0.02" density="1500"/></default><motor gear="2"/></default>
<worldbody><geom type="plane" size="0 0 1"/><body name="chassis" pos="0 0 0.1"><freejoint/>
<inertial pos="0.02 0 0.05" quat="0.97 0.26 0 0" mass="12" diaginertia="0.3 0.35 0.4"/><geom type="sphere" size="0.03"/>
<body name="left" pos="0 0.2 0" euler="-90 0 0" childclass="wheel"><joint name="left"/><geom/></body>
<body name="right" pos="0 -0.2 0" zaxis="0 1 0"><joint name="right" class="wheel" armature="0.01"/>
<geom class="wheel"/></body>
</body></worldbody><actuator><motor name="l" joint="left"/><position name="r" joint="right" kp="2" forcerange="-9 9"/>
</actuator></mujoco>
EOF
cat > simulator/cart.sdf <<EOF
<sdf version="1.8"><model name="cart"><pose>1 2 0 0 0 0</pose><link name="base"><pose>0 0 0.1 0 0 0</pose><inertial>
<pose>0.02 0 0.05 0 0 0</pose><mass>12</mass>
<inertia><ixx>0.3</ixx><iyy>0.35</iyy><izz>0.4</izz></inertia></inertial></link>
<link name="l"><pose>0 0.2 0.1 -1.5708 0 0</pose><collision name="c"><geometry><cylinder><radius>0.1</radius>
<length>0.04</length></cylinder></geometry></collision></link>
<link name="r"><pose relative_to="base">0 -0.2 0 -1.5708 0 0</pose>
<inertial><mass>1</mass><inertia><ixx>0.003</ixx><iyy>0.003</iyy><izz>0.005</izz></inertia></inertial></link>
<joint name="left_joint" type="revolute"><parent>base</parent><child>l</child>
<axis><xyz>0 0 1</xyz><limit><effort>20</effort>
</limit><dynamics><damping>0.02</damping></dynamics></axis></joint><joint name="right_joint" type="revolute">
<parent>base</parent><child>r</child><axis><xyz expressed_in="__model__">0 1 0</xyz></axis></joint></model></sdf>
EOF

# Two models, the second with wheel radii and what its pose says at a stated risk; the record of its robot in a fleet.
cat > robot.yaml <<EOF
model: differential_drive
wheel_radius: 0.1
track_width: 0.4
effort: {kind: torque, hold: zero_order, changes: at_samples}
prior: {mass: [5, 60]}
noise: {wheel_speed: 0.02, effort: {bound: 0.02, bias: 0.0001}, position: 0.002, heading: 0.003}
filter: {order: 2, alpha: 20, beta: 20}
EOF
cat > drive.yaml <<EOF
robot: robot.yaml
parameters: {mass: 21, yaw_inertia: 0.9, viscous_linear: 4, viscous_yaw: 0.5}
trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 4}
sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02, position: 0.002, heading: 0.003, log: [speeds, pose]}
duration: 30
rate: 25
EOF
printf 'robot,log,when,robot_file,role\na,drive.csv,2026-03-01,,commission\na,again.csv,2026-03-02,,check\n' > list.csv
"$program" simulate drive.yaml --out drive.csv --quiet
"$program" simulate drive.yaml --seed 2 --out again.csv --quiet
mkdir made
"$program" commission "$examples/healthy.csv.gz" --robot "$examples/robot.yaml" --out made/torque --quiet
"$program" commission drive.csv --robot robot.yaml --out made/pose --quiet
"$program" fleet list.csv --robot robot.yaml --out made/fleet --quiet || [ $? -eq 1 ]
python3 - "$folder" <<'EOF'
import json
import pathlib
import sqlite3
import sys

folder = pathlib.Path(sys.argv[1])
for name in "torque", "pose":
    model = json.loads((folder / "made" / name / "model.json").read_text())
    for unread in "identification", "validation", "notes":
        model.pop(unread)
    text = json.dumps(model, separators=(",", ":"))
    for reader in "model", "claims":
        (folder / reader / f"{name}.json").write_text(text)
for (record,) in sqlite3.connect(folder / "made/fleet/results.sqlite").execute("SELECT result FROM results"):
    (folder / "record/record.json").write_bytes(record)
EOF
echo 'columns: {omega_r: right, tau_l: "/x.effort[left]*2"}' >> robot.yaml
mv robot.yaml columns/
rm -r made drive.yaml list.csv drive.csv again.csv
printf '{"schema":"wheelwright/model/1","robot":{"name":"a","columns":{"tau_r":"/x.effort[right]*2","t":"stamp"}}}\n' \
  > columns/model.json
cat > gap/gap.json <<EOF
{"schema": "wheelwright/gap/1", "filter": {"beta": 10}, "shrink": {"torque_rms": {"sum": {"floor": 0.02},
"difference": {"floor": 0.005}}},
"causes": [{"effect": "coulomb", "parameters": {"coulomb": {"estimate": 0.3, "unit": "N·m"}}}],
"credible_set": [{"effects": ["coulomb"]},
{"effects": ["delay"], "parameters": {"delay.delay": {"estimate": 0.04, "unit": "s"}}},
{"effects": ["coulomb", "mass"]}, {"effects": ["wheel_radius"]}, {"effects": ["stribeck"]}]}
EOF

# words NAME SOURCE...
words() {
  dictionary=$1.dict
  shift
  (cd "$house" && grep -oh '"[A-Za-z_][A-Za-z_0-9.]*"' "$@") | sort -u > "$dictionary"
}
for name in csv follow; do
  sed -n 's/@/r/; s/^ *{\("[a-z_]*"\), .*/\1/p' "$house/formats/logs/recorded_log.cpp" | sort -u > $name.dict
  printf '"tau_l"\n"1e308"\n"nan"\n"inf"\n"-"\n"\\""\n' >> $name.dict
done
words model formats/robots/online_model_file.cpp formats/robots/robot_keys.cpp results/model_file.cpp
words messages formats/logs/ros_definition.cpp
words robot formats/robots/robot_keys.cpp formats/robots/robot_file.cpp
words urdf formats/robots/robot_description.cpp formats/robots/wheel_geometry.cpp formats/robots/robot_origin.cpp formats/robots/controller_file.cpp
words controllers formats/robots/controller_file.cpp
cp model.dict claims.dict
words columns formats/robots/robot_keys.cpp
words gap results/gap_json.cpp gap/effects/catalogue_actuator.cpp gap/effects/catalogue_friction.cpp gap/effects/catalogue_geometry.cpp
words record results/fleet_json.cpp
words simulator formats/robots/mjcf_document.cpp formats/robots/sdf_document.cpp formats/robots/urdf_document.cpp
words scenario results/scenario_file.cpp formats/robots/robot_keys.cpp
printf '"rosbag2_bagfile_information"\n"relative_file_paths"\n"files"\n"message_count"\n"../"\n"/"\n' > metadata.dict
printf '"robot"\n"log"\n"when"\n"robot_file"\n"role"\n"commission"\n"check"\n"2026-03-01"\n' > fleet.dict
words study results/study_json.cpp study/study_case.cpp study/study_quantity.cpp
