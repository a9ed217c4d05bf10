// SPDX-License-Identifier: Apache-2.0
/// \file
/// Independent items of work on the processes that mpirun started, with the results of one thread.
#pragma once

#include <functional>
#include <string>

#include <wheelwright/study/mpi_session.hpp>
#include <wheelwright/study/work.hpp>

namespace wheelwright {

/// run_work() on all ranks; each has to call it. Rank 0 hands items out to whoever has little left, evaluates items itself, and
/// puts each result into the store as soon as it has arrived. The others send each result as soon as it is done, and have an item
/// or more waiting for each thread, so that nobody idles for want of a message. Looks for messages are up to 2 ms apart and keep no
/// processor busy. A killed rank ends all (mpirun sees to that): what rank 0 had put is in the store, and what was under way or on
/// its way is evaluated again by the next run.
///
/// \param work         the same on every rank
/// \param fingerprint  what all ranks have to agree on, in lines; nothing is evaluated before they do
/// \param open         called on rank 0 alone, once: the store, which has to live until the end
/// \param options      `threads` of this rank, beside the one that sends and receives; `progress` is called on rank 0; no shard
/// \returns on rank 0 what the whole run did, elsewhere what the rank evaluated.
///
/// Throws on rank 0 what an item or the store throws, as run_work() does; what comes from another rank is InputError, Error or
/// std::runtime_error again, and names the rank. InputError names the rank that has another fingerprint. The other
/// ranks return as if all were well. Throws InvalidArgument on every rank for no thread or a shard.
RunCount run_work_on_ranks(const MpiSession& mpi, const Work& work, const std::string& fingerprint,
                           const std::function<ResultStore&()>& open, const RunOptions& options = {});

}  // namespace wheelwright
