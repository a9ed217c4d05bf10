// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <string_view>

#include "app/run_items.hpp"
#include "study/work_on_ranks.hpp"

namespace wheelwright::app {
namespace {

// Ranks that are all on this machine talk through its memory: none of them listens on the network. Whoever chose
// otherwise (mpirun --mca btl) keeps it.
void stay_on_this_machine() {
  const char* const all = std::getenv("OMPI_COMM_WORLD_SIZE");
  const char* const here = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE");
  if (all != nullptr && here != nullptr && std::string_view(all) == here) {
    setenv("OMPI_MCA_btl", "self,vader", 0);
  }
}

}  // namespace

std::optional<study::RunCount> run_on_ranks(const study::Work& work, const std::string& fingerprint,
                                            const std::function<study::ResultStore&()>& open,
                                            const study::RunOptions& options) {
  stay_on_this_machine();
  const study::MpiSession mpi;
  const study::RunCount count = study::run_work_on_ranks(mpi, work, fingerprint, open, options);
  return mpi.rank() == 0 ? std::optional(count) : std::nullopt;
}

}  // namespace wheelwright::app
