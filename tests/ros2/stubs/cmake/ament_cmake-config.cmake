# SPDX-License-Identifier: Apache-2.0
# Stands in for the package of ROS 2 of this name where ROS is not to be had.
function(ament_package)
endfunction()
