// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rows of a log in the setting of a commissioning.
#pragma once

#include "commission/setting.hpp"
#include "core/log.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {

/// The rows of `log` in this setting, with the error bounds `errors`.
[[nodiscard]] TorqueRows make_rows(LogSource& log, const Setting& setting, const filter::SignalErrors& errors = {});

}  // namespace wheelwright::commission
