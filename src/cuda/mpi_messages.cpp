#include "cuda/mpi_messages.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "mpi/patience.hpp"

namespace breccia::cuda {
namespace {

constexpr int kTag = 2;

bool all_done(std::vector<MPI_Request>& requests) {
  int all = 0;
  MPI_Testall(static_cast<int>(requests.size()), requests.data(), &all, MPI_STATUSES_IGNORE);
  return all != 0;
}

void wait_for(std::vector<MPI_Request>& requests) {
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
}

}  // namespace

MpiMessages::MpiMessages(bool direct, bool ahead, std::size_t block_bytes, const mpi::Comm& comm)
    : direct_(direct), block_bytes_(block_bytes), comm_(comm), exceptions_(std::uncaught_exceptions()) {
  MPI_Type_contiguous(static_cast<int>(block_bytes), MPI_BYTE, &block_);
  MPI_Type_commit(&block_);
  if (ahead) signal_ = std::make_unique<StreamSignal>();
}

MpiMessages::~MpiMessages() {
  try {
    if (std::uncaught_exceptions() == exceptions_) bring_in();
  } catch (const NumericsError&) {
    // The device has failed, which the next use of it tells: here nobody could be told.
  }
  if (arrived_ != enqueued_) give_up();
  MPI_Type_free(&block_);
}

// A message that another rank has begun to send can no longer be refused, and may never end if that rank has gone: then
// MPI keeps the memory it was given.
void MpiMessages::give_up() {
  for (MPI_Request& request : receives_) {
    if (request != MPI_REQUEST_NULL) MPI_Cancel(&request);
  }
  if (!mpi::complete_within(std::chrono::seconds(1), receives_)) received_host_.leave();
  if (!all_done(sends_)) sent_host_.leave();
}

std::size_t MpiMessages::bytes() const {
  std::size_t blocks = 0;
  for (const HaloPart& part : parts_) blocks += part.blocks;
  return blocks * block_bytes_;
}

void MpiMessages::set(std::vector<HaloPart> parts, const void* sent, void* received) {
  parts_ = std::move(parts);
  sent_ = sent;
  received_ = received;
  new_to_mpi_ = direct_;
  if (direct_) return;
  sent_host_.reserve(bytes());
  received_host_.reserve(bytes());
}

void MpiMessages::start(cudaStream_t stream) {
  if (!direct_) check(cudaMemcpyAsync(sent_host_.data(), sent_, bytes(), cudaMemcpyDeviceToHost, stream), "halo");
  packed(enqueued_).record(stream);
}

void MpiMessages::finish(cudaStream_t stream) {
  ++enqueued_;
  // A CUDA-aware MPI makes memory known to other devices when it is first sent, and streams and events of its own when
  // it first needs them, for which it may wait for the device.
  if (signal_ && !new_to_mpi_) {
    signal_->precede(stream, enqueued_);
  } else {
    deliver();
  }
  new_to_mpi_ = false;
  if (!direct_)
    check(cudaMemcpyAsync(received_, received_host_.data(), bytes(), cudaMemcpyHostToDevice, stream), "halo");
  deliver_what_is_there();
  if (enqueued_ - arrived_ == kMostAhead) deliver();
}

void MpiMessages::bring_in() {
  while (arrived_ != enqueued_) deliver();
}

void MpiMessages::exchange() {
  const std::byte* from = direct_ ? static_cast<const std::byte*>(sent_) : sent_host_.data();
  std::byte* to = direct_ ? static_cast<std::byte*>(received_) : received_host_.data();
  for (const HaloPart& part : parts_) {
    const auto count = static_cast<int>(part.blocks);
    MPI_Irecv(to, count, block_, part.rank, kTag, comm_.handle(), &receives_.emplace_back());
    MPI_Isend(from, count, block_, part.rank, kTag, comm_.handle(), &sends_.emplace_back());
    from += part.blocks * block_bytes_;
    to += part.blocks * block_bytes_;
  }
}

void MpiMessages::arrived() {
  receives_.clear();
  sends_.clear();
  ++arrived_;
  if (signal_) signal_->set(arrived_);
}

void MpiMessages::deliver() {
  if (receives_.empty()) {
    packed(arrived_).wait();
    exchange();
  }
  wait_for(receives_);
  wait_for(sends_);
  arrived();
}

void MpiMessages::deliver_what_is_there() {
  while (arrived_ != enqueued_) {
    if (receives_.empty()) {
      if (!packed(arrived_).has_come()) return;
      exchange();
    }
    if (!all_done(receives_) || !all_done(sends_)) return;
    arrived();
  }
}

}  // namespace breccia::cuda
