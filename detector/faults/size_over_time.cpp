// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/size_over_time.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bounds/polytope.hpp"
#include "core/check.hpp"
#include "core/for_all.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/odometry_isolation.hpp"
#include "detector/faults/onset_rows.hpp"
#include "detector/faults/step_elements.hpp"
#include "detector/threshold.hpp"
#include "model/filter/odometry_filter.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kRounded = 1e-7;       // of all that is added in a sum: its rounding, and what is forgotten
constexpr std::size_t kInstants = 200;  // of SizeOverTime::growing
constexpr std::array<double, 5> kEarlier = {1.0, 2.0, 3.5, 5.0, 8.0};  // 1/β before a row: T0

// Whether rows have a part in κ²: motion and efforts change at once.
bool has_square(const FaultType& fault) {
  return (fault.motion.size() > 0 || fault.slip.size() > 0) && (fault.effort.size() > 0 || fault.ground.size() > 0);
}

// { x / y }, enclosed; y > 0.
Interval over(const Interval& x, const Interval& y) {
  return {core::round_down(std::min(x.lower / y.lower, x.lower / y.upper)),
          core::round_up(std::max(x.upper / y.lower, x.upper / y.upper))};
}

Interval wider(const Interval& x, double by) { return x + Interval{-by, by}; }

// The mean with the weights |w| where (∫ w κ)/∫ w lies in `ratio`, and up to `share`/2 of |w| is of the other sign.
Interval mixed(const Interval& ratio, double share, const Interval& range) {
  const Interval other = Interval{1.0 - share, 1.0 - share} * ratio + Interval{share, share} * range;
  return {std::min(ratio.lower, other.lower), std::max(ratio.upper, other.upper)};
}

// Takes a mean of sizes, in the fault's unit, where anything is known of it.
void take_mean(SizeEvidence& out, const Interval& range, double from, double to, const Interval& size) {
  const Interval held{std::max(size.lower, range.lower), std::min(size.upper, range.upper)};
  if (!(held.lower <= held.upper)) {
    out.excluded = true;
    return;
  }
  if (held == range) {
    return;
  }
  if (!out.means.empty() && out.means.back().to == to && out.means.back().from == from) {
    Interval& before = out.means.back().size;
    before = {std::max(before.lower, held.lower), std::min(before.upper, held.upper)};
    out.excluded = out.excluded || !(before.lower <= before.upper);
    return;
  }
  out.means.push_back({from, to, held});
}

// What means say of faults that grow.
void take_sides(const FaultType& fault, SizeEvidence& out) {
  const auto amount = [&](double size) { return size > 0.0 ? amount_of(fault, size) : 0.0; };
  const auto amount_below = [&](double size) { return size > 0.0 ? amount_of(fault, -size) : 0.0; };
  for (const MeanSize& mean : out.means) {
    for (std::size_t k = 0; k < 2; ++k) {
      const double least = k == 0 ? mean.size.lower : -mean.size.upper,
                   most = k == 0 ? mean.size.upper : -mean.size.lower;
      SizeEvidence::Side& side = out.sides[k];
      if (most < 0.0) {
        side.excluded = true;
        continue;
      }
      const double low = k == 0 ? amount(least) : amount_below(least),
                   high = k == 0 ? amount(most) : amount_below(most);
      side.links.push_back({mean.to, mean.to, core::round_down(low), 0.0, true});
      side.links.push_back({mean.from, mean.from, core::round_up(high), 0.0, false});
    }
  }
}

// Up to `most` instants in the window at which a row is, evenly spread, and those next to the times `also`.
std::vector<std::size_t> rows_within(const ReferenceMotion& motion, const Interval& window, std::size_t most,
                                     const std::vector<double>& also) {
  const std::vector<std::size_t> all = settled_within(motion, window, motion.instants());
  std::vector<std::size_t> out = settled_within(motion, window, most);
  for (const double t : also) {
    const auto at = std::ranges::lower_bound(all, t, {}, [&](std::size_t k) { return motion.t[k]; });
    if (at != all.end() && window.contains(t)) {
      out.push_back(*at);
    }
  }
  std::ranges::sort(out);
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

// What parameters and noise leave of output `i` at instant `k`: E.
Interval left_of_row(const ThresholdRule& rule, const RegressionBlock& rows, std::size_t k, std::size_t i) {
  const auto at = static_cast<Eigen::Index>(k * rows.outputs + i);
  const std::size_t p = rows.parameters;
  const Threshold threshold = rule.at({rows.Y.row(at).data(), p}, {rows.dY.row(at).data(), p}, rows.dy[at], i);
  return core::point(rows.y[at]) - Interval{threshold.lower, threshold.upper};
}

// What all faults of the torque residual share.
struct TorqueRows {
  const ReferenceMotion& motion;
  const RegressorFilter& filter;
  const Eigen::MatrixXd& efforts;
  const Polytope& set;
  std::vector<std::size_t> rows;
  std::vector<Interval> left;  // E, row by row, output by output
  double most_effort = 0.0;    // of a bias that is spoken of
};

// Σ θ_j a_j over a box of θ, a_j in [low_j, high_j].
struct Product {
  double low = 0.0, high = 0.0;
  void add(const Interval& theta, double least, double most) {
    const double a = theta.lower * least, b = theta.lower * most, c = theta.upper * least, d = theta.upper * most;
    low += std::min(std::min(a, b), std::min(c, d));
    high += std::max(std::max(a, b), std::max(c, d));
  }
};

// S(T) of every step in one row.
class StepResponses {
 public:
  StepResponses(const FaultType& fault, const TorqueRows& in)
      : in_(in),
        elements_(step_elements(fault, in.filter.model(), in.filter.design().static_gain(), in.motion)),
        errors_(fault, in.filter.model(), in.filter.design(), in.motion),
        offset_(fault.offset.size() > 0 ? fault.offset.cwiseAbs().maxCoeff() : 0.0) {
    // At an onset the errors of the shortest step's speed count.
    const std::vector<double>& step = in.motion.step;
    std::size_t shortest = 0;
    for (std::size_t k = 1; k < step.size(); ++k) {
      shortest = step[k] > 0.0 && (!(step[shortest] > 0.0) || step[k] < step[shortest]) ? k : shortest;
    }
    errors_.begin(shortest);
    const std::size_t size = elements_.outputs * elements_.columns;
    square_ = has_square(fault);
    linear_ = std::ranges::all_of(elements_.g2, [](double x) { return x == 0.0; }) &&
              std::ranges::all_of(elements_.twice, [](double x) { return x == 0.0; });
    used_.resize(elements_.outputs);
    for (std::size_t i = 0; i < elements_.outputs; ++i) {
      for (std::size_t j = 0; j < elements_.columns; ++j) {
        bool any = false;
        for (std::size_t e = i * elements_.columns + j; e < elements_.g1.size(); e += size) {
          any = any || elements_.g1[e] != 0.0 || elements_.g2[e] != 0.0 || elements_.once[e] != 0.0 ||
                elements_.twice[e] != 0.0;
        }
        if (any) {
          used_[i].push_back(j);
        }
      }
    }
  }

  // Least and largest of S(T), of all T, 0 among them, and up to some instants.
  struct Range {
    double least = 0.0, most = 0.0;
    struct Earlier {
      double t = 0.0, least = 0.0, most = 0.0;  // of all T up to t
    };
    std::vector<Earlier> earlier{};
  };

  // For sizes of either sign up to `amount` (0: none of that sign), output `i` of the row at instant `row`.
  [[nodiscard]] std::array<Range, 2> of(const RowWeights& weights, std::size_t row, std::size_t i,
                                        const std::array<double, 2>& amount) {
    const Box& box = in_.set.hull();
    const Eigen::VectorXd largest = box.magnitudes();
    const ReferenceMotion& motion = in_.motion;
    const double beta = in_.filter.design().beta;
    const bool speeds = motion.kind == MotionKind::speed;
    const std::size_t first = weights.first(), columns = elements_.columns;
    std::vector<double> g1(columns, 0.0), g2(columns, 0.0), g1_behind(columns, 0.0), g2_behind(columns, 0.0);
    double c = 0.0, sum = 0.0;
    for (std::vector<Interval>& each : responses_) {
      each.assign(row - first + 1, Interval{});
    }
    std::array<Range, 2> out;
    const auto bound = [&](std::size_t k, double c_behind, double weight, double weight_before, bool jumps) {
      std::array<Product, 2> product{Product{std::min(c, c_behind), std::max(c, c_behind)},
                                     Product{std::min(c, c_behind), std::max(c, c_behind)}};
      // At the largest size; in between is what is between, since both are linear over linear.
      std::array<Product, 2> grown{};
      const double* here1 = elements_.at(elements_.once, k, i);
      const double* here2 = elements_.at(elements_.twice, k, i);
      const double* next1 = elements_.at(elements_.once, std::min(k + 1, row), i);
      const double* next2 = elements_.at(elements_.twice, std::min(k + 1, row), i);
      for (const std::size_t j : used_[i]) {
        // A step about instant k: the sums from it on and those behind it, the impulse as the samples on either side
        // have it.
        double low1 = g1[j], high1 = low1, low2 = g2[j], high2 = low2;
        if (jumps) {
          const double a = g1[j] + weight * here1[j], b = g1_behind[j] + weight * next1[j];
          low1 = std::min(a, b);
          high1 = std::max(a, b);
          const double a2 = g2[j] + weight * here2[j], b2 = g2_behind[j] + weight * next2[j];
          low2 = std::min(a2, b2);
          high2 = std::max(a2, b2);
          if (speeds && k > first) {
            const double d = g1[j] + weight_before * here1[j], d2 = g2[j] + weight_before * here2[j];
            low1 = std::min(low1, d);
            high1 = std::max(high1, d);
            low2 = std::min(low2, d2);
            high2 = std::max(high2, d2);
          }
        }
        const Interval& theta = box.sides[j];
        for (std::size_t s = 0; s < 2; ++s) {
          product[s].add(theta, low1, high1);
          if (!linear_) {
            const double sigma = s == 0 ? 1.0 : -1.0, twice = 2.0 * sigma * amount[s];
            const double x = twice * low2, y = twice * high2, by = square_ ? 1.0 / (1.0 + sigma * amount[s]) : 1.0;
            grown[s].add(theta, by * (low1 + std::min(x, y)), by * (high1 + std::max(x, y)));
          }
        }
      }
      for (std::size_t s = 0; s < 2 && !linear_; ++s) {
        product[s].low = std::min(product[s].low, grown[s].low);
        product[s].high = std::max(product[s].high, grown[s].high);
      }
      return product;
    };
    for (std::size_t k = row + 1; k-- > first;) {
      const double weight = k < row ? weights.weight(k) : 0.0, c_behind = c;
      if (k < row) {
        g1_behind = g1;
        g2_behind = g2;
        const double *a = elements_.at(elements_.g1, k, i), *b = elements_.at(elements_.g2, k, i);
        for (const std::size_t j : used_[i]) {
          g1[j] += weight * a[j];
          g2[j] += weight * b[j];
          sum += std::abs(weight) * (std::abs(a[j]) + 2.0 * std::max(amount[0], amount[1]) * std::abs(b[j])) *
                 largest[static_cast<Eigen::Index>(j)];
        }
        const double add = weight * elements_.c[k * elements_.outputs + i];
        c += add;
        sum += std::abs(add);
      }
      const std::array<Product, 2> here = bound(k, c_behind, weight, k > first ? weights.weight(k - 1) : 0.0, true);
      for (std::size_t s = 0; s < 2; ++s) {
        out[s].least = std::min(out[s].least, here[s].low);
        out[s].most = std::max(out[s].most, here[s].high);
        responses_[s][k - first] = {here[s].low, here[s].high};
      }
    }
    const std::array<Product, 2> full = bound(first, c, 0.0, 0.0, false);
    // Errors of the signature: of a step at the worst moment, and of the speed at its onset twice.
    const SignatureErrors::Row& e = errors_.row(row, i, in_.filter.design().order == 1 ? 0.0 : 1.0 / beta);
    for (std::size_t s = 0; s < 2; ++s) {
      const double sigma = s == 0 ? 1.0 : -1.0, first_order = e.e1.dot(largest);
      const double larger = linear_ ? first_order
                                    : std::max(first_order, (first_order + 2.0 * amount[s] * e.e2.dot(largest)) /
                                                                (square_ ? 1.0 + sigma * amount[s] : 1.0));
      double error = larger + e.ec + kRounded * sum / (square_ ? 1.0 - amount[1] : 1.0);
      if (offset_ > 0.0 && motion.effort_dY.rows() > 0) {
        error += offset_ * motion.effort_dY.row(static_cast<Eigen::Index>(row * elements_.outputs + i)).dot(largest);
      }
      Range& range = out[s];
      range.least = std::min(range.least, full[s].low) - error;
      range.most = std::max(range.most, full[s].high) + error;
      Interval running{full[s].low, full[s].high};
      range.earlier.push_back({motion.instant[first], running.lower - error, running.upper + error});
      std::size_t wanted = kEarlier.size();
      for (std::size_t k = first; k <= row && wanted > 0; ++k) {
        if (motion.instant[row] - motion.instant[k] < kEarlier[wanted - 1] / beta) {
          --wanted;
          if (k > first) {
            range.earlier.push_back({motion.instant[k - 1], running.lower - error, running.upper + error});
          }
        }
        running = {std::min(running.lower, responses_[s][k - first].lower),
                   std::max(running.upper, responses_[s][k - first].upper)};
      }
    }
    return out;
  }

 private:
  const TorqueRows& in_;
  StepElements elements_;
  SignatureErrors errors_;
  double offset_;
  bool square_ = false;                         // has_square()
  bool linear_ = false;                         // no part in κ²
  std::vector<std::vector<std::size_t>> used_;  // columns, per output
  std::array<std::vector<Interval>, 2> responses_;
};

bool has_a_size(const FaultType& fault) {
  using Kind = FaultProfile::Kind;
  return !fault.whole && !fault.held_effort && (fault.profile.kind == Kind::step || fault.profile.kind == Kind::ramp);
}

// Evidence on a fault that grows, by the rows of the torque residual.
void grow(const FaultType& catalogued, const TorqueRows& in, SizeEvidence& out) {
  FaultType fault = catalogued;
  fault.profile = {};
  const bool encoder = fault.seen.size() > 0;
  if (!OnsetRows::knows(fault, in.filter.model())) {
    return;
  }
  fault = encoder ? as_motion_of_reading(fault) : fault;
  const bool bias = fault.offset.size() > 0;
  std::array<double, 2> largest{amount_of(catalogued, catalogued.range.upper),
                                amount_of(catalogued, catalogued.range.lower)};
  std::array<double, 2> kappa{std::abs(fault.kappa(fault.range.upper)), std::abs(fault.kappa(fault.range.lower))};
  for (std::size_t k = 0; k < 2; ++k) {
    if (bias) {
      largest[k] = std::min(largest[k], in.most_effort);
    }
    out.sides[k].excluded = out.sides[k].excluded || !(largest[k] > 0.0);
  }
  StepResponses responses(fault, in);
  RowWeights weights(in.motion, in.filter.design());
  const std::size_t n = in.filter.model().n();
  for (std::size_t r = 0; r < in.rows.size(); ++r) {
    const std::size_t row = in.rows[r];
    weights.of(row);
    for (std::size_t i = 0; i < n; ++i) {
      if (out.sides[0].excluded && out.sides[1].excluded) {
        return;
      }
      Interval left = in.left[r * n + i];
      if (bias && in.motion.effort_doubt.rows() > 0) {
        left = wider(
            left, in.motion.effort_doubt.row(static_cast<Eigen::Index>(row * n + i)).dot(in.set.hull().magnitudes()));
      }
      const std::array<StepResponses::Range, 2> responded = responses.of(weights, row, i, kappa);
      for (std::size_t k = 0; k < 2; ++k) {
        SizeEvidence::Side& side = out.sides[k];
        if (side.excluded) {
          continue;
        }
        const double amount = largest[k];
        const Interval e = k == 0 ? left : Interval{-left.upper, -left.lower};
        const StepResponses::Range& s = responded[k];
        const double t = in.motion.instant[row], most = s.most, least = -s.least;
        if (!std::isfinite(most) || !std::isfinite(least)) {
          continue;
        }
        if (e.lower > core::round_up(amount * most) || e.upper < -core::round_up(amount * least)) {
          side.excluded = true;
          continue;
        }
        for (const StepResponses::Range::Earlier& earlier : s.earlier) {
          if (most > 0.0) {
            side.links.push_back({t, earlier.t, core::round_down(e.lower / most),
                                  core::round_down(core::round_down(most - earlier.most) / most), true});
          }
          const double both = earlier.least + least;
          if (earlier.least > 0.0) {
            side.links.push_back({earlier.t, t, core::round_up(e.upper / core::round_down(both)),
                                  core::round_up(least / core::round_down(both)), false});
          }
          if (e.upper < 0.0 && least > 0.0 && both > 0.0) {
            side.links.push_back({t, earlier.t, core::round_down(-e.upper / least),
                                  core::round_down(core::round_down(both) / least), true});
          }
        }
      }
    }
  }
}

// Means of an effort's lost share, and of its bias.
void average(const FaultType& fault, const TorqueRows& in, SizeEvidence& out) {
  const ReferenceMotion& motion = in.motion;
  const Model& model = in.filter.model();
  const std::size_t n = model.n();
  const Measurement& measurement = in.filter.measurement();
  const bool alone = fault.motion.size() == 0 && fault.slip.size() == 0 && fault.ground.size() == 0 &&
                     fault.seen.size() == 0 && fault.theta.size() == 0 && fault.lateral == 0.0;
  const bool loss = fault.share_lost && fault.effort.size() > 0, bias = fault.offset.size() > 0;
  if (!alone || loss == bias || model.input.rows() != model.input.cols()) {
    return;
  }
  if (loss && (measurement.effort_unsigned || !measurement.correction.empty())) {
    return;
  }
  const Eigen::MatrixXd to_joints = core::pseudo_inverse(model.input);
  // The joint whose effort is meant, and how it enters the outputs.
  const Eigen::MatrixXd of_joints = loss ? Eigen::MatrixXd(to_joints * fault.effort * model.input) : to_joints;
  Eigen::Index joint = 0;
  if (loss) {
    of_joints.diagonal().cwiseAbs().maxCoeff(&joint);
  } else {
    (to_joints * fault.offset).cwiseAbs().maxCoeff(&joint);
  }
  const std::size_t late =
      measurement.nominal_step > 0.0
          ? static_cast<std::size_t>(std::ceil(std::max(0.0, measurement.delay.upper) / measurement.nominal_step))
          : 0;
  const std::size_t about = motion.effort_reach + late + 2;
  const Interval range = bias ? Interval{fault.magnitude(std::max(fault.kappa(fault.range.lower), -in.most_effort)),
                                         fault.magnitude(std::min(fault.kappa(fault.range.upper), in.most_effort))}
                              : fault.range;
  const Eigen::VectorXd largest = in.set.hull().magnitudes();
  RowWeights weights(motion, in.filter.design());
  for (std::size_t r = 0; r < in.rows.size(); ++r) {
    const std::size_t row = in.rows[r];
    weights.of(row);
    double sum = 0.0, positive = 0.0, negative = 0.0;
    for (std::size_t k = weights.first(); k < row; ++k) {
      const std::array<double, 2> shares = motion.shares(k);
      const double weight = weights.weight(k) * (shares[0] + shares[1]);
      if (bias) {
        positive += std::max(0.0, weight);
        negative += std::max(0.0, -weight);
        continue;
      }
      double low = in.efforts(joint, static_cast<Eigen::Index>(k)), high = low;
      for (std::size_t m = k > about ? k - about : 0; m <= std::min(k + about, motion.instants() - 1); ++m) {
        low = std::min(low, in.efforts(joint, static_cast<Eigen::Index>(m)));
        high = std::max(high, in.efforts(joint, static_cast<Eigen::Index>(m)));
      }
      positive += std::max({0.0, weight * low, weight * high});
      negative += std::max({0.0, -weight * low, -weight * high});
      sum += std::abs(weight) * std::max(std::abs(low), std::abs(high));
    }
    const auto block = motion.rows.y.segment(static_cast<Eigen::Index>(row * n), static_cast<Eigen::Index>(n));
    const double net = bias ? positive - negative : (to_joints * block)[joint];
    const double slack = kRounded * (bias ? positive + negative : sum);
    const double side = net < 0.0 ? -1.0 : 1.0;
    const Interval weight{core::round_down(std::abs(net) - slack), core::round_up(std::abs(net) + slack)};
    const double against = (side > 0.0 ? negative : positive) + slack;
    if (!(weight.lower > 0.0)) {
      continue;
    }
    const double share = core::round_up(2.0 * against / (weight.lower + 2.0 * against));
    for (std::size_t i = 0; i < n; ++i) {
      const double enters =
          bias ? fault.offset[static_cast<Eigen::Index>(i)] : model.input(static_cast<Eigen::Index>(i), joint);
      if (enters == 0.0) {
        continue;
      }
      Interval left = in.left[r * n + i];
      if (bias && motion.effort_dY.rows() > 0) {
        const auto at = static_cast<Eigen::Index>(row * n + i);
        const double size = core::magnitude({fault.kappa(range.lower), fault.kappa(range.upper)});
        left = wider(left, size * fault.offset.cwiseAbs().maxCoeff() * motion.effort_dY.row(at).dot(largest) +
                               motion.effort_doubt.row(at).dot(largest));
      }
      const Interval scaled = side * enters > 0.0 ? left : Interval{-left.upper, -left.lower};
      const Interval entered{std::abs(enters), std::abs(enters)};
      Interval ratio = over(over(scaled, entered), weight);
      if (bias) {
        ratio = {core::round_down(fault.magnitude(ratio.lower)), core::round_up(fault.magnitude(ratio.upper))};
      }
      take_mean(out, range, motion.instant[weights.first()], motion.instant[row], mixed(ratio, share, range));
    }
  }
}

}  // namespace

std::vector<SizeEvidence> size_evidence(const ReferenceMotion& motion, const RegressorFilter& filter,
                                        const Eigen::MatrixXd& efforts, const Polytope& set,
                                        const std::vector<FaultType>& faults, const Interval& window,
                                        const SizeOptions& options) {
  const Model& model = filter.model();
  check::that(set.dimension() == model.p(), "set", "as many parameters as the model");
  check::that(static_cast<std::size_t>(efforts.rows()) == model.joints.size() &&
                  static_cast<std::size_t>(efforts.cols()) == motion.instants(),
              "efforts", "joints × instants");
  std::vector<SizeEvidence> out(faults.size());
  TorqueRows in{motion,
                filter,
                efforts,
                set,
                rows_within(motion, window, options.most_rows, options.also),
                {},
                motion.most_effort};
  if (in.most_effort <= 0.0) {
    in.most_effort = core::kInfinity;
  }
  const ThresholdRule rule(set, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.p())));
  for (const std::size_t row : in.rows) {
    for (std::size_t i = 0; i < model.n(); ++i) {
      in.left.push_back(left_of_row(rule, motion.rows, row, i));
    }
  }
  core::for_all(faults.size(), options.threads, [&](std::size_t k) {
    validate(faults[k], model);
    if (has_a_size(faults[k])) {
      average(faults[k], in, out[k]);
      take_sides(faults[k], out[k]);
      grow(faults[k], in, out[k]);
    }
  });
  return out;
}

namespace {

// What all faults of the kinematic residual share.
struct OdometryRows {
  const OdometryReference& reference;
  const Model& model;
  const filter::OdometryMeasurement& measurement;
  const filter::OdometryErrors& errors;
  const Polytope& set;
  std::vector<std::size_t> rows;
  std::vector<Interval> left;  // E, row by row, output by output
};

// Σ κ_k a_k p_k as c P κ̄ and a rest, κ̄ the mean with the weights p_k >= 0.
class WeightedRow {
 public:
  explicit WeightedRow(const Interval& range) : range_(range) {}
  // A step with a in `a`, p in `p`; `typical` of p.
  void add(const Interval& a, const Interval& p, double typical) {
    steps_.push_back({a, p});
    weight_ += a.centre() * typical;
    total_ += typical;
  }
  // P lies in `total`: the mean of sizes where the sum is in `sum`; nothing where no sizes of the range make that sum.
  [[nodiscard]] std::optional<Interval> mean(const Interval& sum, const Interval& total) const {
    const double c = total_ > 0.0 ? weight_ / total_ : 0.0;
    const double middle = range_.centre(), half = core::round_up(0.5 * range_.width());
    Interval rest{0.0, 0.0};
    double apart = 0.0;
    for (const Step& step : steps_) {
      const Interval d = step.a - core::point(c);
      const Interval product = d * step.p;
      rest = rest + product;
      apart = core::round_up(apart + core::magnitude(product));
    }
    const Interval beside = wider(core::point(middle) * rest, core::round_up(half * apart));
    const Interval weight = core::point(c) * total, possible = weight * range_ + beside;
    if (possible.upper < sum.lower || sum.upper < possible.lower) {
      return std::nullopt;
    }
    const Interval left = sum - beside;
    Interval mean = range_;
    if (weight.lower > 0.0) {
      mean = over(left, weight);
    } else if (weight.upper < 0.0) {
      mean = over({-left.upper, -left.lower}, {-weight.upper, -weight.lower});
    }
    mean = {std::max(mean.lower, range_.lower), std::min(mean.upper, range_.upper)};
    return mean.lower <= mean.upper ? std::optional<Interval>(mean) : std::nullopt;
  }

 private:
  struct Step {
    Interval a, p;
  };
  Interval range_;
  std::vector<Step> steps_;
  double weight_ = 0.0, total_ = 0.0;
};

// One fault in the kinematic residual: radii, encoder, slip.
class Rolling {
 public:
  Rolling(const FaultType& fault, const OdometryRows& in)
      : in_(in),
        catalogued_(fault),
        encoder_(fault.seen.size() > 0),
        fault_(encoder_ ? as_motion_of_reading(fault) : fault),
        signature_(odometry_signature(fault_, in.model)),
        range_{fault_.kappa(fault_.range.lower), fault_.kappa(fault_.range.upper)},
        amount_(core::magnitude(range_)),
        share_(signature_.read_share()) {}

  // Whether weights are known: wheels of their own, or slip.
  [[nodiscard]] bool known() const {
    const bool slips = signature_.along != 0.0 || signature_.turning != 0.0 || fault_.lateral != 0.0;
    const Eigen::Matrix2d& k = signature_.rolled;
    const double largest = k.cwiseAbs().maxCoeff();
    const bool apart = std::abs(k(0, 1)) <= 1e-12 * largest && std::abs(k(1, 0)) <= 1e-12 * largest;
    const auto& seen = catalogued_.seen;
    const bool alone = !encoder_ || (fault_.slip.size() == 0 && catalogued_.motion.size() == 0 &&
                                     (seen * seen - seen).cwiseAbs().maxCoeff() <= 1e-12 * seen.cwiseAbs().maxCoeff());
    return alone && (slips ? largest == 0.0 : largest > 0.0 && apart);
  }

  void take(SizeEvidence& out) const {
    const std::vector<double>& t = in_.reference.motion.t;
    const std::size_t n = in_.measurement.outputs().size();
    for (std::size_t r = 0; r < in_.rows.size(); ++r) {
      const std::size_t row = in_.rows[r], from = in_.reference.window[row];
      for (std::size_t i = 0; i < n && from < row; ++i) {
        const std::optional<Interval> mean = signature_.rolled.isZero(0.0) ? by_time(row, from, i, in_.left[r * n + i])
                                                                           : by_way(row, from, i, in_.left[r * n + i]);
        if (!mean) {
          out.excluded = true;
          return;
        }
        take_mean(out, catalogued_.range, t[from], t[row], size_of(*mean));
      }
    }
  }

 private:
  [[nodiscard]] Interval size_of(const Interval& kappa) const {
    const auto size = [&](double k) { return catalogued_.magnitude(encoder_ ? k / (1.0 - k) : k); };
    return {core::round_down(core::round_down(size(kappa.lower))), core::round_up(core::round_up(size(kappa.upper)))};
  }

  [[nodiscard]] bool displacement(std::size_t i) const { return in_.measurement.position && i < 2; }

  // Entry `i` of the direction of step k, and of what is to the left of it, in the frame of a row from `from` on.
  [[nodiscard]] std::array<double, 2> direction(std::size_t k, std::size_t from, std::size_t i) const {
    const std::vector<double>& heading = in_.reference.motion.heading;
    const std::array<double, 2> e = filter::mean_direction(heading[k] - heading[from], heading[k + 1] - heading[from]);
    return i == 0 ? std::array<double, 2>{e[0], -e[1]} : std::array<double, 2>{e[1], e[0]};
  }

  // By the ways of the wheels.
  [[nodiscard]] std::optional<Interval> by_way(std::size_t row, std::size_t from, std::size_t i,
                                               const Interval& left) const {
    const ReferenceMotion& motion = in_.reference.motion;
    const bool along = displacement(i), speeds = in_.measurement.motion == MotionKind::speed;
    const std::size_t column = along || !in_.measurement.position ? 0 : 2;
    const Box& box = in_.set.hull();
    const Eigen::Vector2d gain = signature_.rolled.diagonal();
    const bool both = gain[0] != 0.0 && gain[1] != 0.0;
    const std::size_t lead = gain[0] != 0.0 ? 0 : 1;
    // One wheel's parameter is divided out.
    const Interval factor = core::point(gain[static_cast<Eigen::Index>(lead)]) * box.sides[column + lead];
    const Interval outer = both ? core::point(factor.centre()) : factor;
    if (!(outer.lower > 0.0) && !(outer.upper < 0.0)) {
      return range_;
    }
    const double sign = outer.lower > 0.0 ? 1.0 : -1.0;
    const Interval size = sign > 0.0 ? outer : Interval{-outer.upper, -outer.lower};
    WeightedRow weights(range_);
    Interval total{0.0, 0.0};
    double turning = 0.0;  // of what a size may change by within a step
    for (std::size_t w = 0; w < 2; ++w) {
      const auto at = static_cast<Eigen::Index>(w);
      if (gain[at] == 0.0) {
        continue;
      }
      const Interval ratio = both ? over(core::point(gain[at]) * (sign > 0.0 ? box.sides[column + w]
                                                                             : Interval{-box.sides[column + w].upper,
                                                                                        -box.sides[column + w].lower}),
                                         size)
                                  : core::point(1.0);
      double runs = 0.0, known = 0.0, noise = 0.0, before = 0.0, doubtful = 0.0;
      for (std::size_t k = from; k < row; ++k) {
        const auto a = static_cast<Eigen::Index>(k);
        const double h = motion.t[k + 1] - motion.t[k];
        const double d = motion.joint_angle(at, a + 1) - motion.joint_angle(at, a);
        const double error = speeds ? in_.errors.motion * h : 2.0 * in_.errors.motion;
        const double most = std::abs(d) + error;
        const double e = along ? 0.5 * direction(k, from, i)[0] : (w == 0 ? 1.0 : -1.0);
        const double way = d > error ? 1.0 : d < -error ? -1.0 : 0.0;
        if (way != 0.0) {
          runs += way != before ? 1.0 : 0.0;
          known += std::abs(d);
          noise += error;
          weights.add(core::point(way * e) * ratio, {std::max(0.0, std::abs(d) - error), std::abs(d) + error},
                      std::abs(d));
        } else {
          doubtful += most;
          weights.add(Interval{-std::abs(e), std::abs(e)} * ratio, {0.0, most}, 0.0);
        }
        before = way;
        if (along) {
          turning += 0.25 * most * core::magnitude(ratio) * std::abs(motion.heading[k + 1] - motion.heading[k]);
        }
      }
      // Errors of angles cancel but at the ends of what goes one way.
      noise = speeds ? noise : std::min(noise, 2.0 * in_.errors.motion * runs);
      total = total + Interval{core::round_down((1.0 - kRounded) * known - noise),
                               core::round_up((1.0 + kRounded) * known + noise + doubtful)};
    }
    const double error = error_of(row, i) + 0.5 * range_.width() * turning * core::magnitude(outer);
    Interval sum = wider(left, core::round_up(error));
    sum = over(sign > 0.0 ? sum : Interval{-sum.upper, -sum.lower}, size);
    total.lower = std::max(0.0, total.lower);
    return weights.mean(sum, total);
  }

  // By time.
  [[nodiscard]] std::optional<Interval> by_time(std::size_t row, std::size_t from, std::size_t i,
                                                const Interval& left) const {
    const ReferenceMotion& motion = in_.reference.motion;
    WeightedRow weights(range_);
    double error = error_of(row, i);
    for (std::size_t k = from; k < row; ++k) {
      const double h = motion.t[k + 1] - motion.t[k];
      double a = signature_.turning;
      if (displacement(i)) {
        const std::array<double, 2> e = direction(k, from, i);
        a = signature_.along * e[0] + fault_.lateral * e[1];
        error += amount_ * h * std::hypot(signature_.along, fault_.lateral) *
                 (in_.errors.heading + std::abs(motion.heading[k + 1] - motion.heading[k]) +
                  0.25 * h * h * in_.errors.yaw_gain * in_.errors.acceleration);
      }
      weights.add(core::point(a), core::point(h), h);
    }
    const double all = motion.t[row] - motion.t[from];
    return weights.mean(wider(left, core::round_up(error)), {(1.0 - kRounded) * all, (1.0 + kRounded) * all});
  }

  // Of what the measured ways make of the fault's part.
  [[nodiscard]] double error_of(std::size_t row, std::size_t i) const {
    const RegressionBlock& rows = in_.reference.motion.rows;
    const auto at = static_cast<Eigen::Index>(row * rows.outputs + i);
    return amount_ * share_ *
           (rows.dY.row(at).maxCoeff() * in_.set.hull().magnitudes().sum() +
            (in_.errors.estimated.size() > 0 ? rows.dy[at] : 0.0));
  }

  const OdometryRows& in_;
  FaultType catalogued_;
  bool encoder_;
  FaultType fault_;
  OdometrySignature signature_;
  Interval range_;
  double amount_, share_;
};

}  // namespace

std::vector<SizeEvidence> size_evidence_by_odometry(const OdometryReference& reference, const Model& model,
                                                    const filter::OdometryMeasurement& measurement,
                                                    const filter::OdometryErrors& errors, const Polytope& set,
                                                    const std::vector<FaultType>& faults, const Interval& window,
                                                    const SizeOptions& options) {
  const ReferenceMotion& motion = reference.motion;
  check::that(set.dimension() == motion.rows.parameters, "set", "as many parameters as the rows");
  OdometryRows in{
      reference, model, measurement, errors, set, rows_within(motion, window, options.most_rows, options.also), {}};
  const ThresholdRule rule(set, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(set.dimension())));
  bool healthy = true;
  for (const std::size_t row : in.rows) {
    for (std::size_t i = 0; i < motion.rows.outputs; ++i) {
      in.left.push_back(left_of_row(rule, motion.rows, row, i));
      healthy = healthy && in.left.back().contains(0.0);
    }
  }
  std::vector<SizeEvidence> out(faults.size());
  core::for_all(faults.size(), options.threads, [&](std::size_t k) {
    validate(faults[k], model);
    if (!has_a_size(faults[k])) {
      return;
    }
    if (!shows_in_odometry(faults[k])) {
      out[k].excluded = !healthy;
      return;
    }
    if (const Rolling rolling(faults[k], in); rolling.known()) {
      rolling.take(out[k]);
      take_sides(faults[k], out[k]);
    }
  });
  return out;
}

double amount_of(const FaultType& fault, double size) {
  const double kappa = fault.kappa(size);
  if (fault.seen.size() > 0) {
    return std::abs(kappa / (1.0 + kappa));
  }
  return std::abs(has_square(fault) ? kappa + 0.5 * kappa * kappa : kappa);
}

double size_of(const FaultType& fault, double sigma, double amount) {
  const double x = std::copysign(amount, sigma);
  if (fault.seen.size() > 0) {
    return x < 1.0 ? fault.magnitude(x / (1.0 - x)) : core::kInfinity;
  }
  if (has_square(fault)) {
    return x > -0.5 ? fault.magnitude(2.0 * x / (1.0 + std::sqrt(1.0 + 2.0 * x))) : -core::kInfinity;
  }
  return fault.magnitude(x);
}

SizeOverTime size_over_time(const FaultType& fault, std::span<const SizeEvidence> evidence) {
  SizeOverTime out{.fault = fault};
  std::array<std::vector<SizeEvidence::Link>, 2> links;
  std::array<bool, 2> excluded{!(fault.range.upper > 0.0), !(fault.range.lower < 0.0)};
  for (const SizeEvidence& each : evidence) {
    out.excluded = out.excluded || each.excluded;
    out.means.insert(out.means.end(), each.means.begin(), each.means.end());
    for (std::size_t k = 0; k < 2; ++k) {
      excluded[k] = excluded[k] || each.sides[k].excluded;
      links[k].insert(links[k].end(), each.sides[k].links.begin(), each.sides[k].links.end());
    }
  }
  std::ranges::stable_sort(out.means, {}, &MeanSize::to);
  out.growing_excluded = out.excluded || (excluded[0] && excluded[1]);
  std::vector<double> times;
  for (const std::vector<SizeEvidence::Link>& side : links) {
    for (const SizeEvidence::Link& link : side) {
      times.push_back(link.at);
      times.push_back(link.from);
    }
  }
  if (times.empty() || out.growing_excluded) {
    return out;
  }
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  const auto place = [&](double t) {
    return static_cast<std::size_t>(std::ranges::lower_bound(times, t) - times.begin());
  };
  std::array<std::vector<Interval>, 2> sizes;  // at each of the times
  for (std::size_t k = 0; k < 2; ++k) {
    const double sigma = k == 0 ? 1.0 : -1.0, end = k == 0 ? fault.range.upper : fault.range.lower;
    std::vector<Interval> amount(times.size(), {0.0, core::round_up(amount_of(fault, end))});
    std::vector<std::vector<SizeEvidence::Link>> below(times.size()), above(times.size());
    for (const SizeEvidence::Link& link : links[k]) {
      (link.below ? below : above)[place(link.at)].push_back(link);
    }
    for (std::size_t i = 0; i < times.size(); ++i) {
      double& lower = amount[i].lower;
      lower = i > 0 ? std::max(lower, amount[i - 1].lower) : lower;
      for (const SizeEvidence::Link& link : below[i]) {
        const double from = link.share != 0.0 ? amount[place(link.from)].lower : 0.0;
        lower = std::max(lower, core::round_down(link.constant + core::round_down(link.share * from)));
      }
    }
    for (std::size_t i = times.size(); i-- > 0;) {
      double& upper = amount[i].upper;
      upper = i + 1 < times.size() ? std::min(upper, amount[i + 1].upper) : upper;
      for (const SizeEvidence::Link& link : above[i]) {
        const double from = link.share != 0.0 ? amount[place(link.from)].upper : 0.0;
        upper = std::min(upper, core::round_up(link.constant + core::round_up(link.share * from)));
      }
    }
    for (const Interval& each : amount) {
      excluded[k] = excluded[k] || each.lower > each.upper;
      const double a = size_of(fault, sigma, each.lower), b = size_of(fault, sigma, std::max(0.0, each.upper));
      // A few operations on either bound.
      const double slack = 1e-14 * (1.0 + std::abs(a) + std::abs(b));
      sizes[k].push_back(
          {std::max(std::min(a, b) - slack, fault.range.lower), std::min(std::max(a, b) + slack, fault.range.upper)});
    }
  }
  out.growing_excluded = excluded[0] && excluded[1];
  if (out.growing_excluded) {
    return out;
  }
  const std::size_t count = std::min(kInstants, times.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = count > 1 ? i * (times.size() - 1) / (count - 1) : 0;
    const Interval &up = sizes[0][at], &down = sizes[1][at];
    out.growing.push_back({times[at], excluded[1] ? up
                                      : excluded[0]
                                          ? down
                                          : Interval{std::min(up.lower, down.lower), std::max(up.upper, down.upper)}});
  }
  return out;
}

}  // namespace wheelwright::detector
