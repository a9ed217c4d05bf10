// SPDX-License-Identifier: Apache-2.0
// wheelwright-bench [--filter WORDS] [--json] [--benchmark_…]: every benchmark whose name has one of the words, one
// measurement a line.
#include <malloc.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "tests/benchmarks/bench.hpp"

namespace {

void usage() {
  fmt::print(
      stderr,
      "usage: wheelwright-bench [--filter WORDS] [--json] [--benchmark_...]\n"
      "  --filter WORDS   only benchmarks whose name has one of the words (separated by blanks or commas)\n"
      "  --json           one JSON object a line\n"
      "  --benchmark_...  options of Google Benchmark; not --benchmark_out, since every line is a run of its own\n");
}

}  // namespace

// As in the program: memory that is freed stays at hand, for ours and for the peers.
static void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
}

int main(int count, char** arguments) try {
  keep_freed_memory();
  std::vector<std::string> words;
  auto form = wheelwright::bench::Form::table;
  std::vector<char*> others = {arguments[0]};
  for (int k = 1; k < count; ++k) {
    const std::string_view argument = arguments[k];
    if (argument == "--json") {
      form = wheelwright::bench::Form::json;
    } else if (argument == "--filter" && k + 1 < count) {
      std::string text = arguments[++k];
      std::ranges::replace(text, ',', ' ');
      std::istringstream in(text);
      words.insert(words.end(), std::istream_iterator<std::string>(in), {});
    } else if (argument.starts_with("--benchmark_out")) {
      usage();
      return 2;
    } else {
      others.push_back(arguments[k]);
    }
  }
  if (!wheelwright::bench::take_options(others, usage)) {
    usage();
    return 2;
  }
  for (const auto& [name, run] : wheelwright::bench::benchmarks()) {
    const auto wanted = [&name = name](const std::string& word) { return name.find(word) != std::string::npos; };
    if (words.empty() || std::ranges::any_of(words, wanted)) {
      run(form);
    }
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "wheelwright-bench: {}\n", error.what());
  return 3;
}
