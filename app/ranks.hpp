// SPDX-License-Identifier: Apache-2.0
/// \file
/// The processes that mpirun or srun started together, as far as a command cares.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <wheelwright/study/work.hpp>

namespace wheelwright::app {

/// True if this process is one of several that mpirun or srun started together, by the environment they set; MPI itself
/// is not asked, so that a plain run never starts it. False where that says that there is one alone.
[[nodiscard]] bool launched_by_mpi();

/// Evaluates `work` on all these processes (run_work_on_ranks()); each has to call it, once. `fingerprint` is what all
/// have to agree on; `open` is called on rank 0, and what it opens has the results there. Returns what was done on rank
/// 0, nothing on the others, whose part is over. Throws InputError where the program was built without MPI.
[[nodiscard]] std::optional<study::RunCount> run_on_ranks(const study::Work& work, const std::string& fingerprint,
                                                          const std::function<study::ResultStore&()>& open,
                                                          const study::RunOptions& options);

}  // namespace wheelwright::app
