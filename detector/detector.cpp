// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/detector.hpp>

#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

constexpr double kGapSteps = 5.0;  // as logs are split: a longer step is a gap

}  // namespace

Detector::Detector(RegressorFilter filter, ThresholdRule threshold, DetectorOptions options)
    : filter_(std::move(filter)), threshold_(std::move(threshold)), options_(std::move(options)) {
  const std::size_t n = filter_.model().n();
  check::that(threshold_.set().dimension() == filter_.model().p(), "feasible set",
              "as many parameters as the filter's model has");
  if (options_.mu) {
    check::that(static_cast<std::size_t>(options_.mu->size()) == n && (options_.mu->array() >= 0.0).all(), "mu",
                "one value >= 0 for each output");
  }
  counters_.assign(n, PersistenceCounter(options_.persistence.value_or(Persistence{})));
  decision_.channels.resize(n);
}

void Detector::restart() {
  started_ = false;
  filter_.restart();
  for (PersistenceCounter& counter : counters_) {
    counter.reset();
  }
}

const Decision& Detector::step(double t, std::span<const double> sample) {
  const double nominal = filter_.measurement().nominal_step;
  if (started_ && (!(t > t_) || (nominal > 0.0 && t - t_ > kGapSteps * nominal))) {
    restart();
  }
  started_ = true;
  t_ = t;
  if (!filter_.step(t, sample)) {
    decision_.valid = false;
    decision_.fault = false;
    return decision_;
  }
  return decide(filter_.row());
}

const Decision& Detector::decide(const FilteredRow& row) {
  decision_.valid = true;
  decision_.fault = false;
  const auto p = static_cast<std::size_t>(row.Y.cols());
  for (std::size_t i = 0; i < decision_.channels.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    ChannelDecision& c = decision_.channels[i];
    c.predicted = row.Y.row(at).dot(threshold_.estimate());
    c.residual = row.y[at] - c.predicted;
    if (options_.mu) {
      c.threshold = {-(*options_.mu)[at], (*options_.mu)[at]};
    } else {
      c.threshold = threshold_.at({row.Y.row(at).data(), p}, {row.dY.row(at).data(), p}, row.dy[at], i);
    }
    c.dead_zone = options_.test == Test::two_sided ? dead_zone(c.residual, c.threshold.lower, c.threshold.upper)
                                                   : dead_zone(c.residual, c.threshold.rho());
    c.outside = options_.test == Test::two_sided ? c.residual < c.threshold.lower || c.residual > c.threshold.upper
                                                 : c.dead_zone > 0.0;
    c.alarm = counters_[i].step(c.outside);
    decision_.fault = decision_.fault || c.alarm;
  }
  return decision_;
}

}  // namespace wheelwright
