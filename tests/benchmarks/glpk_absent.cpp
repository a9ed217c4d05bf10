// SPDX-License-Identifier: Apache-2.0
// Takes the place of glpk_peers.cpp where GLPK is absent.
#include "core/error.hpp"

#include "tests/benchmarks/lp_peers.hpp"

namespace wheelwright::bench {

bool has_glpk() noexcept { return false; }
HullPeer glpk_hull(const DriveRows&, GlpkForm) { throw Error("built without GLPK"); }
MinimaxPeer glpk_minimax(const DriveRows&) { throw Error("built without GLPK"); }
SupportPeer glpk_support(const Facets&) { throw Error("built without GLPK"); }

}  // namespace wheelwright::bench
