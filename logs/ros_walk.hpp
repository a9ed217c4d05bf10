// SPDX-License-Identifier: Apache-2.0
/// \file
/// Walks along the bytes of a message as its plan says.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/logs/ros_plan.hpp>

namespace wheelwright::ros {

/// The place of a name that was not found.
inline constexpr std::size_t nowhere = ~std::size_t{0};

/// Where a walk puts what it reads.
struct WalkTargets {
  std::span<double> values{};                   ///< slots 0, 1, …
  std::span<double> more{};                     ///< slots behind those
  std::vector<std::string>* strings = nullptr;  ///< gets the strings of a list, where given
  std::size_t strings_step = 0;                 ///< the step of the plan's first block that walks along that list
};

/// Walks along `cdr` once (twice where the plan says so). Slots of what the message does not have stay as they were.
/// `places` has one element for each of the plan's names, and is where they were found afterwards. False, with the reason
/// in `error`, where the bytes are no message of `type`: see RosExtractor::read(). Never reads outside of `cdr`; allocates
/// nothing but `strings`, and `error` where it is set.
[[nodiscard]] bool walk(const MessagePlan& plan, const std::string& type, std::string_view cdr,
                        std::vector<std::size_t>& places, const WalkTargets& to, std::string& error);

}  // namespace wheelwright::ros
