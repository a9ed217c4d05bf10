// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <string>
#include <vector>

#include <zlib.h>
#include <zstd.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/files/atomic_file.hpp>
#include <wheelwright/logs/csv.hpp>
#include <wheelwright/logs/log_file.hpp>

namespace wheelwright::logs {
namespace {

constexpr std::size_t rows_written_at_once = 4096;

/// Takes text, puts bytes into a file.
class Packer {
 public:
  explicit Packer(files::AtomicFile& file) : file_(file) {}
  virtual ~Packer() = default;
  virtual void write(std::string_view text, bool last) = 0;

 protected:
  files::AtomicFile& file_;
};

class PlainPacker final : public Packer {
 public:
  using Packer::Packer;
  void write(std::string_view text, bool) override { file_.write(text); }
};

class GzipPacker final : public Packer {
 public:
  explicit GzipPacker(files::AtomicFile& file) : Packer(file) {
    if (deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
      throw Error("zlib cannot start");
    }
  }
  ~GzipPacker() override { deflateEnd(&stream_); }
  GzipPacker(const GzipPacker&) = delete;
  GzipPacker& operator=(const GzipPacker&) = delete;

  void write(std::string_view text, bool last) override {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream_.avail_in = static_cast<uInt>(text.size());
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      deflate(&stream_, last ? Z_FINISH : Z_NO_FLUSH);
      file_.write({buffer_.data(), buffer_.size() - stream_.avail_out});
    } while (stream_.avail_out == 0);
  }

 private:
  z_stream stream_{};
  std::array<char, 1 << 16> buffer_;
};

class ZstdPacker final : public Packer {
 public:
  explicit ZstdPacker(files::AtomicFile& file) : Packer(file), context_(ZSTD_createCCtx()) {
    if (!context_) {
      throw Error("zstd cannot start");
    }
  }
  void write(std::string_view text, bool last) override {
    ZSTD_inBuffer in{text.data(), text.size(), 0};
    std::size_t rest = 1;
    while (rest > 0) {
      ZSTD_outBuffer out{buffer_.data(), buffer_.size(), 0};
      rest = ZSTD_compressStream2(context_.get(), &out, &in, last ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(rest) != 0) {
        throw Error(std::string("zstd: ") + ZSTD_getErrorName(rest));
      }
      file_.write({buffer_.data(), out.pos});
      rest = last ? rest : in.size - in.pos;
    }
  }

 private:
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  std::unique_ptr<ZSTD_CCtx, Free> context_;
  std::array<char, 1 << 16> buffer_;
};

std::unique_ptr<Packer> packer_for(const std::filesystem::path& path, files::AtomicFile& file) {
  if (path.extension() == ".gz") {
    return std::make_unique<GzipPacker>(file);
  }
  if (path.extension() == ".zst") {
    return std::make_unique<ZstdPacker>(file);
  }
  return std::make_unique<PlainPacker>(file);
}

void append_number(std::string& text, double value) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(digits.data(), end);
}

class CsvWriter final : public LogWriter {
 public:
  CsvWriter(const std::filesystem::path& path, const std::vector<std::string>& names)
      : file_(path), packer_(packer_for(path, file_)), columns_(names.size()), text_("t") {
    for (const std::string& name : names) {
      text_ += "," + name;
    }
    text_ += '\n';
  }

  void write(const LogBlock& block) override {
    check_block(block, columns_);
    for (std::size_t k = 0; k < block.rows(); ++k) {
      append_number(text_, block.t[k]);
      for (const auto& column : block.columns) {
        text_ += ',';
        append_number(text_, column[k]);
      }
      text_ += '\n';
      if (text_.size() > (std::size_t{1} << 16)) {
        packer_->write(text_, false);
        text_.clear();
      }
    }
  }

  void commit() override {
    packer_->write(text_, true);
    file_.commit();
  }

 private:
  files::AtomicFile file_;
  std::unique_ptr<Packer> packer_;
  std::size_t columns_;
  std::string text_;
};

}  // namespace

std::unique_ptr<LogWriter> create_csv(const std::filesystem::path& path, const std::vector<std::string>& names) {
  check_column_names(names);
  return std::make_unique<CsvWriter>(path, names);
}

void write_csv(const std::filesystem::path& path, const LogTable& table) {
  check::that(table.names.size() == table.columns.size(), "log", "one name for each column");
  const auto writer = create_csv(path, table.names);
  LogBlock block;
  block.columns.resize(table.columns.size());
  for (std::size_t first = 0; first < table.rows(); first += rows_written_at_once) {
    const std::size_t last = std::min(table.rows(), first + rows_written_at_once);
    const auto part = [&](const std::vector<double>& column, std::vector<double>& to) {
      check::that(column.size() == table.rows(), "log column", "as many values as there are times");
      to.assign(column.begin() + static_cast<std::ptrdiff_t>(first),
                column.begin() + static_cast<std::ptrdiff_t>(last));
    };
    part(table.t, block.t);
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      part(table.columns[c], block.columns[c]);
    }
    writer->write(block);
  }
  writer->commit();
}

}  // namespace wheelwright::logs
