// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cstdlib>
#include <string_view>

#include "ranks.hpp"

namespace wheelwright::app {

bool launched_by_mpi() {
  // Open MPI's mpirun; MPICH's and Intel's, and srun with PMI or PMI2.
  for (const char* const name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    if (const char* const size = std::getenv(name); size != nullptr) {
      const std::string_view text = size;
      int processes = 0;
      std::from_chars(text.data(), text.data() + text.size(), processes);
      return processes > 1;
    }
  }
  // srun with PMIx, which does not tell the number: Slurm does.
  if (std::getenv("PMIX_RANK") != nullptr) {
    const char* const tasks = std::getenv("SLURM_STEP_NUM_TASKS");
    return tasks == nullptr || std::string_view(tasks) != "1";
  }
  return false;
}

}  // namespace wheelwright::app
