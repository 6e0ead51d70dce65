#include "cuda/device_memory.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "breccia/error.hpp"
#include "cuda/check.hpp"
#include "cuda/device_particles.hpp"
#include "cuda/observe_kernels.hpp"
#include "cuda/step_arguments.hpp"
#include "mpi/together.hpp"

namespace breccia::cuda {
namespace {

// A device has another number in each process that may see others (CUDA_VISIBLE_DEVICES), but one place on the bus.
struct Share {
  int domain, bus, slot;
  std::uint64_t needed;
  [[nodiscard]] bool same_device(const Share& other) const {
    return domain == other.domain && bus == other.bus && slot == other.slot;
  }
};

cudaDeviceProp properties_of_this() {
  int device = 0;
  cudaDeviceProp properties{};
  check(cudaGetDevice(&device), "device");
  check(cudaGetDeviceProperties(&properties, device), "device");
  return properties;
}

// Of the ranks on this node that use the device of this rank.
std::vector<Share> shares(std::uint64_t needed, const cudaDeviceProp& device, const mpi::Comm& comm) {
  MPI_Comm node = MPI_COMM_NULL;
  MPI_Comm_split_type(comm.handle(), MPI_COMM_TYPE_SHARED, comm.rank(), MPI_INFO_NULL, &node);
  const Share own{device.pciDomainID, device.pciBusID, device.pciDeviceID, needed};
  std::vector<Share> all = mpi::Comm(node).allgather(own);
  MPI_Comm_free(&node);
  std::erase_if(all, [&](const Share& other) { return !other.same_device(own); });
  return all;
}

std::string gigabytes(std::uint64_t bytes) {
  const auto hundredths = static_cast<std::uint64_t>(std::ceil(1e-7 * static_cast<double>(bytes)));
  const std::string places = std::to_string(100 + hundredths % 100);
  return std::to_string(hundredths / 100) + "." + places.substr(1) + " GB";
}

// What a particle takes for a while, when all arrays of the sorting are still there: at outputs what the grid says of
// it (CudaEngine::observe), and where particles have come from other ranks a field twice, with what is to stay
// (DeviceParticles::replace).
template <class P>
std::uint64_t passing_bytes() {
  std::size_t widest = 0;
  for (const grid::FieldDescriptor& f : device_fields<P>()) {
    widest = std::max(widest, static_cast<std::size_t>(f.element_bytes) * static_cast<std::size_t>(f.components));
  }
  return std::max(kProbedReals * sizeof(typename P::Real), widest + sizeof(unsigned));
}

}  // namespace

template <class P>
std::uint64_t bytes_needed(std::size_t record, const Load& load) {
  constexpr std::uint64_t real = sizeof(typename P::Real);
  // Beside its fields: some of them while all are rearranged, keys and order of the sorting twice, four numbers of its
  // run, places in hash tables of up to four entries.
  constexpr std::uint64_t sorting = kRearrangedBytes + 2 * (8 + 8 + 4) + 4 * 4 + 8 + 4 * 12;
  constexpr std::uint64_t lone = 6 * real + sizeof(std::int32_t);
  constexpr std::uint64_t tile_hash = 2 * 2 * 27 * 12;
  constexpr std::uint64_t tile = kSums * kTileNodes * real + 27 * sizeof(grid::BlockKey) + sizeof(PassSums) + 8;
  constexpr std::uint64_t block = kSums * grid::kBlockNodes * real + 27 * sizeof(unsigned);
  // Of other ranks as much is received as is sent.
  constexpr std::uint64_t shared = 2 * kSums * grid::kBlockNodes * real + 6 * sizeof(unsigned);
  const std::uint64_t all = load.particles * (record + sorting + passing_bytes<P>()) + load.lone * lone +
                            load.tiles * (tile + tile_hash) + load.blocks * block + load.shared * shared +
                            load.flaws * sizeof(float);
  return all + all / 8;  // room that arrays keep (DeviceArray::reserve)
}

template std::uint64_t bytes_needed<MixedPrecision>(std::size_t, const Load&);
template std::uint64_t bytes_needed<DoublePrecision>(std::size_t, const Load&);

void require_memory(std::uint64_t needed, const std::string& what, const mpi::Comm& comm) {
  const cudaDeviceProp device = properties_of_this();
  const std::vector<Share> all = shares(needed, device, comm);
  std::uint64_t sum = 0;
  for (const Share& share : all) sum += share.needed;
  std::size_t available = 0;
  std::size_t total = 0;
  check(cudaMemGetInfo(&available, &total), "memory information");
  mpi::together<UsageError>(comm, [&] {
    if (sum <= available) return;
    throw UsageError(std::string(device.name) + " has not enough memory for " + what + ": " + gigabytes(sum) +
                     " needed by " + std::to_string(all.size()) + (all.size() == 1 ? " rank" : " ranks") + " (" +
                     std::to_string(sum) + " bytes), " + gigabytes(available) + " available (" +
                     std::to_string(available) +
                     " bytes); use more devices with a rank each, fewer particles, or --device host");
  });
}

int ranks_on_device(const mpi::Comm& comm) { return static_cast<int>(shares(0, properties_of_this(), comm).size()); }

}  // namespace breccia::cuda
