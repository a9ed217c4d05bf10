#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Makes seeds for the fuzzers with our own writers, and for those of text a dictionary: the words in the sources that read it.
#
#   fuzz/seeds.sh PROGRAM FOLDER     FOLDER/NAME/* for every fuzzer NAME, and FOLDER/NAME.dict
set -eu
program=$(realpath "${1:?usage: fuzz/seeds.sh PROGRAM FOLDER}")
folder=${2:?usage: fuzz/seeds.sh PROGRAM FOLDER}
house=$(realpath "$(dirname "$0")/..")
examples=$house/examples
rm -rf "$folder"
for name in csv follow hdf5 db3 journal mcap messages metadata robot urdf controllers fleet model study scenario; do
  mkdir -p "$folder/$name"
done
cd "$folder"

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
sed 's/^robot:.*/robot: {model: differential_drive, wheel_radius: 0.1, track_width: 0.4, effort: {kind: torque, hold: zero_order}}/' \
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
"$program" convert csv/drive.csv bag --quiet
cp bag/metadata.yaml metadata/
rm -r bag
printf 'rosbag2_bagfile_information:\n  message_count: 3\n  relative_file_paths: [a_0.mcap, ../secret.mcap, a_1.mcap]\n' \
  > metadata/two.yaml
printf 'robot,log,when,robot_file,role\na,one.csv,2026-03-01,,commission\na,two.csv,2026-03-02,,check\nb,c.csv,3,r.yaml,\n' \
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
printf 'string[] name\nfloat64[] velocity\nInner[2] deep\n===\nMSG: fuzz/Inner\nuint8 LEVEL=3\nwstring<=5 w\nbool[<=3] b\n' \
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
methods: {morris: {trajectories: 3, levels: 4}, sobol: {points: 8, replicates: 2, confidence: 0.9}, grid: {levels: {duration: 3}}}
seed: 7
EOF
cat > urdf/robot.urdf <<EOF
<robot name="r">
  <link name="base"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="right_wheel"><collision><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>
  <joint name="right" type="continuous"><parent link="base"/><child link="right_wheel"/><axis xyz="0 1 0"/>
    <origin xyz="0 -0.2 0" rpy="0 0 0"/><limit effort="2" velocity="9"/><dynamics damping="0.1" friction="0.2"/></joint>
  <ros2_control name="c" type="system"><joint name="right"><command_interface name="effort"/></joint></ros2_control>
</robot>
EOF
"$program" commission "$examples/healthy.csv.gz" --robot "$examples/robot.yaml" --out model --quiet
rm model/report.html drive.yaml

# words NAME SOURCE...
words() {
  dictionary=$1.dict
  shift
  (cd "$house" && grep -oh '"[A-Za-z_][A-Za-z_0-9.]*"' "$@") | sort -u > "$dictionary"
}
for name in csv follow; do
  sed -n 's/@/r/; s/^ *{\("[a-z_]*"\), .*/\1/p' "$house/logs/recorded_log.cpp" | sort -u > $name.dict
  printf '"tau_l"\n"1e308"\n"nan"\n"inf"\n"-"\n"\\""\n' >> $name.dict
done
words messages logs/ros_definition.cpp
words robot robots/robot_keys.cpp robots/robot_file.cpp
words urdf robots/robot_description.cpp robots/wheel_geometry.cpp robots/robot_origin.cpp robots/controller_file.cpp
words model robots/online_model_file.cpp robots/robot_keys.cpp
words controllers robots/controller_file.cpp
words scenario results/scenario_file.cpp robots/robot_keys.cpp
printf '"rosbag2_bagfile_information"\n"relative_file_paths"\n"files"\n"message_count"\n"../"\n"/"\n' > metadata.dict
printf '"robot"\n"log"\n"when"\n"robot_file"\n"role"\n"commission"\n"check"\n"2026-03-01"\n' > fleet.dict
words study results/study_json.cpp study/study_case.cpp study/study_quantity.cpp
