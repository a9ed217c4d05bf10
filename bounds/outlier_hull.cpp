// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/outlier_hull.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include <wheelwright/bounds/certificate.hpp>
#include <wheelwright/bounds/infeasibility.hpp>
#include <wheelwright/bounds/interval_hull.hpp>
#include <wheelwright/bounds/kernels.hpp>
#include <wheelwright/bounds/linear_program.hpp>
#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/bounds/survey.hpp>
#include <wheelwright/core/limits.hpp>

namespace wheelwright {
namespace {

using Samples = std::vector<std::size_t>;  // ascending

constexpr double kSlack = 1e-12;     // of the width: what cutting a branch off may cost
constexpr double kLoose = 1e-10;     // of the width: a certified bound that is worse is tried in another way
constexpr double kViolated = 1e-11;  // of the reach of a row over the box
constexpr std::size_t kWorst = 64;   // rows that a point adds in a round
constexpr std::size_t kMostRounds = 40;
constexpr std::size_t kMostViolatedColumns = 32;  // of kernels::Table::violated

Samples united(Samples samples, const std::vector<WeightedRow>& rows) {
  for (const WeightedRow& weighted : rows) {
    if (!weighted.row.origin.is_prior) {
      samples.push_back(weighted.row.origin.sample);
    }
  }
  std::sort(samples.begin(), samples.end());
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
  return samples;
}

Samples with(Samples samples, std::size_t one) {
  samples.insert(std::lower_bound(samples.begin(), samples.end(), one), one);
  return samples;
}

bool holds(const Samples& samples, std::size_t one) { return std::binary_search(samples.begin(), samples.end(), one); }

/// Half-spaces held for the search, each once.
class WorkingRows {
 public:
  explicit WorkingRows(std::size_t p) { bank_.parameters = p; }

  [[nodiscard]] bool has(const RowOrigin& origin) const {
    return origin.is_prior || known_.contains({origin.sample, origin.output, origin.side});
  }
  void add(const HalfSpace& row) {
    if (!has(row.origin)) {
      known_.emplace(row.origin.sample, row.origin.output, row.origin.side);
      bank_.add({row.a.data(), bank_.parameters}, row.b, row.origin);
    }
  }
  void add(const std::vector<WeightedRow>& rows) {
    for (const WeightedRow& weighted : rows) {
      add(weighted.row);
    }
  }
  [[nodiscard]] RowBank without(const Samples& dropped) const {
    RowBank left;
    left.parameters = bank_.parameters;
    for (std::size_t i = 0; i < bank_.size(); ++i) {
      if (!holds(dropped, bank_.origins[i].sample)) {
        left.add(bank_.normal(i), bank_.b[i], bank_.origins[i]);
      }
    }
    return left;
  }
  [[nodiscard]] const RowBank& bank() const { return bank_; }
  [[nodiscard]] std::size_t size() const { return bank_.size(); }

 private:
  RowBank bank_;
  std::set<std::tuple<std::size_t, std::size_t, Side>> known_;
};

/// A direction over the set without some instants: empty, or an upper bound and where it is reached.
struct Node {
  bool empty = false;
  std::vector<WeightedRow> proof;  // contradiction, or binding rows
  double value = -kInfinity;
  Eigen::VectorXd point;
};

/// The half-spaces held, in coordinates in which the sets searched have a size of about one.
class Programs {
 public:
  /// `outermost`: instants without which the set is about as large as it gets.
  Programs(const Box& prior, const Box& within, const Eigen::MatrixXd& information, const WorkingRows& rows,
           const Samples& outermost)
      : prior_(prior), within_(within), information_(information), rows_(rows) {
    CuttingPlanes planes(prior, information);
    planes.add_to_hull(rows.without(outermost));
    coordinates_ = planes.coordinates();
    reach_ = 4.0 * extent(within, coordinates_).array() + 4.0;
    for (std::size_t i = 0; i < rows.bank().size(); ++i) {
      all_.push_back(rows.bank().at(i));
    }
    for (HalfSpace& side : sides_as_rows(prior)) {
      all_.push_back(std::move(side));
    }
    a_.resize(static_cast<Eigen::Index>(prior.dimension()), static_cast<Eigen::Index>(all_.size()));
    b_.resize(a_.cols());
    norms_.resize(a_.cols());
    for (Eigen::Index i = 0; i < a_.cols(); ++i) {
      const HalfSpace& row = all_[static_cast<std::size_t>(i)];
      a_.col(i) = coordinates_.transform.transpose() * row.a;
      norms_[i] = std::max(a_.col(i).norm(), 1e-300);
      a_.col(i) /= norms_[i];
      b_[i] = (row.b - row.a.dot(coordinates_.centre)) / norms_[i];
    }
  }

  /// Direction 2j is −θ_j, direction 2j + 1 is θ_j. Proofs are over `within` for bounds, over the prior for emptiness.
  [[nodiscard]] Node solve(const Samples& dropped, std::size_t direction) const {
    const Eigen::Index p = a_.rows();
    const auto j = static_cast<Eigen::Index>(direction / 2);
    Eigen::VectorXd axis = Eigen::VectorXd::Zero(p);
    axis[j] = direction % 2 == 0 ? -1.0 : 1.0;
    Node node;
    if (!solve_one(dropped, axis, node)) {
      CuttingPlanes planes(prior_, information_);
      planes.add_to_hull(rows_.without(dropped));
      if (planes.is_empty()) {
        return {true, planes.contradiction(), -kInfinity, {}};
      }
      CertifiedBound bound = planes.certified_maximum(axis, within_);
      const std::optional<LpSolution> solution = planes.maximise(axis);
      node = {false, std::move(bound.binding), bound.value, solution ? solution->x : Eigen::VectorXd()};
    }
    const Interval& side = within_.sides[direction / 2];
    node.value = std::min(node.value, direction % 2 == 0 ? -side.lower : side.upper);
    return node;
  }

 private:
  /// One program from the corner of a box. False where it has no certified, tight answer.
  bool solve_one(const Samples& dropped, const Eigen::VectorXd& axis, Node& node) const {
    std::vector<Eigen::Index> held;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (all_[i].origin.is_prior || !holds(dropped, all_[i].origin.sample)) {
        held.push_back(static_cast<Eigen::Index>(i));
      }
    }
    LinearProgram program(-reach_, reach_);
    program.add_rows(a_(Eigen::all, held), b_(held));
    const Eigen::VectorXd c = coordinates_.transform.transpose() * axis;
    const double norm = c.norm();
    const LpSolution solution = program.maximise(c / norm);
    if (solution.status != LpSolution::Status::optimal) {
      return false;
    }
    for (std::size_t k = 0; k < solution.rows.size(); ++k) {
      const Eigen::Index i = held[static_cast<std::size_t>(solution.rows[k])];
      node.proof.push_back(
          {all_[static_cast<std::size_t>(i)], solution.multipliers[static_cast<Eigen::Index>(k)] * norm / norms_[i]});
    }
    node.point = coordinates_.centre + coordinates_.transform * solution.x;
    node.value = certified_upper_bound({axis.data(), within_.dimension()}, node.proof, within_);
    const Eigen::VectorXd minus = -axis;
    const double width =
        within_.support({axis.data(), within_.dimension()}) + within_.support({minus.data(), within_.dimension()});
    if (!(node.value - axis.dot(node.point) <= kLoose * width)) {
      node = {};
      return false;
    }
    return true;
  }

  const Box& prior_;
  const Box& within_;
  const Eigen::MatrixXd& information_;
  const WorkingRows& rows_;
  Coordinates coordinates_;
  Eigen::VectorXd reach_, b_, norms_;
  Eigen::MatrixXd a_;
  std::vector<HalfSpace> all_;
};

/// What the search of one direction found.
struct Found {
  double value = -kInfinity;  // the largest of all choices; −infinity where all are empty
  bool complete = true;
  Samples dropped;
  Node node;  // without `dropped`
  std::vector<OutlierContradiction> contradictions;
  std::size_t sets = 0;
};

/// Branch and bound over the choices of instants, on the half-spaces held.
class Search {
 public:
  Search(const Programs& programs, std::size_t direction, double width, const OutlierHullOptions& options)
      : programs_(programs), direction_(direction), options_(options), slack_(kSlack * width) {}

  Found operator()() {
    Samples outermost;
    const double limit = layers({}, options_.most, kInfinity, outermost);
    visit({}, limit);
    found_.value = found_.complete ? std::max(best_, ceiling_) : limit;
    if (!found_.complete) {
      found_.dropped = outermost;
    }
    found_.node = at(found_.dropped);
    found_.sets = nodes_.size();
    return std::move(found_);
  }

 private:
  /// The set without `dropped`, bounded once.
  const Node& at(const Samples& dropped) {
    const auto [entry, is_new] = nodes_.try_emplace(dropped);
    if (is_new) {
      entry->second = programs_.solve(dropped, direction_);
    }
    return entry->second;
  }

  void note(const Node& node, const Samples& dropped) {
    if (node.empty) {
      found_.contradictions.push_back({dropped, node.proof});
    }
  }

  /// The loosest of `count` + 1 bounds whose proofs have no instant in common, or the first above `enough`.
  double layers(Samples dropped, std::size_t count, double enough, Samples& outermost) {
    double limit = -kInfinity;
    for (std::size_t layer = 0; layer <= count && !(limit > enough); ++layer) {
      const Node& node = at(dropped);
      note(node, dropped);
      if (node.value > limit) {
        limit = node.value;
        outermost = dropped;
      }
      Samples more = united(dropped, node.proof);
      if (more.size() == dropped.size()) {
        break;
      }
      dropped = std::move(more);
    }
    return limit;
  }

  bool closed(double limit) {
    if (!(limit <= best_ + slack_)) {
      return false;
    }
    ceiling_ = std::max(ceiling_, limit);
    return true;
  }

  void visit(const Samples& dropped, double limit) {
    if (!found_.complete || !visited_.insert(dropped).second) {
      return;
    }
    const Node& node = at(dropped);
    note(node, dropped);
    if (node.value > best_) {
      best_ = node.value;
      found_.dropped = dropped;
    }
    const std::size_t left = options_.most - dropped.size();
    if (left == 0 || closed(limit)) {
      return;
    }
    const Samples branches = united({}, node.proof);
    if (branches.empty()) {
      return;
    }
    Samples unused;
    if (!dropped.empty() && closed(layers(dropped, left, best_ + slack_, unused))) {
      return;
    }
    std::vector<std::pair<double, std::size_t>> order;
    for (const std::size_t sample : branches) {
      if (nodes_.size() >= options_.budget) {
        found_.complete = false;
        return;
      }
      order.emplace_back(-at(with(dropped, sample)).value, sample);
    }
    std::sort(order.begin(), order.end());
    for (const auto& [value, sample] : order) {
      visit(with(dropped, sample), limit);
    }
  }

  const Programs& programs_;
  const std::size_t direction_;
  const OutlierHullOptions& options_;
  const double slack_;
  std::map<Samples, Node> nodes_;
  std::set<Samples> visited_;
  Found found_;
  double best_ = -kInfinity, ceiling_ = -kInfinity;
};

/// Rows not held that a point violates although its instants are dropped, the worst of them.
class Violations {
 public:
  Violations(const OutlierBound& bound, const WorkingRows& held) : bound_(bound), held_(held) {}

  void look(const HalfSpace& row, const Box& box) {
    if (holds(bound_.dropped, row.origin.sample) || held_.has(row.origin)) {
      return;
    }
    double reach = std::numeric_limits<double>::min();
    for (std::size_t j = 0; j < box.dimension(); ++j) {
      reach += std::abs(row.a[static_cast<Eigen::Index>(j)]) * box.sides[j].width();
    }
    const double excess = (row.a.dot(bound_.at) - row.b) / reach;
    if (excess > kViolated) {
      rows_.emplace_back(excess, row);
      if (rows_.size() >= 4 * kWorst) {
        trim();
      }
    }
  }
  /// Adds the worst to `to`; whether there was one.
  bool add(WorkingRows& to) {
    trim();
    for (const auto& [excess, row] : rows_) {
      to.add(row);
    }
    return !rows_.empty();
  }
  [[nodiscard]] const Eigen::VectorXd& point() const { return bound_.at; }

 private:
  void trim() {
    std::stable_sort(rows_.begin(), rows_.end(), [](const auto& x, const auto& y) { return x.first > y.first; });
    rows_.resize(std::min(rows_.size(), kWorst));
  }

  const OutlierBound& bound_;
  const WorkingRows& held_;
  std::vector<std::pair<double, HalfSpace>> rows_;
};

/// One walk over the source for all of `open`.
void find_violations(RegressionSource& source, const Samples& excluded, const Box& prior, const Box& box,
                     std::vector<Violations>& open) {
  const std::size_t p = prior.dimension();
  const SlabRows slabs(prior);
  Eigen::MatrixXd points(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(open.size()));
  for (std::size_t k = 0; k < open.size(); ++k) {
    points.col(static_cast<Eigen::Index>(k)) = open[k].point();
  }
  std::vector<std::uint32_t> numbers;
  std::vector<double> Y(p), dY(p);
  HalfSpace upper, lower;
  ColumnPacker packer(source.outputs(), p);
  packer.walk(source, excluded, [&](const SlabColumns& columns, const std::vector<char>&) {
    numbers.resize(columns.n);
    std::iota(numbers.begin(), numbers.end(), 0U);
    if (p <= kMostViolatedColumns) {
      const kernels::Slabs rows{
          columns.Y.data(), columns.dY.empty() ? nullptr : columns.dY.data(), columns.y, columns.dy, columns.n, p};
      numbers.resize(kernels::best().violated(rows, points.data(), open.size(), numbers.data()));
    }
    for (const std::uint32_t i : numbers) {
      for (std::size_t j = 0; j < p; ++j) {
        Y[j] = columns.Y[j][i];
        dY[j] = columns.dY.empty() ? 0.0 : columns.dY[j][i];
      }
      slabs.half_spaces(Y, dY, columns.y[i], columns.dy[i], columns.origin(i), upper, lower);
      for (Violations& violations : open) {
        violations.look(upper, box);
        violations.look(lower, box);
      }
    }
    return true;
  });
}

/// A box around all choices: q + 1 hulls whose proofs have no instant in common. Their rows go to `rows`.
bool bound_by_layers(RegressionSource& source, const Box& prior, const OutlierHullOptions& options, WorkingRows& rows,
                     OutlierHull& result, Samples& outermost) {
  Samples dropped;
  bool any = false;
  for (std::size_t layer = 0; layer <= options.most; ++layer) {
    IntervalHullOptions own{.excluded_samples = options.excluded_samples};
    own.excluded_samples.insert(own.excluded_samples.end(), dropped.begin(), dropped.end());
    IntervalHull set = interval_hull(source, prior, own);
    result.passes += set.passes;
    ++result.sets;
    outermost = dropped;
    Samples more = united(dropped, set.contradiction);
    rows.add(set.contradiction);
    for (const std::vector<CertifiedBound>* bounds : {&set.lower, &set.upper}) {
      for (const CertifiedBound& bound : *bounds) {
        more = united(std::move(more), bound.binding);
        rows.add(bound.binding);
      }
    }
    if (set.empty) {
      result.contradictions.push_back({dropped, std::move(set.contradiction)});
    } else {
      result.layers = any ? hull(result.layers, set.hull) : set.hull;
      any = true;
    }
    if (more.size() == dropped.size()) {
      break;
    }
    dropped = std::move(more);
  }
  return any;
}

}  // namespace

OutlierHull hull_with_outliers(RegressionSource& source, const Box& prior, const OutlierHullOptions& options) {
  const std::size_t p = prior.dimension();
  OutlierHull result;
  result.hull = result.layers = prior;
  WorkingRows rows(p);
  Samples outermost;
  if (!bound_by_layers(source, prior, options, rows, result, outermost)) {
    result.empty = true;
    result.working = rows.size();
    return result;
  }
  Samples excluded = options.excluded_samples;
  std::sort(excluded.begin(), excluded.end());
  const Eigen::MatrixXd information = survey(source, prior, excluded).information;
  ++result.passes;

  std::vector<OutlierBound> bounds(2 * p);
  std::vector<char> settled(2 * p, 0);
  bool more = true;
  while (more && result.rounds < kMostRounds) {
    const Programs programs(prior, result.layers, information, rows, outermost);
    ++result.rounds;
    std::vector<std::size_t> directions;
    std::vector<Violations> open;
    for (std::size_t d = 0; d < 2 * p; ++d) {
      if (settled[d] != 0) {
        continue;
      }
      Found found = Search(programs, d, result.layers.sides[d / 2].width(), options)();
      result.sets += found.sets;
      if (found.complete && found.value == -kInfinity) {
        result.empty = true;
        result.contradictions = std::move(found.contradictions);
        result.layers = prior;
        result.working = rows.size();
        return result;
      }
      bounds[d] = {found.value, false, std::move(found.dropped), {}, {}};
      if (!found.node.empty) {
        bounds[d].binding = std::move(found.node.proof);
        bounds[d].at = std::move(found.node.point);
      } else {
        bounds[d].value = d % 2 == 0 ? -result.layers.sides[d / 2].lower : result.layers.sides[d / 2].upper;
      }
      if (found.complete && bounds[d].at.size() > 0) {
        directions.push_back(d);
        open.emplace_back(bounds[d], rows);
      } else {
        settled[d] = 1;
      }
    }
    more = false;
    if (!open.empty()) {
      find_violations(source, excluded, prior, result.layers, open);
      ++result.passes;
      for (std::size_t k = 0; k < open.size(); ++k) {
        const bool grew = open[k].add(rows);
        bounds[directions[k]].exact = !grew;
        settled[directions[k]] = grew ? 0 : 1;
        more = more || grew;
      }
    }
  }
  result.contradictions.clear();
  result.working = rows.size();
  for (std::size_t j = 0; j < p; ++j) {
    bounds[2 * j].value = -bounds[2 * j].value;
    const double low = bounds[2 * j].value, high = bounds[2 * j + 1].value;
    result.hull.sides[j] = {std::min(low, high), std::max(low, high)};
    result.lower.push_back(std::move(bounds[2 * j]));
    result.upper.push_back(std::move(bounds[2 * j + 1]));
  }
  return result;
}

}  // namespace wheelwright
