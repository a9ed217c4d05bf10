// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/work_on_ranks.hpp>

#include "ranks.hpp"

namespace wheelwright::app {

std::optional<RunCount> run_on_ranks(const Work& work, const std::string& fingerprint,
                                     const std::function<ResultStore&()>& open, const RunOptions& options) {
  const MpiSession mpi;
  const RunCount count = run_work_on_ranks(mpi, work, fingerprint, open, options);
  return mpi.rank() == 0 ? std::optional(count) : std::nullopt;
}

}  // namespace wheelwright::app
