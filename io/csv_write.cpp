// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <memory>

#include <zlib.h>
#include <zstd.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/io/atomic_file.hpp>
#include <wheelwright/io/csv.hpp>

namespace wheelwright {
namespace {

/// Takes text, puts bytes into a file.
class Packer {
 public:
  explicit Packer(AtomicFile& file) : file_(file) {}
  virtual ~Packer() = default;
  virtual void write(std::string_view text, bool last) = 0;

 protected:
  AtomicFile& file_;
};

class PlainPacker final : public Packer {
 public:
  using Packer::Packer;
  void write(std::string_view text, bool) override { file_.write(text); }
};

class GzipPacker final : public Packer {
 public:
  explicit GzipPacker(AtomicFile& file) : Packer(file) {
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
  explicit ZstdPacker(AtomicFile& file) : Packer(file), context_(ZSTD_createCCtx()) {
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

std::unique_ptr<Packer> packer_for(const std::filesystem::path& path, AtomicFile& file) {
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

void check_table(const LogTable& table) {
  check::that(table.names.size() == table.columns.size(), "log", "one name for each column");
  for (const double t : table.t) {
    check::finite(t, "log time");
  }
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const std::string& name = table.names[c];
    check::that(!name.empty() && name.find_first_of(",;\t\"\r\n#") == std::string::npos, "log column '" + name + "'",
                "a name without separators, quotes, # and line ends");
    check::that(table.columns[c].size() == table.rows(), "log column '" + name + "'",
                "as many values as there are times");
    for (const double value : table.columns[c]) {
      check::finite(value, "log column '" + name + "'");
    }
  }
}

}  // namespace

void write_csv(const std::filesystem::path& path, const LogTable& table) {
  check_table(table);
  AtomicFile file(path);
  const auto packer = packer_for(path, file);
  std::string text = "t";
  for (const std::string& name : table.names) {
    text += "," + name;
  }
  text += '\n';
  for (std::size_t k = 0; k < table.rows(); ++k) {
    append_number(text, table.t[k]);
    for (const auto& column : table.columns) {
      text += ',';
      append_number(text, column[k]);
    }
    text += '\n';
    if (text.size() > (std::size_t{1} << 16)) {
      packer->write(text, false);
      text.clear();
    }
  }
  packer->write(text, true);
  file.commit();
}

}  // namespace wheelwright
