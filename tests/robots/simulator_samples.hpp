// SPDX-License-Identifier: Apache-2.0
/// \file
/// Simulators' files as they are found: an MJCF with classes, degrees and densities, and an SDF with poses.
#pragma once

#include <string>

namespace wheelwright::testing {

/// r = 0.1 m, D = 0.4 m; a chassis whose inertial frame is turned, wheels whose mass comes from their geoms, castors,
/// a ground, motors.
inline const std::string sample_mjcf = R"(<?xml version="1.0"?>
<!-- a robot of our own -->
<mujoco model="cart">
  <compiler angle="degree" autolimits="true"/>
  <option timestep="0.001" cone="elliptic" impratio="50" iterations="30" tolerance="1e-12"/>
  <default>
    <geom solref="0.004 1" solimp="0.99 0.99 0.001"/>
    <default class="wheel">
      <joint axis="0 0 1" damping="0.02" armature="0.01"/>
      <geom type="cylinder" size="0.1 0.02" density="1500" condim="3" priority="1" friction="1.5 0.01 0.001"/>
    </default>
    <motor gear="2"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" condim="1"/>
    <body name="chassis" pos="0 0 0.1">
      <freejoint/>
      <inertial pos="0.02 0 0.05" quat="0.9659258262890683 0.25881904510252074 0 0"
                mass="12" diaginertia="0.3 0.35 0.4"/>
      <geom type="box" size="0.25 0.15 0.05" pos="0 0 0.08" contype="0" conaffinity="0"/>
      <geom type="sphere" size="0.03" pos="0.2 0 -0.07" condim="1" friction="0 0 0" priority="1"/>
      <geom type="sphere" size="0.03" pos="-0.2 0 -0.07" condim="1" friction="0 0 0" priority="1"/>
      <body name="left wheel" pos="0 0.2 0" euler="-90 0 0" childclass="wheel">
        <joint name="left" />   <!-- turns about its z -->
        <geom/>
      </body>
      <body name="right wheel" pos="0 -0.2 0" zaxis="0 1 0">
        <joint name="right" class="wheel" damping="0.03"/>
        <geom class="wheel"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="l" joint="left"/>
    <motor name="r" joint="right" gear="2 0 0 0 0 0"/>
  </actuator>
</mujoco>
)";

/// The same robot for Gazebo; its left joint has dynamics, its right one has none.
inline const std::string sample_sdf = R"(<?xml version="1.0"?>
<sdf version="1.8">
  <world name="hall">
    <model name="ground"><static>true</static><link name="plane"/></model>
    <model name="cart">
      <pose>1 2 0 0 0 0</pose>
      <link name="chassis">
        <pose>0 0 0.1 0 0 0</pose>
        <inertial>
          <pose>0.02 0 0.05 0 0 0</pose>
          <mass>12</mass>
          <inertia><ixx>0.3</ixx><iyy>0.35</iyy><izz>0.4</izz></inertia>
        </inertial>
      </link>
      <link name="left_wheel">
        <pose>0 0.2 0.1 -1.5707963267948966 0 0</pose>
        <inertial><mass>1</mass><inertia><ixx>0.003</ixx><iyy>0.003</iyy><izz>0.005</izz></inertia></inertial>
        <collision name="c">
          <geometry><cylinder><radius> 0.1 </radius><length>0.04</length></cylinder></geometry>
        </collision>
      </link>
      <link name="right_wheel">
        <pose relative_to="chassis">0 -0.2 0 -1.5707963267948966 0 0</pose>
        <inertial><mass>1</mass><inertia><ixx>0.003</ixx><iyy>0.003</iyy><izz>0.005</izz></inertia></inertial>
        <collision name="c">
          <geometry><cylinder><radius>0.1</radius><length>0.04</length></cylinder></geometry>
        </collision>
      </link>
      <joint name="left_joint" type="revolute">
        <parent>chassis</parent><child>left_wheel</child>
        <axis>
          <xyz>0 0 1</xyz>
          <limit><lower>-1e16</lower><upper>1e16</upper><effort>20</effort></limit>
          <dynamics><damping>0.02</damping></dynamics>
        </axis>
      </joint>
      <joint name="right_joint" type="revolute">
        <parent>chassis</parent><child>right_wheel</child>
        <axis><xyz expressed_in="__model__">0 1 0</xyz></axis>
      </joint>
    </model>
  </world>
</sdf>
)";

}  // namespace wheelwright::testing
