// SPDX-License-Identifier: Apache-2.0
/// \file
/// pooled_prior.yaml: the box that a fleet gives the next robot's file.
#pragma once

#include <string>

#include <wheelwright/study/fleet_result.hpp>

namespace wheelwright {

/// The key `prior:` as a robot file takes it, with every included parameter in digits that read back exactly, below comments that
/// state the coverage, what it rests on, and what is left out. Where there is no box, the comments say why and the mapping is
/// empty.
[[nodiscard]] std::string pooled_prior_yaml(const FleetResult& fleet, const std::string& software);

}  // namespace wheelwright
