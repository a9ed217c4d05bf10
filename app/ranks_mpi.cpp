// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/work_on_ranks.hpp>

#include "run_items.hpp"

namespace wheelwright::app {

std::optional<study::RunCount> run_on_ranks(const study::Work& work, const std::string& fingerprint,
                                            const std::function<study::ResultStore&()>& open,
                                            const study::RunOptions& options) {
  const study::MpiSession mpi;
  const study::RunCount count = study::run_work_on_ranks(mpi, work, fingerprint, open, options);
  return mpi.rank() == 0 ? std::optional(count) : std::nullopt;
}

}  // namespace wheelwright::app
