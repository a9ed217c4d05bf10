// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/core/error.hpp>

#include "ranks.hpp"

namespace wheelwright::app {

std::optional<RunCount> run_on_ranks(const Work& /*work*/, const std::string& /*fingerprint*/,
                                     const std::function<ResultStore&()>& /*open*/, const RunOptions& /*options*/) {
  throw InputError(
      "mpirun: this wheelwright was built without MPI: expected one that was built with it (tools/setup.sh), or one "
      "process, or --shard I/N");
}

}  // namespace wheelwright::app
