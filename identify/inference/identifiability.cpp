// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/identifiability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "core/words.hpp"

namespace wheelwright::inference {

TermKind kind_of(std::string_view name) {
  static constexpr std::pair<std::string_view, TermKind> kinds[] = {
      {"viscous", TermKind::viscous}, {"coulomb", TermKind::coulomb}, {"offset", TermKind::offset},
      {"mass", TermKind::inertia},    {"inertia", TermKind::inertia}, {"armature", TermKind::inertia},
      {"payload", TermKind::inertia},
  };
  for (const auto& [word, kind] : kinds) {
    if (name.find(word) != std::string_view::npos) {
      return kind;
    }
  }
  return TermKind::other;
}

Eigen::VectorXd largest_part_one(const Eigen::VectorXd& c, const Eigen::VectorXd& size, double least) {
  const Eigen::VectorXd part = c.cwiseAbs().cwiseProduct(size);
  Eigen::Index largest = 0;
  if (c.size() == 0 || !(part.maxCoeff(&largest) > 0.0)) {
    return c;
  }
  Eigen::Index first = 0;
  while (part[first] < least * part[largest]) {
    ++first;
  }
  return c / std::copysign(c[largest], c[first]);
}

std::string combination_in_words(const Eigen::VectorXd& c, const std::vector<ParameterWords>& parameters,
                                 const Eigen::VectorXd& size, double least) {
  check::that(static_cast<std::size_t>(c.size()) == parameters.size() && size.size() == c.size(), "combination",
              "one coefficient and one size for each parameter");
  const Eigen::VectorXd part = c.cwiseAbs().cwiseProduct(size);
  Eigen::Index largest = 0;
  if (c.size() == 0 || !(part.maxCoeff(&largest) > 0.0)) {
    return "nothing";
  }
  std::vector<Eigen::Index> members;
  for (Eigen::Index j = 0; j < c.size(); ++j) {
    if (part[j] >= least * part[largest]) {
      members.push_back(j);
    }
  }
  std::string words;
  std::vector<std::string> units;
  bool same_unit = true;
  for (const Eigen::Index j : members) {
    const ParameterWords& parameter = parameters[static_cast<std::size_t>(j)];
    words += words.empty() ? (c[j] < 0.0 ? "−" : "") : (c[j] < 0.0 ? " − " : " + ");
    const std::string number = fmt::format("{:.2g}", std::abs(c[j]));
    words += number == "1" ? parameter.name : number + "·" + parameter.name;
    units.push_back(parameter.name + " in " + (parameter.unit.empty() ? "1" : parameter.unit));
    same_unit = same_unit && parameter.unit == parameters[static_cast<std::size_t>(members.front())].unit;
  }
  if (same_unit) {
    const std::string& unit = parameters[static_cast<std::size_t>(members.front())].unit;
    return unit.empty() ? words : fmt::format("{} ({})", words, unit);
  }
  return fmt::format("{} ({})", words, fmt::join(units, ", "));
}

std::vector<std::string> missing_manoeuvres(const std::vector<Eigen::Index>& members,
                                            const std::vector<ParameterWords>& parameters) {
  std::vector<std::string> names, own;
  std::vector<TermKind> kinds;
  for (const Eigen::Index j : members) {
    const ParameterWords& parameter = parameters.at(static_cast<std::size_t>(j));
    names.push_back(parameter.name);
    kinds.push_back(parameter.kind);
    if (!parameter.excite.empty() && std::find(own.begin(), own.end(), parameter.excite) == own.end()) {
      own.push_back(parameter.excite);
    }
  }
  const auto has = [&](TermKind kind) { return std::find(kinds.begin(), kinds.end(), kind) != kinds.end(); };
  const auto only = [&](TermKind kind) {
    return std::all_of(kinds.begin(), kinds.end(), [&](TermKind k) { return k == kind; });
  };
  std::vector<std::string> advice;
  if (members.size() < 2) {
    return own;
  }
  if (only(TermKind::inertia)) {
    advice.push_back("no motion may tell " + core::enumerated(names) +
                     " apart: state one of them, or drive once more with a load of known mass");
  }
  if (has(TermKind::viscous) && has(TermKind::coulomb)) {
    advice.emplace_back("drive in both directions and at many speeds, from slow to fast");
  }
  if (has(TermKind::offset) && has(TermKind::coulomb)) {
    advice.emplace_back("drive forwards and backwards for equal times");
  }
  if (has(TermKind::offset) && has(TermKind::viscous)) {
    advice.emplace_back("hold several different speeds, standstill among them");
  }
  if (has(TermKind::inertia) && (has(TermKind::viscous) || has(TermKind::coulomb))) {
    advice.emplace_back("speed up and brake often, and hold constant speeds in between");
  }
  return advice.empty() ? own : advice;
}

namespace {

constexpr double kRoundings = 64.0;    // ε of a row
constexpr double kClearOfNoise = 3.0;  // as in excitation.hpp
constexpr double kTakesPart = 0.1;     // of a direction's largest scaled entry
constexpr double kDependent = 1e-6;    // of a regrouping coefficient, scaled
constexpr double kEqualRest = 0.5;     // of the longest rest of a column

std::vector<Eigen::Index> members_of(const Eigen::VectorXd& scaled, double least) {
  std::vector<Eigen::Index> members;
  const double most = scaled.cwiseAbs().maxCoeff();
  for (Eigen::Index j = 0; j < scaled.size(); ++j) {
    if (std::abs(scaled[j]) >= least * most && most > 0.0) {
      members.push_back(j);
    }
  }
  return members;
}

std::vector<std::string> names_of(const std::vector<Eigen::Index>& members,
                                  const std::vector<ParameterWords>& parameters) {
  std::vector<std::string> names;
  for (const Eigen::Index j : members) {
    names.push_back(parameters[static_cast<std::size_t>(j)].name);
  }
  return names;
}

// The first `rank` columns that a pivoted QR takes, in the order of the parameters.
std::vector<Eigen::Index> base_columns(Eigen::MatrixXd rest, int rank) {
  std::vector<Eigen::Index> base;
  for (int k = 0; k < rank; ++k) {
    const Eigen::VectorXd lengths = rest.colwise().norm();
    Eigen::Index pivot = 0;
    while (lengths[pivot] < kEqualRest * lengths.maxCoeff()) {
      ++pivot;
    }
    base.push_back(pivot);
    const Eigen::VectorXd axis = rest.col(pivot).normalized();
    for (int twice = 0; twice < 2; ++twice) {
      rest -= axis * (axis.transpose() * rest).eval();
    }
    rest.col(pivot).setZero();
  }
  std::sort(base.begin(), base.end());
  return base;
}

struct ScaledDirections {
  Eigen::MatrixXd R;       // columns of length one
  Eigen::VectorXd length;  // of the columns before
  Eigen::MatrixXd V;       // right singular vectors
};

void find_base(const IdentifiabilityInput& input, const ScaledDirections& scaled, Identifiability& result) {
  const auto p = static_cast<Eigen::Index>(input.parameters.size());
  result.base = base_columns(scaled.R, result.rank);
  std::vector<Eigen::Index> others;
  for (Eigen::Index j = 0; j < p; ++j) {
    if (!std::binary_search(result.base.begin(), result.base.end(), j)) {
      others.push_back(j);
    }
  }
  const Eigen::MatrixXd R1 = scaled.R(Eigen::all, result.base);
  Eigen::MatrixXd beta =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(result.base.size()), static_cast<Eigen::Index>(others.size()));
  if (beta.size() > 0) {
    beta = R1.colPivHouseholderQr().solve(Eigen::MatrixXd(scaled.R(Eigen::all, others)));
    beta = (beta.array().abs() < kDependent).select(0.0, beta);
  }
  const Eigen::VectorXd size = scaled.length.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 1.0; });
  for (Eigen::Index i = 0; i < beta.rows(); ++i) {
    const Eigen::Index b = result.base[static_cast<std::size_t>(i)];
    KnownCombination combination;
    combination.coefficients = Eigen::VectorXd::Unit(p, b);
    for (Eigen::Index k = 0; k < beta.cols(); ++k) {
      const Eigen::Index d = others[static_cast<std::size_t>(k)];
      combination.coefficients[d] = beta(i, k) * scaled.length[d] / scaled.length[b];
    }
    combination.words = combination_in_words(combination.coefficients, input.parameters, size, kDependent);
    result.seen.push_back(std::move(combination));
  }
  for (Eigen::Index k = 0; k < beta.cols(); ++k) {
    const Eigen::Index d = others[static_cast<std::size_t>(k)];
    UnseenDirection unseen;
    unseen.direction = Eigen::VectorXd::Unit(p, d);
    unseen.members = {d};
    std::vector<std::string> combinations;
    for (Eigen::Index i = 0; i < beta.rows(); ++i) {
      if (beta(i, k) != 0.0) {
        const Eigen::Index b = result.base[static_cast<std::size_t>(i)];
        unseen.direction[b] = -result.seen[static_cast<std::size_t>(i)].coefficients[d];
        unseen.members.push_back(b);
        combinations.push_back(result.seen[static_cast<std::size_t>(i)].words);
      }
    }
    std::sort(unseen.members.begin(), unseen.members.end());
    if (!(scaled.length[d] > 0.0)) {
      unseen.why = Unseen::not_moved;
      unseen.words = input.parameters[static_cast<std::size_t>(d)].name + ": its motion never occurs in the log";
    } else {
      unseen.words = fmt::format("{} cannot be told apart here: only {} {} seen",
                                 core::enumerated(names_of(unseen.members, input.parameters)),
                                 core::enumerated(combinations), combinations.size() == 1 ? "is" : "are");
    }
    unseen.manoeuvres = missing_manoeuvres(unseen.members, input.parameters);
    result.unseen.push_back(std::move(unseen));
  }
}

void find_noise(const IdentifiabilityInput& input, const ScaledDirections& scaled, Identifiability& result) {
  result.noise_rank = result.rank;
  if (input.noise.size() == 0 || result.rank == 0) {
    return;
  }
  const Eigen::VectorXd size = scaled.length.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 1.0; });
  const Eigen::MatrixXd V = scaled.V.leftCols(result.rank);
  const Eigen::MatrixXd noise = V.transpose() * size.asDiagonal() * input.noise * size.asDiagonal() * V;
  Eigen::MatrixXd excess = -kClearOfNoise * kClearOfNoise * noise;
  excess.diagonal() += result.singular_values.head(result.rank).cwiseAbs2();
  const core::EigenPairs eigen = core::symmetric_eigen(excess);
  for (Eigen::Index k = 0; k < excess.rows() && eigen.values[k] <= 0.0; ++k) {
    --result.noise_rank;
    const Eigen::VectorXd z = V * eigen.vectors.col(k);
    UnseenDirection unseen;
    unseen.why = Unseen::noise;
    unseen.direction = z.cwiseProduct(size) / z.cwiseAbs().maxCoeff();
    unseen.members = members_of(z, kTakesPart);
    unseen.words = fmt::format("sensor noise alone would show as much: the log says nothing sure about {}",
                               combination_in_words(largest_part_one(z.cwiseQuotient(size), size, kTakesPart),
                                                    input.parameters, size, kTakesPart));
    unseen.manoeuvres = missing_manoeuvres(unseen.members, input.parameters);
    result.unseen.push_back(std::move(unseen));
  }
}

void find_precision(const IdentifiabilityInput& input, Identifiability& result) {
  if (input.covariance.size() == 0 || input.size.size() == 0) {
    return;
  }
  const auto p = static_cast<Eigen::Index>(input.parameters.size());
  std::vector<Eigen::Index> kept;
  for (Eigen::Index j = 0; j < p; ++j) {
    if (input.covariance(j, j) > 0.0) {
      kept.push_back(j);
    }
  }
  if (kept.empty()) {
    return;
  }
  const Eigen::VectorXd one_over = input.size(kept).cwiseInverse();
  const core::EigenPairs eigen =
      core::symmetric_eigen(one_over.asDiagonal() * input.covariance(kept, kept) * one_over.asDiagonal());
  for (Eigen::Index k = 0; k < eigen.values.size(); ++k) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(p);
    u(kept) = eigen.vectors.col(k);
    KnownCombination combination;
    combination.coefficients = largest_part_one(u.cwiseQuotient(input.size), input.size, kTakesPart);
    combination.relative_error = std::sqrt(std::max(0.0, eigen.values[k]));
    combination.words = combination_in_words(combination.coefficients, input.parameters, input.size, kTakesPart);
    result.known.push_back(combination);
  }
  for (auto worst = result.known.rbegin(); worst != result.known.rend() && worst->relative_error > 1.0; ++worst) {
    UnseenDirection unseen;
    unseen.why = Unseen::imprecise;
    const Eigen::VectorXd u = worst->coefficients.cwiseProduct(input.size);
    unseen.direction = u.cwiseProduct(input.size) / u.cwiseAbs().maxCoeff();
    unseen.members = members_of(u, kTakesPart);
    unseen.standard_error = std::sqrt(worst->coefficients.dot(input.covariance * worst->coefficients));
    unseen.words =
        fmt::format("the log says little about {}: its standard error is {:.2g}", worst->words, unseen.standard_error);
    unseen.manoeuvres = missing_manoeuvres(unseen.members, input.parameters);
    result.unseen.push_back(std::move(unseen));
  }
}

}  // namespace

IdentifiabilityInput identifiability_input(const identify::LeastSquares& rows, std::vector<ParameterWords> parameters) {
  const Eigen::MatrixXd factor = rows.factor();
  const Eigen::Index p = factor.cols() - 1;
  IdentifiabilityInput input;
  input.parameters = std::move(parameters);
  input.factor = factor.topLeftCorner(p, p);
  input.instants = rows.instants();
  return input;
}

Identifiability identifiability(const IdentifiabilityInput& input) {
  const auto p = static_cast<Eigen::Index>(input.parameters.size());
  const auto square_or_empty = [&](const Eigen::MatrixXd& m) {
    return m.size() == 0 || (m.rows() == p && m.cols() == p && m.allFinite());
  };
  check::that(p > 0, "parameters", "at least 1");
  check::that(input.factor.cols() == p && input.factor.rows() > 0 && input.factor.allFinite(), "factor",
              "a finite matrix with one column for each parameter");
  check::that(square_or_empty(input.noise), "noise", "a finite p × p matrix, or none");
  check::that(square_or_empty(input.covariance), "covariance", "a finite p × p matrix, or none");
  check::that(input.size.size() == 0 || (input.size.size() == p && (input.size.array() > 0.0).all()), "size",
              "a number > 0 for each parameter, or none");

  ScaledDirections scaled;
  scaled.length = input.factor.colwise().norm();
  scaled.R = input.factor;
  for (Eigen::Index j = 0; j < p; ++j) {
    if (scaled.length[j] > 0.0) {
      scaled.R.col(j) /= scaled.length[j];
    }
  }
  Identifiability result;
  const core::SingularValues svd = core::singular_values(scaled.R);
  scaled.V = svd.V;
  result.singular_values = Eigen::VectorXd::Zero(p);
  result.singular_values.head(svd.values.size()) = svd.values;
  const double largest = result.singular_values[0];
  const double smallest = result.singular_values[p - 1];
  result.condition = smallest > 0.0 ? largest / smallest : std::numeric_limits<double>::infinity();
  const double rounding = kRoundings * static_cast<double>(p) * 0x1.0p-53 *
                          std::sqrt(static_cast<double>(std::max<std::size_t>(input.instants, 1)));
  result.tolerance = rounding;
  result.rank = static_cast<int>((result.singular_values.array() > result.tolerance * largest).count());
  find_base(input, scaled, result);
  find_noise(input, scaled, result);
  find_precision(input, result);
  return result;
}

namespace {

constexpr double kWindows = 60.0;
constexpr double kNoInformation = 1e-13;  // eigenvalue of the scaled Gram matrix, of the largest
constexpr double kConfounded = 1e-5;      // part of a scaled unit vector in the null space

}  // namespace

namespace {

// Whether the time of no block begins before that of the one before it has ended.
bool on_one_clock(const std::vector<identify::MomentBlock>& blocks) {
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b].last < blocks[b].first || (b > 0 && blocks[b].first < blocks[b - 1].last)) {
      return false;
    }
  }
  return true;
}

// Median of the blocks' steps, s; 0 where there is none.
double step_of(const std::vector<identify::MomentBlock>& blocks) {
  std::vector<double> steps;
  for (const identify::MomentBlock& block : blocks) {
    if (block.instants > 1 && block.last > block.first) {
      steps.push_back((block.last - block.first) / static_cast<double>(block.instants - 1));
    }
  }
  return steps.empty() ? 0.0 : core::median(std::move(steps));
}

}  // namespace

InformationOverTime information_over_time(const identify::RegressionMoments& moments,
                                          const InformationOptions& options) {
  check::non_negative(options.seconds, "length of a window");
  check::that(options.coverage > 0.0 && options.coverage <= 1.0, "coverage", "in (0, 1]");
  const Eigen::VectorXd w = options.weights.size() > 0
                                ? options.weights
                                : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(moments.outputs()));
  const std::vector<identify::MomentBlock>& blocks = moments.blocks();
  const auto p = static_cast<Eigen::Index>(moments.parameters());
  InformationOverTime result;
  result.parameters.resize(moments.parameters());
  if (blocks.empty()) {
    return result;
  }
  const bool one_clock = on_one_clock(blocks);
  const double step = step_of(blocks);
  const auto length = [&](const identify::MomentBlock& of) {
    return one_clock ? of.last - of.first : step * static_cast<double>(of.instants);
  };
  for (const identify::MomentBlock& block : blocks) {
    result.seconds += one_clock ? 0.0 : length(block);
  }
  result.seconds = one_clock ? blocks.back().last - blocks.front().first : result.seconds;
  const double seconds = options.seconds > 0.0 ? options.seconds : result.seconds / kWindows;
  std::vector<Eigen::MatrixXd> grams;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Eigen::MatrixXd YY = moments.block(b, w).YY;
    // A block belongs where its middle is.
    const auto is_full = [&] {
      const identify::MomentBlock& window = result.windows.back();
      return one_clock ? 0.5 * (blocks[b].first + blocks[b].last) >= window.first + seconds
                       : blocks[b].first < window.last || blocks[b].last < blocks[b].first ||
                             window.last < window.first || length(window) + 0.5 * length(blocks[b]) >= seconds;
    };
    if (result.windows.empty() || is_full()) {
      result.windows.push_back(blocks[b]);
      grams.push_back(YY);
    } else {
      result.windows.back().last = blocks[b].last;
      result.windows.back().instants += blocks[b].instants;
      grams.back() += YY;
    }
  }
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(p, p);
  for (const Eigen::MatrixXd& gram : grams) {
    G += gram;
  }
  const Eigen::VectorXd one_over = G.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 0.0; });
  const core::EigenPairs eigen = core::symmetric_eigen(one_over.asDiagonal() * G * one_over.asDiagonal());
  const Eigen::VectorXd inverse = eigen.values.unaryExpr(
      [&](double value) { return value > kNoInformation * eigen.values[p - 1] ? 1.0 / value : 0.0; });
  const auto W = static_cast<Eigen::Index>(result.windows.size());

  for (Eigen::Index j = 0; j < p; ++j) {
    ParameterInformation& info = result.parameters[static_cast<std::size_t>(j)];
    info.share = info.cumulative = Eigen::VectorXd::Zero(W);
    const Eigen::VectorXd row = eigen.vectors.row(j).transpose();
    const double confounded = (inverse.array() == 0.0).select(row.array().square(), 0.0).sum();
    if (!(one_over[j] > 0.0) || confounded > kConfounded * kConfounded) {
      continue;
    }
    const Eigen::VectorXd column = one_over.cwiseProduct(eigen.vectors * inverse.cwiseProduct(row)) * one_over[j];
    const Eigen::VectorXd d = column / column[j];
    for (Eigen::Index k = 0; k < W; ++k) {
      info.share[k] = std::max(0.0, d.dot(grams[static_cast<std::size_t>(k)] * d));
    }
    info.information = info.share.sum();
    if (!(info.information > 0.0)) {
      continue;
    }
    info.share /= info.information;
    std::partial_sum(info.share.begin(), info.share.end(), info.cumulative.begin());

    std::vector<std::size_t> order(result.windows.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return info.share[static_cast<Eigen::Index>(a)] > info.share[static_cast<Eigen::Index>(b)];
    });
    double carried = 0.0;
    for (std::size_t k = 0; k < order.size() && carried < options.coverage; ++k) {
      info.shortest.push_back(order[k]);
      carried += info.share[static_cast<Eigen::Index>(order[k])];
    }
    std::sort(info.shortest.begin(), info.shortest.end());
    for (std::size_t k = 0; k < info.shortest.size(); ++k) {
      const identify::MomentBlock& window = result.windows[info.shortest[k]];
      const bool follows = k > 0 && info.shortest[k] == info.shortest[k - 1] + 1 && !info.spans.empty() &&
                           window.first >= info.spans.back().second;
      if (follows && window.last >= window.first) {
        info.spans.back().second = window.last;
      } else if (window.last >= window.first) {
        info.spans.emplace_back(window.first, window.last);
      }
      info.seconds += length(window);
    }
  }
  return result;
}

}  // namespace wheelwright::inference
