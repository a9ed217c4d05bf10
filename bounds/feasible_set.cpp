// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/feasible_set.hpp>

#include <algorithm>
#include <utility>

#include <wheelwright/bounds/certificate.hpp>
#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/bounds/survey.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t kBatch = 512;      // candidates gathered before they are tested together
constexpr std::size_t kInstants = 8192;  // instants after which candidates are tested in any case
constexpr std::size_t kMostOpenSigns = 4;

/// The independent blocks of parameters, each with its working set; takes instants one by one.
class Cutter {
 public:
  Cutter(const RowSurvey& survey, const Box& prior) : rows_(prior), block_of_(prior.dimension()) {
    for (const std::vector<std::size_t>& parameters : survey.blocks) {
      const auto q = static_cast<Eigen::Index>(parameters.size());
      Part part;
      Box box;
      Eigen::MatrixXd information(q, q);
      for (Eigen::Index i = 0; i < q; ++i) {
        const std::size_t j = parameters[static_cast<std::size_t>(i)];
        box.sides.push_back(prior.sides[j]);
        block_of_[j] = parts_.size();
        for (Eigen::Index k = 0; k < q; ++k) {
          information(i, k) = survey.information(static_cast<Eigen::Index>(j),
                                                 static_cast<Eigen::Index>(parameters[static_cast<std::size_t>(k)]));
        }
      }
      part.parameters = parameters;
      part.planes.emplace(box, information, parameters);
      parts_.push_back(std::move(part));
    }
  }

  /// Takes the instant; false once the set is proved empty.
  bool offer(const RegressionBlock& block, std::size_t k) {
    for (std::size_t i = 0; i < block.outputs; ++i) {
      const auto row = static_cast<Eigen::Index>(k * block.outputs + i);
      rows_.half_spaces(block, row, upper_, lower_);
      if (!offer(upper_) || !offer(lower_)) {
        return false;
      }
    }
    return ++instants_ % kInstants != 0 || flush();
  }

  /// Tests all candidates; false once the set is proved empty.
  bool flush() {
    for (Part& part : parts_) {
      if (!flush(part)) {
        return false;
      }
    }
    return true;
  }

  /// The half-spaces held, in all parameters, sides of the prior box left out.
  [[nodiscard]] std::vector<HalfSpace> half_spaces() {
    std::vector<HalfSpace> all;
    for (Part& part : parts_) {
      part.planes->reduce();
      for (const HalfSpace& row : part.planes->rows()) {
        if (!row.origin.is_prior) {
          all.push_back(spread(part, row));
        }
      }
    }
    return all;
  }

  [[nodiscard]] std::vector<WeightedRow> contradiction() const {
    std::vector<WeightedRow> result;
    for (const Part& part : parts_) {
      if (part.planes->is_empty()) {
        for (const WeightedRow& weighted : part.planes->contradiction()) {
          result.push_back({spread(part, weighted.row), weighted.multiplier});
        }
        break;
      }
    }
    return result;
  }

  [[nodiscard]] std::size_t working_set() const { return working_set_; }

  [[nodiscard]] std::size_t undecided() const {
    std::size_t sum = 0;
    for (const Part& part : parts_) {
      sum += part.planes->undecided();
    }
    return sum;
  }

 private:
  struct Part {
    std::vector<std::size_t> parameters;
    std::optional<CuttingPlanes> planes;
    std::vector<HalfSpace> candidates;
    Eigen::VectorXd a;
  };

  [[nodiscard]] HalfSpace spread(const Part& part, const HalfSpace& row) const {
    HalfSpace full{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(block_of_.size())), row.b, row.origin};
    for (std::size_t i = 0; i < part.parameters.size(); ++i) {
      full.a[static_cast<Eigen::Index>(part.parameters[i])] = row.a[static_cast<Eigen::Index>(i)];
    }
    return full;
  }

  bool offer(const HalfSpace& half_space) {
    std::size_t j = 0;
    while (j + 1 < block_of_.size() && half_space.a[static_cast<Eigen::Index>(j)] == 0.0) {
      ++j;
    }
    Part& part = parts_[block_of_[j]];
    part.a.resize(static_cast<Eigen::Index>(part.parameters.size()));
    for (std::size_t i = 0; i < part.parameters.size(); ++i) {
      part.a[static_cast<Eigen::Index>(i)] = half_space.a[static_cast<Eigen::Index>(part.parameters[i])];
    }
    if (part.planes->implied(part.a, half_space.b)) {
      return true;
    }
    part.candidates.push_back({part.a, half_space.b, half_space.origin});
    return part.candidates.size() < kBatch || flush(part);
  }

  bool flush(Part& part) {
    part.planes->add(std::exchange(part.candidates, {}));
    std::size_t held = 0;
    for (const Part& each : parts_) {
      held += each.planes->rows().size();
    }
    working_set_ = std::max(working_set_, held);
    return !part.planes->is_empty();
  }

  SlabRows rows_;
  std::vector<std::size_t> block_of_;
  std::vector<Part> parts_;
  HalfSpace upper_, lower_;
  std::size_t instants_ = 0, working_set_ = 0;
};

/// One cutting pass over a part of the prior box with the convex description of the rows.
FeasibleSet cut(RegressionSource& source, const RowSurvey& survey, const Box& prior,
                const std::vector<std::size_t>& excluded, const PolytopeOptions& options) {
  Cutter cutter(survey, prior);
  bool alive = true;
  // The evenly spread sample first, so that the set is small before the long walk begins.
  for (std::size_t k = 0; alive && k < survey.sample.instants(); ++k) {
    alive = cutter.offer(survey.sample, k);
  }
  alive = alive && cutter.flush();
  RegressionBlock block;
  source.rewind();
  while (alive && source.next(block)) {
    for (std::size_t k = 0; alive && k < block.instants(); ++k) {
      if (!std::binary_search(excluded.begin(), excluded.end(), block.sample[k])) {
        alive = cutter.offer(block, k);
      }
    }
  }
  alive = alive && cutter.flush();
  FeasibleSet result;
  result.passes = 1;
  result.rows = survey.rows;
  result.working_set = cutter.working_set();
  result.undecided = cutter.undecided();
  result.hull = prior;
  if (!alive) {
    result.status = FeasibleSet::Status::empty;
    result.contradiction = cutter.contradiction();
    return result;
  }
  auto intersection = Polytope::intersect(cutter.half_spaces(), prior, options);
  if (auto* contradiction = std::get_if<std::vector<WeightedRow>>(&intersection)) {
    result.status = FeasibleSet::Status::empty;
    result.contradiction = std::move(*contradiction);
    return result;
  }
  result.polytope = std::move(std::get<Polytope>(intersection));
  result.hull = result.polytope->hull();
  result.lower = result.polytope->lower();
  result.upper = result.polytope->upper();
  return result;
}

/// Parameters whose column is noisy and whose sign the box leaves open.
std::vector<std::size_t> open_signs(const RowSurvey& survey, const Box& box) {
  std::vector<std::size_t> open;
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    if (survey.noisy[j] && box.sides[j].lower < 0.0 && box.sides[j].upper > 0.0) {
      open.push_back(j);
    }
  }
  return open;
}

/// Adds what it cost to get `part`.
void account(FeasibleSet& total, const FeasibleSet& part) {
  total.passes += part.passes;
  total.working_set = std::max(total.working_set, part.working_set);
  total.undecided += part.undecided;
}

/// Hull of two non-empty parts.
void merge(FeasibleSet& all, const FeasibleSet& part) {
  all.hull = hull(all.hull, part.hull);
  for (std::size_t j = 0; j < all.lower.size(); ++j) {
    if (part.lower[j].value < all.lower[j].value) {
      all.lower[j] = part.lower[j];
    }
    if (part.upper[j].value > all.upper[j].value) {
      all.upper[j] = part.upper[j];
    }
  }
}

}  // namespace

FeasibleSet feasible_set(RegressionSource& source, const Box& prior, const FeasibleSetOptions& options) {
  std::vector<std::size_t> excluded = options.excluded_samples;
  std::sort(excluded.begin(), excluded.end());
  const RowSurvey known = survey(source, prior, excluded);
  FeasibleSet convex = cut(source, known, prior, excluded, options.polytope);
  ++convex.passes;
  if (convex.status == FeasibleSet::Status::empty || open_signs(known, prior).empty()) {
    return convex;
  }

  // Signs that the convex outer set already decides are open no more.
  Box decided = prior;
  for (const std::size_t j : open_signs(known, prior)) {
    if (convex.hull.sides[j].lower >= 0.0) {
      decided.sides[j].lower = 0.0;
    } else if (convex.hull.sides[j].upper <= 0.0) {
      decided.sides[j].upper = 0.0;
    }
  }
  const std::vector<std::size_t> open = open_signs(known, decided);
  if (open.size() > kMostOpenSigns) {
    convex.convexified = true;
    return convex;
  }
  FeasibleSet result;
  std::size_t nonempty = 0;
  FeasibleSet cost;
  account(cost, convex);
  const std::size_t parts = std::size_t{1} << open.size();
  std::vector<WeightedRow> contradiction;
  for (std::size_t pattern = 0; pattern < parts; ++pattern) {
    Box box = decided;
    for (std::size_t i = 0; i < open.size(); ++i) {
      Interval& side = box.sides[open[i]];
      ((pattern >> i & 1) != 0 ? side.upper : side.lower) = 0.0;
    }
    FeasibleSet part = cut(source, known, box, excluded, options.polytope);
    account(cost, part);
    if (part.status == FeasibleSet::Status::empty) {
      if (contradiction.empty()) {
        contradiction = part.contradiction;
      }
    } else if (nonempty++ == 0) {
      result = std::move(part);
    } else {
      merge(result, part);
    }
  }
  if (nonempty == 0) {
    result.status = FeasibleSet::Status::empty;
    result.hull = prior;
    result.contradiction = std::move(contradiction);
  } else if (nonempty > 1) {
    // The convex description over the hull of the parts: the chords are shortest there.
    FeasibleSet outer = cut(source, known, result.hull, excluded, options.polytope);
    account(cost, outer);
    result.polytope = outer.polytope ? outer.polytope : convex.polytope;
    result.convexified = true;
  }
  result.rows = known.rows;
  result.passes = cost.passes;
  result.working_set = cost.working_set;
  result.undecided = cost.undecided;
  result.sign_parts = parts;
  return result;
}

}  // namespace wheelwright
