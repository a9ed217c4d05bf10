// SPDX-License-Identifier: Apache-2.0
/// \file
/// The result of commissioning in plain sentences.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/commission/commission.hpp>

namespace wheelwright::words {

/// Smallest |κ| over the outputs that held-out driving shows for certain; nothing where it shows none.
[[nodiscard]] std::optional<double> smallest_certain_kappa(const Commissioning& result);

/// |δ1|/r = √(1 + κ) − 1: the growth of both wheel radii that ζ = κ·Yθ means.
[[nodiscard]] double radius_change(double kappa);

/// Overall standing of a result.
enum class Standing { good, caution, bad };

/// good: a model whose thresholds held and can fire. caution: a model with something to be read first (parameters that
/// the log does not show, false alarms on held-out driving, thresholds that can hardly fire, or see
/// coarse faults only). bad: no model.
[[nodiscard]] Standing standing(const Commissioning& result);

/// One short sentence. Text, not HTML.
[[nodiscard]] std::string verdict(const Commissioning& result);

/// Three to six sentences: what was found, what it stands on, how it fared on held-out driving, what it can see, and
/// what to do next where the result is not what was hoped for. Text, not HTML.
[[nodiscard]] std::vector<std::string> commission_words(const Commissioning& result);

}  // namespace wheelwright::words
