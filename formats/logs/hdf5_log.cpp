// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/hdf5_log.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/bag_files.hpp"
#include "formats/logs/hdf5_attributes.hpp"
#include "formats/logs/hdf5_header.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/mcap_format.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/logs/wall_clock.hpp"

namespace wheelwright::logs {
namespace {

using hdf5::DatasetAttributes;
using hdf5::format_defect;
using hdf5::Handle;
using hdf5::StoredAs;

constexpr std::string_view signature("\x89HDF\r\n\x1a\n", 8);
constexpr std::size_t rows_at_once = 8192;
constexpr std::size_t most_objects = 100000;
constexpr std::ptrdiff_t deepest_group = 64;
constexpr hsize_t most_rows = hsize_t{1} << 32;
constexpr hsize_t largest_chunk = hsize_t{1} << 25;  // bytes; the library holds a chunk of each column
constexpr hsize_t cached_chunks = hsize_t{1} << 20;  // bytes that the library keeps unasked
constexpr std::uint64_t always_pieces = std::uint64_t{1} << 16, bytes_a_piece = 8;

/// Where the values of a dataset stand: in a line along one of at most two dimensions, of which the other has a size of
/// 1, as MATLAB and column vectors have it.
struct ValueLine {
  using Place = std::array<hsize_t, 2>;

  hsize_t rows = 0;
  int dimensions = 1;
  std::size_t along = 0;

  [[nodiscard]] Place place(hsize_t row) const { return along == 0 ? Place{row, 0} : Place{0, row}; }
  [[nodiscard]] Place sides(hsize_t count) const { return along == 0 ? Place{count, 1} : Place{1, count}; }
};

/// One column that a file has: a dataset, or a member of one of a compound type.
struct Source {
  std::string path{};    ///< of the dataset
  std::string member{};  ///< empty for a plain dataset
  std::string unit{};
  ValueLine line{};
  hsize_t chunk = 0;       ///< bytes of one, 0 where it is not stored in chunks
  std::string refused{};   ///< why it is not read, without a subject; empty where it is
  std::string unlike{};    ///< how it differs from a column, in spite of its name
  std::string doubtful{};  ///< why it is read only where it is asked for by name
  std::string remedy{};    ///< what makes a column of what is unlike one
  StoredAs stored{};
  double factor = 1.0;  ///< by which its values are multiplied

  [[nodiscard]] std::string name() const { return member.empty() ? path.substr(path.rfind('/') + 1) : member; }
  [[nodiscard]] std::string shown() const { return member.empty() ? path : path + "." + member; }
  /// Where its companions are: the group, or the dataset of members.
  [[nodiscard]] std::string home() const { return member.empty() ? path.substr(0, path.rfind('/') + 1) : path; }
};

Handle open_file(const std::filesystem::path& path) {
  hdf5::begin_library();
  Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file) {
    throw InputError(path.string() +
                     ": the HDF5 library cannot open it: expected a whole HDF5 file, closed by its writer");
  }
  return file;
}

bool is_number(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return kind == H5T_INTEGER || kind == H5T_FLOAT || kind == H5T_ENUM;
}

/// Bytes of the file.
std::uint64_t size_of(hid_t file) {
  hsize_t size = 0;
  return H5Fget_filesize(file, &size) < 0 ? 0 : size;
}

/// Why values packed by a shuffle are not read: bytes come back in order where it knows the size of an element, which
/// the library always gives it, and the library asks nobody whether the file has another.
std::string shuffle_defect(hid_t how, std::size_t width) {
  std::array<unsigned, 1> parameter{};
  std::size_t parameters = parameter.size();
  unsigned flags = 0, configuration = 0;
  const bool shuffled = H5Pget_filter_by_id2(how, H5Z_FILTER_SHUFFLE, &flags, &parameters, parameter.data(), 0, nullptr,
                                             &configuration) >= 0;
  return shuffled && parameter[0] != width
             ? fmt::format("has values of {} bytes, shuffled as such of {}: the file is damaged", width, parameter[0])
             : "";
}

/// Sides of a chunk: along the line of values, and across it.
struct PieceSides {
  hsize_t along = 0, across = 1;
};

/// Those of a dataset in chunks; without length where they have other dimensions than the dataset, or no size.
PieceSides piece_of(hid_t how, const ValueLine& line) {
  ValueLine::Place sides{0, 1};
  if (H5Pget_chunk(how, line.dimensions, sides.data()) != line.dimensions || sides[1 - line.along] == 0) {
    return {};
  }
  return {sides[line.along], sides[1 - line.along]};
}

/// Why a dataset is not read: what it says of its place is followed with trust only, and its size must be one that a
/// log has. `chunk` becomes the bytes of a chunk.
std::string refusal(hid_t dataset, hid_t type, const ValueLine& line, bool trust, hsize_t& chunk) {
  const hsize_t rows = line.rows;
  const Handle how(H5Dget_create_plist(dataset), H5Pclose);
  const H5D_layout_t layout = how ? H5Pget_layout(how.get()) : H5D_LAYOUT_ERROR;
  if (!how || layout == H5D_LAYOUT_ERROR) {
    return "does not say how it is stored: expected a whole HDF5 file";
  }
  if (!trust && layout == H5D_VIRTUAL) {
    return "is a virtual dataset, whose values stand in other files: expected them in this file, or --trust";
  }
  if (!trust && H5Pget_external_count(how.get()) > 0) {
    return "has its values in another file: expected them in this file, or --trust";
  }
  const std::size_t width = H5Tget_size(type);
  if (width == 0) {
    return "has values of no bytes: expected numbers";
  }
  if (std::string defect = shuffle_defect(how.get(), width); !defect.empty()) {
    return defect;
  }
  const auto [piece, beside] = layout == H5D_CHUNKED ? piece_of(how.get(), line) : PieceSides{0, 1};
  if (layout == H5D_CHUNKED && (piece == 0 || piece > largest_chunk / width / beside)) {
    return fmt::format("is stored in pieces of {}{} values: expected at most {} bytes in one", piece,
                       beside == 1 ? "" : fmt::format(" x {}", beside), largest_chunk);
  }
  chunk = piece * beside * width;
  const Handle file(H5Iget_file_id(dataset), H5Fclose);
  if (!trust && piece > 0 && rows / piece > always_pieces + size_of(file.get()) / bytes_a_piece) {
    return fmt::format(
        "has {} values in pieces of {}, more pieces than its file of {} bytes has room for: expected pieces that were "
        "written, or --trust",
        rows, piece, size_of(file.get()));
  }
  if (rows > most_rows) {
    return fmt::format("has {} values: expected at most {}", rows, most_rows);
  }
  const hsize_t stored = H5Dget_storage_size(dataset);
  const bool here = layout != H5D_VIRTUAL && H5Pget_external_count(how.get()) == 0;
  if (rows > 0 && here && stored == 0) {
    return fmt::format("has {} values, none of which was written", rows);
  }
  // The library reads on behind values that stand in a header.
  if (here && layout != H5D_CHUNKED && stored / width < rows) {
    return fmt::format("has {} values of {} bytes in {} bytes: the file is damaged", rows, width, stored);
  }
  return {};
}

/// The first row of a dataset in chunks whose chunk the library finds no way to in the file, as it looks for it when it
/// reads: it takes zeros in its place. Where chunks of `chunk` bytes are not packed and have fewer, it reads on behind
/// them. Nothing where it finds all.
std::optional<hsize_t> first_unwritten(hid_t dataset, const ValueLine& line, hsize_t chunk) {
  const Handle how(H5Dget_create_plist(dataset), H5Pclose);
  const hsize_t piece = H5Pget_layout(how.get()) == H5D_CHUNKED ? piece_of(how.get(), line).along : 0;
  if (piece == 0) {
    return std::nullopt;
  }
  hsize_t expected = 0;
  for (hsize_t row = 0; row < line.rows; row += piece, expected += chunk) {
    hsize_t bytes = 0;
    if (H5Dget_chunk_storage_size(dataset, line.place(row).data(), &bytes) < 0 || bytes == 0) {
      return row;
    }
  }
  const bool packed = H5Pget_nfilters(how.get()) != 0;
  return packed || H5Dget_storage_size(dataset) >= expected ? std::nullopt : std::optional<hsize_t>(0);
}

/// Of two reasons the first that there is.
std::string either(std::string first, std::string second) {
  return first.empty() ? std::move(second) : std::move(first);
}

/// How the values of a dataset stand. Where they are in no line that could be a column, `unlike` and `remedy` of
/// `source` say so.
void find_line(hid_t space, Source& source) {
  const int dimensions = H5Sget_simple_extent_ndims(space);
  ValueLine::Place sides{0, 1};
  if (dimensions == 1 || dimensions == 2) {
    H5Sget_simple_extent_dims(space, sides.data(), nullptr);
    source.line = {std::max(sides[0], sides[1]), dimensions, sides[0] == 1 && dimensions == 2 ? 1U : 0U};
    source.line.rows = std::min(sides[0], sides[1]) == 0 ? 0 : source.line.rows;
  }
  const bool one_value = dimensions == 2 && sides[0] == 1 && sides[1] == 1;  // MATLAB's way of a number
  if (dimensions != 1 && (dimensions != 2 || one_value || (sides[0] != 1 && sides[1] != 1))) {
    source.unlike = fmt::format("has {} dimensions: expected 1", dimensions);
    source.remedy = one_value ? "" : "write each column as a dataset of its own";
  }
}

/// Lists a member that is no number, where it is like a column, and what is like one inside of it: nothing of it is
/// read.
void list_unlike_member(const Source& whole, const std::string& name, hid_t type, std::vector<Source>& sources) {
  const H5T_class_t kind = H5Tget_class(type);
  const auto put = [&](const std::string& path, const std::string& member, const std::string& unlike) {
    if (recognise_log_column(member) != nullptr) {
      sources.push_back({.path = path, .member = member, .line = whole.line, .unlike = unlike});
    }
  };
  put(whole.path, name,
      kind == H5T_ARRAY      ? "is a member with several numbers a row: expected one, or a member for each"
      : kind == H5T_COMPOUND ? "is a member that has members itself: expected numbers in members of the dataset itself"
                             : "holds no numbers");
  const int inner = kind == H5T_COMPOUND ? H5Tget_nmembers(type) : 0;
  for (int k = 0; k < inner; ++k) {
    char* inner_name = H5Tget_member_name(type, static_cast<unsigned>(k));
    if (inner_name != nullptr) {
      put(whole.path + "." + name, inner_name,
          "is a member of a member: expected numbers in members of the dataset itself");
    }
    H5free_memory(inner_name);
  }
}

/// Lists the members of a dataset of a compound type.
void list_members(const Source& whole, hid_t type, std::vector<Source>& sources) {
  const int members = H5Tget_nmembers(type);
  for (int k = 0; k < members; ++k) {
    const auto index = static_cast<unsigned>(k);
    const Handle member(H5Tget_member_type(type, index), H5Tclose);
    char* name = H5Tget_member_name(type, index);
    // The library takes a member's place for granted.
    const bool inside = member && H5Tget_member_offset(type, index) + H5Tget_size(member.get()) <= H5Tget_size(type);
    if (name != nullptr && (!inside || is_number(member.get()))) {
      Source source = whole;
      source.member = name;
      source.refused =
          either(inside ? format_defect(member.get()) : "ends outside of its row: the file is damaged", whole.refused);
      sources.push_back(std::move(source));
    } else if (name != nullptr) {
      list_unlike_member(whole, name, member.get(), sources);
    }
    H5free_memory(name);
  }
}

/// Lists what a dataset offers; `defect` says why it must not be opened.
void list_dataset(hid_t file, const std::string& path, const std::string& defect, bool trust,
                  std::vector<Source>& sources) {
  if (!defect.empty()) {
    sources.push_back({.path = path, .refused = defect});
    return;
  }
  const Handle dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle space(dataset ? H5Dget_space(dataset.get()) : -1, H5Sclose);
  const Handle type(dataset ? H5Dget_type(dataset.get()) : -1, H5Tclose);
  if (!dataset || !space || !type) {
    sources.push_back({.path = path, .refused = "cannot be opened by the HDF5 library: the file is damaged"});
    return;
  }
  Source source{.path = path};
  find_line(space.get(), source);
  const bool numbers = is_number(type.get());
  if (source.unlike.empty() && !numbers && H5Tget_class(type.get()) != H5T_COMPOUND) {
    source.unlike = "holds no numbers";
  }
  if (!source.unlike.empty()) {
    if (recognise_log_column(source.name()) != nullptr) {
      sources.push_back(std::move(source));
    }
    return;
  }
  source.refused = refusal(dataset.get(), type.get(), source.line, trust, source.chunk);
  if (!numbers) {
    list_members(source, type.get(), sources);
    return;
  }
  const std::optional<DatasetAttributes> attributes = hdf5::attributes_of(dataset.get(), type.get());
  source.refused = either(attributes ? format_defect(type.get()) : "has damaged attributes", source.refused);
  if (attributes) {
    source.refused = either(source.refused, attributes->defect);
    source.unit = attributes->clear_unit ? attributes->unit : "";
    source.doubtful = attributes->clear_unit ? "" : "has units that are no single text";
    source.stored = attributes->stored;
  }
  sources.push_back(std::move(source));
}

/// The column that the last name of a path is like; null where it is like none.
const LogColumn* column_of(std::string_view path) { return recognise_log_column(path.substr(path.rfind('/') + 1)); }

/// All columns of the file `name`, in the order of their paths.
std::vector<Source> list_sources(hid_t file, const std::filesystem::path& name, bool trust) {
  struct Found {
    std::vector<std::pair<std::string, haddr_t>> datasets;
    std::vector<Source> others;
    std::set<std::string> named;  // like a column
    std::size_t objects = 0, links = 0;
    bool too_deep = false;
  } found;
  const auto visit = [](hid_t, const char* found_name, const H5O_info_t* info, void* to) -> herr_t {
    auto& all = *static_cast<Found*>(to);
    const std::string_view path(found_name);
    all.too_deep = std::ranges::count(path, '/') >= deepest_group;
    const bool like_column = column_of(path) != nullptr;
    if (info->type == H5O_TYPE_DATASET) {
      all.datasets.emplace_back(fmt::format("/{}", path), info->addr);
    } else if (info->type != H5O_TYPE_GROUP && like_column) {
      all.others.push_back({.path = fmt::format("/{}", path), .refused = "is no dataset: the file is damaged"});
    }
    if (like_column) {
      all.named.emplace(path);
    }
    return ++all.objects <= most_objects && !all.too_deep ? 0 : 1;
  };
  // Links to a name, to another file or to a dataset that has been listed by another name.
  const auto visit_link = [](hid_t, const char* path, const H5L_info_t*, void* to) -> herr_t {
    auto& all = *static_cast<Found*>(to);
    if (const LogColumn* column = column_of(path); column != nullptr && !all.named.contains(path)) {
      all.others.push_back({.path = fmt::format("/{}", path),
                            .unlike = fmt::format("is a link, or another name of a dataset: expected a dataset, or "
                                                  "--map {}=/GROUP/DATASET of that it leads to",
                                                  column->name)});
    }
    return ++all.links <= most_objects ? 0 : 1;
  };
  if (H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, visit, &found, H5O_INFO_BASIC) < 0 ||
      (found.objects <= most_objects && !found.too_deep &&
       H5Lvisit(file, H5_INDEX_NAME, H5_ITER_INC, visit_link, &found) < 0)) {
    throw InputError(fmt::format(
        "{}: is damaged: the HDF5 library lists {} datasets and finds no way to others: expected a whole HDF5 "
        "file, closed by its writer",
        name.string(), found.datasets.size()));
  }
  if (found.too_deep || std::max(found.objects, found.links) > most_objects) {
    throw InputError(fmt::format("{}: {}: expected a log, with at most {} objects in groups at most {} deep",
                                 name.string(),
                                 found.too_deep ? "its groups lie too deep in each other" : "has too many objects",
                                 most_objects, deepest_group));
  }
  const Handle made(H5Fget_create_plist(file), H5Pclose);
  hdf5::FieldSizes sizes;
  hsize_t base = 0;
  if (!made || H5Pget_sizes(made.get(), &sizes.offset, &sizes.length) < 0 || H5Pget_userblock(made.get(), &base) < 0) {
    throw InputError(name.string() + ": does not say how it is made: expected a whole HDF5 file");
  }
  mcap::WindowedFile bytes(name, false);
  std::vector<Source> sources = std::move(found.others);
  for (const auto& [path, address] : found.datasets) {
    list_dataset(file, path, hdf5::header_defect(bytes, base + address, sizes), trust, sources);
  }
  return sources;
}

/// Values of one column, read in pieces.
class ColumnReader {
 public:
  ColumnReader(hid_t file, const Source& source, std::string where)
      : where_(std::move(where)),
        line_(source.line),
        stored_(source.stored),
        dataset_(H5Dopen2(file, source.path.c_str(), access_to(source).get()), H5Dclose) {
    if (source.member.empty()) {
      type_ = Handle(H5Tcopy(H5T_NATIVE_DOUBLE), H5Tclose);
    } else {
      type_ = Handle(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
      H5Tinsert(type_.get(), source.member.c_str(), 0, H5T_NATIVE_DOUBLE);
    }
  }

  /// The value of `row`; rows are asked for in ascending order.
  double at(hsize_t row) {
    if (row >= first_ + values_.size()) {
      fill(row);
    }
    return values_[static_cast<std::size_t>(row - first_)];
  }

 private:
  /// The library unpacks a chunk again for each piece of rows unless its cache holds it; members of a dataset are read
  /// in turn, also where their rows lie in two chunks.
  static Handle access_to(const Source& source) {
    Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
    const hsize_t wanted = source.member.empty() ? source.chunk : 2 * source.chunk;
    if (wanted > cached_chunks) {
      H5Pset_chunk_cache(access.get(), H5D_CHUNK_CACHE_NSLOTS_DEFAULT, static_cast<std::size_t>(wanted),
                         H5D_CHUNK_CACHE_W0_DEFAULT);
    }
    return access;
  }

  void fill(hsize_t row) {
    const hsize_t count = std::min<hsize_t>(rows_at_once, line_.rows - row);
    values_.resize(static_cast<std::size_t>(count));
    first_ = row;
    const Handle space(dataset_ ? H5Dget_space(dataset_.get()) : -1, H5Sclose);
    const ValueLine::Place first = line_.place(row), sides = line_.sides(count);
    const Handle memory(H5Screate_simple(line_.dimensions, sides.data(), nullptr), H5Sclose);
    if (!space || H5Sget_simple_extent_ndims(space.get()) != line_.dimensions ||
        H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, first.data(), nullptr, sides.data(), nullptr) < 0 ||
        H5Dread(dataset_.get(), type_.get(), memory.get(), space.get(), H5P_DEFAULT, values_.data()) < 0) {
      throw InputError(
          fmt::format("{}: rows {} to {} cannot be read: the file is damaged, or packed by a filter that is "
                      "not installed",
                      where_, row + 1, row + count));
    }
    if (!stored_.plain()) {
      std::ranges::transform(values_, values_.begin(), [&](double stored) { return stored_.value(stored); });
    }
  }

  std::string where_;
  ValueLine line_;
  StoredAs stored_;
  Handle dataset_;
  Handle type_;
  std::vector<double> values_;
  hsize_t first_ = 0;
};

/// Which column of the file is which of the log.
struct Choice {
  std::map<std::string, Source> found;  ///< name, `t` among them
  std::vector<std::string> header;
  std::vector<std::string> notes;
};

class DatasetChooser {
 public:
  DatasetChooser(const std::string& path, const LogOptions& options, std::vector<Source> sources,
                 std::uint64_t file_bytes)
      : path_(path), options_(options), sources_(std::move(sources)), file_bytes_(file_bytes) {}

  Choice choose() {
    for (const Source& source : sources_) {
      choice_.header.push_back(source.shown());
    }
    const std::string home = home_of_time();
    for (const auto& [name, place] : options_.map) {
      if (!factor_alone(place)) {
        take_mapped(name, place, home);
      }
    }
    for (const Source& source : sources_) {
      if (source.home() == home) {
        recognise(source);
      }
    }
    scale_found();
    for (const std::string& name : options_.extra) {
      take(name, named(name, home, name));
    }
    same_length();
    check_size();
    say_unlike(home);
    say_elsewhere(home);
    refuse_time_alone();
    return std::move(choice_);
  }

 private:
  /// A unit is a column's also where it is written as the contract writes it ("m or rad"), as create_hdf5() does.
  static const LogColumn* meaning_of(const Source& source) {
    const LogColumn* by_name = recognise_log_column(source.name());
    const bool own_unit = source.unit.empty() || (by_name != nullptr && by_name->unit == source.unit);
    return own_unit ? by_name : recognise_log_column(source.name() + " [" + source.unit + "]");
  }

  /// Why a source is not taken for a column unasked; empty where it is.
  static std::string objection(const Source& source) { return either(source.unlike, source.doubtful); }

  /// Why what is named like a time is not taken for it; empty where there is nothing.
  [[nodiscard]] std::string lost_time() const {
    const auto lost = std::ranges::find_if(sources_, [](const Source& source) {
      const LogColumn* column = recognise_log_column(source.name());
      return column != nullptr && column->name == "t";
    });
    if (lost == sources_.end()) {
      return "";
    }
    const std::string why = either(
        lost->unlike, either(lost->doubtful, fmt::format("has the unit {}, expected s", files::shown(lost->unit))));
    return fmt::format("; {} {}{}", lost->shown(), why,
                       lost->unlike.empty()   ? fmt::format(": --map \"t={}*SECONDS_A_UNIT\" takes it", lost->shown())
                       : lost->remedy.empty() ? ""
                                              : ": " + lost->remedy);
  }

  /// Where there are times, in the order of the file.
  [[nodiscard]] std::vector<std::string> homes_of_times() const {
    std::vector<std::string> homes;
    std::set<std::string> seen;
    for (const Source& source : sources_) {
      const LogColumn* column = meaning_of(source);
      if (column != nullptr && column->name == "t" && objection(source).empty() && seen.insert(source.home()).second) {
        homes.push_back(source.home());
      }
    }
    return homes;
  }

  [[nodiscard]] std::string home_of_time() {
    if (const auto mapped = options_.map.find("t"); mapped != options_.map.end() && !factor_alone(mapped->second)) {
      const std::string place = split_factor(mapped->second).first;
      for (const Source& source : sources_) {
        if (source.shown() == mapped->second || source.name() == mapped->second || source.shown() == place ||
            source.name() == place) {
          return source.home();
        }
      }
    }
    const std::vector<std::string> homes = homes_of_times();
    if (homes.empty()) {
      throw InputError(fmt::format(
          "{}: no dataset of times: expected one called t, time or the like (in s) beside the columns, or --map "
          "t=/GROUP/DATASET: the file has {}{}",
          path_, choice_.header.empty() ? "no one-dimensional numeric dataset" : core::listed(choice_.header),
          lost_time()));
    }
    if (homes.size() > 1) {
      choice_.notes.push_back(fmt::format(
          "there are several logs in it ({}); the first was read, --map t=… takes another", core::listed(homes)));
    }
    return homes.front();
  }

  [[nodiscard]] const Source* find(const std::string& place, const std::string& home) const {
    for (const bool anywhere : {false, true}) {
      for (const Source& source : sources_) {
        const bool here = source.home() == home && source.name() == place;
        if (anywhere ? source.shown() == place || source.shown() == "/" + place : here) {
          return &source;
        }
      }
    }
    return nullptr;
  }

  [[nodiscard]] Source named(const std::string& place, const std::string& home, const std::string& name) const {
    if (const Source* source = find(place, home)) {
      return *source;
    }
    throw InputError(fmt::format("{}: no dataset {} for column {}: the file has {}{}", path_, files::shown(place), name,
                                 core::listed(choice_.header), files::did_you_mean(place, choice_.header)));
  }

  /// Multiplies the columns of which the map gives no more than a factor.
  void scale_found() {
    for (const auto& [name, mapped] : options_.map) {
      const std::optional<double> factor = factor_alone(mapped);
      if (!factor || (options_.only && name != "t" && std::ranges::count(*options_.only, name) == 0)) {
        continue;
      }
      const auto found = choice_.found.find(name);
      if (found == choice_.found.end()) {
        throw InputError(fmt::format("{}: no dataset for {}, which --map {}={} multiplies: the file has {}", path_,
                                     name, name, mapped, core::listed(choice_.header)));
      }
      found->second.factor *= *factor;
      choice_.notes.push_back(fmt::format("{} is {} times {:g}", name, found->second.shown(), found->second.factor));
    }
  }

  void take_mapped(const std::string& name, const std::string& mapped, const std::string& home) {
    const auto [place, factor] = find(mapped, home) != nullptr ? std::pair{mapped, 1.0} : split_factor(mapped);
    if (find(place, home) == nullptr && find(name, home) != nullptr &&
        std::ranges::count(options_.or_by_name, name) > 0) {
      choice_.notes.push_back(by_its_own_name(place, name));
      take(name, named(name, home, name));
      return;
    }
    Source source = named(place, home, name);
    source.factor = factor;
    take(name, std::move(source));
  }

  void take(const std::string& name, Source source) {
    if (const std::string& why = source.refused.empty() ? source.unlike : source.refused; !why.empty()) {
      throw InputError(
          fmt::format("{}: {} {}{}", path_, source.shown(), why, source.remedy.empty() ? "" : ": " + source.remedy));
    }
    say_numbers(name, source);
    choice_.found.insert_or_assign(name, std::move(source));
  }

  /// Says what is done to the numbers of a source.
  void say_numbers(const std::string& name, const Source& source) {
    std::string done;
    const auto say = [&](double number, double none, std::string_view what) {
      done += number == none ? "" : fmt::format(fmt::runtime(what), number);
    };
    say(source.stored.scale, 1.0, " times {:g} (attribute scale_factor)");
    say(source.stored.offset, 0.0, " plus {:g} (attribute add_offset)");
    say(source.factor, 1.0, done.empty() ? " times {:g}" : ", and that times {:g}");
    if (!done.empty()) {
      choice_.notes.push_back(fmt::format("{} is {}{}", name, source.shown(), done));
    }
    std::vector<std::string> missing;
    for (const double number : source.stored.missing) {
      missing.push_back(fmt::format("{:g}", number));
    }
    if (!missing.empty()) {
      choice_.notes.push_back(fmt::format("{} in {} stands for no value (attribute _FillValue or missing_value)",
                                          core::listed(missing, " or "), source.shown()));
    }
  }

  /// Whether a column is looked for by its name.
  [[nodiscard]] bool looked_for(const std::string& name) const {
    const auto mapped = options_.map.find(name);
    return (mapped == options_.map.end() || factor_alone(mapped->second)) &&
           (!options_.only || name == "t" || std::ranges::find(*options_.only, name) != options_.only->end());
  }

  void recognise(const Source& source) {
    const LogColumn* column = meaning_of(source);
    if (column == nullptr) {
      if (const LogColumn* by_name = recognise_log_column(source.name()); by_name != nullptr && !source.unit.empty()) {
        choice_.notes.push_back(fmt::format("{} was not taken as {}: its unit is {}, expected {}", source.shown(),
                                            by_name->name, files::shown(source.unit), by_name->unit));
      }
      return;
    }
    const std::string& name = column->name;
    if (!looked_for(name) || !objection(source).empty()) {
      return;
    }
    if (const auto other = choice_.found.find(name); other != choice_.found.end()) {
      throw InputError(fmt::format("{}: {} and {} both mean {}: expected one, or --map {}=…", path_,
                                   other->second.shown(), source.shown(), name, name));
    }
    take(name, source);
  }

  /// Says what is like a column by its name beside the times, and was not taken.
  void say_unlike(const std::string& home) {
    for (const Source& source : sources_) {
      const LogColumn* column = source.home() == home && !objection(source).empty() ? meaning_of(source) : nullptr;
      if (column != nullptr && looked_for(column->name)) {
        say_left_out(*column, source, objection(source));
      }
    }
  }

  /// Says, once for each column that is lacking, what is like it and as long as the times, and stands apart from them.
  void say_elsewhere(const std::string& home) {
    const std::vector<std::string> homes = homes_of_times();
    const std::set<std::string> logs(homes.begin(), homes.end());
    std::set<std::string> said;
    for (const Source& source : sources_) {
      const LogColumn* column = meaning_of(source);
      if (column != nullptr && looked_for(column->name) && !choice_.found.contains(column->name) &&
          source.home() != home && source.refused.empty() && of_these_rows(source) && !logs.contains(source.home()) &&
          said.insert(column->name).second) {
        say_left_out(*column, source,
                     either(objection(source), fmt::format("lies in another group than the times: --map {}={} takes it",
                                                           column->name, source.shown())));
      }
    }
  }

  /// Throws InputError where there are other values than times and none is known: nothing would be read.
  void refuse_time_alone() const {
    if (choice_.found.size() > 1 || sources_.size() == 1 || options_.only) {
      return;
    }
    std::vector<std::string> known = log_column_names();
    std::erase(known, "t");
    std::string why;
    for (const std::string& note : choice_.notes) {
      why += "; " + note;
    }
    throw InputError(
        fmt::format("{}: no column but the time is known: the file has {}: expected one of {}, or --map NAME=DATASET{}",
                    path_, core::listed(choice_.header), core::listed(known), why));
  }

  void say_left_out(const LogColumn& column, const Source& source, const std::string& why) {
    const bool mendable = of_these_rows(source) && !source.remedy.empty();
    choice_.notes.push_back(fmt::format(
        "{} was not taken as {}: it {}{}{}", source.shown(), column.name, why, mendable ? ": " + source.remedy : "",
        source.doubtful.empty() ? "" : fmt::format(": --map \"{}={}*FACTOR\" takes it", column.name, source.shown())));
  }

  /// Whether a source has as many rows as the times.
  [[nodiscard]] bool of_these_rows(const Source& source) const {
    return source.line.rows == choice_.found.at("t").line.rows;
  }

  void same_length() const {
    const Source& time = choice_.found.at("t");
    for (const auto& [name, source] : choice_.found) {
      if (!of_these_rows(source)) {
        throw InputError(fmt::format("{}: {} has {} values and {} has {}: expected as many values as times", path_,
                                     source.shown(), source.line.rows, time.shown(), time.line.rows));
      }
    }
  }

  /// Values that were never written, or pack too well, cost as much as others.
  void check_size() const {
    const hsize_t rows = choice_.found.at("t").line.rows;
    const std::uint64_t columns = choice_.found.size(), most = files::most_unpacked(file_bytes_);
    if (!options_.trust && rows > most / sizeof(double) / columns) {
      throw InputError(
          fmt::format("{}: {} columns of {} rows: {}", path_, columns, rows, files::too_much_unpacked(file_bytes_)));
    }
  }

  const std::string& path_;
  const LogOptions& options_;
  std::vector<Source> sources_;
  std::uint64_t file_bytes_;
  Choice choice_;
};

class Hdf5Walk final : public RowWalk {
 public:
  Hdf5Walk(const std::filesystem::path& path, const Choice& choice, const std::vector<std::string>& names,
           double longest_step, LogReport* report, TimeOrigin origin)
      : path_(path),
        choice_(choice),
        names_(names),
        cleaner_(names, report),
        row_(names.size() + 1),
        hashed_(report != nullptr),
        file_(open_file(path)),
        rows_(choice.found.at("t").line.rows),
        shared_origin_(std::move(origin)) {
    cleaner_.set_longest_step(longest_step);
    cleaner_.begin_file(path.string() + ": row ");
    open_column("t");
    for (const std::string& name : names) {
      open_column(name);
    }
  }

  bool next(RowOutcome& outcome) override {
    if (next_ == rows_) {
      return false;
    }
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      row_[k] = factors_[k] * columns_[k].at(next_);
    }
    if (!clock_known_ && std::isfinite(row_[0])) {
      begin_clock();
    }
    row_[0] = (row_[0] - static_cast<double>(origin_) * per_second_) / per_second_;
    ++next_;
    outcome = cleaner_.clean(row_, static_cast<std::size_t>(next_));
    return true;
  }
  [[nodiscard]] double t() const override { return cleaner_.t(); }
  [[nodiscard]] const double* values() const override { return row_.data() + 1; }
  void describe(LogFileReport& file) const override {
    mcap::WindowedFile bytes(path_, hashed_);
    bytes.leave(bytes.size());
    file.format = "hdf5";
    file.packing = "";
    file.bytes = bytes.size();
    file.hash = bytes.hash();
    file.header = choice_.header;
    file.notes = choice_.notes;
    file.time_origin = static_cast<double>(origin_);
    file.time_zone = origin_ != 0 ? "UTC" : "";
    if (per_second_ != 1.0) {
      file.notes.push_back(fmt::format("times are counts of {}, and were read as such", unit_));
    }
    for (const std::string& column : choice_.header) {
      const bool used = std::ranges::any_of(choice_.found, [&](const auto& found) {
        return found.second.shown() == column &&
               (found.first == "t" || std::ranges::find(names_, found.first) != names_.end());
      });
      if (!used) {
        file.ignored.push_back(column);
      }
    }
  }

 private:
  /// Times since 1970, in s or in whole counts, are counted from a whole second.
  void begin_clock() {
    clock_known_ = true;
    for (const auto& [seconds, unit] : count_units) {
      if (is_since_1970(row_[0] * seconds) && row_[0] == std::floor(row_[0])) {
        per_second_ = std::round(1.0 / seconds);
        unit_ = unit;
      }
    }
    if (is_since_1970(row_[0] / per_second_)) {
      origin_ = common_origin(shared_origin_, static_cast<std::int64_t>(std::floor(row_[0] / per_second_)));
    }
  }

  void open_column(const std::string& name) {
    const Source& source = choice_.found.at(name);
    columns_.emplace_back(file_.get(), source, fmt::format("{}: {}", path_.string(), source.shown()));
    factors_.push_back(source.factor);
  }

  std::filesystem::path path_;
  const Choice& choice_;
  const std::vector<std::string>& names_;
  RowCleaner cleaner_;
  std::vector<double> row_;
  bool hashed_;
  Handle file_;
  hsize_t rows_;
  hsize_t next_ = 0;
  std::vector<ColumnReader> columns_;
  std::vector<double> factors_;  // of each
  TimeOrigin shared_origin_;
  bool clock_known_ = false;
  double per_second_ = 1.0;  // counts of the times
  std::string_view unit_;    // of a count
  std::int64_t origin_ = 0;  // s
};

class Hdf5File final : public RowFile {
 public:
  Hdf5File(std::filesystem::path path, const LogOptions& options, TimeOrigin origin)
      : path_(std::move(path)), origin_(std::move(origin)) {
    if (!options.trust) {
      bag::refuse_holes(path_);
    }
    const Handle file = open_file(path_);
    choice_ =
        DatasetChooser(path_.string(), options, list_sources(file.get(), path_, options.trust), size_of(file.get()))
            .choose();
    std::set<std::string> looked_at;  // members of a compound type share their pieces
    for (const auto& [name, source] : choice_.found) {
      if (name != "t") {
        names_.push_back(name);
      }
      if (!options.trust && looked_at.insert(source.path).second) {
        refuse_unwritten(file.get(), source);
      }
    }
  }

  [[nodiscard]] std::string path() const override { return path_.string(); }
  [[nodiscard]] const std::vector<std::string>& columns() const override { return names_; }
  [[nodiscard]] std::unique_ptr<RowWalk> open(const std::vector<std::string>& names, double longest_step,
                                              LogReport* report) override {
    return std::make_unique<Hdf5Walk>(path_, choice_, names, longest_step, report, origin_);
  }

 private:
  void refuse_unwritten(hid_t file, const Source& source) const {
    const Handle dataset(H5Dopen2(file, source.path.c_str(), H5P_DEFAULT), H5Dclose);
    if (const auto row = dataset ? first_unwritten(dataset.get(), source.line, source.chunk) : std::nullopt) {
      throw InputError(fmt::format(
          "{}: {} has {} values, of which row {} and others were never written or are lost: expected a whole "
          "log, or --trust, which takes what HDF5 puts in their place",
          path_.string(), source.shown(), source.line.rows, *row + 1));
    }
  }

  std::filesystem::path path_;
  TimeOrigin origin_;
  Choice choice_;
  std::vector<std::string> names_;
};

}  // namespace

bool is_hdf5(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  std::array<char, signature.size()> head{};
  return file && std::fread(head.data(), 1, head.size(), file.get()) == head.size() &&
         std::string_view(head.data(), head.size()) == signature;
}

std::unique_ptr<RowFile> hdf5_file(const std::filesystem::path& path, const LogOptions& options,
                                   const TimeOrigin& origin) {
  return std::make_unique<Hdf5File>(path, options, origin);
}

}  // namespace wheelwright::logs
