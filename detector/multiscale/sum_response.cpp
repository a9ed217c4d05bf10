// SPDX-License-Identifier: Apache-2.0
#include "detector/multiscale/sum_response.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "core/regression.hpp"
#include "model/filter/sample_weights.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kPast = 60.0;       // scales after which nothing is left of what was added: e^{−60}
constexpr double kSameStep = 1e-12;  // relative: steps whose decays need not be computed anew

// Where the errors of readings stand in a row of SumDrive::reading.
struct SumErrors {
  Eigen::Index n, coordinates;
  [[nodiscard]] Eigen::Index slope(Eigen::Index output) const { return output; }
  [[nodiscard]] Eigen::Index motion(Eigen::Index output) const { return n + output; }
  [[nodiscard]] Eigen::Index length(Eigen::Index output) const { return 2 * n + output; }
  [[nodiscard]] Eigen::Index between(Eigen::Index output, Eigen::Index coordinate) const {
    return (3 + coordinate) * n + output;
  }
  [[nodiscard]] Eigen::Index function(Eigen::Index output, Eigen::Index which) const {
    return (3 + coordinates + which) * n + output;
  }
};

// Follows the weights of one walk, and sums up what errors of a reading do in them.
class ReadingErrors {
 public:
  ReadingErrors(const ScaleDetector& detector)
      : angles_(detector.elements().angles()),
        n_(static_cast<Eigen::Index>(detector.elements().model().n())),
        coordinates_(static_cast<Eigen::Index>(detector.elements().model().coordinates.size())),
        functions_(static_cast<Eigen::Index>(detector.elements().functions().size())),
        p_(static_cast<Eigen::Index>(detector.elements().model().p())),
        scales_(detector.scales()) {
    const auto W = static_cast<Eigen::Index>(detector.weights().size());
    g_ = g1_ = g2_ = Eigen::ArrayXXd::Zero(W, n_);
    older_ = Eigen::ArrayXXd::Zero(W, (3 + 2 * coordinates_) * n_);
    newest_ = Eigen::ArrayXXd::Zero(W, p_ + (1 + coordinates_ + functions_) * n_);
    for (std::size_t k = 0; k < scales_.size(); ++k) {
      sums_.push_back({KernelSums(W, older_.cols()), KernelSums(W, newest_.cols())});
    }
    Y_ = core::RowMatrix::Zero(n_, p_);
  }

  [[nodiscard]] Eigen::Index errors() const { return (3 + coordinates_ + functions_) * n_; }

  void take(const ScaleDetector& detector) {
    const filter::ElementFilter& elements = detector.elements();
    const filter::WeakElement& e = elements.element();
    if (e.number == 1) {
      for (auto& [older, newest] : sums_) {
        older.reset();
        newest.reset();
      }
      g_.setZero();
      g1_.setZero();
    }
    h1_ = e.number == 1 ? e.before : h_;
    h_ = angles_ ? e.before : e.step;
    g2_ = g1_;
    g1_ = g_;
    g_ = detector.element_weights();
    filter::element_regressor(elements, e, Y_);
    const Eigen::ArrayXXd difference = (g_ - g1_).abs();
    older_.leftCols(n_) = ((g_ - g1_) / h_ - (g1_ - g2_) / h1_).abs();
    older_.middleCols(n_, n_) = difference;
    older_.middleCols(2 * n_, n_) = g_.abs().max(g1_.abs()) * std::max(h_, h1_);
    newest_.leftCols(p_).matrix().noalias() = g_.matrix() * Y_;
    newest_.middleCols(p_, n_) = g_.abs() * e.length;
    for (Eigen::Index c = 0; c < coordinates_; ++c) {
      const double doubt = angles_ ? e.motion_doubt_before[c] : 0.0;
      older_.middleCols((3 + 2 * c) * n_, n_) = difference * (doubt / h_);
      older_.middleCols((4 + 2 * c) * n_, n_) = g_.abs() * doubt;
      newest_.middleCols(p_ + (1 + c) * n_, n_) = g_.abs() * (angles_ ? 0.0 : e.motion_doubt[c]);
    }
    for (Eigen::Index f = 0; f < functions_; ++f) {
      newest_.middleCols(p_ + (1 + coordinates_ + f) * n_, n_) =
          g_.abs() * e.functions[static_cast<std::size_t>(f)].error;
    }
    for (std::size_t k = 0; k < scales_.size(); ++k) {
      const double x = h_ / scales_[k], decay = std::exp(-x);
      auto& [older, newest] = sums_[k];
      older.advance(x, decay);
      older.add(older_, x, decay, older_.cols());
      newest.advance(x, decay);
      newest.add(newest_);
    }
  }

  // Of the look at one sum.
  void write(std::size_t weight, std::size_t scale, Eigen::Ref<Eigen::RowVectorXd> y,
             Eigen::Ref<Eigen::RowVectorXd> out) const {
    const SumErrors at{n_, coordinates_};
    const auto w = static_cast<Eigen::Index>(weight);
    const auto& [older, newest] = sums_[scale];
    const double T = scales_[scale], step = std::exp(std::max(h_, h1_) / T) / T;
    for (Eigen::Index q = 0; q < p_; ++q) {
      y[q] = newest.value(w, q, SumKernel::kShape);
    }
    for (Eigen::Index i = 0; i < n_; ++i) {
      const double varies =
          older.value(w, n_ + i, SumKernel::kShape) + step * older.value(w, 2 * n_ + i, SumKernel::slope());
      const double length = newest.value(w, p_ + i, SumKernel::kShape);
      const double last = SumKernel::at(SumKernel::kShape, h_ / T, std::exp(-h_ / T)) * std::abs(g1_(w, i)) / h_;
      out[at.slope(i)] = angles_ ? older.value(w, i, SumKernel::kShape) +
                                       2.0 * step * older.value(w, n_ + i, SumKernel::slope()) +
                                       step / T * older.value(w, 2 * n_ + i, SumKernel::curvature()) + last
                                 : varies;
      out[at.motion(i)] = angles_ ? varies : length;
      out[at.length(i)] = length;
      for (Eigen::Index c = 0; c < coordinates_; ++c) {
        out[at.between(i, c)] = older.value(w, (3 + 2 * c) * n_ + i, SumKernel::kShape) +
                                step * older.value(w, (4 + 2 * c) * n_ + i, SumKernel::slope()) +
                                newest.value(w, p_ + (1 + c) * n_ + i, SumKernel::kShape);
      }
      for (Eigen::Index f = 0; f < functions_; ++f) {
        out[at.function(i, f)] = newest.value(w, p_ + (1 + coordinates_ + f) * n_ + i, SumKernel::kShape);
      }
    }
  }

 private:
  bool angles_;
  Eigen::Index n_, coordinates_, functions_, p_;
  std::vector<double> scales_;
  double h_ = 0.0, h1_ = 0.0;
  Eigen::ArrayXXd g_, g1_, g2_;     // of the newest element and the two before
  Eigen::ArrayXXd older_, newest_;  // of the element before the newest, and of the newest
  std::vector<std::pair<KernelSums, KernelSums>> sums_;
  core::RowMatrix Y_;
};

// Walks the log; calls element(instant, whether there is one) for each instant of the motion, earlier() for each
// element before it, and look(instant, time, state) for each look. False where the instants are not those of the
// motion.
template <typename Earlier, typename Element, typename Look>
bool walk_sums(LogSource& log, ScaleDetector& detector, const ReferenceMotion& motion, const SumDriveOptions& options,
               Earlier&& earlier, Element&& element, Look&& look) {
  std::size_t seen = 0, count = 0;
  double begun = 0.0;
  bool any = false, fits = true, over = false;
  core::for_each_sample(log, detector.elements().measurement().columns(), [&](const core::LogSample& sample) {
    over = over || count == motion.instants() || (any && !options.piece && sample.t - begun > options.most);
    if (over || !fits) {
      return;
    }
    begun = any ? begun : sample.t;
    any = true;
    if (sample.starts) {
      detector.restart();
      seen = 0;
    }
    detector.step(sample.t, sample.values);
    const std::size_t instants = detector.elements().instants();
    if (instants == 0 || instants == seen) {
      seen = instants;
      return;
    }
    seen = instants;
    if (options.piece && count == 0 &&
        (sample.row < *options.piece || detector.elements().instant() < motion.instant.front())) {
      if (instants > 1) {
        earlier();
      }
      return;
    }
    fits = count < motion.instants() && motion.instant[count] == detector.elements().instant();
    if (!fits) {
      return;
    }
    element(count, instants > 1);
    for (const SumState& state : detector.looks()) {
      look(count, sample.t, state);
    }
    ++count;
  });
  return fits && (over || count == motion.instants());
}

OnlineModel with_errors(const OnlineModel& model, const filter::SignalErrors& errors) {
  OnlineModel other = model;
  other.errors = errors;
  return other;
}

}  // namespace

std::optional<SumDrive> read_sum_drive(LogSource& log, const OnlineModel& model, const ReferenceMotion& motion,
                                       const SumDriveOptions& options) {
  check::that(model.at_risk.has_value(), "model", "one that was learnt at a stated risk");
  // Readings of one motion are two bounds apart: as read_reference() has it.
  filter::SignalErrors errors = model.errors;
  if (options.any_log && errors.between_samples) {
    errors.speed_sample *= 2.0;
    errors.joint_sample *= 2.0;
    errors.heading *= 2.0;
    errors.motion.effort *= 5.0;
    errors.output *= motion.effort_reach > 0 ? 3.0 : 1.0;
  }
  const OnlineModel any = with_errors(model, errors);
  ScaleDetectorOptions usual;
  usual.false_alarms *= torque_share(model);
  ScaleDetector detector(any, usual);
  ReadingErrors reading(detector);
  const RiskModel& risk = *model.at_risk;
  const ThresholdRule rule(Polytope(risk.facets, risk.box), model.estimate);
  const auto n = static_cast<Eigen::Index>(model.model.n()), p = static_cast<Eigen::Index>(model.model.p()),
             W = static_cast<Eigen::Index>(detector.weights().size()), K = static_cast<Eigen::Index>(motion.instants());
  SumDrive drive;
  drive.weights = detector.weights();
  drive.scales = detector.scales();
  const double share = usual.false_alarms / static_cast<double>(drive.weights.size() * drive.scales.size());
  drive.miss = risk.risk + share * *std::max_element(drive.scales.begin(), drive.scales.end()) / usual.checks;
  drive.n = model.model.motion.cwiseAbs().rowwise().sum() * risk.errors.motion.bound;
  drive.element.assign(motion.instants(), false);
  drive.step.assign(motion.instants(), 0.0);
  drive.way = drive.length = drive.step;
  drive.g = Eigen::MatrixXd::Zero(W * n, K);
  std::vector<double> rows, doubts;
  Eigen::RowVectorXd y(p), doubt(reading.errors());
  std::vector<double> direction(static_cast<std::size_t>(p)), opposite = direction;
  const bool fits = walk_sums(
      log, detector, motion, options, [&] { reading.take(detector); },
      [&](std::size_t k, bool element) {
        drive.instants = k + 1;
        if (!element) {
          return;
        }
        const filter::WeakElement& e = detector.elements().element();
        reading.take(detector);
        drive.element[k] = true;
        drive.step[k] = detector.elements().angles() ? e.before : e.step;
        drive.way[k] = (e.number > 1 && k > 0 ? drive.way[k - 1] : 0.0) + drive.step[k];
        drive.length[k] = e.length;
        drive.g.col(static_cast<Eigen::Index>(k)) = detector.element_weights().reshaped();
      },
      [&](std::size_t k, double t, const SumState& state) {
        reading.write(state.weight, state.scale, y, doubt);
        for (std::size_t q = 0; q < direction.size(); ++q) {
          direction[q] = y[static_cast<Eigen::Index>(q)];
        }
        const Interval range = rule.prediction(direction, state.weight);
        drive.looks.push_back({k, t, state.weight, state.scale, state.value, state.radius, range.width()});
        rows.insert(rows.end(), y.begin(), y.end());
        doubts.insert(doubts.end(), doubt.begin(), doubt.end());
      });
  if (!fits) {
    return std::nullopt;
  }
  const auto count = static_cast<Eigen::Index>(drive.looks.size());
  drive.y = Eigen::Map<const core::RowMatrix>(rows.data(), count, p);
  drive.reading = Eigen::Map<const core::RowMatrix>(doubts.data(), count, reading.errors());
  drive.growth.assign(drive.looks.size(), 0.0);
  drive.doubtful = drive.growth;
  if (!options.any_log || !errors.between_samples || !(motion.most_effort > 0.0)) {
    return drive;
  }
  // The same where efforts are larger.
  errors.motion.effort.array() += motion.most_effort;
  const OnlineModel wide = with_errors(model, errors);
  ScaleDetector wider(wide, usual);
  std::size_t look = 0;
  const bool known = walk_sums(
      log, wider, motion, options, [] {}, [](std::size_t, bool) {},
      [&](std::size_t k, double, const SumState& state) {
        if (look < drive.looks.size() && drive.looks[look].instant == k) {
          const double more = std::max(0.0, state.radius - drive.looks[look].radius);
          drive.growth[look] = more / motion.most_effort;
          drive.doubtful[look] = detector.elements().functions().empty() ? 0.0 : more;
        }
        ++look;
      });
  return known && look == drive.looks.size() ? std::optional(std::move(drive)) : std::nullopt;
}

FaultRow SumRow::row() const {
  const auto span = [](const Eigen::VectorXd& x) {
    return std::span<const double>(x.data(), static_cast<std::size_t>(x.size()));
  };
  return {.y = span(y),
          .g1 = span(g1),
          .g2 = span(g2),
          .s = span(s),
          .dY = span(none),
          .c = c,
          .dy = dy,
          .doubt = doubt,
          .range = span(range)};
}

namespace {

// What a step makes of the kernels of all scales.
struct Decays {
  std::vector<double> x, decay;  // of each scale
  double h = 0.0;

  void step_to(double next, const std::vector<double>& scales) {
    if (std::abs(next - h) > kSameStep * h) {
      h = next;
      x.resize(scales.size());
      decay.resize(scales.size());
      for (std::size_t j = 0; j < scales.size(); ++j) {
        x[j] = h / scales[j];
        decay[j] = std::exp(-x[j]);
      }
    }
  }
};

}  // namespace

// A fault that has set in: what the shared sums held before, or sums of its own. Neither where it was always there.
struct SumResponse::Active {
  std::size_t which = 0, first = 0;  // number of the onset; instant at which its first element ends
  double t = 0.0;
  std::vector<KernelSums> sums;
  std::optional<FaultElements> elements;
  Eigen::MatrixXd last;
  double added = 0.0;
};

SumResponse::SumResponse(FaultType fault, const OnlineModel& model, const ReferenceMotion& motion,
                         const SumDrive& drive)
    : fault_(std::move(fault)), model_(&model), motion_(&motion), drive_(&drive) {
  validate(fault_, model.model);
  const auto c = static_cast<Eigen::Index>(model.model.coordinates.size());
  n_ = static_cast<Eigen::Index>(model.model.n());
  p_ = static_cast<Eigen::Index>(model.model.p());
  W_ = static_cast<Eigen::Index>(drive.weights.size());
  exact_ = polynomial(fault_, model.model);
  stationary_ = fault_.profile.kind == FaultProfile::Kind::step;
  const bool sees = fault_.seen.size() > 0, gains = fault_.effort.size() > 0 || fault_.ground.size() > 0,
             moves = fault_.motion.size() > 0 || fault_.slip.size() > 0 || fault_.lateral != 0.0;
  const bool functions =
      std::ranges::any_of(model.model.terms, [](const Term& term) { return term.kind == Term::Kind::function; });
  constant_only_ = sees;
  const auto block = [&](bool there, Eigen::Index width) {
    const Eigen::Index first = there ? columns_ : -1;
    columns_ += there ? width : 0;
    return first;
  };
  g1_ = block(moves || gains, p_);
  g2_ = block(moves && (gains || functions), p_);
  s_ = block(sees, p_);
  c_ = block(fault_.theta.size() > 0 || fault_.offset.size() > 0, 1);
  range_ = block(motion.effort_reach > 0, 1);
  const auto size_or_zero = [](const Eigen::MatrixXd& matrix, Eigen::Index size) {
    return matrix.size() > 0 ? Eigen::MatrixXd(matrix.cwiseAbs()) : Eigen::MatrixXd::Zero(size, size);
  };
  motion_gain_ = size_or_zero(fault_.motion, c);
  seen_gain_ = size_or_zero(fault_.seen, c);
  effort_gain_ = size_or_zero(fault_.effort, n_) + size_or_zero(fault_.ground, n_);
  spread_ = model.model.input.cwiseAbs() * core::pseudo_inverse(model.model.input).cwiseAbs();
  most_kappa_ = std::max(std::abs(fault_.kappa(fault_.range.lower)), std::abs(fault_.kappa(fault_.range.upper)));
  largest_ = model.at_risk->box.magnitudes();
  signals_ = Eigen::MatrixXd::Zero(n_, columns_);
  q_ = Eigen::ArrayXXd::Zero(W_, columns_);
  shared_.assign(drive.scales.size(), KernelSums(W_, columns_));
}

// The newest element's signals; `last` is the signature at the end of the one before: g1, g2 and c.
void SumResponse::take(const FaultElements& elements, Eigen::Ref<Eigen::MatrixXd> last) {
  const FaultSignals &begin = elements.at_begin(), &end = elements.at_end();
  const std::array<double, 2>& shares = elements.shares();
  const double length = shares[0] + shares[1];
  signals_.setZero();
  Eigen::VectorXd effort = shares[0] * begin.c.cwiseAbs() + shares[1] * end.c.cwiseAbs();
  const auto fill = [&](Eigen::Index at, const core::RowMatrix& from, const core::RowMatrix& to, double times) {
    if (at >= 0) {
      signals_.middleCols(at, p_) = shares[0] * from + shares[1] * to;
      effort += times * (shares[0] * from.cwiseAbs() + shares[1] * to.cwiseAbs()) * largest_;
    }
  };
  fill(g1_, begin.g1, end.g1, 1.0);
  fill(g2_, begin.g2, end.g2, most_kappa_);
  fill(s_, begin.s, end.s, 1.0);
  if (c_ >= 0) {
    signals_.col(c_) = shares[0] * begin.c + shares[1] * end.c;
    signals_.col(0) = signals_.col(c_);
  }
  const Eigen::VectorXd& theta = model_->estimate;
  if (g1_ >= 0) {
    signals_.col(0) += signals_.middleCols(g1_, p_) * theta;
  }
  if (s_ >= 0) {
    signals_.col(0) -= signals_.middleCols(s_, p_) * theta;
  }
  if (g2_ >= 0) {
    signals_.col(1) = signals_.middleCols(g2_, p_) * theta;
  }
  added_ = effort.maxCoeff() / length;
  if (range_ >= 0) {
    const auto signature = [&](const FaultSignals& signals) {
      Eigen::MatrixXd all(n_, 2 * p_ + 1);
      all << signals.g1, signals.g2, signals.c;
      return all;
    };
    const Eigen::MatrixXd from = signature(begin), to = signature(end);
    const Eigen::MatrixXd change = spread_ * ((from - last).cwiseAbs() + (to - from).cwiseAbs());
    signals_.col(range_) =
        0.5 * static_cast<double>(motion_->effort_reach) * length *
        ((change.leftCols(p_) + most_kappa_ * change.middleCols(p_, p_)) * largest_ + change.col(2 * p_));
    last = to;
  }
}

// What the motion jumps by at the onset, beside the signals.
void SumResponse::add_jump(const FaultSignals& jump) {
  if (g1_ >= 0) {
    signals_.middleCols(g1_, p_) += jump.g1;
    signals_.col(0) += jump.g1 * model_->estimate;
  }
  if (s_ >= 0) {
    signals_.middleCols(s_, p_) += jump.s;
    signals_.col(0) -= jump.s * model_->estimate;
  }
}

void SumResponse::weigh(std::size_t instant) {
  const Eigen::Map<const Eigen::MatrixXd> g(drive_->g.col(static_cast<Eigen::Index>(instant)).data(), W_, n_);
  q_.matrix().noalias() = g * signals_;
  if (range_ >= 0) {
    q_.col(range_).matrix() = g.cwiseAbs() * signals_.col(range_);
  }
}

void SumResponse::walk(std::span<const std::size_t> onsets, double within,
                       const std::function<void(const At&)>& visit) {
  if (!exact_) {
    return;
  }
  const std::vector<double>& scales = drive_->scales;
  std::vector<Active> active;
  std::size_t next_onset = 0, next_look = 0;
  Decays decays;
  for (std::size_t s = 0; s < motion_->segment_starts.size(); ++s) {
    const std::size_t start = motion_->segment_starts[s], end = end_of(s);
    if (start >= end) {
      break;
    }
    active.clear();
    for (KernelSums& sums : shared_) {
      sums.reset();
    }
    FaultElements broken(fault_, model_->model, model_->filter.static_gain(), *motion_);
    Eigen::MatrixXd last = Eigen::MatrixXd::Zero(n_, 2 * p_ + 1);
    double added = 0.0;
    broken.begin_broken(start);
    for (std::size_t k = start + 1; k < end && broken.next(); ++k) {
      decays.step_to(drive_->step[k], scales);
      const auto add = [&](std::vector<KernelSums>& sums) {
        for (std::size_t j = 0; j < scales.size(); ++j) {
          sums[j].advance(decays.x[j], decays.decay[j]);
          sums[j].add(q_);
        }
      };
      if (stationary_) {
        take(broken, last);
        added = std::max(added, added_);
        weigh(k);
        add(shared_);
      } else {
        for (Active& each : active) {
          each.elements->next();
          take(*each.elements, each.last);
          each.added = std::max(each.added, added_);
          weigh(k);
          add(each.sums);
        }
      }
      while (next_onset < onsets.size() && onsets[next_onset] + 1 < k) {
        ++next_onset;
      }
      for (; next_onset < onsets.size() && onsets[next_onset] + 1 == k; ++next_onset) {
        Active fresh{next_onset, k, motion_->instant[k - 1], {}, {}, Eigen::MatrixXd::Zero(n_, 2 * p_ + 1), 0.0};
        fresh.elements.emplace(fault_, model_->model, model_->filter.static_gain(), *motion_);
        fresh.elements->begin(k - 1);
        fresh.elements->next();
        take(*fresh.elements, fresh.last);
        fresh.added = added_;
        const FaultSignals jump = fresh.elements->jump();
        // A speed jumps in the step that ends at the onset, an angle's slope at its sample.
        const bool before = motion_->kind == MotionKind::speed;
        if (!before) {
          add_jump(jump);
        }
        weigh(k);
        const double sign = stationary_ ? -1.0 : 1.0;
        if (stationary_) {
          fresh.sums = shared_;
          fresh.elements.reset();
        } else {
          fresh.sums.assign(scales.size(), KernelSums(W_, columns_));
        }
        for (KernelSums& sums : fresh.sums) {
          sums.add(sign * q_);
        }
        if (before) {
          signals_.setZero();
          add_jump(jump);
          weigh(k - 1);
          for (std::size_t j = 0; j < scales.size(); ++j) {
            fresh.sums[j].add(sign * q_, decays.x[j], decays.decay[j], columns_);
          }
        }
        active.push_back(std::move(fresh));
      }
      std::erase_if(active, [&](const Active& each) { return motion_->t[k] - each.t > within; });
      while (next_look < drive_->looks.size() && drive_->looks[next_look].instant < k) {
        ++next_look;
      }
      for (; next_look < drive_->looks.size() && drive_->looks[next_look].instant == k; ++next_look) {
        for (Active& each : active) {
          if (stationary_) {
            each.added = std::max(each.added, added);
          }
          visit_look(next_look, each, visit);
        }
      }
    }
  }
}

void SumResponse::walk_broken(const std::function<void(const At&)>& visit) {
  check::that(stationary_, "fault '" + fault_.name + "'", "one that is there in full from its onset on (a step)");
  if (!exact_) {
    return;
  }
  const std::vector<double>& scales = drive_->scales;
  std::size_t next_look = 0;
  Decays decays;
  for (std::size_t s = 0; s < motion_->segment_starts.size() && motion_->segment_starts[s] < end_of(s); ++s) {
    const std::size_t start = motion_->segment_starts[s], end = end_of(s);
    for (KernelSums& sums : shared_) {
      sums.reset();
    }
    FaultElements broken(fault_, model_->model, model_->filter.static_gain(), *motion_);
    broken.begin_broken(start);
    Active always{s, start + 1, motion_->instant[start], {}, {}, Eigen::MatrixXd::Zero(n_, 2 * p_ + 1), 0.0};
    for (std::size_t k = start + 1; k < end && broken.next(); ++k) {
      decays.step_to(drive_->step[k], scales);
      take(broken, always.last);
      always.added = std::max(always.added, added_);
      weigh(k);
      for (std::size_t j = 0; j < scales.size(); ++j) {
        shared_[j].advance(decays.x[j], decays.decay[j]);
        shared_[j].add(q_);
      }
      for (; next_look < drive_->looks.size() && drive_->looks[next_look].instant <= k; ++next_look) {
        if (drive_->looks[next_look].instant == k) {
          visit_look(next_look, always, visit);
        }
      }
    }
  }
}

std::size_t SumResponse::end_of(std::size_t segment) const {
  const std::vector<std::size_t>& starts = motion_->segment_starts;
  return std::min(drive_->instants, segment + 1 < starts.size() ? starts[segment + 1] : drive_->instants);
}

void SumResponse::visit_look(std::size_t which, const Active& active,
                             const std::function<void(const At&)>& visit) const {
  const SumLook& look = drive_->looks[which];
  if (constant_only_ && drive_->weights[look.weight].shape != SumWeight::Shape::constant) {
    return;
  }
  At at;
  at.onset = active.which;
  at.look = which;
  at.of_ = this;
  at.active_ = &active;
  const auto w = static_cast<Eigen::Index>(look.weight);
  at.once = value(at, w, 0);
  at.twice = g2_ >= 0 ? value(at, w, 1) : 0.0;
  visit(at);
}

double SumResponse::value(const At& at, Eigen::Index weight, Eigen::Index column) const {
  const Active& active = *static_cast<const Active*>(at.active_);
  const SumLook& look = drive_->looks[at.look];
  const KernelSums& sums = (stationary_ ? shared_ : active.sums)[look.scale];
  if (!stationary_ || active.sums.empty()) {
    return sums.value(weight, column, SumKernel::kShape);
  }
  const double x = (drive_->way[look.instant] - drive_->way[active.first]) / drive_->scales[look.scale];
  return x > kPast ? sums.value(weight, column, SumKernel::kShape)
                   : sums.since(weight, column, active.sums[look.scale], x, std::exp(-x));
}

SumRow SumResponse::row(const At& at) const {
  const SumLook& look = drive_->looks[at.look];
  const Active& active = *static_cast<const Active*>(at.active_);
  const auto w = static_cast<Eigen::Index>(look.weight), r = static_cast<Eigen::Index>(at.look);
  SumRow row;
  row.y = drive_->y.row(r);
  row.g1 = row.g2 = row.s = row.range = row.none = Eigen::VectorXd::Zero(p_);
  const auto fill = [&](Eigen::Index first, Eigen::VectorXd& to) {
    for (Eigen::Index q = 0; first >= 0 && q < p_; ++q) {
      to[q] = value(at, w, first + q);
    }
  };
  fill(g1_, row.g1);
  fill(g2_, row.g2);
  fill(s_, row.s);
  row.c = c_ >= 0 ? value(at, w, c_) : 0.0;
  row.dy = look.radius;
  // In what the sensors show and in what the threshold allows for.
  row.doubt = 2.0 * drive_->growth[at.look] * active.added;
  row.dy += active.added > 0.0 ? drive_->doubtful[at.look] : 0.0;
  if (range_ >= 0) {
    row.doubt += 2.0 * std::max(0.0, value(at, w, range_));
  }
  add_errors(at, row);
  return row;
}

// Errors of the signature, whose motion was read.
void SumResponse::add_errors(const At& at, SumRow& row) const {
  if (!motion_->measured) {
    return;
  }
  const SumLook& look = drive_->looks[at.look];
  const Active& active = *static_cast<const Active*>(at.active_);
  const Model& model = model_->model;
  const SumErrors part{n_, static_cast<Eigen::Index>(model.coordinates.size())};
  const auto reading = drive_->reading.row(static_cast<Eigen::Index>(at.look));
  const bool angles = motion_->kind != MotionKind::speed;
  const double T = drive_->scales[look.scale];
  const double x = std::min((drive_->way[look.instant] - drive_->way[active.first]) / T, kPast);
  const double decay = std::exp(-x), h = drive_->step[active.first];
  const bool pulse = fault_.profile.kind == FaultProfile::Kind::pulse;  // its end cuts once more, at another age
  const double kernel = pulse ? 2.0 : SumKernel::at(SumKernel::kShape, x, decay);
  const double slope = (pulse ? 4.0 : SumKernel::at(SumKernel::slope(), x, decay)) * std::exp(h / T) / T;
  // Of a profile that comes by and by.
  double rate = 0.0, kinks = 0.0, bends = 0.0;
  if (fault_.profile.kind == FaultProfile::Kind::ramp) {
    rate = 1.0 / fault_.profile.rise;
    kinks = 2.0 * rate;
  } else if (fault_.profile.kind == FaultProfile::Kind::bump) {
    const double fastest =
        motion_->joint_speed.row(static_cast<Eigen::Index>(fault_.profile.joint)).cwiseAbs().maxCoeff();
    rate = std::numbers::pi / fault_.profile.arc * fastest;
    bends = 2.0 * rate * rate;
  }
  struct Parts {
    double slope, jump, motion, length;
  };
  const Eigen::Map<const Eigen::MatrixXd> g(drive_->g.col(static_cast<Eigen::Index>(active.first)).data(), W_, n_);
  const Eigen::Map<const Eigen::MatrixXd> before(drive_->g.col(static_cast<Eigen::Index>(active.first - 1)).data(), W_,
                                                 n_);
  const auto w = static_cast<Eigen::Index>(look.weight);
  std::vector<Parts> outputs;
  for (Eigen::Index i = 0; i < n_; ++i) {
    const double size = std::abs(g(w, i)), change = std::abs(g(w, i) - before(w, i));
    const double bulk =
        reading[part.slope(i)] + (2.0 * rate + kinks) * reading[part.motion(i)] + bends * reading[part.length(i)];
    const double smooth = angles ? kernel * change / h + slope * size : kernel * size;
    outputs.push_back({bulk + smooth + (angles ? 2.0 * kernel * size / h : 0.0), bulk + smooth,
                       reading[part.motion(i)] + rate * reading[part.length(i)] + (angles ? kernel * size : 0.0),
                       reading[part.length(i)]});
  }
  const Eigen::VectorXd& n = drive_->n;
  const Eigen::VectorXd moved = motion_gain_ * n, seen = seen_gain_ * n;
  const Eigen::VectorXd sample = motion_->errors.speed_sample;
  const auto beyond = [&](const Eigen::MatrixXd& gain) {
    return (gain * sample).maxCoeff() + motion_->errors.heading * (1.0 + gain.maxCoeff());
  };
  const bool moves = fault_.motion.size() > 0 || fault_.slip.size() > 0, sees = fault_.seen.size() > 0;
  Eigen::Index function = 0;
  for (const Term& term : model.terms) {
    const auto o = static_cast<Eigen::Index>(term.output), j = static_cast<Eigen::Index>(term.parameter),
               c = static_cast<Eigen::Index>(term.coordinate);
    const double scale = std::abs(term.scale);
    // Of the term itself and of what the fault moves, summed with the weights of output i.
    const auto own = [&](Eigen::Index i) {
      const Parts& parts = outputs[static_cast<std::size_t>(i)];
      switch (term.kind) {
        case Term::Kind::acceleration: return scale * n[c] * parts.slope;
        case Term::Kind::speed: return scale * (n[c] * parts.motion + reading[part.between(i, c)]);
        case Term::Kind::function: return 2.0 * scale * reading[part.function(i, function)];
      }
      return 0.0;
    };
    const auto of_motion = [&](Eigen::Index i, const Eigen::MatrixXd& gain, const Eigen::VectorXd& by, bool there,
                               double lateral) {
      const Parts& parts = outputs[static_cast<std::size_t>(i)];
      switch (term.kind) {
        case Term::Kind::acceleration:
          return scale * (by[c] * parts.jump + (c == 0 && lateral > 0.0 ? lateral * n[1] * parts.motion : 0.0));
        case Term::Kind::speed: {
          double between = 0.0;
          for (Eigen::Index from = 0; from < gain.cols(); ++from) {
            between += gain(c, from) * reading[part.between(i, from)];
          }
          return scale * (by[c] * parts.motion + between);
        }
        case Term::Kind::function: return there ? scale * beyond(gain) * parts.length : 0.0;
      }
      return 0.0;
    };
    const double lateral = std::abs(fault_.lateral);
    row.range[j] += of_motion(o, motion_gain_, moved, moves, lateral) + of_motion(o, seen_gain_, seen, sees, 0.0);
    if (fault_.whole && sees && term.kind == Term::Kind::function) {
      row.range[j] += own(o);
    }
    for (Eigen::Index i = 0; i < n_; ++i) {
      if (effort_gain_(i, o) > 0.0) {
        row.range[j] += effort_gain_(i, o) * (own(i) + most_kappa_ * of_motion(i, motion_gain_, moved, moves, lateral));
      }
    }
    row.doubt += fault_.theta.size() > 0 ? std::abs(fault_.theta[j]) * own(o) : 0.0;
    function += term.kind == Term::Kind::function ? 1 : 0;
  }
}

}  // namespace wheelwright::detector
