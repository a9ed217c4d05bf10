// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/event_isolation.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace wheelwright {
namespace {

using Verdict = FaultFinding::Verdict;

constexpr double kMemory = 16.0;  // of the filter before the window, in units of 1/β

// Rows of a log with times in [from, to], of the segment that row `row` belongs to.
struct Piece {
  std::size_t row = 0;
  double from = 0.0, to = 0.0;
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

std::string names(const Isolation& isolation, Verdict verdict) {
  std::string out;
  for (const FaultFinding& f : isolation.findings) {
    if (f.verdict == verdict) {
      out += (out.empty() ? "" : ", ") + f.fault.name;
    }
  }
  return out;
}

}  // namespace

std::vector<Isolation> isolate_events(LogSource& log, const CommissionedModel& model, const Detection& detection,
                                      const EventIsolationOptions& options) {
  const RegressorFilter filter(model.model, model.filter, model.measurement, model.errors);
  std::vector<Piece> pieces;
  for (std::size_t k = 0; k < std::min(detection.events.size(), options.most_events); ++k) {
    const Event& event = detection.events[k];
    const double memory = (kMemory + model.filter.settle) / model.filter.beta;
    pieces.push_back({.row = event.start_sample,
                      .from = event.start - options.isolation.before - memory,
                      .to = event.alarm + options.isolation.after});
  }
  if (pieces.empty()) {
    return {};
  }
  gather(log, pieces);
  const Polytope set(model.facets, model.box);
  const std::vector<FaultType> faults = fault_catalogue(model.model, model.estimate, model.robot.effort);
  std::vector<Isolation> out;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    TableSource source(pieces[k].table);
    const ReferenceMotion motion = read_reference(source, filter);
    out.push_back(
        isolate(motion, filter, set, faults, detection.events[k].start, detection.events[k].alarm, options.isolation));
  }
  return out;
}

std::string sentence(const FaultFinding& finding) {
  const FaultType& fault = finding.fault;
  std::string text = fault.sentence.empty() ? fault.name : fault.sentence;
  if (finding.magnitude && finding.magnitude->lower <= fault.range.lower &&
      finding.magnitude->upper >= fault.range.upper) {
    text += " by any amount";
  } else if (finding.magnitude) {
    const bool share = fault.unit == "1";
    const double factor = share ? 100.0 : 1.0;
    // Outward, to three digits of the larger end.
    const double low = factor * finding.magnitude->lower, high = factor * finding.magnitude->upper;
    const double size = std::max({std::abs(low), std::abs(high), 1e-12});
    const int decimals = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 9);
    const double unit = std::pow(10.0, -decimals);
    text += fmt::format(" by {:.{}f} to {:.{}f} {}", std::floor(low / unit) * unit, decimals,
                        std::ceil(high / unit) * unit, decimals, share ? "%" : fault.unit);
  }
  text += fmt::format(", since {}{:.2f} to {:.2f} s", finding.earlier ? "before " : "",
                      std::floor(100.0 * finding.onset.lower) / 100.0, std::ceil(100.0 * finding.onset.upper) / 100.0);
  return text + (finding.complete ? "" : " (not narrowed down further)");
}

std::string sentence(const Isolation& isolation) {
  std::string text;
  for (const FaultFinding& finding : isolation.findings) {
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

}  // namespace wheelwright
