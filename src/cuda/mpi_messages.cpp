#include "cuda/mpi_messages.hpp"

#include <utility>

namespace breccia::cuda {
namespace {

constexpr int kTag = 2;

}  // namespace

MpiMessages::MpiMessages(bool direct, std::size_t block_bytes, const mpi::Comm& comm)
    : direct_(direct), block_bytes_(block_bytes), comm_(comm) {
  MPI_Type_contiguous(static_cast<int>(block_bytes), MPI_BYTE, &block_);
  MPI_Type_commit(&block_);
}

MpiMessages::~MpiMessages() { MPI_Type_free(&block_); }

std::size_t MpiMessages::bytes() const {
  std::size_t blocks = 0;
  for (const HaloPart& part : parts_) blocks += part.blocks;
  return blocks * block_bytes_;
}

void MpiMessages::set(std::vector<HaloPart> parts, const void* sent, void* received) {
  parts_ = std::move(parts);
  sent_ = sent;
  received_ = received;
  if (direct_) return;
  sent_host_.reserve(bytes());
  received_host_.reserve(bytes());
}

void MpiMessages::start(cudaStream_t stream) {
  if (!direct_) check(cudaMemcpyAsync(sent_host_.data(), sent_, bytes(), cudaMemcpyDeviceToHost, stream), "halo");
  ready_.record(stream);
}

void MpiMessages::finish(cudaStream_t stream) {
  ready_.wait();
  const std::byte* from = direct_ ? static_cast<const std::byte*>(sent_) : sent_host_.data();
  std::byte* to = direct_ ? static_cast<std::byte*>(received_) : received_host_.data();
  std::vector<MPI_Request> requests;
  for (const HaloPart& part : parts_) {
    const auto count = static_cast<int>(part.blocks);
    requests.emplace_back();
    MPI_Irecv(to, count, block_, part.rank, kTag, comm_.handle(), &requests.back());
    requests.emplace_back();
    MPI_Isend(from, count, block_, part.rank, kTag, comm_.handle(), &requests.back());
    from += part.blocks * block_bytes_;
    to += part.blocks * block_bytes_;
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  if (!direct_)
    check(cudaMemcpyAsync(received_, received_host_.data(), bytes(), cudaMemcpyHostToDevice, stream), "halo");
}

}  // namespace breccia::cuda
