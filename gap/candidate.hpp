// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effects as columns of one least-squares problem, and sets of them compared by cross-validation.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/block_gram.hpp>

namespace wheelwright::gap {

/// One effect at one point of its shapes, as columns of a BlockGram.
struct Candidate {
  std::size_t effect = 0;  ///< index into the catalogue
  std::vector<double> shape;
  std::vector<std::size_t> columns;
  std::vector<int> sign;          ///< of each column's coefficient, as Subset::sign
  bool unit_coefficient = false;  ///< the columns enter with the coefficient 1
  std::vector<std::size_t>
      own{};  ///< those of the columns that are the effect itself, not what comes along with it; empty:
              ///< all
};

/// All candidates of a gap analysis. Keeps a reference to the Gram matrices.
struct CandidateTable {
  const BlockGram* gram = nullptr;
  std::vector<std::size_t> base;      ///< columns of the base model's parameters θ
  std::vector<std::size_t> unknown;   ///< those of them that have no nominal value: fitted in any case
  std::vector<Candidate> candidates;  ///< of one effect side by side
  std::vector<std::string> names;     ///< of the effects, by index
};

/// Treatment of θ beside the causes: fitted freely, or held at its nominal value.
enum class BaseModel {
  refitted,
  nominal,  ///< as far as it has a nominal value
};

/// A set of causes and what it leaves.
struct CauseSet {
  std::vector<std::size_t> members;  ///< indices of candidates, ascending; at most one of an effect
  double held_out_error = 0.0;       ///< mean square in units of the floor
  Eigen::VectorXd loss;              ///< of each block
  double coefficients = 0.0;         ///< number of coefficients and shapes that are estimated besides θ
};

/// The least-squares problem of the set.
[[nodiscard]] Subset subset_of(const CandidateTable& table, const std::vector<std::size_t>& members, BaseModel base);

/// The set with its held-out error.
[[nodiscard]] CauseSet evaluate(const CandidateTable& table, std::vector<std::size_t> members, BaseModel base);

/// `set` without its member `k`.
[[nodiscard]] CauseSet evaluate_without(const CandidateTable& table, const CauseSet& set, std::size_t k,
                                        BaseModel base);

/// Effects of the set, ascending.
[[nodiscard]] std::vector<std::size_t> effects_of(const CandidateTable& table, const CauseSet& set);

/// Their names.
[[nodiscard]] std::vector<std::string> names_of(const CandidateTable& table, const CauseSet& set);

/// Options of search_causes().
struct CauseSearchOptions {
  BaseModel base = BaseModel::refitted;
  std::vector<bool> allowed;    ///< by effect; empty: all
  std::size_t largest = 3;      ///< most causes in a set
  std::size_t pair_beam = 10;   ///< best single effects from which pairs are grown
  std::size_t triple_beam = 4;  ///< best pairs from which triples are grown
  std::size_t kept = 40;        ///< best sets of each size that are returned
  std::size_t threads = 1;      ///< the result does not depend on it
};

/// Sets by size: the empty one, every effect alone at its best shape, and the best pairs and triples, each best first.
/// Pairs are grown from the best single effects with every other effect, the shapes of both chosen again for each
/// other; triples from the best pairs.
[[nodiscard]] std::vector<std::vector<CauseSet>> search_causes(const CandidateTable& table,
                                                               const CauseSearchOptions& options = {});

}  // namespace wheelwright::gap
