// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/rebuilt_rows.hpp>

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/filter/row_stream.hpp>

namespace wheelwright::results {
namespace {

/// The instants of the log's regression that the claims name.
RegressionBlock named_instants(const ModelClaims& claims, LogSource& log) {
  std::set<std::size_t> wanted;
  const auto want = [&](const bounds::RowOrigin& origin) {
    if (!origin.is_prior) {
      wanted.insert(origin.sample);
    }
  };
  for (const auto* bounds : {&claims.lower, &claims.upper}) {
    for (const PublishedBound& bound : *bounds) {
      std::ranges::for_each(bound.proof, [&](const NamedRow& row) { want(row.origin); });
    }
  }
  std::ranges::for_each(claims.contradiction, [&](const NamedRow& row) { want(row.origin); });
  std::ranges::for_each(claims.facets, [&](const bounds::HalfSpace& facet) { want(facet.origin); });

  RegressionBlock kept, block;
  kept.resize(wanted.size(), claims.model.n(), claims.model.p());
  const auto n = static_cast<Eigen::Index>(claims.model.n());
  std::size_t count = 0;
  TorqueRows rows(log, RegressorFilter(claims.model, claims.filter, claims.measurement, claims.errors));
  while (rows.next(block)) {
    for (std::size_t k = 0; k < block.instants(); ++k) {
      if (wanted.contains(block.sample[k])) {
        const auto to = static_cast<Eigen::Index>(count) * n, from = static_cast<Eigen::Index>(k) * n;
        kept.sample[count] = block.sample[k];
        kept.t[count++] = block.t[k];
        kept.Y.middleRows(to, n) = block.Y.middleRows(from, n);
        kept.dY.middleRows(to, n) = block.dY.middleRows(from, n);
        kept.y.segment(to, n) = block.y.segment(from, n);
        kept.dy.segment(to, n) = block.dy.segment(from, n);
      }
    }
  }
  kept.sample.resize(count);  // fewer than the storage holds where a name is no instant of this log
  kept.t.resize(count);
  return kept;
}

/// A side of the prior box.
bounds::HalfSpace side_of(const Box& prior, const bounds::RowOrigin& origin) {
  const Interval& side = prior.sides[origin.parameter];
  const bool is_upper = origin.side == bounds::Side::upper;
  bounds::HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(prior.dimension())),
                        is_upper ? side.upper : -side.lower, origin};
  row.a[static_cast<Eigen::Index>(origin.parameter)] = is_upper ? 1.0 : -1.0;
  return row;
}

}  // namespace

RebuiltRows::RebuiltRows(const ModelClaims& claims, LogSource& log)
    : claims_(claims), instants_(named_instants(claims, log)) {}

bool RebuiltRows::depends_on(const Box& box) const {
  const bounds::SlabRows slabs(box);
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    const auto column = instants_.dY.col(static_cast<Eigen::Index>(j)).head(instants_.rows());
    if (slabs.sign_is_open(j) && (column.array() > 0.0).any()) {
      return true;
    }
  }
  return false;
}

std::optional<bounds::HalfSpace> RebuiltRows::row(const bounds::RowOrigin& origin, const Box& box,
                                                  std::string& why) const {
  if (origin.is_prior) {
    return side_of(claims_.prior, origin);
  }
  if (std::ranges::find(claims_.dropped, origin.sample) != claims_.dropped.end()) {
    why = fmt::format("row {} is one of those that were left out as outliers", origin.sample);
    return std::nullopt;
  }
  const auto it = std::ranges::lower_bound(instants_.sample, origin.sample);
  if (it == instants_.sample.end() || *it != origin.sample) {
    why = fmt::format("row {} is no instant of the regression of this log", origin.sample);
    return std::nullopt;
  }
  const auto k = static_cast<std::size_t>(it - instants_.sample.begin());
  if (instants_.t[k] != origin.t) {
    why = fmt::format("row {} is at t = {} s in this log, not at {} s", origin.sample, instants_.t[k], origin.t);
    return std::nullopt;
  }
  bounds::HalfSpace upper, lower;
  const auto row = static_cast<Eigen::Index>(k * instants_.outputs + origin.output);
  bounds::SlabRows(box).half_spaces(instants_, row, upper, lower);
  return origin.side == bounds::Side::upper ? upper : lower;
}

std::vector<bounds::WeightedRow> RebuiltRows::proof(const std::vector<NamedRow>& named, const Box& box,
                                                    std::string& why) const {
  std::vector<bounds::WeightedRow> rows;
  for (const NamedRow& name : named) {
    std::string missing;
    if (auto half_space = row(name.origin, box, missing)) {
      rows.push_back({*std::move(half_space), name.multiplier});
    } else {
      rows.push_back({{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(box.dimension())), 0.0, {}}, 0.0});
      why = why.empty() ? missing : why;
    }
  }
  return rows;
}

}  // namespace wheelwright::results
