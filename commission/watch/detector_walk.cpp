// SPDX-License-Identifier: Apache-2.0
#include "commission/watch/detector_walk.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "commission/watch/blind_watch.hpp"
#include "detector/faults/odometry_isolation.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "detector/online_model.hpp"

namespace wheelwright::commission {
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

// Equal numbers of instants in every bin; when the bins are full, neighbours are joined. A bin shows effort and
// threshold of its instant that is nearest to the threshold.
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
      const detector::ChannelDecision& c = decision.channels[i];
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

}  // namespace

template <filter::RowFilter Filter>
Detection detect(LogSource& log, Detector<Filter> detector, const DetectionOptions& options) {
  const std::size_t n = detector.filter().outputs();
  Detection d;
  d.residual = detector.options().residual;
  d.outside.assign(n, 0);
  d.utilisation.assign(n, 0.0);
  d.nrmse.assign(n, 0.0);
  std::vector<double> torque_square(n), residual_square(n);
  detector::EventRecorder recorder(n, options.merge);
  Binner binner(n, options.most_points);
  double before = 0.0;
  d.rows = walk_detector(log, detector, [&](std::size_t row, double t, bool first, const Decision& decision) {
    ++d.instants;
    d.seconds += first ? 0.0 : std::max(0.0, t - before);
    before = t;
    binner.add(t, first, decision);
    for (std::size_t i = 0; i < n; ++i) {
      const detector::ChannelDecision& c = decision.channels[i];
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

template Detection detect(LogSource& log, TorqueDetector detector, const DetectionOptions& options);
template Detection detect(LogSource& log, detector::KinematicDetector detector, const DetectionOptions& options);

namespace {

// Rows that the filter settles in, once.
double settling_rows(const OnlineModel& model, double step) { return model.filter.settle / (model.filter.beta * step); }

}  // namespace

Watched how_watched(const Detection& detection, const OnlineModel& model, double step, std::size_t met) {
  if (detection.instants == 0) {
    return Watched::nothing;
  }
  if (hardly_goes_on(step, model.measurement.nominal_step)) {
    return Watched::no_time;
  }
  const double decided = static_cast<double>(detection.instants) + settling_rows(model, step);
  return decided < 0.5 * static_cast<double>(met) ? Watched::little : Watched::enough;
}

double undecided_share(const Detection& detection, const OnlineModel& model, double step, std::size_t met) {
  constexpr double kWorthAWord = 0.05;
  const auto rows = static_cast<double>(met);
  const double undecided = rows - static_cast<double>(detection.instants);
  return undecided - settling_rows(model, step) > kWorthAWord * rows ? undecided / rows : 0.0;
}

namespace {

using Verdict = detector::FaultFinding::Verdict;

constexpr double kMemory = 16.0;  // of the filter before the window, in units of 1/β

// Rows of a log with times in [from, to], of the segment that row `row` belongs to.
struct Piece {
  std::size_t row = 0;
  double from = 0.0, to = 0.0;
  std::size_t first = 0;  // row
  LogTable table{};
  bool closed = false;
};

void gather(LogSource& log, std::vector<Piece>& pieces) {
  for (Piece& piece : pieces) {
    piece.table.names = log.columns();
    piece.table.columns.resize(log.columns().size());
  }
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    for (Piece& piece : pieces) {
      LogTable& table = piece.table;
      for (std::size_t k = 0; k < block.rows() && !piece.closed; ++k) {
        if (std::binary_search(block.segment_starts.begin(), block.segment_starts.end(), k)) {
          piece.closed = block.first_row + k > piece.row;
          if (!piece.closed) {
            table.t.clear();
            for (auto& column : table.columns) {
              column.clear();
            }
          }
        }
        if (!piece.closed && block.t[k] >= piece.from && block.t[k] <= piece.to) {
          piece.first = table.t.empty() ? block.first_row + k : piece.first;
          table.t.push_back(block.t[k]);
          for (std::size_t c = 0; c < table.columns.size(); ++c) {
            table.columns[c].push_back(block.columns[c][k]);
          }
        }
      }
    }
  }
  log.rewind();
}

std::string names(const detector::Isolation& isolation, Verdict verdict) {
  std::string out;
  for (const detector::FaultFinding& f : isolation.findings) {
    if (f.verdict == verdict) {
      out += (out.empty() ? "" : ", ") + f.fault.name;
    }
  }
  return out;
}

}  // namespace

std::string size_words(const Interval& magnitude, const model::FaultType& fault) {
  const bool share = fault.unit == "1";
  const double factor = share ? 100.0 : 1.0;
  const double low = factor * magnitude.lower, high = factor * magnitude.upper;
  const double size = std::max({std::abs(low), std::abs(high), 1e-12});
  const int decimals = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 9);
  const double unit = std::pow(10.0, -decimals);
  return fmt::format(" by {:.{}f} to {:.{}f} {}", std::floor(low / unit) * unit, decimals,
                     std::ceil(high / unit) * unit, decimals, share ? "%" : fault.unit);
}

double isolation_memory(const OnlineModel& model) {
  const double torque = (kMemory + model.filter.settle) / model.filter.beta;
  return model.kinematic ? std::max(torque, 2.0 * model.kinematic->window) : torque;
}

namespace {

bool has_columns(const LogSource& log, const std::vector<std::string>& names) {
  return std::ranges::all_of(names, [&](const std::string& name) { return log.find(name).has_value(); });
}

using Faults = std::vector<FaultType>;

// `findings` on some of `faults`, with the others not examined.
detector::Isolation findings_on(const Faults& faults, const detector::Isolation& findings) {
  detector::Isolation out;
  out.window = findings.window;
  out.findings.resize(faults.size());
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const auto at = std::ranges::find(findings.findings, faults[k].name,
                                      [](const detector::FaultFinding& finding) { return finding.fault.name; });
    if (at != findings.findings.end()) {
      out.findings[k] = *at;
    } else {
      out.findings[k].fault = faults[k];
    }
  }
  return out;
}

// Those of `faults` that `isolation`, of the same faults, does not exclude, if they are `wanted`.
template <typename Wanted>
Faults not_excluded(const detector::Isolation& isolation, const Wanted& wanted) {
  Faults out;
  for (const detector::FaultFinding& finding : isolation.findings) {
    if (finding.verdict != Verdict::excluded && wanted(finding.fault)) {
      out.push_back(finding.fault);
    }
  }
  return out;
}

// By both residuals. The one that shows something is asked first, since it excludes most, the other about what is left.
// What a fault that is not `wanted` is said to be is not looked at.
detector::Isolation isolate_piece(LogSource& piece, const OnlineModel& model, const RegressorFilter& filter,
                                  const Polytope& set, const Faults& faults, const std::vector<std::string>& only,
                                  const detector::Event& event, const detector::IsolationOptions& options) {
  const detector::ReferenceMotion motion = detector::read_reference(piece, filter);
  const auto wanted = [&](const FaultType& fault) { return only.empty() || std::ranges::count(only, fault.name) > 0; };
  Faults asked;
  std::ranges::copy_if(faults, std::back_inserter(asked), wanted);
  const auto by_torque = [&](const Faults& some) {
    const bool covered = motion.instants() > 0 && motion.t.back() >= event.alarm;
    return findings_on(faults, covered ? detector::isolate(motion, filter, set, some, event.start, event.alarm, options)
                                       : detector::Isolation{});
  };
  if (!model.kinematic || !has_columns(piece, model.kinematic->measurement.columns())) {
    return by_torque(asked);
  }
  const detector::KinematicModel& kinematic = *model.kinematic;
  const detector::OdometryReference reference =
      detector::read_odometry(piece, detector::make_filter(kinematic), model.model);
  const Polytope lengths(kinematic.facets, kinematic.box);
  const auto by_odometry = [&](const Faults& some) {
    return findings_on(
        faults, detector::isolate_by_odometry(reference, model.model, kinematic.measurement, kinematic.errors,
                                              kinematic.window, lengths, some, event.start, event.alarm, options));
  };
  const auto shows = [](const FaultType& fault) { return detector::shows_in_odometry(fault); };
  Faults hidden, moving;
  for (const FaultType& fault : faults) {
    if (!shows(fault)) {
      hidden.push_back(fault);
    } else if (wanted(fault)) {
      moving.push_back(fault);
    }
  }
  const double slack = model.measurement.nominal_step + kinematic.measurement.nominal_step;
  detector::Isolation out = by_odometry(hidden);
  if (out.count(Verdict::excluded) > 0) {
    detector::narrow_by(out, by_odometry(moving), slack);
    const Faults left = not_excluded(out, wanted);
    detector::Isolation torque = by_torque(left);
    detector::narrow_by(torque, out, slack);
    return torque;
  }
  detector::Isolation torque = by_torque(asked);
  detector::narrow_by(torque, out, slack);
  detector::narrow_by(
      torque, by_odometry(not_excluded(torque, [&](const FaultType& fault) { return shows(fault) && wanted(fault); })),
      slack);
  return torque;
}

}  // namespace

std::vector<detector::Isolation> isolate_events(LogSource& log, const OnlineModel& model,
                                                std::span<const detector::Event> events,
                                                const EventIsolationOptions& options) {
  const RegressorFilter filter(model.model, model.filter, model.measurement, model.errors);
  std::vector<Piece> pieces;
  for (const detector::Event& event : events) {
    const double memory = isolation_memory(model);
    pieces.push_back({.row = event.start_sample,
                      .from = event.start - options.isolation.before - memory,
                      .to = event.alarm + options.isolation.after});
  }
  if (pieces.empty()) {
    return {};
  }
  std::vector<Piece> longer;
  if (model.at_risk) {
    longer = pieces;
    for (Piece& piece : longer) {
      piece.to += std::max(0.0, options.sums.after - options.isolation.after);
    }
    gather(log, longer);
  }
  gather(log, pieces);
  const Polytope set(model.facets, model.box);
  const std::vector<FaultType> faults = model::fault_catalogue(model.model, model.estimate, model.robot.effort);
  std::vector<detector::Isolation> out;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    TableSource source(pieces[k].table);
    out.push_back(isolate_piece(source, model, filter, set, faults, options.only, events[k], options.isolation));
    for (detector::FaultFinding& finding : out.back().findings) {
      if (!options.only.empty() && std::ranges::count(options.only, finding.fault.name) == 0) {
        finding.verdict = Verdict::not_examined;
      }
    }
    const bool dated = std::ranges::any_of(out.back().findings, [](const detector::FaultFinding& finding) {
      return finding.verdict == Verdict::consistent && !finding.earlier;
    });
    if (!model.at_risk || !dated) {  // sums narrow nothing else
      continue;
    }
    TableSource around(longer[k].table);
    const detector::ReferenceMotion seen = detector::read_reference(around, filter);
    if (const auto drive = detector::read_sum_drive(log, model, seen, {.any_log = false, .piece = longer[k].first})) {
      detector::SumIsolationOptions sums = options.sums;
      sums.threads = options.isolation.threads;
      detector::narrow_by_sums(out.back(), *drive, model, seen, events[k].alarm, sums);
    }
  }
  return out;
}

std::vector<detector::Isolation> isolate_events(LogSource& log, const OnlineModel& model, const Detection& detection,
                                                const EventIsolationOptions& options) {
  const std::size_t count = std::min(detection.events.size(), options.most_events);
  return isolate_events(log, model, std::span(detection.events.data(), count), options);
}

std::string sentence(const detector::FaultFinding& finding) {
  const FaultType& fault = finding.fault;
  std::string text = fault.sentence.empty() ? fault.name : fault.sentence;
  if (finding.magnitude && finding.magnitude->lower <= fault.range.lower &&
      finding.magnitude->upper >= fault.range.upper) {
    text += " by any amount";
  } else if (finding.magnitude) {
    text += size_words(*finding.magnitude, fault);
  }
  text += fmt::format(", since {}{:.2f} to {:.2f} s", finding.earlier ? "before " : "",
                      std::floor(100.0 * finding.onset.lower) / 100.0, std::ceil(100.0 * finding.onset.upper) / 100.0);
  text += finding.complete ? "" : " (not narrowed down further)";
  if (finding.at_risk && finding.at_risk->excluded) {
    text += ", excluded at the stated risk";
  } else if (finding.at_risk && finding.at_risk->magnitude) {
    text += ", at the stated risk" + size_words(*finding.at_risk->magnitude, fault);
  }
  // What is there or not, and a drift with its own rise, are what they are said to be.
  return text + (fault.whole || !fault.profile.jumps() ? "" : ", if it was a step that stays");
}

std::string sentence(const detector::Isolation& isolation) {
  std::string text;
  for (const detector::FaultFinding& finding : isolation.findings) {
    if (finding.verdict == Verdict::consistent) {
      text += (text.empty() ? "consistent with: " : "; ") + sentence(finding);
    }
  }
  const std::string open = names(isolation, Verdict::not_examined), excluded = names(isolation, Verdict::excluded);
  if (text.empty()) {
    text = open.empty() ? "nothing in the catalogue explains it"
                        : "nothing in the catalogue that was examined explains it";
  }
  return text + (excluded.empty() ? "" : ". Excluded: " + excluded) + (open.empty() ? "" : ". Not examined: " + open) +
         ".";
}

OnlineModel with_kinematic_outputs(const OnlineModel& model) {
  OnlineModel view = model;
  view.robot.effort = model::EffortKind::torque;  // units are those of the pose
  view.model = model.kinematic ? detector::kinematic_outputs(*model.kinematic) : Model{};
  view.persistence = model.kinematic ? model.kinematic->persistence : model.persistence;
  view.warrant = model.kinematic ? model.kinematic->warrant : model.warrant;
  view.constant = model.kinematic ? model.kinematic->constant : std::nullopt;
  return view;
}

KinematicWatch watch_kinematics(LogSource& log, const OnlineModel& model, const detector::DetectorOptions& options,
                                const DetectionOptions& detection) {
  if (!model.kinematic) {
    return {std::nullopt, "the log that the model was commissioned on had neither a usable pose nor a gyro"};
  }
  std::string missing;
  for (const std::string& name : model.kinematic->measurement.columns()) {
    if (!log.find(name)) {
      missing += (missing.empty() ? "" : ", ") + name;
    }
  }
  if (!missing.empty()) {
    return {std::nullopt, "the log has no " + missing};
  }
  if (options.residual == detector::Residual::d2 && !model.kinematic->constant) {
    return {std::nullopt, "the model has no constant thresholds of it"};
  }
  return {detect(log, make_detector(*model.kinematic, options), detection), {}};
}

}  // namespace wheelwright::commission
