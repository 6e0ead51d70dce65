// A race on purpose, and the same without: does the thread sanitizer see the one, and know from OpenMP's library that
// the other is none? `planted_race race | barrier`.
#include <cstdio>
#include <string_view>
#include <vector>

namespace {

// Each thread writes its cell and adds that of its neighbour, as tiles do with the nodes of the next plane; only a
// barrier between the two keeps the neighbour's write and this read apart.
double sum_with_neighbours(std::vector<double>& cells, bool ordered) {
  const int count = static_cast<int>(cells.size());
  double sum = 0.0;
#pragma omp parallel num_threads(4) reduction(+ : sum)
  {
#pragma omp for schedule(static, 1) nowait
    for (int i = 0; i < count; ++i) cells[static_cast<std::size_t>(i)] = i;
    if (ordered) {
#pragma omp barrier
    }
#pragma omp for schedule(static, 1) nowait
    for (int i = 0; i < count; ++i) sum += cells[static_cast<std::size_t>((i + 1) % count)];
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view which = argc > 1 ? argv[1] : "";
  if (which != "race" && which != "barrier") {
    std::fputs("usage: planted_race race|barrier\n", stderr);
    return 2;
  }
  std::vector<double> cells(4096);
  std::printf("%g\n", sum_with_neighbours(cells, which == "barrier"));
}
