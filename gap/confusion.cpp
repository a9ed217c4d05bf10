// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/confusion.hpp>

#include <algorithm>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>

namespace wheelwright {
namespace {

Eigen::MatrixXd products(const BlockGram& gram, const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  Eigen::MatrixXd m(static_cast<Eigen::Index>(a.size()), static_cast<Eigen::Index>(b.size()));
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      m(i, j) = gram.product(a[static_cast<std::size_t>(i)], b[static_cast<std::size_t>(j)]);
    }
  }
  return m;
}

// Σ signature² that the columns `on` leave of Σ weight·column.
double left_of(const BlockGram& gram, const std::vector<std::size_t>& columns, const Eigen::VectorXd& weights,
               const std::vector<std::size_t>& on) {
  const double square = weights.dot(products(gram, columns, columns) * weights);
  if (on.empty()) {
    return square;
  }
  Eigen::MatrixXd A = products(gram, on, on);
  const Eigen::VectorXd unit = A.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  A = unit.asDiagonal() * A * unit.asDiagonal();
  A.diagonal().array() += 1e-10;
  const Eigen::VectorXd c = unit.asDiagonal() * (products(gram, on, columns) * weights);
  return std::max(square - c.dot(A.ldlt().solve(c)), 0.0);
}

struct Signature {
  std::size_t candidate = 0;
  Eigen::VectorXd weights;
  double square = 0.0;  // beside θ
};

}  // namespace

std::vector<ConfusablePair> confusable_pairs(const CandidateTable& table, BaseModel base, double least) {
  const BlockGram& gram = *table.gram;
  const std::vector<std::size_t>& theta = base == BaseModel::refitted ? table.base : table.unknown;
  std::vector<std::optional<Signature>> of_effect(table.names.size());
  std::vector<double> error(table.names.size(), std::numeric_limits<double>::infinity());
  for (std::size_t c = 0; c < table.candidates.size(); ++c) {
    const std::size_t e = table.candidates[c].effect;
    const CauseSet set = evaluate(table, {c}, base);
    if (set.held_out_error < error[e]) {
      error[e] = set.held_out_error;
      of_effect[e] = Signature{c, {}, 0.0};
    }
  }
  for (std::optional<Signature>& signature : of_effect) {
    if (!signature) {
      continue;
    }
    const Candidate& candidate = table.candidates[signature->candidate];
    const auto n = static_cast<Eigen::Index>(candidate.columns.size());
    signature->weights = Eigen::VectorXd::Ones(n);
    if (!candidate.unit_coefficient) {
      Subset subset = subset_of(table, {signature->candidate}, base);
      subset.sign.clear();
      signature->weights = gram.fit(subset).coefficients.tail(n);
    }
    signature->square = left_of(gram, candidate.columns, signature->weights, theta);
    if (!(signature->square > 0.0)) {
      signature.reset();
    }
  }
  const auto made_up = [&](const Signature& a, const Signature& b) {
    std::vector<std::size_t> on = theta;
    const Candidate& rival = table.candidates[b.candidate];
    const std::vector<std::size_t>& columns = rival.own.empty() ? rival.columns : rival.own;
    on.insert(on.end(), columns.begin(), columns.end());
    return 1.0 - left_of(gram, table.candidates[a.candidate].columns, a.weights, on) / a.square;
  };
  std::vector<ConfusablePair> pairs;
  for (std::size_t a = 0; a < of_effect.size(); ++a) {
    for (std::size_t b = a + 1; b < of_effect.size(); ++b) {
      if (!of_effect[a] || !of_effect[b]) {
        continue;
      }
      const double similarity = std::max(made_up(*of_effect[a], *of_effect[b]), made_up(*of_effect[b], *of_effect[a]));
      if (similarity >= least) {
        pairs.push_back({table.names[a], table.names[b], std::min(similarity, 1.0), false, {}});
      }
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const ConfusablePair& a, const ConfusablePair& b) { return a.similarity > b.similarity; });
  return pairs;
}

std::vector<std::string> not_excited(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                     const Drive& drive, double least) {
  const BlockGram& gram = *table.gram;
  std::vector<double> beyond(catalogue.size(), 0.0);
  for (const Candidate& candidate : table.candidates) {
    for (std::size_t k = 0; k < candidate.columns.size(); ++k) {
      const double square = gram.square(candidate.columns[k]);
      if (square > 0.0) {
        const double left = left_of(gram, {candidate.columns[k]}, Eigen::VectorXd::Ones(1), table.base);
        beyond[candidate.effect] = std::max(beyond[candidate.effect], left / square);
      }
    }
  }
  std::vector<std::string> sentences;
  for (std::size_t e = 0; e < catalogue.size(); ++e) {
    const Applicability applies = applicability(catalogue[e], drive);
    if (!applies.applies) {
      sentences.push_back(catalogue[e].name + ": " + applies.reason);
    } else if (beyond[e] < least && !catalogue[e].parametric) {
      sentences.push_back(catalogue[e].name + ": this log does not show it; " + catalogue[e].excite);
    }
  }
  return sentences;
}

}  // namespace wheelwright
