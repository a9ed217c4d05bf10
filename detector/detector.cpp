// SPDX-License-Identifier: Apache-2.0
#include "detector/detector.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kGapSteps = 5.0;  // as logs are split: a longer step is a gap

}  // namespace

bool follows(double before, double t, double nominal) noexcept {
  return t > before && !(nominal > 0.0 && t - before > kGapSteps * nominal);
}

bool is_whole(double t, std::span<const double> sample) noexcept {
  double sum = t - t;  // of zeros, unless one of them is none
  for (const double x : sample) {
    sum += x - x;
  }
  return sum == 0.0;
}

RowDetector::RowDetector(std::size_t outputs, ThresholdRule threshold, DetectorOptions options)
    : threshold_(std::move(threshold)), options_(std::move(options)) {
  if (options_.mu) {
    check::that(static_cast<std::size_t>(options_.mu->size()) == outputs && (options_.mu->array() >= 0.0).all(), "mu",
                "one value >= 0 for each output");
  }
  counters_.assign(outputs, PersistenceCounter(options_.persistence.value_or(Persistence{})));
  decision_.channels.resize(outputs);
}

void RowDetector::restart() {
  for (PersistenceCounter& counter : counters_) {
    counter.reset();
  }
}

const Decision& RowDetector::nothing() {
  decision_.valid = false;
  decision_.fault = false;
  return decision_;
}

const Decision& RowDetector::decide(const filter::FilteredRow& row) {
  decision_.valid = true;
  decision_.fault = false;
  const auto p = static_cast<std::size_t>(row.Y.cols());
  for (std::size_t i = 0; i < decision_.channels.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    ChannelDecision& c = decision_.channels[i];
    c.predicted = 0.0;
    for (Eigen::Index j = 0; j < row.Y.cols(); ++j) {  // in this order: an exported detector gives the same digits
      c.predicted += row.Y(at, j) * threshold_.estimate()[j];
    }
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

template class Detector<RegressorFilter>;
template class Detector<filter::OdometryFilter>;

}  // namespace wheelwright::detector
