// SPDX-License-Identifier: Apache-2.0
/// \file
/// Verification of the claims about a feasible set against the rows that it was made from, in exact arithmetic.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bounds/check_certificate.hpp"
#include "core/regression.hpp"
#include "results/model_claims.hpp"

namespace wheelwright::results {

/// A published bound and what became of it.
struct BoundVerdict {
  std::size_t parameter = 0;
  bounds::Side side = bounds::Side::upper;
  double stated = 0.0;
  double shown = 0.0;  ///< the bound that is proved, rounded outward; ±∞ where none is
  bool proved = false;
  double shortfall = 0.0;  ///< CertificateCheck::shortfall
  std::string reason;      ///< why it is not proved; empty where it is
};

/// Verdicts on the rows of `feasible_set`.
struct FacetVerdicts {
  std::size_t rows = 0;            ///< the log's row that they name, coefficient by coefficient, b not smaller
  std::size_t sides = 0;           ///< the side of the prior box that they name, b not smaller
  std::size_t implied = 0;         ///< other numbers, which follow from the row that they name and the proved bounds
  std::vector<std::string> wrong;  ///< the others, a sentence each
};

/// What became of the claims about one set.
struct SetCheck {
  std::vector<BoundVerdict> bounds;                   ///< lower and upper bound of each parameter
  std::optional<bounds::CertificateCheck> emptiness;  ///< where it is said to be empty
  FacetVerdicts facets;
  std::vector<bool> facet_proved;     ///< of each facet
  Box proved;                         ///< contains the set, for certain
  bool contradiction = false;         ///< what is to prove the bounds proves that there is no such set
  std::vector<std::string> failures;  ///< everything that is not proved, a sentence each
};

/// Verifies that each facet is the row that it names, or follows from it; that each published bound is proved by the
/// rows that it names, and that the hull contains what is proved; or, where the set is said to be empty, that it is.
/// `rows` are those that it was made from, walked once. Rows of columns with noise whose sign the prior leaves open are
/// rebuilt over the box that they prove.
[[nodiscard]] SetCheck check_set(const SetClaims& claims, core::RegressionSource& rows);

/// "row 5017 (t = 50.17 s, sum, upper)", or "the prior's lower bound of r_mass".
[[nodiscard]] std::string name_of(const bounds::RowOrigin& origin, const SetClaims& claims);

/// Why `check` does not prove its bound, in words; `row_name` names the rows of the certificate.
[[nodiscard]] std::string shortcoming(const bounds::CertificateCheck& check,
                                      const std::function<std::string(std::size_t)>& row_name, const SetClaims& claims);

}  // namespace wheelwright::results
