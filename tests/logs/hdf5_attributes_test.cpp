// SPDX-License-Identifier: Apache-2.0
// What attributes, dimensions and places of datasets say of the columns of an HDF5 log.
#include "formats/logs/hdf5_log.hpp"

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <hdf5.h>

#include "core/error.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::hdf5_attributes_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::size_t rows = 200;

std::vector<double> times() {
  std::vector<double> t;
  for (std::size_t k = 0; k < rows; ++k) {
    t.push_back(static_cast<double>(k) / 128);
  }
  return t;
}

/// Whole numbers, so that every type holds them.
std::vector<double> speeds() {
  std::vector<double> omega;
  for (std::size_t k = 0; k < rows; ++k) {
    omega.push_back(static_cast<double>(k % 50) - 20);
  }
  return omega;
}

/// A file of HDF5 that is written dataset by dataset.
class Datasets {
 public:
  explicit Datasets(const std::filesystem::path& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {}
  ~Datasets() { H5Fclose(file_); }
  Datasets(const Datasets&) = delete;
  Datasets& operator=(const Datasets&) = delete;

  void group(const std::string& name) {
    H5Gclose(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }
  /// `values` in a dataset of these sides (one, of all values, where there are none), in chunks where `piece` has
  /// sides.
  void put(const std::string& name, const std::vector<double>& values, hid_t type = H5T_IEEE_F64LE,
           std::vector<hsize_t> sides = {}, const std::vector<hsize_t>& piece = {}) {
    if (sides.empty()) {
      sides = {values.size()};
    }
    const std::vector<hsize_t> most(sides.size(), H5S_UNLIMITED);
    const auto rank = static_cast<int>(sides.size());
    const hid_t space = H5Screate_simple(rank, sides.data(), piece.empty() ? nullptr : most.data());
    const hid_t how = H5Pcreate(H5P_DATASET_CREATE);
    if (!piece.empty()) {
      H5Pset_chunk(how, rank, piece.data());
      H5Pset_shuffle(how);
      H5Pset_deflate(how, 1);
    }
    const hid_t data = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, how, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    H5Dclose(data);
    H5Pclose(how);
    H5Sclose(space);
  }
  void attribute(const std::string& dataset, const std::string& name, const std::vector<double>& values,
                 hid_t type = H5T_IEEE_F64LE) {
    add(dataset, name, type, values.size(),
        [&](hid_t attribute) { return H5Awrite(attribute, H5T_NATIVE_DOUBLE, values.data()); });
  }
  /// Texts of fixed length, or of variable.
  void attribute(const std::string& dataset, const std::string& name, const std::vector<std::string>& texts,
                 bool variable = false) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, variable ? H5T_VARIABLE : 16);
    std::string fixed;
    std::vector<const char*> pointers;
    for (const std::string& text : texts) {
      fixed += text + std::string(16 - text.size(), '\0');
      pointers.push_back(text.c_str());
    }
    add(dataset, name, type, texts.size(), [&](hid_t attribute) {
      return variable ? H5Awrite(attribute, type, static_cast<const void*>(pointers.data()))
                      : H5Awrite(attribute, type, fixed.data());
    });
    H5Tclose(type);
  }
  [[nodiscard]] hid_t id() const { return file_; }

 private:
  void add(const std::string& dataset, const std::string& name, hid_t type, hsize_t count,
           const std::function<herr_t(hid_t)>& write) {
    const hid_t data = H5Dopen2(file_, dataset.c_str(), H5P_DEFAULT);
    const hid_t space = count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr);
    const hid_t attribute = H5Acreate2(data, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(write(attribute), 0);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Dclose(data);
  }

  hid_t file_;
};

class Hdf5Attributes : public testing::ScratchTest {
 protected:
  /// Times and speeds of this type, and what else `more` writes.
  void write(const std::function<void(Datasets&)>& more, hid_t type = H5T_IEEE_F64LE) {
    Datasets file(path("a.h5"));
    file.put("t", times());
    file.put("omega_r", speeds(), type);
    more(file);
  }
  LogTable read(const LogOptions& options = {}) {
    const auto log = open_log({path("a.h5")}, options);
    report = log->report();
    return read_all(*log);
  }
  std::vector<std::string> notes() { return report.files.at(0).notes; }
  std::string refusal(const LogOptions& options = {}) {
    return input_error([&] { read(options); });
  }
  static LogOptions mapped(const std::string& name, const std::string& place) {
    LogOptions options;
    options.map = {{name, place}};
    return options;
  }

  LogReport report;
};

// 0.05 rad/s, stored as 50, was read as 50 rad/s.
TEST_F(Hdf5Attributes, ScaleAndOffsetOfWhateverTypeAreAppliedAndSaid) {
  for (const auto& [values, numbers] : std::vector<std::pair<hid_t, hid_t>>{
           {H5T_STD_I16LE, H5T_IEEE_F64LE}, {H5T_IEEE_F32BE, H5T_IEEE_F32LE}, {H5T_STD_I32BE, H5T_STD_I8LE}}) {
    const double scale = numbers == H5T_STD_I8LE ? 3.0 : 0.25;
    write(
        [&](Datasets& file) {
          file.attribute("omega_r", "scale_factor", std::vector{scale}, numbers);
          file.attribute("omega_r", "add_offset", std::vector{5.0}, numbers);
        },
        values);
    const LogTable got = read();
    for (std::size_t k = 0; k < rows; ++k) {
      ASSERT_EQ(got.column("omega_r")[k], scale * speeds()[k] + 5.0);
    }
    const std::string said = fmt::format(
        "omega_r is /omega_r times {:g} (attribute scale_factor) plus 5 (attribute "
        "add_offset)",
        scale);
    EXPECT_THAT(notes(), ElementsAre(said));
    EXPECT_EQ(read(mapped("omega_r", "omega_r*2")).column("omega_r")[3], 2 * (scale * speeds()[3] + 5.0));
    EXPECT_THAT(notes(), ElementsAre(said + ", and that times 2"));
  }
  write([](Datasets& file) { file.attribute("t", "scale_factor", std::vector{0.5}); });
  EXPECT_EQ(read().t[10], times()[5]);
}

TEST_F(Hdf5Attributes, AScaleThatIsNoFiniteNumberIsRefused) {
  const std::vector<std::pair<std::function<void(Datasets&)>, std::string>> wrong{
      {[](Datasets& file) { file.attribute("omega_r", "scale_factor", std::vector<std::string>{"milli"}); },
       "'scale_factor' 'milli'"},
      {[](Datasets& file) {
         file.attribute("omega_r", "add_offset", std::vector{1.0, 2.0});
       },
       "'add_offset' 1, 2"},
      {[](Datasets& file) { file.attribute("omega_r", "scale_factor", std::vector{double{NAN}}); },
       "'scale_factor' nan"},
      {[](Datasets& file) { file.attribute("omega_r", "add_offset", std::vector{double{INFINITY}}); },
       "'add_offset' inf"}};
  for (const auto& [make, told] : wrong) {
    write(make);
    EXPECT_THAT(refusal(),
                AllOf(HasSubstr("a.h5: /omega_r has attribute " + told), HasSubstr("expected one finite number")));
  }
}

// The -9999 of a sensor that gave nothing were read as speeds.
TEST_F(Hdf5Attributes, FillValuesAreNoValues) {
  for (const std::string name : {"_FillValue", "missing_value"}) {
    write(
        [&](Datasets& file) {
          file.attribute("omega_r", name, std::vector{7.0}, H5T_STD_I16LE);
          file.attribute("omega_r", "scale_factor", std::vector{2.0});
        },
        H5T_STD_I16LE);
    EXPECT_THAT(read().column("omega_r"), AllOf(Not(Contains(14.0)), Contains(12.0))) << "the stored number counts";
    EXPECT_EQ(report.not_finite.count, rows / 50);
    EXPECT_THAT(notes(), Contains("7 in /omega_r stands for no value (attribute _FillValue or missing_value)"));
  }
  std::vector<double> few = speeds();
  few[4] = 1e20;  // as a float of 32 bits another number than the attribute's
  Datasets file(path("a.h5"));
  file.put("t", times());
  file.put("omega_r", few, H5T_IEEE_F32LE);
  file.attribute("omega_r", "_FillValue", std::vector{1e20, 19.0});
  EXPECT_GE(H5Fflush(file.id(), H5F_SCOPE_LOCAL), 0);
  EXPECT_EQ(read().rows(), rows - 1 - rows / 50);
}

// deg/s were taken as rad/s.
TEST_F(Hdf5Attributes, AUnitIsFoundInWhateverCase) {
  for (const std::string name : {"Units", "UNITS", "Unit", "units", "unit"}) {
    for (const bool variable : {false, true}) {
      write([&](Datasets& file) {
        file.attribute("omega_r", name, std::vector<std::string>{"deg/s", "deg/s"}, variable);
        file.put("tau_r", speeds());
        file.attribute("tau_r", name, std::vector<std::string>{" N m "}, variable);
      });
      EXPECT_EQ(read().names, std::vector<std::string>{"tau_r"}) << name;
      EXPECT_THAT(notes(),
                  ElementsAre(HasSubstr("/omega_r was not taken as omega_r: its unit is 'deg/s', expected rad/s")));
    }
  }
}

TEST_F(Hdf5Attributes, UnitsThatAreNoSingleTextAreSaid) {
  const std::vector<std::function<void(Datasets&)>> unclear{
      [](Datasets& file) {
        file.attribute("omega_r", "units", std::vector<std::string>{"rad/s", "deg/s"});
      },
      [](Datasets& file) {
        file.attribute("omega_r", "units", std::vector<std::string>{"rad/s", ""}, true);
      },
      [](Datasets& file) { file.attribute("omega_r", "units", std::vector{1.0}); },
      [](Datasets& file) { file.attribute("omega_r", "units", std::vector<std::string>(100, "deg/s")); },
      [](Datasets& file) {
        file.attribute("omega_r", "units", std::vector<std::string>{"rad/s"});
        file.attribute("omega_r", "Unit", std::vector<std::string>{"deg/s"});
      }};
  for (const auto& make : unclear) {
    write(make);
    EXPECT_THAT(testing::input_error([&] { static_cast<void>(read()); }),
                AllOf(HasSubstr("a.h5: no column but the time is known: the file has /omega_r, /t: expected one of"),
                      HasSubstr("; /omega_r was not taken as omega_r: it has units that are no single text: --map "
                                "\"omega_r=/omega_r*FACTOR\" takes it")));
    EXPECT_EQ(read(mapped("omega_r", "/omega_r*2")).column("omega_r")[3], 2 * speeds()[3]);
  }
}

TEST_F(Hdf5Attributes, MoreAttributesThanADatasetOfALogHasAreRefused) {
  write([](Datasets& file) {
    for (int k = 0; k <= 1000; ++k) {
      file.attribute("omega_r", fmt::format("note{}", k), std::vector{1.0});
    }
  });
  EXPECT_THAT(refusal(), HasSubstr("/omega_r has 1001 attributes: expected at most 1000"));
}

// "m or rad", which the program itself writes, was not taken, and only the times were left.
TEST_F(Hdf5Attributes, EveryColumnThatIsWrittenIsReadAgain) {
  LogTable table;
  table.names = log_column_names();
  std::erase(table.names, "t");
  LogBlock block;
  block.t = times();
  block.columns.assign(table.names.size(), speeds());
  block.segment_starts = {0};
  const auto writer = create_hdf5(path("a.h5"), table.names);
  writer->write(block);
  writer->commit();
  EXPECT_EQ(read().names.size(), table.names.size());
  EXPECT_THAT(notes(), IsEmpty());
}

// Vectors of MATLAB (1xN) and numpy's column vectors (Nx1) were refused.
TEST_F(Hdf5Attributes, AVectorMayHaveASecondDimensionOfOne) {
  const std::vector<double> omega = speeds();
  for (const auto& sides : {std::vector<hsize_t>{1, rows}, std::vector<hsize_t>{rows, 1}}) {
    const bool lying = sides[0] == 1;
    for (const auto& piece : {std::vector<hsize_t>{}, std::vector<hsize_t>{lying ? 1U : 48U, lying ? 48U : 1U},
                              std::vector<hsize_t>{lying ? 3U : 48U, lying ? 48U : 3U}}) {
      {
        Datasets file(path("a.h5"));
        file.put("t", times(), H5T_IEEE_F64LE, sides, piece);
        file.put("omega_r", omega, H5T_IEEE_F32LE, sides, piece);
        file.put("x", {4.0}, H5T_IEEE_F64LE, {1, 1});
      }
      const LogTable got = read();
      EXPECT_EQ(got.t, times());
      EXPECT_EQ(got.column("omega_r"), omega);
      EXPECT_EQ(got.names, std::vector<std::string>{"omega_r"}) << "a number is no vector";
    }
  }
}

TEST_F(Hdf5Attributes, PiecesOfAVectorAreLookedForAlongIt) {
  const hsize_t sides[] = {1, rows}, piece[] = {1, 50}, first[] = {0, 100}, some[] = {1, 50};
  write([&](Datasets& file) {
    const hid_t space = H5Screate_simple(2, sides, nullptr), how = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(how, 2, piece);
    const hid_t data = H5Dcreate2(file.id(), "tau_r", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    H5Sselect_hyperslab(space, H5S_SELECT_NOTB, first, nullptr, some, nullptr);
    EXPECT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, space, space, H5P_DEFAULT, speeds().data()), 0);
    H5Dclose(data);
    H5Pclose(how);
    H5Sclose(space);
  });
  EXPECT_THAT(refusal(), HasSubstr("/tau_r has 200 values, of which row 101 and others were never written"));
  write([&](Datasets& file) {
    file.put("tau_r", speeds(), H5T_IEEE_F64LE, {1, rows}, {hsize_t{1} << 12, hsize_t{1} << 11});
  });
  EXPECT_THAT(refusal(), HasSubstr("/tau_r is stored in pieces of 2048 x 4096 values: expected at most"));
}

TEST_F(Hdf5Attributes, OfAMatrixItIsSaidWhatToDo) {
  std::vector<double> both = speeds();
  both.insert(both.end(), both.begin(), both.end());
  write([&](Datasets& file) { file.put("tau_r", both, H5T_IEEE_F64LE, {rows, 2}); });
  const std::string told = "has 2 dimensions: expected 1: write each column as a dataset of its own";
  EXPECT_EQ(read().names, std::vector<std::string>{"omega_r"});
  EXPECT_THAT(notes(), ElementsAre("/tau_r was not taken as tau_r: it " + told));
  EXPECT_THAT(refusal(mapped("tau_r", "/tau_r")), HasSubstr("/tau_r " + told));
}

// "no dataset of times: ... the file has /time", and no word of why that was none.
TEST_F(Hdf5Attributes, OfATimeInAnotherUnitTheUnitIsSaid) {
  {
    Datasets file(path("a.h5"));
    std::vector<double> t = times();
    for (double& time : t) {
      time *= 1000.0;
    }
    file.put("time", t);
    file.attribute("time", "units", std::vector<std::string>{"ms"});
    file.put("omega_r", speeds());
  }
  EXPECT_THAT(refusal(), AllOf(HasSubstr("no dataset of times"), HasSubstr("/time has the unit 'ms', expected s"),
                               HasSubstr("--map \"t=/time*SECONDS_A_UNIT\"")));
  EXPECT_EQ(read(mapped("t", "/time*0.001")).rows(), rows);
}

TEST_F(Hdf5Attributes, MembersThatAreNoNumbersAreSaid) {
  struct Row {
    double t, omega_r[2], tau_r;
    double gyro_z;
  };
  std::vector<Row> table(rows);
  for (std::size_t k = 0; k < rows; ++k) {
    table[k] = {times()[k], {1.0, 2.0}, 3.0, 4.0};
  }
  {
    const Datasets file(path("a.h5"));
    const hsize_t two = 2, count = rows;
    const hid_t pair = H5Tarray_create2(H5T_NATIVE_DOUBLE, 1, &two), inner = H5Tcreate(H5T_COMPOUND, sizeof(double));
    H5Tinsert(inner, "tau_r", 0, H5T_NATIVE_DOUBLE);
    const hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(Row)), space = H5Screate_simple(1, &count, nullptr);
    H5Tinsert(type, "t", HOFFSET(Row, t), H5T_NATIVE_DOUBLE);
    H5Tinsert(type, "omega_r", HOFFSET(Row, omega_r), pair);
    H5Tinsert(type, "wheel", HOFFSET(Row, tau_r), inner);
    H5Tinsert(type, "gyro_z", HOFFSET(Row, gyro_z), H5T_NATIVE_DOUBLE);
    const hid_t data = H5Dcreate2(file.id(), "log", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, table.data()), 0);
    H5Dclose(data);
    for (const hid_t made : {type, inner, pair}) {
      H5Tclose(made);
    }
    H5Sclose(space);
  }
  EXPECT_EQ(read().names, std::vector<std::string>{"gyro_z"});
  EXPECT_THAT(notes(),
              ElementsAre(HasSubstr("/log.omega_r was not taken as omega_r: it is a member with several numbers"),
                          HasSubstr("/log.wheel.tau_r was not taken as tau_r: it is a member of a member")));
}

// Times at the root and the rest in /joints: the log was read without its speeds, and nothing was said.
TEST_F(Hdf5Attributes, ColumnsInAnotherGroupThanTheTimesAreSaid) {
  write([](Datasets& file) {
    file.group("joints");
    for (const std::string name : {"omega_l", "omega_r", "raw"}) {
      file.put("joints/" + name, speeds());
    }
    file.put("joints/tau_r", std::vector<double>(rows / 2, 1.0));
    file.group("vehicle");  // behind t
    file.put("vehicle/t", times());
    file.put("vehicle/gyro_z", speeds());
  });
  EXPECT_EQ(read().names, std::vector<std::string>{"omega_r"});
  EXPECT_THAT(notes(), ElementsAre(HasSubstr("there are several logs in it"),
                                   "/joints/omega_l was not taken as omega_l: it lies in another group than the times: "
                                   "--map omega_l=/joints/omega_l takes it"));
  EXPECT_EQ(read(mapped("omega_l", "/joints/omega_l")).column("omega_l"), speeds());
  EXPECT_THAT(notes(), ElementsAre(HasSubstr("there are several logs in it")));
}

}  // namespace
}  // namespace wheelwright::logs::hdf5_attributes_test
