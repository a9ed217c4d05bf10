// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/isolation_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "bounds/certificate.hpp"
#include "bounds/linear_program.hpp"
#include "bounds/slab_rows.hpp"
#include "core/check.hpp"

namespace wheelwright::detector {

using bounds::HalfSpace;

namespace {

constexpr double kNarrower = 0.9;       // a turn that leaves more than this of an interval is the last
constexpr double kRowRounding = 1e-12;  // of a row's coefficients, relative to all that is added in it
constexpr double kForgotten = 1e-3;     // of a row's error: less than this of what an onset left is counted as error
constexpr int kTurns = 12;              // of narrowing
constexpr int kHalvings = 24;           // of an interval of sizes
constexpr std::size_t kLeft = 3;        // parts of what is left of an onset, for each output

// One fault: intervals of onsets and sizes, cut until they are consistent or excluded.
class Search {
 public:
  Search(const IsolationSetting& setting, HypothesisRows& rows, bool free_offset, double largest_offset,
         FaultFinding& finding)
      : in_(setting),
        rows_(&rows),
        finding_(finding),
        fault_(finding.fault),
        n_(setting.motion.rows.outputs),
        p_(static_cast<Eigen::Index>(setting.set.dimension())),
        variables_(p_ + 1 + static_cast<Eigen::Index>(rows.leaves() ? kLeft * n_ : 0)),
        free_offset_(free_offset),
        largest_offset_(largest_offset) {}

  void run() {
    const IsolationWindow& w = in_.window;
    const std::size_t last = std::min(w.outside, w.end - 3);
    const Interval all = sizes();
    // Before the window: what it left in the filter is that of onsets in the time before, as far as it is remembered.
    if (w.begin > w.first && !w.from_start) {
      if (const auto kappa = explore_sizes(w.first, w.begin, all)) {
        finding_.earlier = true;
        take(w.begin, w.begin, *kappa);
      }
    }
    const std::size_t from = w.begin, cells = 8;
    std::vector<std::pair<std::size_t, std::size_t>> coarse;
    for (std::size_t k = 0; k < cells; ++k) {
      const std::size_t a = from + k * (last + 1 - from) / cells, b = from + (k + 1) * (last + 1 - from) / cells;
      if (b > a) {
        coarse.emplace_back(a, b);
      }
    }
    // From both ends inward: what lies within what was found already need not be looked at.
    for (std::size_t k = 0; k < coarse.size(); ++k) {
      const auto& [a, b] = coarse[k % 2 == 0 ? k / 2 : coarse.size() - 1 - k / 2];
      explore(a, b, all);
    }
    finding_.programs = programs_;
    if (!found_) {
      finding_.verdict = FaultFinding::Verdict::excluded;
      return;
    }
    finding_.verdict = FaultFinding::Verdict::consistent;
    // What was there when the segment began may have been there before.
    finding_.earlier = finding_.earlier || (w.from_start && first_ == w.begin);
    finding_.onset = {in_.motion.instant[first_ > in_.window.first ? first_ - 1 : first_], in_.motion.instant[last_]};
    if (!fault_.whole) {
      const auto size = [&](double kappa) {
        return fault_.magnitude(rows_->encoder() ? kappa / (1.0 - kappa) : kappa);
      };
      finding_.magnitude = Interval{size(kappa_.lower), size(kappa_.upper)};
    }
  }

 private:
  // A row that holds whatever κ is.
  struct Row {
    Eigen::Index at = 0;  // of the motion's rows
    std::size_t output = 0;
    bool faulty = false;
    OnsetRow part;
  };

  [[nodiscard]] Interval sizes() const {
    if (fault_.whole) {
      return {fault_.kappa(fault_.range.upper), fault_.kappa(fault_.range.upper)};
    }
    Interval range{fault_.kappa(fault_.range.lower), fault_.kappa(fault_.range.upper)};
    if (rows_->encoder()) {
      check::that(range.lower > -1.0, "fault '" + fault_.name + "', range", "above −1 for a scale");
      range = {range.lower / (1.0 + range.lower), range.upper / (1.0 + range.upper)};
    }
    return range;
  }

  void take(std::size_t a, std::size_t b, const Interval& kappa) {
    first_ = found_ ? std::min(first_, a) : a;
    last_ = found_ ? std::max(last_, b) : b;
    kappa_ = found_ ? Interval{std::min(kappa_.lower, kappa.lower), std::max(kappa_.upper, kappa.upper)} : kappa;
    found_ = true;
  }

  [[nodiscard]] bool known(std::size_t a, std::size_t b, const Interval& kappa) const {
    return found_ && a >= first_ && b <= last_ && kappa.lower >= kappa_.lower && kappa.upper <= kappa_.upper;
  }

  // Onsets in [a, b].
  void explore(std::size_t a, std::size_t b, const Interval& within) {
    if (b + 2 > in_.window.end - 1) {
      b = in_.window.end - 3;
    }
    if (a >= b) {
      return;
    }
    const double width = in_.motion.instant[b] - in_.motion.instant[a];
    const bool finest = width <= in_.options.onset_step || b - a < 2;
    place(a, b);
    const auto kappa = finest ? narrow(within) : contract(within);
    if (!kappa || known(a, b, *kappa)) {
      return;
    }
    if (finest || spent()) {
      take(a, b, *kappa);
      return;
    }
    const std::size_t middle = a + (b - a) / 2;
    explore(a, middle, *kappa);
    explore(middle, b, *kappa);
  }

  std::optional<Interval> explore_sizes(std::size_t a, std::size_t b, const Interval& within) {
    place(a, b);
    return narrow(within);
  }

  void place(std::size_t a, std::size_t b) {
    rows_->between(a, b);
    std::size_t count = 0;
    const std::size_t keep = a > in_.window.first ? a - 1 : a;
    for (const std::size_t k : in_.window.rows) {
      const bool faulty = k > rows_->start();
      if (!faulty && k > keep) {
        continue;
      }
      for (std::size_t i = 0; i < n_; ++i) {
        if (count == data_.size()) {
          data_.emplace_back();
        }
        Row& row = data_[count++];
        row.at = static_cast<Eigen::Index>(k * n_ + i);
        row.output = i;
        row.faulty = faulty;
        if (faulty) {
          rows_->row(k, i, row.part);
        }
      }
    }
    data_.resize(count);
  }

  [[nodiscard]] bool spent() {
    finding_.complete = finding_.complete && programs_ < in_.options.budget;
    return !finding_.complete;
  }

  // The hull of the sizes within `kappa` that are not excluded, its ends to the resolution.
  std::optional<Interval> narrow(const Interval& kappa) {
    const auto whole = contract(kappa);
    if (!whole || fault_.whole) {
      return whole;
    }
    const auto lower = end_of(*whole, -1.0, 0);
    if (!lower) {
      return std::nullopt;
    }
    const auto upper = end_of({*lower, whole->upper}, 1.0, 0);
    return upper ? std::optional<Interval>({*lower, *upper}) : std::nullopt;
  }

  // The outermost size on one side that is not excluded.
  std::optional<double> end_of(const Interval& kappa, double side, int depth) {
    const auto end = [&](const Interval& piece) { return side < 0.0 ? piece.lower : piece.upper; };
    // Sizes that are known to be possible need no better bound.
    if (found_ && depth > 0 && kappa.lower >= kappa_.lower && kappa.upper <= kappa_.upper) {
      return end(kappa);
    }
    const auto piece = depth == 0 ? std::optional<Interval>(kappa) : contract(kappa);
    if (!piece) {
      return std::nullopt;
    }
    const double size = core::magnitude(*piece);
    if (piece->upper - piece->lower <= in_.options.resolution * size || depth >= kHalvings || spent()) {
      return end(*piece);
    }
    const double middle = piece->centre();
    const Interval low{piece->lower, middle}, high{middle, piece->upper};
    const auto outer = end_of(side < 0.0 ? low : high, side, depth + 1);
    return outer ? outer : end_of(side < 0.0 ? high : low, side, depth + 1);
  }

  // A part of `kappa` that holds all of it that is not excluded; nothing where all is.
  std::optional<Interval> contract(Interval kappa) {
    for (int turn = 0; turn < kTurns; ++turn) {
      const auto inner = program(kappa);
      if (!inner) {
        return std::nullopt;
      }
      const double before = kappa.upper - kappa.lower, now = inner->upper - inner->lower;
      kappa = *inner;
      if (!(now < kNarrower * before) || now <= 0.1 * in_.options.resolution * core::magnitude(kappa) || spent()) {
        break;
      }
    }
    return kappa;
  }

  // Variables: θ, d, A, B and C of every output, as shares of their bounds but for θ.
  std::optional<Interval> program(const Interval& kappa) {
    const double middle = kappa.centre(), eta = core::round_up(std::max(kappa.upper - middle, middle - kappa.lower));
    const double size = core::magnitude(kappa);
    const double reach = free_offset_ ? largest_offset_ : eta;
    Box box = in_.set.hull();
    box.sides.push_back({-1.0, 1.0});
    std::vector<std::array<double, kLeft>> left(n_);
    for (std::size_t i = 0; i < n_ && rows_->leaves(); ++i) {
      left[i] = rows_->left_bounds(i, size, in_.largest);
      if (free_offset_) {
        const auto more = rows_->offset_left_bounds(i, reach);
        for (std::size_t part = 0; part < kLeft; ++part) left[i][part] += more[part];
      }
    }
    box.sides.resize(static_cast<std::size_t>(variables_), {-1.0, 1.0});
    if (rows_of_set_ == 0) {
      half_spaces_ = facets();
      rows_of_set_ = half_spaces_.size();
    }
    half_spaces_.resize(rows_of_set_ + 2 * data_.size());
    std::size_t next = rows_of_set_;
    const bounds::SlabRows slabs(box);
    std::vector<double> a(static_cast<std::size_t>(variables_)), da = a;
    const RegressionBlock& data = in_.motion.rows;
    for (const Row& row : data_) {
      std::fill(a.begin(), a.end(), 0.0);
      std::fill(da.begin(), da.end(), 0.0);
      double y = data.y[row.at], dy = data.dy[row.at], sum = std::abs(y) + dy, slope = 0.0;
      const OnsetRow& g = row.part;
      const double c = free_offset_ ? 0.0 : g.c;
      for (Eigen::Index j = 0; j < p_; ++j) {
        double value = data.Y(row.at, j), error = data.dY(row.at, j);
        if (row.faulty) {
          const double tangent = g.g1[j] + 2.0 * middle * g.g2[j];
          value += middle * g.g1[j] + middle * middle * g.g2[j];
          error += g.e0[j] + size * g.e1[j] + size * size * g.e2[j];
          slope += tangent * in_.centre[j];
          dy += eta * std::abs(tangent) * in_.half[j] + eta * eta * std::abs(g.g2[j]) * in_.largest[j];
          sum += size * (std::abs(g.g1[j]) + size * std::abs(g.g2[j])) * in_.largest[j];
        }
        a[static_cast<std::size_t>(j)] = value;
        da[static_cast<std::size_t>(j)] = error;
        sum += (std::abs(data.Y(row.at, j)) + error) * in_.largest[j];
      }
      if (row.faulty) {
        const std::size_t own = static_cast<std::size_t>(p_ + 1) + kLeft * row.output;
        y -= middle * c;
        dy += size * g.ec;
        a[static_cast<std::size_t>(p_)] = free_offset_ ? reach * g.c : eta * (slope + c);
        sum += std::abs(size * c) + std::abs(a[static_cast<std::size_t>(p_)]);
        for (std::size_t part = 0; part < kLeft && rows_->leaves(); ++part) {
          const double most = g.left[part] * left[row.output][part];
          if (most <= std::max(kForgotten * dy, kRowRounding * sum)) {
            dy += most;
          } else {
            a[own + part] = most;
            sum += most;
          }
        }
      }
      slabs.half_spaces(a, da, y, dy + kRowRounding * sum, {}, half_spaces_[next], half_spaces_[next + 1]);
      next += 2;
    }
    return solve(half_spaces_, box, kappa, middle, eta);
  }

  std::vector<HalfSpace> facets() const {
    std::vector<HalfSpace> out;
    for (const HalfSpace& facet : in_.set.facets()) {
      HalfSpace row{Eigen::VectorXd::Zero(variables_), facet.b, {}};
      row.a.head(p_) = facet.a;
      out.push_back(std::move(row));
    }
    return out;
  }

  std::optional<Interval> solve(const std::vector<HalfSpace>& rows, const Box& box, const Interval& kappa,
                                double middle, double eta) {
    bounds::Coordinates coordinates{Eigen::VectorXd::Zero(variables_),
                                    Eigen::MatrixXd::Identity(variables_, variables_)};
    for (Eigen::Index j = 0; j < p_; ++j) {
      coordinates.centre[j] = in_.centre[j];
      coordinates.transform(j, j) = std::max(in_.half[j], 1e-9 * in_.largest[j] + 1e-300);
    }
    const auto inner_rows = static_cast<Eigen::Index>(rows.size()), m = inner_rows + 2 * variables_;
    const Eigen::VectorXd scale = coordinates.transform.diagonal();
    scaled_.resize(variables_, m);
    right_.resize(m);
    norms_.resize(m);
    for (Eigen::Index i = 0; i < inner_rows; ++i) {
      const HalfSpace& row = rows[static_cast<std::size_t>(i)];
      auto g = scaled_.col(i);
      g = scale.cwiseProduct(row.a);
      norms_[i] = std::max(g.norm(), std::numeric_limits<double>::min());
      g /= norms_[i];
      right_[i] = (row.b - row.a.dot(coordinates.centre)) / norms_[i];
    }
    for (Eigen::Index j = 0; j < variables_; ++j) {
      const Interval& side = box.sides[static_cast<std::size_t>(j)];
      const Eigen::Index at = inner_rows + 2 * j;
      scaled_.middleCols(at, 2).setZero();
      scaled_(j, at) = -1.0;
      scaled_(j, at + 1) = 1.0;
      right_[at] = (coordinates.centre[j] - side.lower) / scale[j];
      right_[at + 1] = (side.upper - coordinates.centre[j]) / scale[j];
    }
    bounds::LinearProgram program(Eigen::VectorXd::Constant(variables_, -3.0),
                                  Eigen::VectorXd::Constant(variables_, 3.0));
    program.add_rows(scaled_, right_);
    double ends[2] = {1.0, 1.0};  // of −d, d
    for (int k = 0; k < 2; ++k) {
      Eigen::VectorXd direction = Eigen::VectorXd::Zero(variables_);
      direction[p_] = k == 0 ? -1.0 : 1.0;
      ++programs_;
      const bounds::LpSolution solution = program.maximise(direction);
      if (solution.status == bounds::LpSolution::Status::infeasible) {
        ++programs_;
        if (bounds::find_contradiction(rows, box, coordinates)) {
          return std::nullopt;
        }
        return kappa;
      }
      if (fault_.whole) {
        return kappa;  // nothing to be narrowed
      }
      if (solution.status == bounds::LpSolution::Status::optimal) {
        std::vector<bounds::WeightedRow> members;
        for (std::size_t r = 0; r < solution.rows.size(); ++r) {
          const int i = solution.rows[r];
          if (i < static_cast<int>(rows.size())) {
            members.push_back(
                {rows[static_cast<std::size_t>(i)], solution.multipliers[static_cast<Eigen::Index>(r)] / norms_[i]});
          }
        }
        ends[k] = bounds::certified_upper_bound({direction.data(), static_cast<std::size_t>(variables_)}, members, box);
      }
    }
    const Interval inner{std::max(kappa.lower, core::round_down(middle - core::round_up(eta * std::min(ends[0], 1.0)))),
                         std::min(kappa.upper, core::round_up(middle + core::round_up(eta * std::min(ends[1], 1.0))))};
    if (inner.lower > inner.upper) {
      return std::nullopt;
    }
    return inner;
  }

  const IsolationSetting& in_;
  HypothesisRows* rows_;
  FaultFinding& finding_;
  const FaultType& fault_;
  std::size_t n_;
  Eigen::Index p_, variables_;
  bool free_offset_;
  double largest_offset_;
  std::vector<Row> data_;
  std::vector<HalfSpace> half_spaces_;  // of a program: those of the set, then two of each row
  std::size_t rows_of_set_ = 0;
  Eigen::MatrixXd scaled_;  // its rows as columns of norm 1, the box's sides last
  Eigen::VectorXd right_, norms_;
  std::size_t programs_ = 0;
  bool found_ = false;
  std::size_t first_ = 0, last_ = 0;
  Interval kappa_{};
};

}  // namespace

IsolationWindow isolation_window(const ReferenceMotion& motion, const RowMemory& memory, double outside, double alarm,
                                 const IsolationOptions& options) {
  const auto at = [&](double t) {
    return static_cast<std::size_t>(std::lower_bound(motion.t.begin(), motion.t.end(), t) - motion.t.begin());
  };
  IsolationWindow w;
  w.outside = at(outside);
  const std::size_t last = at(alarm);
  check::that(last < motion.instants() && w.outside <= last, "alarm", "a time of the motion");
  const auto next = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), last);
  const std::size_t segment = next == motion.segment_starts.begin() ? 0 : *(next - 1);
  const std::size_t stop = next == motion.segment_starts.end() ? motion.instants() : *next;
  w.outside = std::max(w.outside, segment);
  w.begin = std::max(segment, std::min(at(outside - options.before), w.outside));
  w.first = std::max(segment, std::min(at(outside - options.before - memory.all), w.begin));
  w.from_start = w.begin <= segment + 2;
  w.begin = w.from_start ? segment : w.begin;
  w.first = w.from_start ? segment : w.first;
  w.end = std::min(stop, std::max(at(alarm + options.after), last + 1));
  // Evenly spread in each of three stretches: before the alarm, while the filter still holds the onset, and after that.
  const auto spread = [&](std::size_t from, std::size_t to, std::size_t most) {
    const std::size_t count = std::min(most, std::max(to, from) - from);
    for (std::size_t k = 0; k < count; ++k) {
      w.rows.push_back(from + k * (to - from) / count);
    }
  };
  const std::size_t third = options.most_instants / 3;
  const std::size_t fresh = std::clamp(at(outside - memory.fresh), w.begin, w.outside);
  const std::size_t stale = std::clamp(at(outside + 2.0 * memory.fresh), w.outside, w.end);
  spread(w.begin, fresh, third);
  spread(fresh, stale, third);
  spread(stale, w.end, third);
  w.rows.push_back(w.outside);
  w.rows.push_back(last);
  std::sort(w.rows.begin(), w.rows.end());
  w.rows.erase(std::unique(w.rows.begin(), w.rows.end()), w.rows.end());
  std::erase_if(w.rows, [&](std::size_t k) { return !motion.settled[k]; });
  return w;
}

IsolationSetting::IsolationSetting(const ReferenceMotion& reference, const Polytope& parameters,
                                   const IsolationOptions& how, IsolationWindow where)
    : motion(reference), set(parameters), options(how), window(std::move(where)) {
  check::positive(options.before, "before");
  check::non_negative(options.after, "after");
  check::positive(options.onset_step, "onset_step");
  check::positive(options.resolution, "resolution");
  check::that(options.most_instants >= 4, "most_instants", "at least 4");
  check::that(set.dimension() == motion.rows.parameters, "set", "as many parameters as the rows");
  const auto p = static_cast<Eigen::Index>(set.dimension());
  centre = half = Eigen::VectorXd::Zero(p);
  largest = set.hull().magnitudes();
  for (Eigen::Index j = 0; j < p; ++j) {
    const Interval& side = set.hull().sides[static_cast<std::size_t>(j)];
    centre[j] = side.centre();
    half[j] = core::round_up(std::max(side.upper - centre[j], centre[j] - side.lower));
  }
}

bool explained_without_fault(const IsolationSetting& setting) {
  const RegressionBlock& data = setting.motion.rows;
  const auto n = static_cast<Eigen::Index>(data.outputs), p = static_cast<Eigen::Index>(setting.set.dimension());
  const bounds::SlabRows slabs(setting.set.hull());
  std::vector<HalfSpace> rows(setting.set.facets().begin(), setting.set.facets().end());
  for (const std::size_t k : setting.window.rows) {
    for (Eigen::Index i = static_cast<Eigen::Index>(k) * n; i < static_cast<Eigen::Index>(k + 1) * n; ++i) {
      HalfSpace upper, lower;
      slabs.half_spaces(data, i, upper, lower);
      rows.push_back(std::move(upper));
      rows.push_back(std::move(lower));
    }
  }
  bounds::Coordinates coordinates{setting.centre, Eigen::MatrixXd::Identity(p, p)};
  for (Eigen::Index j = 0; j < p; ++j) {
    coordinates.transform(j, j) = std::max(setting.half[j], 1e-9 * setting.largest[j] + 1e-300);
  }
  return !bounds::find_contradiction(rows, setting.set.hull(), coordinates);
}

void search(const IsolationSetting& setting, HypothesisRows& rows, bool free_offset, double largest_offset,
            FaultFinding& finding) {
  Search(setting, rows, free_offset, largest_offset, finding).run();
}

}  // namespace wheelwright::detector
