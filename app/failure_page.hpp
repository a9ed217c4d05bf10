// SPDX-License-Identifier: Apache-2.0
/// \file
/// A report of what could be read, where a step fails.
#pragma once

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/bytes.hpp>
#include <wheelwright/report/commission_report.hpp>

#include "common.hpp"

namespace wheelwright::app {

/// Runs `work` and returns what it returns. Where it throws an Error and results are wanted, out/report.html shows the
/// message and the raw signals of `context`; the error is thrown on.
template <typename Work>
auto or_failure_page(const CommonOptions& options, const report::ReportContext& context, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    if (!options.out.empty()) {
      files::atomic_write(options.out / "report.html", report::failure_report(error.what(), context));
    }
    throw;
  }
}

}  // namespace wheelwright::app
