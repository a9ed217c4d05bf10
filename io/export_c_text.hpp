// SPDX-License-Identifier: Apache-2.0
/// \file
/// The parts of an exported detector that are the same for every model, as C99.
///
/// `pfx` stands for the user's prefix, `PFX` for the same in capitals. Each part mirrors one piece of the library operation
/// by operation; whoever changes one changes the other (tests/io/export_c_test.cpp compares every bit).
#pragma once

#include <string_view>

namespace wheelwright::c_text {

/// Compiler settings that the numbers depend on.
extern const std::string_view kCompiler;
/// Types: cascade, weights (filter/exact.hpp), channel, decision (detector/detector.hpp).
extern const std::string_view kTypes;
/// exponential_moments() and StepWeights.
extern const std::string_view kWeights;
/// Cascade.
extern const std::string_view kCascade;
/// Box::support, of the hull.
extern const std::string_view kHull;
/// SupportTable::support: the walk in one block.
extern const std::string_view kFollow;
/// ThresholdRule::at.
extern const std::string_view kThreshold;
/// PersistenceCounter.
extern const std::string_view kPersistence;

}  // namespace wheelwright::c_text
