# SPDX-License-Identifier: Apache-2.0
"""ros2 launch wheelwright_diagnostics wheelwright_diagnostics.launch.py [params_file:=FILE]"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    share = Path(get_package_share_directory("wheelwright_diagnostics"))
    return LaunchDescription([
        DeclareLaunchArgument("params_file", default_value=str(share / "config" / "wheelwright_diagnostics.yaml"),
                              description="parameters of the node"),
        Node(package="wheelwright_diagnostics", executable="wheelwright_diagnostics", name="wheelwright_diagnostics",
             parameters=[LaunchConfiguration("params_file")], output="screen"),
    ])
