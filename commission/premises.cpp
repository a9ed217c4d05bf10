// SPDX-License-Identifier: Apache-2.0
#include "commission/premises.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "commission/contradiction_search.hpp"
#include "commission/fit.hpp"
#include "commission/keep_instants.hpp"
#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "commission/setting_rows.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "identify/moments.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

using core::AssumptionVerdict;
using identify::MomentSums;
using identify::RegressionMoments;
using Indices = std::vector<Eigen::Index>;

constexpr std::size_t kBlocksOfMoments = 512;
constexpr double kLongEnoughForThirds = 60.0;  // s
constexpr double kFewestInPart = 60.0;         // instants, from which on a part is fitted
constexpr double kMotionShare = 0.5;           // of a direction's Σ YᵀY that must be more than noise
constexpr double kAlwaysShows = 2.0;           // standard errors beyond a limit
constexpr double kPartOfParameter = 0.1, kPartOfEffort = 0.02;
constexpr double kTimesOffset = 5.0;
constexpr double kShapeOfEffort = 0.05;
constexpr double kOpenSign = 0.1;      // of dry friction: an instant with more of it in doubt is left out
constexpr double kRegular = 1e-9;      // reciprocal condition, columns scaled
constexpr double kLeastSide = 0.05;    // of a log on either side of a change
constexpr double kLevelOfTime = 7.35;  // of the likelihood ratio of a change's place at 95 % (Hansen 2000)

// ω|ω| and √|ω| sgn ω of one joint, whose number is the first constant.
model::TermValue quadratic(const model::MotionState& state, const std::array<double, 2>& joint) {
  const auto j = static_cast<std::size_t>(joint[0]);
  const double speed = state.joint_speed[j], error = j < state.joint_error.size() ? state.joint_error[j] : 0.0;
  return {speed * std::abs(speed), (2.0 * std::abs(speed) + error) * error};
}
model::TermValue root(const model::MotionState& state, const std::array<double, 2>& joint) {
  const auto j = static_cast<std::size_t>(joint[0]);
  const double speed = state.joint_speed[j], error = j < state.joint_error.size() ? state.joint_error[j] : 0.0;
  return {std::copysign(std::sqrt(std::abs(speed)), speed), std::sqrt(2.0 * error)};
}

// The setting with columns of its own for the premises: first those of the model.
struct Widened {
  Setting setting;
  Indices model, offsets, shapes, dry;
};

Indices joined(Indices a, const Indices& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

bool has_constant(const Model& model) {
  return std::ranges::any_of(model.terms,
                             [](const Term& t) { return t.function.shape() == model::TermShape::constant; });
}

Widened widened_for_premises(const Setting& s, const Fit& fit) {
  Widened w{.setting = s, .model = {}, .offsets = {}, .shapes = {}, .dry = {}};
  Model& m = w.setting.model;
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    if (fit.excitation[j].state != identify::Excitation::not_excited) {
      w.model.push_back(static_cast<Eigen::Index>(j));
    }
    if (m.parameters[j].dry_friction) {
      w.dry.push_back(static_cast<Eigen::Index>(j));
    }
  }
  const auto joints = static_cast<std::size_t>(m.input.cols());
  const auto add = [&](const std::string& name) {
    m.parameters.push_back(
        {.name = name, .unit = {}, .physical = name, .physical_unit = {}, .prior = {}, .excite = {}});
    return m.p() - 1;
  };
  const auto add_term = [&](std::size_t parameter, std::size_t joint, const model::TermFunction& function) {
    for (std::size_t i = 0; i < m.n(); ++i) {
      const double scale = m.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(joint));
      if (scale != 0.0) {
        m.terms.push_back({.output = i,
                           .parameter = parameter,
                           .kind = Term::Kind::function,
                           .coordinate = 0,
                           .scale = scale,
                           .function = function});
      }
    }
  };
  if (!has_constant(s.model)) {
    for (std::size_t joint = 0; joint < joints; ++joint) {
      const std::size_t at = add(fmt::format("effort offset of joint {}", joint + 1));
      w.offsets.push_back(static_cast<Eigen::Index>(at));
      add_term(at, joint, model::TermShape::constant);
    }
  }
  const auto add_shape = [&](const char* name, model::TermFunction::Shaped function) {
    const std::size_t at = add(name);
    w.shapes.push_back(static_cast<Eigen::Index>(at));
    for (std::size_t joint = 0; joint < joints; ++joint) {
      add_term(at, joint, model::TermFunction(function, {static_cast<double>(joint), 0.0}));
    }
  };
  if (s.robot.effects.empty()) {
    add_shape("the square of the speed", quadratic);
    if (!w.dry.empty()) {
      add_shape("the root of the speed", root);
    }
  }
  return w;
}

// Whether noise leaves little of the dry friction of instant `k` open, in each output.
bool signs_are_known(const Widened& w, const RegressionBlock& block, std::size_t k) {
  const auto n = static_cast<Eigen::Index>(block.outputs), first = static_cast<Eigen::Index>(k) * n;
  return std::ranges::none_of(w.dry, [&](Eigen::Index j) {
    return (block.dY.col(j).segment(first, n).array() > kOpenSign * block.Y.col(j).segment(first, n).array().abs())
        .any();
  });
}

RegressionMoments premise_moments(LogSource& log, const Widened& w) {
  TorqueRows rows = make_rows(log, w.setting, errors_of_fit(w.setting));
  RegressionMoments moments(rows.outputs(), rows.parameters(), false, kBlocksOfMoments);
  core::for_each_block(rows, [&](RegressionBlock& block) {
    keep_instants(block, [&](std::size_t k) { return signs_are_known(w, block, k); });
    moments.add(block);
  });
  log.rewind();
  return moments;
}

// A range of the moments' blocks.
struct BlockRange {
  std::size_t first = 0, last = 0;
  std::string name{};
};

// Blocks from which on other parameters fit: best, and all but as well as that.
struct ChangePlace {
  std::size_t best = 0, first = 0, last = 0;
};

// Least squares on a part of a log, for the columns that were kept.
struct PartFit {
  bool usable = false;
  Eigen::VectorXd theta;      // with the noise of the motion taken away
  Eigen::VectorXd by_noise;   // by how much that changes it
  Eigen::VectorXd error;      // standard errors
  Eigen::VectorXd freedom;    // of their Student's t
  Eigen::MatrixXd by_offset;  // kept × joints: what a unit of each joint's offset makes of θ
  Eigen::MatrixXd inverse;    // kept × kept: what the rows' Σ Yᵀy makes of θ
};

// Moments in weighted units, with what noise adds to them.
class PremiseMoments {
 public:
  PremiseMoments(const RegressionMoments& moments, const Eigen::VectorXd& weights, const identify::RowNoise& noise)
      : instants_(moments.blocks().size()) {
    noise_ = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(moments.parameters()),
                                   static_cast<Eigen::Index>(moments.parameters()));
    for (std::size_t i = 0; i < noise.YY.size(); ++i) {
      const double w = weights[static_cast<Eigen::Index>(i)];
      noise_ += w * w * noise.YY[i];
    }
    for (std::size_t b = 0; b < instants_.size(); ++b) {
      blocks_.push_back(moments.block(b, weights));
      instants_[b] = static_cast<double>(moments.blocks()[b].instants);
      begins_.push_back(moments.blocks()[b].first);
    }
  }

  [[nodiscard]] std::size_t blocks() const { return blocks_.size(); }
  [[nodiscard]] double begin_of(std::size_t block) const { return begins_[block]; }
  [[nodiscard]] bool holds(const BlockRange& range, double t) const {
    return range.first < blocks() && t >= begins_[range.first] && (range.last >= blocks() || t < begins_[range.last]);
  }
  [[nodiscard]] double instants(std::size_t first, std::size_t last) const {
    double sum = 0.0;
    for (std::size_t b = first; b < last; ++b) {
      sum += instants_[b];
    }
    return sum;
  }
  // The block before which this share of all instants lies.
  [[nodiscard]] std::size_t at_share(double share) const {
    const double all = instants(0, blocks());
    double sum = 0.0;
    for (std::size_t b = 0; b < blocks(); ++b) {
      if (sum >= share * all) {
        return b;
      }
      sum += instants_[b];
    }
    return blocks();
  }
  [[nodiscard]] MomentSums sums(std::size_t first, std::size_t last) const {
    MomentSums total;
    total.YY = Eigen::MatrixXd::Zero(noise_.rows(), noise_.cols());
    total.Yy = Eigen::VectorXd::Zero(noise_.rows());
    for (std::size_t b = first; b < last; ++b) {
      total.YY += blocks_[b].YY;
      total.Yy += blocks_[b].Yy;
      total.yy += blocks_[b].yy;
    }
    return total;
  }
  // Root mean square of the efforts, and of one column.
  [[nodiscard]] double effort() const { return std::sqrt(sums(0, blocks()).yy / std::max(instants(0, blocks()), 1.0)); }
  [[nodiscard]] double column(Eigen::Index j) const {
    return std::sqrt(sums(0, blocks()).YY(j, j) / std::max(instants(0, blocks()), 1.0));
  }

  [[nodiscard]] PartFit fit(const BlockRange& range, const Indices& kept, const Indices& offsets) const;
  // All columns, zero those that are not kept; what the rows leave open is as small as can be.
  [[nodiscard]] Eigen::VectorXd least_squares(std::size_t first, std::size_t last, const Indices& kept) const;
  // Residuals are alike over `alike` instants.
  [[nodiscard]] ChangePlace change(const Indices& kept, double alike) const;

 private:
  std::vector<MomentSums> blocks_;
  std::vector<double> instants_, begins_;
  Eigen::MatrixXd noise_;
};

PartFit PremiseMoments::fit(const BlockRange& range, const Indices& kept, const Indices& offsets) const {
  PartFit part;
  const MomentSums total = sums(range.first, range.last);
  const double n = instants(range.first, range.last);
  const Eigen::MatrixXd whole = total.YY(kept, kept), noise = noise_(kept, kept);
  if (kept.empty() || n < kFewestInPart || !(whole.diagonal().minCoeff() > 0.0)) {
    return part;
  }
  const Eigen::VectorXd unit = whole.diagonal().cwiseSqrt().cwiseInverse();
  const auto scaled = [&](const Eigen::MatrixXd& A) -> Eigen::MatrixXd {
    return unit.asDiagonal() * A * unit.asDiagonal();
  };
  const Eigen::MatrixXd signal = scaled(whole - n * noise);
  const core::LdltFactors with(signal), without(scaled(whole));
  const std::optional<Eigen::VectorXd> shares = core::generalized_eigenvalues(signal, scaled(whole));
  if (with.reciprocal_condition() < kRegular || !shares || shares->minCoeff() < kMotionShare) {
    return part;
  }
  const auto solve = [&](const core::LdltFactors& by, const Eigen::MatrixXd& b) -> Eigen::MatrixXd {
    return unit.asDiagonal() * by.solve(Eigen::MatrixXd(unit.asDiagonal() * b));
  };
  const Eigen::VectorXd right = total.Yy(kept);
  part.theta = solve(with, right);
  part.by_noise = part.theta - solve(without, right).col(0);
  part.by_offset =
      offsets.empty() ? Eigen::MatrixXd(Eigen::MatrixXd::Zero(unit.size(), 0)) : solve(with, total.YY(kept, offsets));
  const auto count = static_cast<Eigen::Index>(range.last - range.first);
  Eigen::MatrixXd scores(unit.size(), count), squares(unit.size(), count);
  const Eigen::MatrixXd& inverse = part.inverse = solve(with, Eigen::MatrixXd::Identity(unit.size(), unit.size()));
  for (Eigen::Index k = 0; k < count; ++k) {
    const MomentSums& s = blocks_[range.first + static_cast<std::size_t>(k)];
    const Eigen::MatrixXd YY = s.YY(kept, kept);
    scores.col(k) = s.Yy(kept) - (YY - instants_[range.first + static_cast<std::size_t>(k)] * noise) * part.theta;
    squares.col(k) = (inverse * YY * inverse.transpose()).diagonal();
  }
  const identify::LongRunCovariance covariance = identify::long_run_covariance(Eigen::MatrixXd(inverse * scores));
  part.error = covariance.matrix.diagonal().cwiseMax(0.0).cwiseSqrt();
  part.freedom.resize(unit.size());
  for (Eigen::Index j = 0; j < unit.size(); ++j) {
    part.freedom[j] =
        std::max(1.0, identify::effective_freedom(squares.row(j), static_cast<std::size_t>(covariance.freedom)));
  }
  part.usable = covariance.freedom > 0.0 && part.theta.allFinite() && part.error.allFinite();
  return part;
}

Eigen::VectorXd PremiseMoments::least_squares(std::size_t first, std::size_t last, const Indices& kept) const {
  const MomentSums total = sums(first, last);
  const Eigen::VectorXd unit =
      total.YY.diagonal()(kept).unaryExpr([](double x) { return x > 0.0 ? 1.0 / std::sqrt(x) : 0.0; });
  const Eigen::MatrixXd scaled = unit.asDiagonal() * total.YY(kept, kept) * unit.asDiagonal();
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(noise_.rows());
  theta(kept) = unit.cwiseProduct(core::minimum_norm_solution(scaled, unit.cwiseProduct(total.Yy(kept))).col(0));
  return theta;
}

ChangePlace PremiseMoments::change(const Indices& kept, double alike) const {
  const MomentSums all = sums(0, blocks());
  MomentSums before = sums(0, 0);
  ChangePlace place{.best = blocks() / 2};
  std::vector<double> both(blocks(), -std::numeric_limits<double>::infinity());  // explained by a change there
  const double count = instants(0, blocks());
  double seen = 0.0;
  const auto explained = [&](const Eigen::MatrixXd& YY, const Eigen::VectorXd& Yy) {
    const Eigen::VectorXd right = Yy(kept);
    return right.dot(core::LdltFactors(YY(kept, kept)).solve(right));
  };
  for (std::size_t b = 0; b + 1 < blocks(); ++b) {
    before.YY += blocks_[b].YY;
    before.Yy += blocks_[b].Yy;
    seen += instants_[b];
    if (seen < kLeastSide * count || seen > (1.0 - kLeastSide) * count) {
      continue;
    }
    const double parts = explained(before.YY, before.Yy) + explained(all.YY - before.YY, all.Yy - before.Yy);
    both[b + 1] = std::isfinite(parts) ? parts : both[b + 1];
    place.best = both[b + 1] > both[place.best] ? b + 1 : place.best;
  }
  const double variance = std::max(0.0, all.yy - both[place.best]) / std::max(count, 1.0);
  const double enough = both[place.best] - kLevelOfTime * variance * std::max(alike, 1.0);
  place.first = place.last = place.best;
  for (std::size_t b = 0; b < blocks(); ++b) {
    if (both[b] >= enough) {
      place.first = std::min(place.first, b);
      place.last = std::max(place.last, b);
    }
  }
  return place;
}

// A sum over the rows of ranges of the moments' blocks: coefficients of Σ Yᵀy, weighted.
struct OverRange {
  BlockRange range;
  Eigen::VectorXd of_columns;
};
using SumOverRows = std::vector<OverRange>;

// Whether errors may be anything within declared bounds: nothing is declared of their mean.
bool errors_are_bounded_only(const Setting& s) { return s.noise_complete && !s.robot.noise.effort.bias.has_value(); }

// What the errors of a log may do to a sum over its rows without averaging out. Asked only of what stands out, since
// both questions walk the log.
class ErrorsInLog {
 public:
  ErrorsInLog(LogSource& log, const Setting& setting, const Widened& widened, const PremiseMoments& moments,
              const Fit& fit)
      : log_(log), setting_(setting), widened_(widened), moments_(moments), fit_(fit) {}

  [[nodiscard]] bool are_bounded_only() const { return errors_are_bounded_only(setting_); }
  // Whether they average out as far as the log shows it.
  [[nodiscard]] bool average();
  // The most that they make of the sums within their bounds; zero where they average out, or no bounds are declared.
  [[nodiscard]] Eigen::VectorXd largest(const std::vector<SumOverRows>& sums) {
    return are_bounded_only() && !average() ? worst_case(sums)
                                            : Eigen::VectorXd::Zero(static_cast<Eigen::Index>(sums.size()));
  }
  // The same, whether they average out or not.
  [[nodiscard]] Eigen::VectorXd worst_case(const std::vector<SumOverRows>& sums);

  // Parameters that the whole log shows beside offsets of its efforts.
  [[nodiscard]] Eigen::VectorXd model() const {
    return moments_.least_squares(0, moments_.blocks(), joined(widened_.model, widened_.offsets));
  }

  // What makes entry `j` of a fit of these columns.
  [[nodiscard]] OverRange entry(const PartFit& part, const BlockRange& range, const Indices& kept, Eigen::Index j,
                                double sign = 1.0) const {
    OverRange sum{range, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(widened_.setting.model.p()))};
    sum.of_columns(kept) = sign * part.inverse.row(j).transpose();
    return sum;
  }

 private:
  LogSource& log_;
  const Setting& setting_;
  const Widened& widened_;
  const PremiseMoments& moments_;
  const Fit& fit_;
  std::optional<bool> average_;
};

// Rows are alike for as long as the filter remembers: f₂ * f₂ by (1 + x)e⁻ˣ after x/β, f * f and what errors of the
// motion leave by less. Rows that are alike for longer have errors that are. The model is given all that is tested, and
// each piece of the log parameters of its own, so that what a premise breaks is not taken for errors.
bool ErrorsInLog::average() {
  constexpr std::size_t kPieces = 8;
  constexpr std::array<double, 4> kAges = {6.0, 8.0, 12.0, 16.0};  // 1/β
  constexpr double kRiskOfAverages = 0.02;                         // that errors which average out are said not to
  if (average_) {
    return *average_;
  }
  const auto p = static_cast<Eigen::Index>(widened_.setting.model.p());
  const Indices kept = joined(joined(widened_.model, widened_.offsets), widened_.shapes);
  Eigen::MatrixXd theta(p, static_cast<Eigen::Index>(kPieces));
  std::vector<double> begins;
  for (std::size_t k = 0; k < kPieces; ++k) {
    const auto border = [&](std::size_t i) { return moments_.at_share(static_cast<double>(i) / kPieces); };
    theta.col(static_cast<Eigen::Index>(k)) = moments_.least_squares(border(k), border(k + 1), kept);
    begins.push_back(k > 0 && border(k) < moments_.blocks() ? moments_.begin_of(border(k)) : -core::kInfinity);
  }
  std::array<std::size_t, kAges.size()> lags{};
  for (std::size_t i = 0; i < lags.size(); ++i) {
    lags[i] = static_cast<std::size_t>(std::ceil(kAges[i] / (setting_.filter.beta * setting_.survey.median_step)));
  }
  std::deque<Eigen::VectorXd> before;
  identify::BlockSums series(kAges.size());
  Eigen::VectorXd products(static_cast<Eigen::Index>(kAges.size())), total = Eigen::VectorXd::Zero(products.size());
  double squares = 0.0;
  std::size_t piece = 0;
  TorqueRows rows = make_rows(log_, widened_.setting, errors_of_fit(widened_.setting));
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    const auto n = static_cast<Eigen::Index>(block.outputs);
    for (std::size_t k = 0; k < block.instants(); ++k) {
      if (!signs_are_known(widened_, block, k)) {
        continue;
      }
      while (piece + 1 < kPieces && block.t[k] >= begins[piece + 1]) {
        ++piece;
      }
      const Eigen::Index at = static_cast<Eigen::Index>(k) * n;
      const Eigen::VectorXd left = fit_.weights.cwiseProduct(
          block.y.segment(at, n) - block.Y.middleRows(at, n) * theta.col(static_cast<Eigen::Index>(piece)));
      before.push_front(left);
      if (before.size() > lags.back()) {
        for (std::size_t i = 0; i < lags.size(); ++i) {
          products[static_cast<Eigen::Index>(i)] = left.dot(before[lags[i]]);
        }
        squares += left.squaredNorm();
        total += products;
        series.add(products);
        before.pop_back();
      }
    }
  });
  log_.rewind();
  const identify::LongRunCovariance covariance = identify::long_run_covariance(series);
  const double t = covariance.freedom > 0.0
                       ? core::student_quantile(1.0 - kRiskOfAverages / kAges.size(), covariance.freedom)
                       : core::kInfinity;
  average_ = true;
  for (std::size_t i = 0; i < lags.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double alike = (1.0 + kAges[i]) * std::exp(-kAges[i]) * squares;
    average_ = *average_ && std::abs(total[at]) <= alike + t * std::sqrt(std::max(0.0, covariance.matrix(at, at)));
  }
  return *average_;
}

Eigen::VectorXd ErrorsInLog::worst_case(const std::vector<SumOverRows>& sums) {
  const auto count = static_cast<Eigen::Index>(sums.size());
  filter::ErrorInfluence influence(widened_.setting.model, setting_.filter, setting_.measurement,
                                   noise_budget(setting_.robot, setting_.measurement).sensors, model(), count);
  TorqueRows rows = make_rows(log_, widened_.setting, errors_of_fit(widened_.setting));
  core::RowMatrix g;
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    const auto n = static_cast<Eigen::Index>(block.outputs);
    g.setZero(block.rows(), count);
    for (std::size_t k = 0; k < block.instants(); ++k) {
      if (!signs_are_known(widened_, block, k)) {
        continue;
      }
      for (Eigen::Index i = 0; i < count; ++i) {
        for (const OverRange& part : sums[static_cast<std::size_t>(i)]) {
          if (moments_.holds(part.range, block.t[k])) {
            const Eigen::Index at = static_cast<Eigen::Index>(k) * n;
            g.block(at, i, n, 1) += fit_.weights.cwiseAbs2().cwiseProduct(block.Y.middleRows(at, n) * part.of_columns);
          }
        }
      }
    }
    influence.add(block, g);
  });
  log_.rewind();
  return influence.value();
}

constexpr const char* kErrorsMayDoIt =
    "errors within their declared bounds may do that, and those of this log do not average out";

double largest_speed(const Setting& s) {
  return s.survey.largest_speed.empty() ? 0.0 : std::ranges::max(s.survey.largest_speed);
}

double noise_of_steps(const Setting& s) {
  return s.measurement.motion == MotionKind::speed ? s.motion_noise->sd
                                                   : std::numbers::sqrt2 * s.motion_noise->sd / s.survey.median_step;
}

// Whether the speed of single steps, which functions of the motion are made of, is told well enough for its square.
bool speeds_are_fine(const Setting& s) {
  constexpr double kFine = 0.05;  // of the largest speed
  return noise_of_steps(s) <= kFine * largest_speed(s);
}

// Whether reversals are: what noise and the motion within a step make of dry friction there looks like the root of the
// speed.
bool reversals_are_fine(const Setting& s) {
  constexpr double kFine = 0.005, kOfStep = 0.3;  // of the largest speed
  const std::vector<double>& sharpest = s.survey.sharpest_change;
  const double change = s.survey.median_step * (sharpest.empty() ? 0.0 : std::ranges::max(sharpest));
  return noise_of_steps(s) <= kFine * largest_speed(s) && change <= kOfStep * largest_speed(s);
}

// How far each effort may be off throughout: nothing where its noise is not declared.
std::optional<double> declared_offset(const Setting& s) {
  const model::NoiseBound& effort = s.robot.noise.effort;
  return effort.value ? std::optional(std::min(effort.bias.value_or(*effort.value), *effort.value)) : std::nullopt;
}

// The offset of efforts that speeds which are off throughout, within their bound, make of viscous friction.
double offset_by_speeds(const Setting& s, const Eigen::VectorXd& theta) {
  const model::NoiseBound& speed = s.robot.noise.wheel_speed;
  if (s.measurement.motion != MotionKind::speed || !speed.value) {
    return 0.0;
  }
  Eigen::MatrixXd friction = Eigen::MatrixXd::Zero(s.model.input.rows(), s.model.motion.rows());
  for (const Term& term : s.model.terms) {
    if (term.kind == Term::Kind::speed) {
      friction(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.coordinate)) +=
          term.scale * theta[static_cast<Eigen::Index>(term.parameter)];
    }
  }
  const Eigen::MatrixXd of_joints = core::pseudo_inverse(s.model.input) * friction * s.model.motion;
  return std::min(speed.bias.value_or(*speed.value), *speed.value) * of_joints.cwiseAbs().rowwise().sum().maxCoeff();
}

std::string of_itself(double share) {
  return share < 1.0 ? fmt::format("{:.2g} %", 100.0 * share) : fmt::format("{:.2g} times", share);
}

// Rows hold what the filter keeps of the time before them, and as long are their errors alike: f₂ * f₂, over its value
// at zero, has the area 4/β, and f * f has 2/β.
std::string time_of_change(const Setting& s, const PremiseMoments& moments, const Indices& kept) {
  const double delay = s.filter.delay();
  const double step = s.survey.median_step;
  const ChangePlace place = moments.change(kept, step > 0.0 ? 2.0 * delay / step : 1.0);
  const auto time = [&](std::size_t block) { return moments.begin_of(block) - delay; };
  return fmt::format("one change fits best at {:.5g} s, and nearly as well from {:.5g} to {:.5g} s", time(place.best),
                     time(place.first), time(place.last));
}

// A comparison of two parts that stands farthest outside of what it may be.
struct PartsApart {
  double times = 0.0;  // its limit
  std::size_t a = 0, b = 0;
  Eigen::Index column = 0;
};

void compare_parts(const Setting& s, const Widened& w, const PremiseMoments& moments, ErrorsInLog& errors,
                   Premises& result, std::vector<LogContradiction>& out) {
  std::vector<BlockRange> parts;
  const auto cut = [&](const std::vector<std::string>& names) {
    const auto count = static_cast<double>(names.size());
    for (std::size_t k = 0; k < names.size(); ++k) {
      parts.push_back({moments.at_share(static_cast<double>(k) / count),
                       moments.at_share(static_cast<double>(k + 1) / count), names[k]});
    }
  };
  std::vector<std::pair<std::size_t, std::size_t>> pairs = {{0, 1}};
  cut({"first half", "second half"});
  if (s.survey.seconds >= kLongEnoughForThirds) {
    cut({"first third", "middle third", "last third"});
    pairs.insert(pairs.end(), {{2, 3}, {3, 4}, {2, 4}});
  }
  std::vector<PartFit> fits;
  for (const BlockRange& part : parts) {
    fits.push_back(moments.fit(part, w.model, w.offsets));
  }
  if (!fits[0].usable || !fits[1].usable) {
    result.constant.detail = "the halves of the log are too short, or do not show each parameter by itself";
    return;
  }
  const auto q = static_cast<Eigen::Index>(w.model.size());
  const double risk = kPremiseRisk / static_cast<double>(pairs.size() * w.model.size());
  const double offset = declared_offset(s).value_or(0.0) + offset_by_speeds(s, errors.model()),
               effort = moments.effort();
  PartsApart worst;
  Eigen::VectorXd told = Eigen::VectorXd::Zero(q);
  const auto limit = [&](const PartFit& a, const PartFit& b, Eigen::Index j, double more) {
    const double error = std::hypot(a.error[j], b.error[j]);
    const double t = core::student_quantile(1.0 - risk, std::min(a.freedom[j], b.freedom[j]));
    return (t + more) * error + std::abs(a.by_noise[j] - b.by_noise[j]) +
           offset * (a.by_offset.row(j) - b.by_offset.row(j)).cwiseAbs().sum();
  };
  std::erase_if(pairs, [&](const auto& pair) { return !fits[pair.first].usable || !fits[pair.second].usable; });
  // With what errors may do to each difference, pair by pair; empty: nothing.
  const auto compare = [&](const Eigen::VectorXd& by_errors) {
    worst = {};
    Eigen::Index at = 0;
    for (const auto& [a, b] : pairs) {
      for (Eigen::Index j = 0; j < q; ++j, ++at) {
        const double more = by_errors.size() > 0 ? by_errors[at] : 0.0;
        const double times = std::abs(fits[a].theta[j] - fits[b].theta[j]) / (limit(fits[a], fits[b], j, 0.0) + more);
        if (times > worst.times) {
          worst = {times, a, b, j};
        }
        told[j] = a == 0 ? limit(fits[a], fits[b], j, kAlwaysShows) + more : told[j];
      }
    }
  };
  compare({});
  const bool stands_out = worst.times > 1.0;
  if (stands_out) {
    std::vector<SumOverRows> differences;
    for (const auto& [a, b] : pairs) {
      for (Eigen::Index j = 0; j < q; ++j) {
        differences.push_back(
            {errors.entry(fits[a], parts[a], w.model, j), errors.entry(fits[b], parts[b], w.model, j, -1.0)});
      }
    }
    compare(errors.largest(differences));
  }
  std::string shows;
  bool everything = true;
  for (Eigen::Index j = 0; j < q; ++j) {
    const double size = std::abs(fits[0].theta[j] + fits[1].theta[j]) / 2.0;
    everything =
        everything && (told[j] <= kPartOfParameter * size ||
                       told[j] * moments.column(w.model[static_cast<std::size_t>(j)]) <= kPartOfEffort * effort);
    const InWords words = in_words(s, static_cast<std::size_t>(w.model[static_cast<std::size_t>(j)]));
    shows += fmt::format("{}{} by {}", shows.empty() ? "" : ", ", words.name,
                         size > 0.0 ? of_itself(told[j] / size) : std::string("any amount"));
  }
  shows = fmt::format("a change half-way would have shown of {}", shows);
  if (worst.times <= 1.0) {
    result.constant.verdict = everything ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
    const char* names = fits.size() > 2 ? "halves and thirds" : "halves";
    result.constant.detail = stands_out ? fmt::format("its {} differ, but {}; {}", names, kErrorsMayDoIt, shows)
                                        : fmt::format("its {} agree; {}", names, shows);
    return;
  }
  const auto at = static_cast<std::size_t>(w.model[static_cast<std::size_t>(worst.column)]);
  const InWords words = in_words(s, at);
  const auto half = [&](const PartFit& part) {
    const double t = core::student_quantile(0.95, part.freedom[worst.column]);
    return t * std::abs(words.scale) * part.error[worst.column];
  };
  const PartFit &a = fits[worst.a], &b = fits[worst.b];
  const double from = a.theta[worst.column], to = b.theta[worst.column];
  const double apart = std::abs(from - to);
  result.constant.verdict = AssumptionVerdict::fails;
  result.constant.detail = fmt::format(
      "the {} of the log gives {} {:.5g} ± {:.2g} {}, the {} {:.5g} ± {:.2g} {}: {:.2g} times as far apart as parts of "
      "a log of one robot may be; {}",
      parts[worst.a].name, words.name, words.value(from), half(a), words.unit, parts[worst.b].name, words.value(to),
      half(b), words.unit, worst.times, time_of_change(s, moments, w.model));
  out.push_back({.kind = LogContradiction::Kind::halves_disagree,
                 .withdraws = false,
                 .demotes = true,
                 .subject = s.model.parameters[at].physical,
                 .value = std::abs(words.scale) * apart,
                 .limit = std::abs(words.scale) * apart / worst.times,
                 .sentence = result.constant.detail,
                 .next = "the robot changed on the way (load, temperature, a fault), or the model lacks an effect: "
                         "commission the parts by themselves, or let `gap` look at the log"});
}

void test_offsets(const Setting& s, const Widened& w, const PremiseMoments& moments, ErrorsInLog& errors,
                  Premises& result, std::vector<LogContradiction>& out) {
  const std::optional<double> declared = declared_offset(s);
  if (!declared || w.offsets.empty() || s.measurement.effort_unsigned) {
    result.offset.detail = w.offsets.empty() ? "the model has a constant effort of its own"
                           : !declared       ? "no bound on the efforts' errors is declared"
                                             : "the efforts have no sign";
    return;
  }
  const Indices kept = joined(w.model, w.offsets);
  const BlockRange whole{0, moments.blocks(), {}};
  const PartFit fit = moments.fit(whole, kept, {});
  if (!fit.usable) {
    result.offset.detail = "offset and friction are one on this drive: drive both ways, each wheel at different speeds";
    return;
  }
  const std::string unit = output_unit(s.robot, s.model.output_units.front());
  const double risk = kPremiseRisk / static_cast<double>(w.offsets.size());
  double told = 0.0;
  for (std::size_t k = 0; k < w.offsets.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(w.model.size() + k);
    const double t = core::student_quantile(1.0 - risk, fit.freedom[at]);
    const double reach = t * fit.error[at] + std::abs(fit.by_noise[at]);
    double limit = *declared;
    if (std::abs(fit.theta[at]) - reach > limit && errors.are_bounded_only()) {
      limit = std::max(limit, errors.worst_case({{errors.entry(fit, whole, kept, at)}})[0]);
    }
    told = std::max(told, limit + reach + kAlwaysShows * fit.error[at]);
    if (std::abs(fit.theta[at]) - reach <= limit) {
      continue;
    }
    const std::string sentence = fmt::format(
        "{} is off by {:.3g} ± {:.1g} {} throughout, where {:.3g} {} are declared", s.measurement.effort_columns[k],
        fit.theta[at], core::student_quantile(0.95, fit.freedom[at]) * fit.error[at], unit, *declared, unit);
    result.offset.verdict = AssumptionVerdict::fails;
    result.offset.detail += (result.offset.detail.empty() ? "" : "; ") + sentence;
    out.push_back({.kind = LogContradiction::Kind::effort_offset,
                   .withdraws = false,
                   .demotes = true,
                   .subject = s.measurement.effort_columns[k],
                   .value = fit.theta[at],
                   .limit = *declared,
                   .sentence = sentence,
                   .next = "take the offset out of the log where it is the sensor's, or declare a bound that holds it "
                           "(`noise: {effort: …}`); friction that differs forwards and backwards, or a slope, does the "
                           "same, and `gap` tells it"});
  }
  if (result.offset.verdict == AssumptionVerdict::fails) {
    return;
  }
  const double least = *declared > 0.0 ? kTimesOffset * *declared : kPartOfEffort * moments.effort();
  result.offset.verdict = told <= least ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
  result.offset.detail = fmt::format("an offset of {:.2g} {} would have shown", told, unit);
}

void test_friction(const Setting& s, const Widened& w, const PremiseMoments& moments, ErrorsInLog& errors,
                   Premises& result, std::vector<LogContradiction>& out) {
  if (w.shapes.empty()) {
    result.friction.detail = "the robot file names effects of its own";
    return;
  }
  if (!speeds_are_fine(s) || (!w.dry.empty() && !reversals_are_fine(s))) {
    result.friction.detail = "the speeds of single steps are too rough to tell shapes of friction";
    return;
  }
  Indices kept;
  const BlockRange whole{0, moments.blocks(), {}};
  PartFit fit;
  for (const bool with_offsets : {true, false}) {
    if (!fit.usable) {
      kept = joined(with_offsets ? joined(w.model, w.offsets) : w.model, w.shapes);
      fit = moments.fit(whole, kept, w.offsets);
    }
  }
  if (!fit.usable) {
    result.friction.detail = "the speeds of this drive do not tell one shape of friction from another";
    return;
  }
  const double effort = moments.effort(), offset = declared_offset(s).value_or(0.0);
  // Errors that may be anything within their bound, for ever, may follow the motion and look like friction of any
  // shape.
  const double hidden = errors.are_bounded_only() ? s.declared.output.minCoeff() : 0.0;
  const double risk = kPremiseRisk / static_cast<double>(w.shapes.size());
  const bool without_offsets = kept.size() == w.model.size() + w.shapes.size();
  double told = 0.0;
  for (std::size_t k = 0; k < w.shapes.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(kept.size() - w.shapes.size() + k);
    const double t = core::student_quantile(1.0 - risk, fit.freedom[at]);
    double reach = t * fit.error[at] + std::abs(fit.by_noise[at]) +
                   (without_offsets ? offset * fit.by_offset.row(at).cwiseAbs().sum() : 0.0);
    if (std::abs(fit.theta[at]) > reach && moments.column(w.shapes[k]) * std::abs(fit.theta[at]) > hidden) {
      reach += errors.largest({{errors.entry(fit, whole, kept, at)}})[0];
    }
    const double share = effort > 0.0 ? moments.column(w.shapes[k]) / effort : 0.0;
    told = std::max({told, share * (reach + kAlwaysShows * fit.error[at]), effort > 0.0 ? hidden / effort : 0.0});
    if (std::abs(fit.theta[at]) <= reach || moments.column(w.shapes[k]) * std::abs(fit.theta[at]) <= hidden ||
        result.friction.verdict == AssumptionVerdict::fails) {
      continue;
    }
    const std::string& name = w.setting.model.parameters[static_cast<std::size_t>(w.shapes[k])].name;
    result.friction.verdict = AssumptionVerdict::fails;
    result.friction.detail = fmt::format(
        "the efforts hold a part that goes with {}, {:.2g} ± {:.1g} % of them, which the model does not have", name,
        100.0 * share * fit.theta[at], 100.0 * share * core::student_quantile(0.95, fit.freedom[at]) * fit.error[at]);
    out.push_back({.kind = LogContradiction::Kind::friction_shape,
                   .withdraws = false,
                   .demotes = true,
                   .subject = name,
                   .value = share * fit.theta[at],
                   .limit = share * reach,
                   .sentence = result.friction.detail,
                   .next = "let `gap` say which effect it is, and give the robot file that effect (`effects:`)"});
  }
  if (result.friction.verdict != AssumptionVerdict::fails) {
    result.friction.verdict = told <= kShapeOfEffort ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
    result.friction.detail =
        fmt::format("friction that goes with the square{} of the speed would have shown from {} of the effort on",
                    w.shapes.size() > 1 ? " or the root" : "", of_itself(told));
  }
}

// Of all instants, those with unknown signs of friction among them.
std::optional<double> turning_over_driving(LogSource& log, const Setting& s) {
  if (!model::on_two_wheels(s.robot) || log.find("gyro_z") || log.find("theta")) {
    return std::nullopt;
  }
  std::array<const Term*, 2> speeds{};  // of each coordinate
  for (const Term& term : s.model.terms) {
    if (term.kind == Term::Kind::speed && term.coordinate < speeds.size() && term.scale != 0.0) {
      speeds[term.coordinate] = &term;
    }
  }
  if (speeds[0] == nullptr || speeds[1] == nullptr) {
    return std::nullopt;
  }
  std::array<double, 2> square{};
  TorqueRows rows = make_rows(log, s, errors_of_fit(s));
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (std::size_t c = 0; c < square.size(); ++c) {
      const Term& term = *speeds[c];
      for (auto r = static_cast<Eigen::Index>(term.output); r < block.rows();
           r += static_cast<Eigen::Index>(block.outputs)) {
        const double speed = block.Y(r, static_cast<Eigen::Index>(term.parameter)) / term.scale;
        square[c] += speed * speed;
      }
    }
  });
  log.rewind();
  return square[0] > 0.0 ? std::optional(0.5 * s.robot.track_width * std::sqrt(square[1] / square[0])) : std::nullopt;
}

}  // namespace

Premises test_premises(LogSource& log, const Setting& s, const Fit& fit, std::vector<LogContradiction>& out) {
  Premises result;
  const Widened w = widened_for_premises(s, fit);
  const RegressionMoments rows = premise_moments(log, w);
  result.turning = turning_over_driving(log, s);
  const std::optional<identify::RowNoise> noise = row_noise(w.setting);
  if (!noise || w.model.empty() || s.measurement.effort_unsigned) {
    const char* why = !noise ? "the noise of the motion is not known" : "the log does not show the parameters";
    result.constant.detail = result.offset.detail = result.friction.detail = why;
    return result;
  }
  const PremiseMoments moments(rows, fit.weights, *noise);
  ErrorsInLog errors(log, s, w, moments, fit);
  compare_parts(s, w, moments, errors, result, out);
  test_offsets(s, w, moments, errors, result, out);
  test_friction(s, w, moments, errors, result, out);
  return result;
}

bool errors_average(LogSource& log, const Setting& s, const Fit& fit) {
  if (!errors_are_bounded_only(s) || s.measurement.effort_unsigned) {
    return true;
  }
  const Widened w = widened_for_premises(s, fit);
  const std::optional<identify::RowNoise> noise = row_noise(w.setting);
  if (!noise || w.model.empty()) {
    return true;
  }
  const RegressionMoments rows = premise_moments(log, w);
  const PremiseMoments moments(rows, fit.weights, *noise);
  return ErrorsInLog(log, s, w, moments, fit).average();
}

}  // namespace wheelwright::commission
