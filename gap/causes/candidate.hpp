// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effects as columns of one least-squares problem, and sets of them compared by cross-validation: search, model
/// confidence sets over held-out losses, permutation tests for autocorrelated series.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "gap/rows/block_gram.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::gap {

/// One effect at one point of its shapes, as columns of a BlockGram.
struct Candidate {
  std::size_t effect = 0;  ///< index into the catalogue
  std::vector<double> shape;
  std::vector<std::size_t> columns;
  std::vector<int> sign;          ///< of each column's coefficient, as Subset::sign
  bool unit_coefficient = false;  ///< the columns enter with the coefficient 1
  std::vector<std::size_t>
      own{};               ///< those of the columns that are the effect itself, not what comes along with it; empty:
                           ///< all
  std::size_t beside = 0;  ///< of the shapes: not counted as numbers (ShapeParameter::beside)
};

/// All candidates of a gap analysis. Keeps references to the Gram matrices and their rows.
struct CandidateTable {
  const BlockGram* gram = nullptr;
  const std::vector<RowSpace>* spaces = nullptr;  ///< of `gram`; nothing: gains are compared over whole blocks
  std::vector<std::size_t> base;                  ///< columns of the base model's parameters θ
  std::vector<std::size_t> unknown;               ///< those of them that have no nominal value: fitted in any case
  std::vector<Candidate> candidates;              ///< of one effect side by side
  std::vector<std::string> names;                 ///< of the effects, by index
  std::vector<bool> free_form{};                  ///< of the effects, by index (Effect::free_form); empty: none
  std::vector<std::pair<std::size_t, double>>
      inertias{};  ///< columns of θ that are inertias, with the nominal values that their coefficients add to
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

/// Unexplained fraction: the largest share of a column of `a`, after θ is fitted, that the columns of `b` do not make
/// up with coefficients of their signs; 0 where b contains a.
[[nodiscard]] double unexplained_by(const CandidateTable& table, const std::vector<std::size_t>& a,
                                    const std::vector<std::size_t>& b, BaseModel base);

/// The same for what `a` contributes with the coefficients of its fit: the largest share, after θ is fitted, of a
/// member's contribution that the columns of `b` do not make up with coefficients of their signs. A set whose
/// coefficients may have either sign can so be a special case of one whose may not, as a load is of one off the axle.
[[nodiscard]] double fit_unexplained_by(const CandidateTable& table, const std::vector<std::size_t>& a,
                                        const std::vector<std::size_t>& b, BaseModel base);

/// Shapley value of each member of `set`: its mean gain in held-out mean square over all orders in which the causes
/// could have been added, as a share of `gap` (mean squares of the floor).
[[nodiscard]] std::vector<double> shapley_shares(const CandidateTable& table, const CauseSet& set, BaseModel base,
                                                 double gap);

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

/// p-values, corrected for the number of regimes, that the mean of `values` over each of `regimes` (one value a row) is
/// above that of the rest by chance: contiguous blocks of `values` are permuted against the regimes, and the
/// standardised sums are compared with the permutations' maximum over all regimes, step by step (Westfall and Young
/// 1993, section 2.6). Valid for values that are stationary and forget within a block; blocks are ten times `memory`
/// (rows), and there are 12 to 48 of them. All are 1 for fewer than 64 values.
[[nodiscard]] std::vector<double> block_permutation_p_values(const Eigen::VectorXd& values,
                                                             const std::vector<Mask>& regimes, double memory,
                                                             std::size_t permutations, std::uint64_t seed);

/// Integrated autocorrelation time, in rows, of the squares of a Gaussian series with the autocorrelations ρ_k of
/// `series`: 1 + 2 Σ ρ_k², up to the first |ρ_k| <= 0.2. Unlike that of the squares themselves it is little changed by
/// a variance that differs from regime to regime.
[[nodiscard]] double memory_of_squares(const Eigen::VectorXd& series);

/// Options of model_confidence_set().
struct ConfidenceSetOptions {
  double margin = 0.0;  ///< mean loss per block by which a model may be worse than the best and still be as good
  std::size_t resamples = 1999;  ///< > 0, of whole blocks
  std::uint64_t seed = 1;
};

/// p-value of each model of a model confidence set (Hansen, Lunde and Nason 2011): models are dropped one by one, the
/// one with the largest studentised mean loss beyond that of the best (plus the margin) first, and the p-value of each
/// is the largest of the tests up to its own; the best has 1. A model belongs to the set of level 1 − a where its
/// p-value is at least a, and all models that are equally good are in it together with that probability, to what a
/// bootstrap of the blocks can do: which of them comes out best by chance is resampled too. `losses` holds one vector
/// per model, one value per block; blocks are resampled whole, so that they may be correlated inside. Throws
/// InvalidArgument unless all have the same length, at least four.
[[nodiscard]] std::vector<double> model_confidence_set(const std::vector<Eigen::VectorXd>& losses,
                                                       const ConfidenceSetOptions& options = {});

}  // namespace wheelwright::gap
