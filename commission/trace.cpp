// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/trace.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

struct OutputBin {
  double torque = 0.0, predicted = 0.0, low = 0.0, high = 0.0, lower = 0.0, upper = 0.0, use = -1.0;

  void absorb(const OutputBin& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
    if (other.use > use) {
      lower = other.lower;
      upper = other.upper;
      use = other.use;
      torque = other.torque;
      predicted = other.predicted;
    }
  }
};

struct Bin {
  double first = 0.0, last = 0.0;
  bool starts = false;
  std::vector<OutputBin> outputs;

  void absorb(const Bin& other) {
    last = other.last;
    starts = starts || other.starts;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      outputs[i].absorb(other.outputs[i]);
    }
  }
};

double use_of(const ChannelDecision& c) {
  const double half = 0.5 * c.threshold.width();
  return half > 0.0 ? std::abs(c.residual - 0.5 * (c.threshold.lower + c.threshold.upper)) / half : 0.0;
}

// Equal numbers of instants in every bin; when the bins are full, neighbours are joined.
class Binner {
 public:
  Binner(std::size_t outputs, std::size_t most) : most_(std::max<std::size_t>(most, 16)), outputs_(outputs) {}

  void add(double t, bool starts, const Decision& decision) {
    Bin bin{t, t, starts, std::vector<OutputBin>(outputs_)};
    for (std::size_t i = 0; i < outputs_; ++i) {
      const ChannelDecision& c = decision.channels[i];
      bin.outputs[i] = {c.predicted + c.residual, c.predicted,       c.residual, c.residual,
                        c.threshold.lower,        c.threshold.upper, use_of(c)};
    }
    if (in_last_ == 0 || in_last_ == length_) {
      if (bins_.size() == most_) {
        halve();
      }
    }
    if (in_last_ == 0 || in_last_ >= length_) {
      bins_.push_back(std::move(bin));
      in_last_ = 1;
    } else {
      bins_.back().absorb(bin);
      ++in_last_;
    }
  }

  [[nodiscard]] Trace trace() const {
    Trace trace;
    trace.outputs.resize(outputs_);
    for (const Bin& bin : bins_) {
      if (bin.starts && !trace.t.empty()) {
        trace.breaks.push_back(trace.t.size());
      }
      trace.t.push_back(0.5 * (bin.first + bin.last));
      for (std::size_t i = 0; i < outputs_; ++i) {
        const OutputBin& from = bin.outputs[i];
        OutputTrace& to = trace.outputs[i];
        to.torque.push_back(from.torque);
        to.predicted.push_back(from.predicted);
        to.residual_low.push_back(from.low);
        to.residual_high.push_back(from.high);
        to.lower.push_back(from.lower);
        to.upper.push_back(from.upper);
      }
    }
    return trace;
  }

 private:
  void halve() {
    for (std::size_t k = 0; 2 * k < bins_.size(); ++k) {
      Bin joined = std::move(bins_[2 * k]);
      if (2 * k + 1 < bins_.size()) {
        joined.absorb(bins_[2 * k + 1]);
      }
      bins_[k] = std::move(joined);
    }
    in_last_ = bins_.size() % 2 == 1 ? length_ : 2 * length_;
    bins_.resize((bins_.size() + 1) / 2);
    length_ *= 2;
  }

  std::size_t most_;
  std::size_t outputs_;
  std::size_t length_ = 1;
  std::size_t in_last_ = 0;
  std::vector<Bin> bins_;
};

// Walks the log through a detector of either residual, with `n` outputs.
template <typename AnyDetector>
Detection walk(LogSource& log, AnyDetector& detector, std::size_t n, const DetectionOptions& options) {
  std::vector<std::size_t> pick;
  for (const auto& name : detector.filter().measurement().columns()) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "', which the model was commissioned on");
    pick.push_back(*column);
  }
  Detection d;
  d.outside.assign(n, 0);
  d.utilisation.assign(n, 0.0);
  d.nrmse.assign(n, 0.0);
  std::vector<double> torque_square(n), residual_square(n), sample(pick.size());
  EventRecorder recorder(n, options.merge);
  Binner binner(n, options.most_points);
  log.rewind();
  LogBlock block;
  double before = 0.0;
  bool new_segment = true;
  while (log.next(block)) {
    d.rows += block.rows();
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      if (segment < block.segment_starts.size() && block.segment_starts[segment] == k) {
        ++segment;
        detector.restart();
        new_segment = true;
      }
      for (std::size_t c = 0; c < pick.size(); ++c) {
        sample[c] = block.columns[pick[c]][k];
      }
      const double t = block.t[k];
      const Decision& decision = detector.step(t, sample);
      if (!decision.valid) {
        continue;
      }
      ++d.instants;
      d.seconds += new_segment ? 0.0 : std::max(0.0, t - before);
      before = t;
      binner.add(t, new_segment, decision);
      new_segment = false;
      for (std::size_t i = 0; i < n; ++i) {
        const ChannelDecision& c = decision.channels[i];
        d.outside[i] += c.outside ? 1 : 0;
        d.utilisation[i] = std::max(d.utilisation[i], use_of(c));
        const double torque = c.predicted + c.residual;
        torque_square[i] += torque * torque;
        residual_square[i] += c.residual * c.residual;
        recorder.add(i, block.first_row + k, t, c.residual, c.threshold.lower, c.threshold.upper, c.outside, c.alarm);
      }
    }
  }
  log.rewind();
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
