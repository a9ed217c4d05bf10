// SPDX-License-Identifier: Apache-2.0
/// \file
/// The words of model.json.
#pragma once

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/robots/model_words.hpp>

namespace wheelwright {

inline constexpr Words<Commissioning::Status, 5> kStatusWords{{{Commissioning::Status::done, "done"},
                                                               {Commissioning::Status::partial, "partial"},
                                                               {Commissioning::Status::empty, "empty"},
                                                               {Commissioning::Status::nothing, "nothing"},
                                                               {Commissioning::Status::contradicted, "contradicted"}}};
inline constexpr Words<Excitation, 3> kExcitationWords{{{Excitation::identified, "identified"},
                                                        {Excitation::indistinct, "indistinct"},
                                                        {Excitation::not_excited, "not_excited"}}};
inline constexpr Words<Side, 2> kSideWords{{{Side::upper, "upper"}, {Side::lower, "lower"}}};

}  // namespace wheelwright
