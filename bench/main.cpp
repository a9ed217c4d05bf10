// SPDX-License-Identifier: Apache-2.0
// wheelwright-bench [--filter WORDS] [--json]: every benchmark whose name has one of the words, one measurement a line.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench.hpp"

namespace {

using wheelwright::bench::Measurement;

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == ' ' || c == ',') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  std::erase(words, "");
  return words;
}

std::string json_line(const Measurement& m) {
  nlohmann::ordered_json line = {{"name", m.name},
                                 {"rows", m.rows},
                                 {"p", m.p},
                                 {"threads", m.threads},
                                 {"seconds", m.seconds},
                                 {"peer", m.peer},
                                 {"peer_seconds", m.peer_seconds},
                                 {"ratio", m.peer_seconds / m.seconds}};
  if (!m.note.empty()) {
    line["note"] = m.note;
  }
  return line.dump();
}

std::string table_line(const Measurement& m) {
  return fmt::format("{:<28} {:>10} rows  p {:>2}  {:>2} thr  {:>11.6f} s  {:<28} {:>11.6f} s  ratio {:>9.3g}  {}",
                     m.name, m.rows, m.p, m.threads, m.seconds, m.peer, m.peer_seconds, m.peer_seconds / m.seconds,
                     m.note);
}

int usage() {
  fmt::print(stderr,
             "usage: wheelwright-bench [--filter WORDS] [--json]\n"
             "  --filter WORDS  only benchmarks whose name has one of the words (separated by blanks or commas)\n"
             "  --json          one JSON object a line\n");
  return 2;
}

}  // namespace

int main(int count, char** arguments) try {
  std::vector<std::string> words;
  bool json = false;
  for (int k = 1; k < count; ++k) {
    const std::string_view argument = arguments[k];
    if (argument == "--json") {
      json = true;
    } else if (argument == "--filter" && k + 1 < count) {
      const auto more = words_of(arguments[++k]);
      words.insert(words.end(), more.begin(), more.end());
    } else {
      return usage();
    }
  }
  auto& all = wheelwright::bench::benchmarks();
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  for (const auto& benchmark : all) {
    const bool wanted = words.empty() || std::any_of(words.begin(), words.end(), [&](const std::string& word) {
                          return benchmark.name.find(word) != std::string::npos;
                        });
    if (!wanted) {
      continue;
    }
    for (const Measurement& measurement : benchmark.run()) {
      fmt::print("{}\n", json ? json_line(measurement) : table_line(measurement));
      std::fflush(stdout);
    }
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "wheelwright-bench: {}\n", error.what());
  return 3;
}
