// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/logs/hdf5_log.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::logs {
namespace {

using hdf5::Handle;

constexpr hsize_t chunk_rows = 8192;
constexpr unsigned packing_level = 4;

class Hdf5Writer final : public LogWriter {
 public:
  Hdf5Writer(std::filesystem::path path, std::vector<std::string> names) : beside_(std::move(path)) {
    hdf5::begin_library();
    file_ = Handle(H5Fcreate(beside_.path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    const Handle group(file_ ? H5Gcreate2(file_.get(), "log", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT) : -1, H5Gclose);
    if (!group) {
      fail();
    }
    names.insert(names.begin(), "t");
    for (const std::string& name : names) {
      add(group.get(), name);
    }
  }

  void write(const LogBlock& block) override {
    check_block(block, datasets_.size() - 1);
    if (block.rows() == 0) {
      return;
    }
    append(datasets_.front().get(), block.t);
    for (std::size_t c = 0; c < block.columns.size(); ++c) {
      append(datasets_[c + 1].get(), block.columns[c]);
    }
    rows_ += block.rows();
  }

  void commit() override {
    datasets_.clear();
    if (H5Fflush(file_.get(), H5F_SCOPE_LOCAL) < 0) {
      fail();
    }
    file_ = Handle();
    beside_.put();
  }

 private:
  [[noreturn]] void fail() {
    throw InputError(beside_.place().string() +
                     ": cannot be written: the disk is full, or no HDF5 file can be made there");
  }

  void add(hid_t group, const std::string& name) {
    const hsize_t none = 0, unlimited = H5S_UNLIMITED;
    const Handle space(H5Screate_simple(1, &none, &unlimited), H5Sclose);
    const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_chunk(layout.get(), 1, &chunk_rows);
    H5Pset_shuffle(layout.get());
    H5Pset_deflate(layout.get(), packing_level);
    H5Pset_obj_track_times(layout.get(), false);  // equal logs make equal files, whenever they are written
    Handle dataset(H5Dcreate2(group, name.c_str(), H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, layout.get(), H5P_DEFAULT),
                   H5Dclose);
    if (!dataset) {
      fail();
    }
    if (const LogColumn* column = find_log_column(name); column != nullptr) {
      const std::string unit(column->unit);
      const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
      H5Tset_size(type.get(), unit.size());
      H5Tset_cset(type.get(), H5T_CSET_UTF8);
      const Handle one(H5Screate(H5S_SCALAR), H5Sclose);
      const Handle attribute(H5Acreate2(dataset.get(), "units", type.get(), one.get(), H5P_DEFAULT, H5P_DEFAULT),
                             H5Aclose);
      if (!attribute || H5Awrite(attribute.get(), type.get(), unit.data()) < 0) {
        fail();
      }
    }
    datasets_.push_back(std::move(dataset));
  }

  void append(hid_t dataset, const std::vector<double>& values) {
    const hsize_t count = values.size(), all = rows_ + count;
    const Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose);
    if (H5Dset_extent(dataset, &all) < 0) {
      fail();
    }
    const Handle space(H5Dget_space(dataset), H5Sclose);
    if (H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, &rows_, nullptr, &count, nullptr) < 0 ||
        H5Dwrite(dataset, H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT, values.data()) < 0) {
      fail();
    }
  }

  files::FileBeside beside_;  // removed last, when the file is closed
  Handle file_;
  std::vector<Handle> datasets_;  ///< time, then the columns
  hsize_t rows_ = 0;
};

}  // namespace

std::unique_ptr<LogWriter> create_hdf5(const std::filesystem::path& path, const std::vector<std::string>& names) {
  check_column_names(names);
  return std::make_unique<Hdf5Writer>(path, names);
}

}  // namespace wheelwright::logs
