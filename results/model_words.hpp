// SPDX-License-Identifier: Apache-2.0
/// \file
/// The words of model.json.
#pragma once

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/robots/robot_keys.hpp>

namespace wheelwright::results {

inline constexpr files::Words<Commissioning::Status, 5> kStatusWords{
    {{Commissioning::Status::done, "done"},
     {Commissioning::Status::partial, "partial"},
     {Commissioning::Status::empty, "empty"},
     {Commissioning::Status::nothing, "nothing"},
     {Commissioning::Status::contradicted, "contradicted"}}};
inline constexpr files::Words<identify::Excitation, 3> kExcitationWords{
    {{identify::Excitation::identified, "identified"},
     {identify::Excitation::indistinct, "indistinct"},
     {identify::Excitation::not_excited, "not_excited"}}};
inline constexpr files::Words<bounds::Side, 2> kSideWords{
    {{bounds::Side::upper, "upper"}, {bounds::Side::lower, "lower"}}};

}  // namespace wheelwright::results
