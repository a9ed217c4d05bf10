// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the types and attributes of HDF5 files say of stored numbers.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <hdf5.h>

namespace wheelwright::logs::hdf5 {

/// What stored numbers mean by the attributes of netCDF's conventions (CF).
struct StoredAs {
  double scale = 1.0, offset = 0.0;
  std::vector<double> missing{};  ///< stored numbers that stand for none

  [[nodiscard]] bool plain() const { return scale == 1.0 && offset == 0.0 && missing.empty(); }
  [[nodiscard]] double value(double stored) const {
    if (std::ranges::find(missing, stored) != missing.end()) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    return offset == 0.0 ? scale * stored : scale * stored + offset;  // + 0 would take the sign of -0
  }
};

/// What the attributes of a dataset say.
struct DatasetAttributes {
  std::string unit{};
  bool clear_unit = true;  ///< false where there are several, or something else than a text
  StoredAs stored{};
  std::string defect{};  ///< why the values cannot be told by them
};

/// Why the numbers of a type are not those that it seems to have: only formats that machines have are taken, since a
/// header without a checksum gives each bit its meaning. Empty where nothing speaks against them.
[[nodiscard]] std::string format_defect(hid_t type);

/// What the attributes of a dataset say of its `values`. Nothing where they are damaged: the library must not be asked
/// about them again, since it then reads what it has freed. Nor may it go through damaged ones, since it then gives
/// back what it does not have: looking for a name that none can have meets the damage first, and in the library's own
/// order it makes no table of those that stand outside of the header.
[[nodiscard]] std::optional<DatasetAttributes> attributes_of(hid_t dataset, hid_t values);

}  // namespace wheelwright::logs::hdf5
