// SPDX-License-Identifier: Apache-2.0
#include "commission/at_risk/risk_set.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "bounds/slab_rows.hpp"
#include "commission/at_risk/element_walk.hpp"
#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "model/filter/element_filter.hpp"
#include "model/filter/predictable_regressor.hpp"
#include "model/filter/sample_weights.hpp"

namespace wheelwright::commission {
namespace {

using core::RowMatrix;
using filter::ElementFilter;
using filter::PredictableRegressor;
using filter::SampleWeight;
using filter::SampleWeights;
using filter::WeakSummation;

// Times of the first and last element of every segment.
struct Stretch {
  double first = 0.0, last = 0.0;
  std::size_t elements = 0;
};

// Weights rise from 0 over a time from `from` on, and fall to 0 before a segment's last element.
double taper(const Stretch& stretch, double from, double t) {
  constexpr double kOver = 1.0;  // s
  return std::clamp(std::min(t - from, stretch.last - t) / kOver, 0.0, 1.0);
}

// What one delay's instruments make of the log, for one block of parameters.
struct Ellipsoid {
  double delay = 0.0;
  std::vector<Eigen::Index> block;
  Eigen::MatrixXd M, V, V0;  // V of the smaller proxies, or of those for every λ: as squared_radius is
  Eigen::VectorXd straight;  // per instrument: ErrorShare::straight
  double risk = 0.0, squared_radius = 0.0, log_volume = 0.0;
  bool usable = false;
};

// Parameters that share an output, together.
std::vector<std::vector<Eigen::Index>> blocks_of(const Model& model) {
  std::vector<bounds::HalfSpace> rows(model.n());
  for (bounds::HalfSpace& row : rows) {
    row.a = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.p()));
  }
  for (const Term& term : model.terms) {
    rows[term.output].a[static_cast<Eigen::Index>(term.parameter)] = 1.0;
  }
  std::vector<std::vector<Eigen::Index>> result;
  for (const std::vector<std::size_t>& block : bounds::independent_blocks(rows, model.p())) {
    result.emplace_back(block.begin(), block.end());
  }
  return result;
}

// The largest of `count` equal parts that do not add up to more than `risk`.
double part_of(double risk, std::size_t count) {
  const auto parts = static_cast<double>(count);
  const double part = risk / parts;
  return std::fma(part, parts, -risk) > 0.0 ? std::nextafter(part, 0.0) : part;
}

constexpr double kSpread = 0.01;  // η of (a + b)(a + b)ᵀ <= (1 + η) aaᵀ + (1 + 1/η) bbᵀ
// V0 is this share of the V that the log's beginning makes expect: each of these at its part of the risk, since the
// beginning may be driven harder than the rest, or in one direction only.
constexpr std::array<double, 3> kExpected = {0.1, 0.01, 0.001};
constexpr double kRounding = 1e-10;  // relative, of all sums
constexpr double kReach = 1.1;       // for λᵀV0λ, in units of what an ellipsoid asks for if V is as V0 makes expect
constexpr double kEvery = 0.1;       // part of the risk that is kept for proxies for every λ, where others are smaller

// The sum of cᵀc over samples times their variance proxy, each c within middle ± spread.
class Variances {
 public:
  explicit Variances(Eigen::Index size) : sum_(Eigen::MatrixXd::Zero(size, size)), wide_(Eigen::VectorXd::Zero(size)) {}
  void add(const Eigen::VectorXd& middle, const Eigen::VectorXd& spread, double proxy) {
    const double wide = proxy * static_cast<double>(spread.size());
    for (Eigen::Index j = 0; j < wide_.size(); ++j) {
      for (Eigen::Index i = 0; i < wide_.size(); ++i) {
        sum_(i, j) += proxy * middle[i] * middle[j];
      }
      wide_[j] += wide * (spread[j] * spread[j]);
    }
  }
  [[nodiscard]] Eigen::MatrixXd total() const {
    Eigen::MatrixXd result = (1.0 + kSpread) * sum_;
    result.diagonal() += (1.0 + 1.0 / kSpread) * wide_;
    return result;
  }
  [[nodiscard]] Eigen::MatrixXd plain() const { return sum_ + Eigen::MatrixXd(wide_.asDiagonal()); }

 private:
  Eigen::MatrixXd sum_;
  Eigen::VectorXd wide_;
};

// Variances of one delay and block. V0 is that of the log's beginning and is fixed when the first sample of the sums
// comes: the reach of a sample, for which its proxy has to hold, is the largest |λᵀc| with λᵀV0λ <= reach².
class SelfNormalised {
 public:
  // `grown`: what the log's beginning is to be multiplied by to be like the whole.
  SelfNormalised(Eigen::Index size, double expected, double grown, double log_risk)
      : scale_(expected * grown), prior_(size), small_(size), all_(size), V0_(size, size) {
    const double p = static_cast<double>(size);
    const double radius = std::sqrt(2.0 * log_risk + p * std::log1p(1.0 / expected) + 2.0 * std::log(2.0));
    reach_ = kReach * (radius + std::sqrt(p));
  }

  void learn(const filter::SampleClass& sample, const Eigen::VectorXd& middle, const Eigen::VectorXd& spread) {
    prior_.add(middle, spread, sample.multiplicity * sample.deviation * sample.deviation);
  }
  // `proxy` of the sample for every λ.
  void add(const filter::SampleClass& sample, double proxy, const Eigen::VectorXd& middle,
           const Eigen::VectorXd& spread) {
    fix();
    double smaller = proxy;
    if (sample.deviation < sample.bound) {
      turned_.noalias() = root_ * middle;
      smaller = filter::variance_proxy(sample, reach_ * (turned_.norm() + gain_ * spread.norm()), proxy);
    }
    small_.add(middle, spread, smaller);
    all_.add(middle, spread, proxy);
  }

  // Whether errors have deviations below their bounds.
  [[nodiscard]] bool varied() const { return small_.plain() != all_.plain(); }

  // V, V0 and the squared radius at `risk`.
  void finish(Ellipsoid& e, double risk) {
    fix();
    e.risk = risk;
    e.V0 = V0_;
    const bool varied = this->varied();
    // Mixture of exp(λᵀS − λᵀVλ/2) over a Gaussian that is cut off where λᵀV0λ = reach²: half of it or more is left
    // around every λ that the ellipsoid asks for, if those are inside by √p standard deviations.
    if (varied) {
      e.V = small_.total();
      const core::EigenPairs pairs = core::symmetric_eigen(root_ * (e.V + e.V0) * root_.transpose());
      e.log_volume = pairs.values.array().log().sum();
      e.squared_radius = 2.0 * std::log(1.0 / ((1.0 - kEvery) * risk)) + e.log_volume + 2.0 * std::log(2.0);
      const double p = static_cast<double>(e.V0.rows());
      if (std::sqrt(e.squared_radius) + std::sqrt(p) <= reach_ * std::sqrt(pairs.values.minCoeff())) {
        e.usable = std::isfinite(e.squared_radius);
        return;
      }
    }
    e.V = all_.total();
    e.log_volume = core::symmetric_eigen(root_ * (e.V + e.V0) * root_.transpose()).values.array().log().sum();
    e.squared_radius = 2.0 * std::log(1.0 / (varied ? kEvery * risk : risk)) + e.log_volume;
    e.usable = std::isfinite(e.squared_radius);
  }

 private:
  void fix() {
    if (fixed_) {
      return;
    }
    fixed_ = true;
    V0_ = scale_ * prior_.plain();
    const double floor = 1e-6 * V0_.diagonal().maxCoeff();
    V0_.diagonal() += 1e-3 * V0_.diagonal() + Eigen::VectorXd::Constant(V0_.rows(), floor > 0.0 ? floor : 1.0);
    const Eigen::VectorXd scale = V0_.diagonal().cwiseSqrt().cwiseInverse();
    const core::EigenPairs pairs = core::symmetric_eigen(scale.asDiagonal() * V0_ * scale.asDiagonal());
    root_ = pairs.values.cwiseSqrt().cwiseInverse().asDiagonal() * pairs.vectors.transpose() * scale.asDiagonal();
    gain_ = root_.norm();
  }

  double scale_, reach_ = 0.0, gain_ = 0.0;
  bool fixed_ = false;
  Variances prior_, small_, all_;
  Eigen::MatrixXd V0_, root_;  // root V0 rootᵀ = I
  Eigen::VectorXd turned_;
};

// What becomes of a block's elements: first V0 is learnt from those in which the logged torque stands above the
// efforts' errors, then sums begin; between both is a pause, in which no weights stand.
class Phase {
 public:
  Phase(const Model& model, const std::vector<Eigen::Index>& block, double effort_bound, std::size_t to_learn)
      : to_learn_(to_learn) {
    for (std::size_t i = 0; i < model.n(); ++i) {
      const bool has = std::ranges::any_of(model.terms, [&](const Term& term) {
        return term.output == i && static_cast<Eigen::Index>(term.parameter) == block.front();
      });
      if (has) {
        const auto at = static_cast<Eigen::Index>(i);
        outputs_.push_back({at, effort_bound * model.input.row(at).cwiseAbs().sum()});
      }
    }
  }
  void begin_segment(double first) { from_ = first; }
  // The next element. What ends the learning must not depend on what comes later, as anything that a fit knows does.
  void step(const filter::WeakElement& element) {
    if (!learnt_) {
      const bool shows = std::ranges::any_of(
          outputs_, [&](const auto& o) { return std::abs(element.torque[o.first]) > o.second * element.length; });
      seen_ += shows ? 1 : 0;
      learnt_ = seen_ > to_learn_;
    } else if (since_ < kPause && ++since_ == kPause) {
      from_ = element.t;
    }
  }
  [[nodiscard]] bool learning() const { return !learnt_; }
  [[nodiscard]] bool in_use() const { return since_ == kPause; }
  // Whether errors that are handed out now belong to V0.
  [[nodiscard]] bool of_prior() const { return since_ < kPause / 2; }
  [[nodiscard]] double from() const { return from_; }

 private:
  static constexpr std::size_t kPause = 16;  // twice what SampleWeights holds
  std::size_t to_learn_, seen_ = 0, since_ = 0;
  bool learnt_ = false;
  double from_ = 0.0;
  std::vector<std::pair<Eigen::Index, double>> outputs_;
};

class Learner {
 public:
  Learner(LogSource& log, const ElementFilter& filter, const filter::ErrorClasses& classes, filter::ParameterBox box,
          const RiskSetOptions& options)
      : log_(log), filter_(filter), classes_(classes), box_(std::move(box)), options_(options) {
    walk_elements(
        log_, filter_, [&] { stretches_.push_back({}); },
        [&] {
          Stretch& s = stretches_.back();
          const double t = filter_.element().t;
          s.first = s.elements++ == 0 ? t : s.first;
          s.last = t;
        },
        [] {});
    correlation_ = std::max(classes_.motion.correlation, classes_.effort.correlation);
    std::size_t elements = 0;
    for (const Stretch& s : stretches_) {
      elements += s.elements;
    }
    learning_ = static_cast<std::size_t>(options.learning * static_cast<double>(elements));
    grown_ = learning_ > 0 ? static_cast<double>(elements) / static_cast<double>(learning_) : 0.0;
  }

  // Of every delay and block.
  [[nodiscard]] std::vector<Ellipsoid> ellipsoids(const std::vector<std::vector<Eigen::Index>>& blocks) {
    const std::size_t count = options_.delays.size();
    const auto p = box_.middle.size();
    const double risk = part_of(options_.risk, count * blocks.size() * kExpected.size());
    std::vector<std::vector<SelfNormalised>> variances(count);  // of blocks, and of kExpected
    std::vector<Eigen::VectorXd> straight(count, Eigen::VectorXd::Zero(p));
    std::vector<PredictableRegressor> foreseen;
    std::vector<SampleWeights> weights;
    std::vector<WeakSummation> sums;
    for (std::size_t d = 0; d < count; ++d) {
      foreseen.emplace_back(filter_, options_.delays[d], correlation_);
      weights.emplace_back(filter_, box_, p);
      sums.emplace_back(filter_, p);
      for (const std::vector<Eigen::Index>& block : blocks) {
        for (const double expected : kExpected) {
          variances[d].emplace_back(static_cast<Eigen::Index>(block.size()), expected, grown_, std::log(1.0 / risk));
        }
      }
    }
    std::vector<Phase> phases = phases_of(blocks);
    std::size_t stretch = 0;
    std::size_t b = 0;
    const double effort_proxy = filter::variance_proxy(filter::sample_class(classes_.effort, classes_.shortest_step));
    const double motion_proxy = filter::variance_proxy(filter::sample_class(classes_.motion, classes_.shortest_step));
    Eigen::VectorXd middle, spread;
    const auto sink = [&](const SampleWeight& s) {
      const filter::SampleClass c = sample_class(classes_, s);
      straight[b] += (c.averages ? c.bias : c.bound) * (s.middle.cwiseAbs() + s.spread);
      if (!c.averages) {
        return;
      }
      const double proxy = s.sensor == SampleWeight::Sensor::effort ? effort_proxy : motion_proxy;
      for (std::size_t k = 0; k < blocks.size(); ++k) {
        middle = s.middle(blocks[k]);
        spread = s.spread(blocks[k]);
        for (std::size_t i = 0; i < kExpected.size(); ++i) {
          SelfNormalised& of = variances[b][k * kExpected.size() + i];
          if (!phases[k].of_prior()) {
            of.add(c, proxy, middle, spread);
          } else if (s.sensor == SampleWeight::Sensor::effort) {  // weights of the motion's errors depend on the box
            of.learn(c, middle, spread);
          }
        }
      }
    };
    RowMatrix g;
    walk_elements(
        log_, filter_,
        [&] {
          for (b = 0; b < count; ++b) {
            foreseen[b].begin();
            weights[b].begin();
            sums[b].begin();
          }
          for (Phase& phase : phases) {
            phase.begin_segment(stretches_[stretch].first);
          }
        },
        [&] {
          const double t = filter_.element().t;
          for (PredictableRegressor& f : foreseen) {
            f.take(filter_);
          }
          for (Phase& phase : phases) {
            phase.step(filter_.element());
          }
          for (b = 0; b < count; ++b) {
            g = foreseen[b].value();
            if (!filter_.element().known) {
              g.setZero();
            }
            weigh(g, blocks, phases, stretches_[stretch], t, true);
            weights[b].take(filter_, g, sink);
            weigh(g, blocks, phases, stretches_[stretch], t, false);
            sums[b].take(filter_, g);
          }
        },
        [&] {
          for (b = 0; b < count; ++b) {
            weights[b].end(sink);
            sums[b].end(filter_);
          }
          ++stretch;
        });
    std::vector<Ellipsoid> result;
    for (b = 0; b < count; ++b) {
      for (std::size_t k = 0; k < blocks.size(); ++k) {
        const std::vector<Eigen::Index>& block = blocks[k];
        for (std::size_t i = 0; i < kExpected.size(); ++i) {
          Ellipsoid e{options_.delays[b], block, sums[b].sums().Y(block, block), {}, {}, straight[b](block)};
          variances[b][k * kExpected.size() + i].finish(e, risk);
          result.push_back(std::move(e));
        }
      }
    }
    return result;
  }

  // Sums with the weights `directions`, each of the delay and block of the ellipsoid `of`.
  [[nodiscard]] std::vector<RiskFacet> facets(const std::vector<Ellipsoid>& ellipsoids,
                                              const std::vector<std::vector<Eigen::Index>>& blocks,
                                              const std::vector<Eigen::VectorXd>& directions,
                                              const std::vector<std::size_t>& of) {
    const auto count = static_cast<Eigen::Index>(directions.size());
    std::vector<PredictableRegressor> foreseen;
    for (const Ellipsoid& e : ellipsoids) {
      foreseen.emplace_back(filter_, e.delay, correlation_);
    }
    SampleWeights weights(filter_, box_, count);
    WeakSummation sums(filter_, count);
    std::vector<filter::ErrorShare> shares(directions.size());
    const auto sink = [&](const SampleWeight& s) {
      const filter::SampleClass c = sample_class(classes_, s);
      for (std::size_t d = 0; d < shares.size(); ++d) {
        const auto i = static_cast<Eigen::Index>(d);
        add(shares[d], c, std::abs(s.middle[i]) + s.spread[i]);
      }
    };
    std::vector<Phase> phases = phases_of(blocks);
    std::vector<std::size_t> block(directions.size());
    for (std::size_t d = 0; d < block.size(); ++d) {
      block[d] = static_cast<std::size_t>(std::ranges::find(blocks, ellipsoids[of[d]].block) - blocks.begin());
    }
    std::size_t stretch = 0;
    RowMatrix g(static_cast<Eigen::Index>(filter_.model().n()), count);
    walk_elements(
        log_, filter_,
        [&] {
          for (PredictableRegressor& f : foreseen) {
            f.begin();
          }
          weights.begin();
          sums.begin();
          for (Phase& phase : phases) {
            phase.begin_segment(stretches_[stretch].first);
          }
        },
        [&] {
          const double t = filter_.element().t;
          for (PredictableRegressor& f : foreseen) {
            f.take(filter_);
          }
          for (Phase& phase : phases) {
            phase.step(filter_.element());
          }
          for (Eigen::Index d = 0; d < count; ++d) {
            const Phase& phase = phases[block[static_cast<std::size_t>(d)]];
            const double share =
                phase.in_use() && filter_.element().known ? taper(stretches_[stretch], phase.from(), t) : 0.0;
            g.col(d).noalias() =
                foreseen[of[static_cast<std::size_t>(d)]].value() * (share * directions[static_cast<std::size_t>(d)]);
          }
          weights.take(filter_, g, sink);
          sums.take(filter_, g);
        },
        [&] {
          weights.end(sink);
          sums.end(filter_);
          ++stretch;
        });
    std::vector<RiskFacet> result(directions.size());
    for (std::size_t d = 0; d < result.size(); ++d) {
      const auto i = static_cast<Eigen::Index>(d);
      const Ellipsoid& e = ellipsoids[of[d]];
      RiskFacet& f = result[d];
      f.Y = sums.sums().Y.row(i);
      f.dY = sums.sums().dY.row(i);
      f.y = sums.sums().y[i];
      f.ellipsoid = of[d];
      f.weights = directions[d];
      f.share = shares[d];
      const Eigen::VectorXd x = f.weights(e.block);
      f.radius = std::min(std::sqrt(x.dot((e.V + e.V0) * x) * e.squared_radius), f.share.worst - f.share.straight);
      const double size = std::abs(f.y) + f.Y.cwiseAbs().dot(box_.middle.cwiseAbs() + box_.radius);
      f.rounding = kRounding * (size + f.share.worst);
      f.dy = f.radius + f.share.straight + sums.sums().dy[i] + f.rounding;
    }
    return result;
  }

 private:
  [[nodiscard]] std::vector<Phase> phases_of(const std::vector<std::vector<Eigen::Index>>& blocks) const {
    std::vector<Phase> result;
    for (const std::vector<Eigen::Index>& block : blocks) {
      result.emplace_back(filter_.model(), block, classes_.effort.bound, learning_);
    }
    return result;
  }

  // Columns of `g` as their block's phase wants them: those of sums, and with `all` those that V0 is learnt from.
  static void weigh(RowMatrix& g, const std::vector<std::vector<Eigen::Index>>& blocks,
                    const std::vector<Phase>& phases, const Stretch& stretch, double t, bool all) {
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const bool learns = all && phases[k].learning();
      const double share = learns || (all && phases[k].in_use()) ? taper(stretch, phases[k].from(), t)
                           : phases[k].in_use()                  ? 1.0
                                                                 : 0.0;
      g(Eigen::all, blocks[k]) *= share;
    }
  }

  LogSource& log_;
  ElementFilter filter_;
  const filter::ErrorClasses& classes_;
  filter::ParameterBox box_;
  const RiskSetOptions& options_;
  std::vector<Stretch> stretches_;
  std::size_t learning_ = 0;
  double grown_ = 0.0, correlation_ = 0.0;
};

void validate(const RiskSetOptions& options, const filter::ErrorClasses& classes) {
  check::that(options.risk > 0.0 && options.risk < 1.0, "risk", "between 0 and 1");
  check::that(!options.delays.empty(), "delays of the weights", "at least one");
  check::that(options.learning >= 0.0 && options.learning < 1.0, "share of the log to learn a scale on", "below 1");
  filter::validate(classes);
}

std::vector<RiskEllipsoid> published(const std::vector<Ellipsoid>& ellipsoids) {
  std::vector<RiskEllipsoid> result;
  for (const Ellipsoid& e : ellipsoids) {
    result.push_back({e.delay, {e.block.begin(), e.block.end()}, e.risk, e.log_volume, e.squared_radius});
  }
  return result;
}

}  // namespace

RiskSet risk_set(LogSource& log, const Model& model, const Measurement& measurement, const filter::SignalErrors& errors,
                 const filter::ErrorClasses& classes, const bounds::Polytope& guaranteed,
                 const RiskSetOptions& options) {
  validate(options, classes);
  RiskSet result;
  result.risk = options.risk;
  result.learning = options.learning;
  result.box = guaranteed.hull();
  const auto p = static_cast<Eigen::Index>(model.p());
  const filter::ParameterBox box = middle_and_radius(result.box);
  Learner learner(log, ElementFilter(model, measurement, errors), classes, box, options);
  const std::vector<std::vector<Eigen::Index>> blocks = blocks_of(model);
  const std::vector<Ellipsoid> ellipsoids = learner.ellipsoids(blocks);
  result.ellipsoids = published(ellipsoids);

  std::vector<Eigen::VectorXd> directions;  // of instruments
  std::vector<std::size_t> of;
  // The half width of the narrowest ellipsoid along `w`, about; takes it, or the narrowest of each delay.
  const auto consider = [&](const Eigen::VectorXd& w, const std::vector<Eigen::Index>& block, bool all) {
    double best = core::kInfinity, narrowest = core::kInfinity;
    std::size_t first = directions.size();
    for (std::size_t b = 0; b < ellipsoids.size(); ++b) {
      const Ellipsoid& e = ellipsoids[b];
      if (!e.usable || e.block != block) {
        continue;
      }
      const Eigen::VectorXd from = (e.V + e.V0).diagonal().cwiseSqrt().cwiseInverse();
      const Eigen::VectorXd to = box.radius(block).cwiseMax(std::numeric_limits<double>::min());
      const core::RankRevealingLu lu(to.asDiagonal() * e.M.transpose() * from.asDiagonal());
      if (!lu.invertible()) {
        continue;
      }
      const Eigen::VectorXd x = from.cwiseProduct(lu.solve(to.cwiseProduct(w(block))));
      const double half = std::sqrt(x.dot((e.V + e.V0) * x) * e.squared_radius) + x.cwiseAbs().dot(e.straight);
      if (all && first < directions.size() && ellipsoids[of.back()].delay != e.delay) {
        first = directions.size();
        best = core::kInfinity;
      }
      if (half < best) {
        directions.resize(first);
        of.resize(first);
        directions.emplace_back(Eigen::VectorXd::Zero(p));
        directions.back()(block) = x;
        of.push_back(b);
        result.log_volume = std::max(result.log_volume, e.log_volume);
      }
      best = std::min(best, half);
      narrowest = std::min(narrowest, half);
    }
    return narrowest;
  };
  // Parameters, then sums and differences of any two, each in units of what is known of it. Every
  // ellipsoid holds, so that of a parameter's facets the sharpest may be chosen when their sums are known.
  for (const std::vector<Eigen::Index>& block : blocks) {
    Eigen::VectorXd width = box.radius;
    for (const Eigen::Index j : block) {
      width[j] = std::min(consider(Eigen::VectorXd::Unit(p, j), block, true), box.radius[j]);
    }
    for (std::size_t a = 0; a < block.size(); ++a) {
      for (std::size_t b = a + 1; b < block.size(); ++b) {
        const Eigen::Index j = block[a], k = block[b];
        for (const double sign : {1.0, -1.0}) {
          if (width[j] > 0.0 && width[k] > 0.0) {
            consider(Eigen::VectorXd::Unit(p, j) / width[j] + sign * Eigen::VectorXd::Unit(p, k) / width[k], block,
                     false);
          }
        }
      }
    }
  }
  if (directions.empty()) {
    result.reason = "the log does not show all parameters";
    return result;
  }
  result.facets = learner.facets(ellipsoids, blocks, directions, of);
  // Half-spaces are named by their numbers: sums, then guaranteed facets (risk_origin()).
  std::vector<bounds::HalfSpace> rows = guaranteed.facets();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].origin = {};
    rows[k].origin.sample = result.facets.size() + k;
  }
  const bounds::SlabRows slabs(guaranteed.hull());
  for (std::size_t d = 0; d < result.facets.size(); ++d) {
    const RiskFacet& f = result.facets[d];
    bounds::HalfSpace upper, lower;
    bounds::RowOrigin origin;
    origin.sample = d;
    slabs.half_spaces({f.Y.data(), static_cast<std::size_t>(p)}, {f.dY.data(), static_cast<std::size_t>(p)}, f.y, f.dy,
                      origin, upper, lower);
    rows.push_back(std::move(upper));
    rows.push_back(std::move(lower));
  }
  auto set = bounds::Polytope::intersect(rows, guaranteed.hull());
  if (std::holds_alternative<bounds::Polytope>(set)) {
    result.set = std::get<bounds::Polytope>(std::move(set));
  } else {
    result.reason = "the log contradicts what is assumed of its errors";
  }
  return result;
}

RiskOrigin risk_origin(const RiskSet& set, const bounds::RowOrigin& origin) {
  const std::size_t sums = set.facets.size();
  return origin.is_prior        ? RiskOrigin{RiskOrigin::Kind::box, origin.parameter, origin.side}
         : origin.sample < sums ? RiskOrigin{RiskOrigin::Kind::sum, origin.sample, origin.side}
                                : RiskOrigin{RiskOrigin::Kind::guaranteed, origin.sample - sums, origin.side};
}

RiskSums risk_sums(LogSource& log, const Model& model, const Measurement& measurement,
                   const filter::SignalErrors& errors, const filter::ErrorClasses& classes, const Box& box,
                   const RiskSetOptions& options, const std::vector<RiskDirection>& directions) {
  validate(options, classes);
  Learner learner(log, ElementFilter(model, measurement, errors), classes, middle_and_radius(box), options);
  const std::vector<std::vector<Eigen::Index>> blocks = blocks_of(model);
  const std::vector<Ellipsoid> ellipsoids = learner.ellipsoids(blocks);
  std::vector<Eigen::VectorXd> weights;
  std::vector<std::size_t> of;
  for (const RiskDirection& direction : directions) {
    check::that(direction.ellipsoid < ellipsoids.size(), "ellipsoid of a direction", "one of every delay and block");
    Eigen::VectorXd rest = direction.weights;
    check::that(rest.size() == static_cast<Eigen::Index>(model.p()), "weights of a direction", "one per parameter");
    rest(ellipsoids[direction.ellipsoid].block).setZero();
    check::that(rest.isZero(0.0), "weights of a direction", "0 outside of the ellipsoid's block");
    weights.push_back(direction.weights);
    of.push_back(direction.ellipsoid);
  }
  return {published(ellipsoids), learner.facets(ellipsoids, blocks, weights, of)};
}

}  // namespace wheelwright::commission
