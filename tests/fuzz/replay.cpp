// A fuzz target without libFuzzer: every file of its corpus, then damaged copies of them for a bounded time. Under the
// sanitizers of tools/test, which knows g++ only. Usage: fuzz_NAME CORPUS SECONDS; the last input is in last-fuzz_NAME.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/target.hpp"

namespace {

namespace fs = std::filesystem;

std::vector<std::string> contents_of(const fs::path& corpus) {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& entry : fs::directory_iterator(corpus)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> contents;
  for (const fs::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    contents.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return contents;
}

// One to four changes: a bit turned, a byte of any value, a piece taken out, doubled, or put in from another file.
std::string damaged(std::string input, const std::string& other, std::mt19937& random) {
  const auto below = [&](std::size_t end) { return end == 0 ? 0 : random() % end; };
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    const std::size_t at = below(input.size()), length = 1 + below(32);
    switch (below(5)) {
      case 0:
        if (!input.empty()) input[at] = static_cast<char>(input[at] ^ (1 << below(8)));
        break;
      case 1:
        if (!input.empty()) input[at] = static_cast<char>(below(256));
        break;
      case 2:
        input.erase(at, length);
        break;
      case 3:
        input.insert(at, input.substr(at, length));
        break;
      default:
        input.insert(at, other.substr(below(other.size()), length));
    }
  }
  return input;
}

void run(const fs::path& last, const std::string& input) {
  std::ofstream(last, std::ios::binary) << input;
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: fuzz_NAME CORPUS SECONDS\n", stderr);
    return 2;
  }
  const std::vector<std::string> corpus = contents_of(argv[1]);
  const fs::path last = "last-" + fs::path(argv[0]).filename().string();
  for (const std::string& input : corpus) run(last, input);
  std::mt19937 random(1);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(std::stoi(argv[2]));
  std::size_t count = 0;
  for (; std::chrono::steady_clock::now() < end; ++count) {
    run(last, damaged(corpus[random() % corpus.size()], corpus[random() % corpus.size()], random));
  }
  fs::remove(last);
  std::printf("%zu files and %zu damaged copies\n", corpus.size(), count);
}
