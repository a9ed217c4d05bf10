// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"

#include "app/run_items.hpp"

namespace wheelwright::app {

std::optional<study::RunCount> run_on_ranks(const study::Work& /*work*/, const std::string& /*fingerprint*/,
                                            const std::function<study::ResultStore&()>& /*open*/,
                                            const study::RunOptions& /*options*/) {
  throw InputError(
      "mpirun: this wheelwright was built without MPI: expected one that was built with it (tools/setup.sh), or one "
      "process, or --shard I/N");
}

}  // namespace wheelwright::app
