#include "tests/cuda/ptx/ptx_machine.hpp"

#include <array>
#include <map>
#include <utility>

namespace breccia::cuda_ptx {
namespace {

auto& tables() {
  static std::map<std::pair<std::string, std::string>, cuda_emulation::Substitutes> all;
  return all;
}

}  // namespace

const cuda_emulation::Substitutes& translations(const std::string& table, const std::string& arch) {
  return tables()[{table, arch}];
}

Enter::Enter(std::initializer_list<Translation> all) {
  for (const Translation& t : all) tables()[{t.table, t.arch}][t.kernel] = t.substitute;
}

void refuse(const char* memory, std::uint64_t address, std::size_t bytes, std::size_t available, int line) {
  std::string what = std::string(memory) + " access out of range or not aligned: " + std::to_string(bytes) +
                     " bytes at " + std::to_string(address);
  if (available > 0) what += " of " + std::to_string(available);
  cuda_emulation::stop_kernel(what + ", line " + std::to_string(line) + " of the PTX");
}

bool is_allocated(std::uint64_t address, std::size_t bytes, int line) {
  struct Found {
    std::uint64_t first = 0, end = 0, generation = 0;
  };
  static std::array<Found, 4096> last;
  Found& found = last[static_cast<std::size_t>(line) % last.size()];
  const std::uint64_t generation = cuda_emulation::allocation_generation();
  if (found.generation != generation || address < found.first || address + bytes > found.end) {
    const auto range = cuda_emulation::allocation_of(reinterpret_cast<const void*>(address));
    found = {reinterpret_cast<std::uint64_t>(range.data()),
             reinterpret_cast<std::uint64_t>(range.data()) + range.size(), generation};
  }
  return address >= found.first && address + bytes <= found.end;
}

}  // namespace breccia::cuda_ptx
