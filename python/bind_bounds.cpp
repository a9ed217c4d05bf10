// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <mutex>
#include <optional>

#include "bounds/interval_hull.hpp"
#include "bounds/minimax.hpp"
#include "detector/threshold.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"

namespace wheelwright::python {

using bounds::MinimaxFit;

namespace {

using ByColumns = py::array_t<double, py::array::f_style | py::array::forcecast>;

core::RowMatrix sides_of(const Box& box) {
  core::RowMatrix m(static_cast<Eigen::Index>(box.dimension()), 2);
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    m(static_cast<Eigen::Index>(j), 0) = box.sides[j].lower;
    m(static_cast<Eigen::Index>(j), 1) = box.sides[j].upper;
  }
  return m;
}

Box box_of(const Doubles& sides, const std::string& what) {
  check_shape(sides, {-1, 2}, what);
  Box box;
  for (py::ssize_t j = 0; j < sides.shape(0); ++j) {
    box.sides.push_back({sides.at(j, 0), sides.at(j, 1)});
  }
  bounds::check_finite(box, what.c_str());
  return box;
}

py::list proof_of(const std::vector<bounds::WeightedRow>& rows) {
  py::list out;
  for (const bounds::WeightedRow& row : rows) {
    py::dict d;
    d["row"] = row.row.origin.is_prior ? py::object(py::none()) : py::object(py::int_(row.row.origin.sample));
    d["output"] = row.row.origin.is_prior ? py::object(py::none()) : py::object(py::int_(row.row.origin.output));
    d["parameter"] = row.row.origin.is_prior ? py::object(py::int_(row.row.origin.parameter)) : py::object(py::none());
    d["side"] = row.row.origin.side == bounds::Side::upper ? "upper" : "lower";
    d["multiplier"] = row.multiplier;
    out.append(std::move(d));
  }
  return out;
}

py::list proofs_of(const std::vector<bounds::CertifiedBound>& bounds) {
  py::list out;
  for (const bounds::CertifiedBound& bound : bounds) {
    out.append(proof_of(bound.binding));
  }
  return out;
}

// lower <= Yθ <= upper as |y − Yθ| <= dy, rounded outward.
struct Slabs {
  Slabs(const Doubles& lower, const Doubles& upper, py::ssize_t rows) {
    const auto l = values(lower, "lower", rows), u = values(upper, "upper", rows);
    y.reserve(l.size());
    dy.reserve(l.size());
    for (std::size_t i = 0; i < l.size(); ++i) {
      check::that(l[i] <= u[i], "lower, upper in row " + std::to_string(i), "lower <= upper");
      const double middle = l[i] + 0.5 * (u[i] - l[i]);
      const double half = std::max(u[i] - middle, middle - l[i]);
      y.push_back(middle);
      dy.push_back(half == 0.0 ? 0.0 : core::round_up(half));
    }
  }
  std::vector<double> y, dy;
};

// Rows in somebody else's memory, one output, block by block.
class ArrayRows final : public core::RegressionSource {
 public:
  ArrayRows(const double* Y, const double* dY, const double* y, const double* dy, std::size_t rows, std::size_t p)
      : Y_(Y), dY_(dY), y_(y), dy_(dy), rows_(rows), p_(p) {}
  [[nodiscard]] std::size_t outputs() const override { return 1; }
  [[nodiscard]] std::size_t parameters() const override { return p_; }
  bool next(RegressionBlock& block) override {
    const std::size_t count = std::min<std::size_t>(rows_ - at_, 4096);
    block.resize(count, 1, p_);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t row = at_ + k;
      const auto i = static_cast<Eigen::Index>(k);
      block.sample[k] = row;
      block.t[k] = static_cast<double>(row);
      block.y[i] = y_[row];
      block.dy[i] = dy_ != nullptr ? dy_[row] : 0.0;
      for (std::size_t j = 0; j < p_; ++j) {
        block.Y(i, static_cast<Eigen::Index>(j)) = Y_[row * p_ + j];
        block.dY(i, static_cast<Eigen::Index>(j)) = dY_ != nullptr ? dY_[row * p_ + j] : 0.0;
      }
    }
    at_ += count;
    return count > 0;
  }
  void rewind() override { at_ = 0; }

 private:
  const double *Y_, *dY_, *y_, *dy_;
  std::size_t rows_, p_, at_ = 0;
};

bounds::IntervalHull hull_of(const ByColumns& Y, const Doubles& lower, const Doubles& upper, const Doubles& prior,
                             const std::optional<ByColumns>& dY, std::size_t threads) {
  const Box box = box_of(prior, "prior");
  const auto p = static_cast<py::ssize_t>(box.dimension());
  check_shape(Y, {-1, p}, "Y");
  const Slabs slabs(lower, upper, Y.shape(0));
  bounds::SlabColumns rows;
  rows.n = slabs.y.size();
  rows.y = slabs.y.data();
  rows.dy = slabs.dy.data();
  for (py::ssize_t j = 0; j < p; ++j) {
    rows.Y.push_back(Y.data() + j * Y.shape(0));
  }
  if (dY) {
    check_shape(*dY, {Y.shape(0), p}, "dY");
    for (py::ssize_t j = 0; j < p; ++j) {
      rows.dY.push_back(dY->data() + j * Y.shape(0));
    }
  }
  bounds::IntervalHullOptions options;
  options.threads = threads;
  const py::gil_scoped_release unlocked;
  return bounds::interval_hull(rows, box, options);
}

std::unique_ptr<SetObject> set_of(const Doubles& Y, const Doubles& lower, const Doubles& upper, const Doubles& prior,
                                  const std::optional<Doubles>& dY) {
  const Box box = box_of(prior, "prior");
  const auto p = static_cast<py::ssize_t>(box.dimension());
  check_shape(Y, {-1, p}, "Y");
  if (dY) {
    check_shape(*dY, {Y.shape(0), p}, "dY");
  }
  const Slabs slabs(lower, upper, Y.shape(0));
  ArrayRows rows(Y.data(), dY ? dY->data() : nullptr, slabs.y.data(), slabs.dy.data(), slabs.y.size(), box.dimension());
  const py::gil_scoped_release unlocked;
  return std::make_unique<SetObject>(feasible_set(rows, box));
}

MinimaxFit fit_of(const Doubles& Y, const Doubles& y, const Doubles& prior, const std::optional<Doubles>& dY,
                  const std::optional<Doubles>& dy) {
  const Box box = box_of(prior, "prior");
  const auto p = static_cast<py::ssize_t>(box.dimension());
  check_shape(Y, {-1, p}, "Y");
  const auto left = values(y, "y", Y.shape(0));
  if (dY) {
    check_shape(*dY, {Y.shape(0), p}, "dY");
  }
  if (dy) {
    check_shape(*dy, {Y.shape(0)}, "dy");
  }
  ArrayRows rows(Y.data(), dY ? dY->data() : nullptr, left.data(), dy ? dy->data() : nullptr, left.size(),
                 box.dimension());
  const py::gil_scoped_release unlocked;
  return bounds::minimax_fit(rows, box);
}

// Points of all blocks combined, a row each; nothing where they are not known or more than `limit`.
std::optional<core::RowMatrix> all_vertices(const Polytope& set, std::size_t limit = 1 << 16) {
  if (!set.has_vertices()) {
    return std::nullopt;
  }
  std::size_t count = 1;
  for (const Polytope::Block& block : set.blocks()) {
    count *= static_cast<std::size_t>(block.vertices->points.cols());
    if (count > limit) {
      return std::nullopt;
    }
  }
  core::RowMatrix points(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(set.dimension()));
  Eigen::Index repeat = 1;
  for (const Polytope::Block& block : set.blocks()) {
    const Eigen::MatrixXd& own = block.vertices->points;
    for (Eigen::Index row = 0; row < points.rows(); ++row) {
      for (std::size_t j = 0; j < block.parameters.size(); ++j) {
        points(row, static_cast<Eigen::Index>(block.parameters[j])) =
            own(static_cast<Eigen::Index>(j), row / repeat % own.cols());
      }
    }
    repeat *= own.cols();
  }
  return points;
}

// f(pointer to p numbers) of one direction, or of each row.
template <typename T, typename F>
py::object of_rows(const Doubles& a, std::size_t p, const F& f) {
  const auto width = static_cast<py::ssize_t>(p);
  if (a.ndim() == 1) {
    check_shape(a, {width}, "argument");
    return py::cast(f(std::span<const double>(a.data(), p)));
  }
  check_shape(a, {-1, width}, "argument");
  py::array_t<T> out(a.shape(0));
  T* const to = out.mutable_data();
  const double* const from = a.data();
  const auto count = static_cast<std::size_t>(a.shape(0));
  const py::gil_scoped_release unlocked;
  for (std::size_t i = 0; i < count; ++i) {
    to[i] = f(std::span<const double>(from + i * p, p));
  }
  return out;
}

// Serves one thread: the lock is for Python's others.
struct RuleObject {
  detector::ThresholdRule rule;
  std::mutex use;
};

py::tuple thresholds(RuleObject& r, const Doubles& Y, const std::optional<Doubles>& dY, const Doubles& dy) {
  const std::size_t p = r.rule.set().dimension();
  check_shape(Y, {-1, static_cast<py::ssize_t>(p)}, "Y");
  if (dY) {
    check_shape(*dY, {Y.shape(0), Y.shape(1)}, "dY");
  }
  const bool one = dy.ndim() == 0;
  if (!one) {
    check_shape(dy, {Y.shape(0)}, "dy");
  }
  py::array_t<double> lower(Y.shape(0)), upper(Y.shape(0));
  double *const l = lower.mutable_data(), *const u = upper.mutable_data();
  const auto count = static_cast<std::size_t>(Y.shape(0));
  const std::vector<double> zeros(p, 0.0);
  const double *const rows = Y.data(), *const errors = dY ? dY->data() : nullptr, *const output = dy.data();
  {
    const py::gil_scoped_release unlocked;
    const std::lock_guard hold(r.use);
    for (std::size_t i = 0; i < count; ++i) {
      const std::span<const double> dy_row =
          errors != nullptr ? std::span<const double>(errors + i * p, p) : std::span<const double>(zeros);
      const detector::Threshold t = r.rule.at(std::span<const double>(rows + i * p, p), dy_row, output[one ? 0 : i]);
      l[i] = t.lower;
      u[i] = t.upper;
    }
  }
  return py::make_tuple(lower, upper);
}

void bind_set(py::module_& m) {
  py::class_<SetObject>(m, "FeasibleSet",
                        "{ theta in prior : the rows hold }, a polytope of p parameters with certified bounds. "
                        "Immutable; may be used by several threads.")
      .def(py::init(&set_of), py::arg("Y"), py::arg("lower"), py::arg("upper"), py::arg("prior"),
           py::arg("dY") = std::nullopt,
           "{ theta in prior : for every row there is |Y0 - Y| <= dY with lower <= Y0 theta <= upper }.\n\n"
           "Y and dY (>= 0) of shape (rows, p), lower and upper (rows,), prior (p, 2) and finite. float64 arrays that "
           "are C-contiguous are read where they lie. Rounded outward: never inside the exact set (Assumption 1).\n\n"
           "Raises InvalidArgument for shapes and numbers that are not finite.")
      .def_property_readonly(
          "empty", [](const SetObject& s) { return s.set.status == FeasibleSet::Status::empty; },
          "proved empty: no theta of the prior explains the rows; see contradiction")
      .def_property_readonly(
          "dimension", [](const SetObject& s) { return s.hull.rows(); }, "p")
      .def_property_readonly(
          "A", [](const py::object& self) { return view(self.cast<const SetObject&>().A, self); },
          "a facet a row, shape (facets, p), read-only view: the set is { A theta <= b }")
      .def_property_readonly(
          "b", [](const py::object& self) { return view(self.cast<const SetObject&>().b, self); },
          "right-hand sides, shape (facets,), read-only view")
      .def_property_readonly(
          "hull", [](const py::object& self) { return view(self.cast<const SetObject&>().hull, self); },
          "certified interval hull, shape (p, 2), read-only view; the prior where the set is empty")
      .def_property_readonly(
          "vertices",
          [](const SetObject& s) -> py::object {
            const std::optional<core::RowMatrix> points = all_vertices(s.polytope());
            return points ? py::object(py::array_t<double>({points->rows(), points->cols()}, points->data()))
                          : py::object(py::none());
          },
          "all vertices, shape (vertices, p); None where they are not known or more than 65536")
      .def_property_readonly(
          "centre", [](const SetObject& s) { return copy(s.polytope().chebyshev_centre()); },
          "Chebyshev centre, shape (p,): the mid-point of the largest ball, in units of the hull's widths")
      .def_property_readonly(
          "contradiction", [](const SetObject& s) { return proof_of(s.set.contradiction); },
          "rows that prove that the set is empty, with their multipliers; else none")
      .def_property_readonly(
          "lower_proofs", [](const SetObject& s) { return proofs_of(s.set.lower); },
          "for each parameter the rows and multipliers that prove its lower bound")
      .def_property_readonly("upper_proofs", [](const SetObject& s) { return proofs_of(s.set.upper); })
      .def(
          "support",
          [](const SetObject& s, const Doubles& a) {
            const Polytope& set = s.polytope();
            return of_rows<double>(a, set.dimension(), [&set](std::span<const double> d) { return set.support(d); });
          },
          py::arg("a"),
          "h(a) = max { a theta : theta in set }, rounded outward: a float for a of shape (p,), else shape (m,) for "
          "a of shape (m, p). A linear program each; the interpreter's lock is released.")
      .def(
          "contains",
          [](const SetObject& s, const Doubles& theta) {
            const Polytope& set = s.polytope();
            return of_rows<bool>(theta, set.dimension(), [&set](std::span<const double> x) { return set.contains(x); });
          },
          py::arg("theta"), "Whether theta (p,), or each row of (m, p), satisfies every facet.")
      .def("__repr__", [](const SetObject& s) {
        return "<wheelwright.FeasibleSet of " + std::to_string(s.hull.rows()) + " parameters, " +
               (s.set.status == FeasibleSet::Status::empty ? std::string("empty")
                                                           : std::to_string(s.A.rows()) + " facets") +
               ">";
      });
}

}  // namespace

SetObject::SetObject(Polytope polytope)
    : SetObject(FeasibleSet{.polytope = polytope,
                            .hull = polytope.hull(),
                            .lower = polytope.lower(),
                            .upper = polytope.upper(),
                            .contradiction = {}}) {}

SetObject::SetObject(FeasibleSet given) : set(std::move(given)), hull(sides_of(set.hull)) {
  const auto p = static_cast<Eigen::Index>(set.hull.dimension());
  const std::size_t facets = set.polytope ? set.polytope->facets().size() : 0;
  A.resize(static_cast<Eigen::Index>(facets), p);
  b.resize(static_cast<Eigen::Index>(facets));
  for (std::size_t i = 0; i < facets; ++i) {
    A.row(static_cast<Eigen::Index>(i)) = set.polytope->facets()[i].a.transpose();
    b[static_cast<Eigen::Index>(i)] = set.polytope->facets()[i].b;
  }
}

const Polytope& SetObject::polytope() const {
  check::that(set.polytope.has_value(), "the feasible set", "one that is not empty");
  return *set.polytope;
}

void bind_bounds(py::module_& m) {
  bind_set(m);
  py::class_<bounds::IntervalHull>(m, "IntervalHull", "Certified bounds of each parameter; see interval_hull().")
      .def_readonly("empty", &bounds::IntervalHull::empty, "proved empty: the bounds are those of the prior")
      .def_property_readonly(
          "hull",
          [](const bounds::IntervalHull& h) {
            const core::RowMatrix sides = sides_of(h.hull);
            return py::array_t<double>({sides.rows(), sides.cols()}, sides.data());
          },
          "shape (p, 2)")
      .def_property_readonly("lower_proofs", [](const bounds::IntervalHull& h) { return proofs_of(h.lower); })
      .def_property_readonly("upper_proofs", [](const bounds::IntervalHull& h) { return proofs_of(h.upper); })
      .def_property_readonly("contradiction", [](const bounds::IntervalHull& h) { return proof_of(h.contradiction); });
  m.def(
      "interval_hull", &hull_of, py::arg("Y"), py::arg("lower"), py::arg("upper"), py::arg("prior"),
      py::arg("dY") = std::nullopt, py::arg("threads") = 1,
      "Smallest and largest theta_j of { theta in prior : lower <= Y0 theta <= upper, |Y0 - Y| <= dY }, certified.\n\n"
      "Shapes as for FeasibleSet; arrays in Fortran order (columns contiguous) are read where they lie. Much faster "
      "than the set itself on many rows. The result does not depend on `threads`; the interpreter's lock is released.");
  py::class_<MinimaxFit>(m, "MinimaxFit", "lower <= gamma <= upper; see minimax_fit().")
      .def_readonly("lower", &MinimaxFit::lower, "certified")
      .def_readonly("upper", &MinimaxFit::upper, "what theta reaches over all rows")
      .def_readonly("converged", &MinimaxFit::converged)
      .def_readonly("passes", &MinimaxFit::passes)
      .def_property_readonly(
          "theta", [](const MinimaxFit& f) { return copy(f.theta); }, "shape (p,)")
      .def_property_readonly("active", [](const MinimaxFit& f) { return proof_of(f.active); });
  m.def("minimax_fit", &fit_of, py::arg("Y"), py::arg("y"), py::arg("prior"), py::arg("dY") = std::nullopt,
        py::arg("dy") = std::nullopt,
        "Smallest gamma, over theta in prior, with |y - Y theta| <= gamma + dy + dY |theta| in every row (Chebyshev "
        "fit).\n\nY and dY of shape (rows, p), y and dy (rows,), prior (p, 2). The interpreter's lock is released.");
  py::class_<RuleObject>(m, "ThresholdRule", "The tight threshold (34) of rows over a feasible set.")
      .def(py::init([](const SetObject& set, const Doubles& estimate, const std::string& kind) {
             check::that(kind == "polytope" || kind == "box", "kind '" + kind + "'", "polytope or box");
             const auto theta = values(estimate, "estimate", set.hull.rows());
             const Eigen::VectorXd copied =
                 Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Eigen::Index>(theta.size()));
             return std::unique_ptr<RuleObject>(
                 new RuleObject{detector::ThresholdRule(set.polytope(), copied,
                                                        kind == "box" ? detector::ParameterSetKind::box
                                                                      : detector::ParameterSetKind::polytope),
                                {}});
           }),
           py::arg("set"), py::arg("estimate"), py::arg("kind") = "polytope",
           "For a feasible set and a best guess of shape (p,), which need not lie in it.")
      .def("at", &thresholds, py::arg("Y"), py::arg("dY") = std::nullopt, py::arg("dy") = 0.0,
           "(l, u) of shape (rows,) each: l <= y - Y estimate <= u for every theta in the set, every error of Y up to "
           "dY and of y up to dy. Y and dY of shape (rows, p), dy a number or (rows,); the unit is that of y.");
}

}  // namespace wheelwright::python
