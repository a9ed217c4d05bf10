// SPDX-License-Identifier: Apache-2.0
/// \file
/// wheelwright_diagnostics: exit code 2 where a parameter or the model cannot be used.
#include <exception>
#include <memory>

#include "node.hpp"

int main(int count, char** arguments) {
  rclcpp::init(count, arguments);
  int code = 0;
  try {
    rclcpp::spin(std::make_shared<wheelwright_diagnostics::DiagnosticsNode>());
  } catch (const std::exception& error) {
    RCLCPP_FATAL(rclcpp::get_logger("wheelwright_diagnostics"), "%s", error.what());
    code = 2;
  }
  rclcpp::shutdown();
  return code;
}
