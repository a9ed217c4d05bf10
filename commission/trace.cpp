// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/trace.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <wheelwright/commission/detector_walk.hpp>

namespace wheelwright {
namespace {

double use_of(double residual, double lower, double upper) {
  const double half = 0.5 * (upper - lower);
  return half > 0.0 ? std::abs(residual - 0.5 * (lower + upper)) / half : 0.0;
}

// Calls `change` with every column of a trace.
template <typename Change>
void for_each_column(OutputTrace& o, const Change& change) {
  for (std::vector<double>* column : {&o.torque, &o.predicted, &o.residual_low, &o.residual_high, &o.lower, &o.upper}) {
    change(*column);
  }
}

// Equal numbers of instants in every bin; when the bins are full, neighbours are joined. A bin shows effort and threshold
// of its instant that is nearest to the threshold.
class Binner {
 public:
  Binner(std::size_t outputs, std::size_t most) : most_(std::max<std::size_t>(most, 16)) {
    trace_.outputs.resize(outputs);
  }

  void add(double t, bool starts, const Decision& decision) {
    if (in_last_ == length_ && last_.size() == most_) {
      halve();
    }
    trace_.t.push_back(t);
    last_.push_back(t);
    starts_.push_back(starts);
    for (std::size_t i = 0; i < trace_.outputs.size(); ++i) {
      const ChannelDecision& c = decision.channels[i];
      OutputTrace& o = trace_.outputs[i];
      o.torque.push_back(c.predicted + c.residual);
      o.predicted.push_back(c.predicted);
      o.residual_low.push_back(c.residual);
      o.residual_high.push_back(c.residual);
      o.lower.push_back(c.threshold.lower);
      o.upper.push_back(c.threshold.upper);
    }
    if (in_last_ == 0 || in_last_ == length_) {
      in_last_ = 1;
    } else {
      join(last_.size() - 2, last_.size() - 1);
      resize(last_.size() - 1);
      ++in_last_;
    }
  }

  Trace trace() {
    for (std::size_t k = 0; k < last_.size(); ++k) {
      if (k > 0 && starts_[k]) {
        trace_.breaks.push_back(k);
      }
      trace_.t[k] = 0.5 * (trace_.t[k] + last_[k]);
    }
    return std::move(trace_);
  }

 private:
  // Joins bin `from` to bin `to`, which lies before it.
  void join(std::size_t to, std::size_t from) {
    last_[to] = last_[from];
    starts_[to] = starts_[to] || starts_[from];
    for (OutputTrace& o : trace_.outputs) {
      const auto use = [&o](std::size_t k) { return use_of(o.torque[k] - o.predicted[k], o.lower[k], o.upper[k]); };
      o.residual_low[to] = std::min(o.residual_low[to], o.residual_low[from]);
      o.residual_high[to] = std::max(o.residual_high[to], o.residual_high[from]);
      if (use(from) > use(to)) {
        for (std::vector<double>* column : {&o.torque, &o.predicted, &o.lower, &o.upper}) {
          (*column)[to] = (*column)[from];
        }
      }
    }
  }

  void halve() {
    for (std::size_t k = 0; 2 * k < last_.size(); ++k) {
      trace_.t[k] = trace_.t[2 * k];
      last_[k] = last_[2 * k];
      starts_[k] = starts_[2 * k];
      for (OutputTrace& o : trace_.outputs) {
        for_each_column(o, [k](std::vector<double>& column) { column[k] = column[2 * k]; });
      }
      if (2 * k + 1 < last_.size()) {
        join(k, 2 * k + 1);
      }
    }
    in_last_ = last_.size() % 2 == 1 ? length_ : 2 * length_;
    resize((last_.size() + 1) / 2);
    length_ *= 2;
  }

  void resize(std::size_t bins) {
    trace_.t.resize(bins);
    last_.resize(bins);
    starts_.resize(bins);
    for (OutputTrace& o : trace_.outputs) {
      for_each_column(o, [bins](std::vector<double>& column) { column.resize(bins); });
    }
  }

  std::size_t most_;
  std::size_t length_ = 1;
  std::size_t in_last_ = 0;
  Trace trace_;  // t: of the first instant of each bin
  std::vector<double> last_;
  std::vector<bool> starts_;
};

// Walks the log through a detector of either residual, with `n` outputs.
template <typename AnyDetector>
Detection walk(LogSource& log, AnyDetector& detector, std::size_t n, const DetectionOptions& options) {
  Detection d;
  d.outside.assign(n, 0);
  d.utilisation.assign(n, 0.0);
  d.nrmse.assign(n, 0.0);
  std::vector<double> torque_square(n), residual_square(n);
  EventRecorder recorder(n, options.merge);
  Binner binner(n, options.most_points);
  double before = 0.0;
  d.rows = walk_detector(log, detector, [&](std::size_t row, double t, bool first, const Decision& decision) {
    ++d.instants;
    d.seconds += first ? 0.0 : std::max(0.0, t - before);
    before = t;
    binner.add(t, first, decision);
    for (std::size_t i = 0; i < n; ++i) {
      const ChannelDecision& c = decision.channels[i];
      d.outside[i] += c.outside ? 1 : 0;
      d.utilisation[i] = std::max(d.utilisation[i], use_of(c.residual, c.threshold.lower, c.threshold.upper));
      const double torque = c.predicted + c.residual;
      torque_square[i] += torque * torque;
      residual_square[i] += c.residual * c.residual;
      recorder.add(i, row, t, c.residual, c.threshold.lower, c.threshold.upper, c.outside, c.alarm);
    }
  });
  for (std::size_t i = 0; i < n; ++i) {
    d.nrmse[i] = torque_square[i] > 0.0 ? std::sqrt(residual_square[i] / torque_square[i]) : 0.0;
  }
  d.events = recorder.events();
  d.trace = binner.trace();
  return d;
}

}  // namespace

Detection detect(LogSource& log, Detector detector, const DetectionOptions& options) {
  return walk(log, detector, detector.filter().model().n(), options);
}

Detection detect(LogSource& log, KinematicDetector detector, const DetectionOptions& options) {
  return walk(log, detector, static_cast<std::size_t>(detector.filter().row().y.size()), options);
}

}  // namespace wheelwright
