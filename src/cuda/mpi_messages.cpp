#include "cuda/mpi_messages.hpp"

#include <utility>

namespace breccia::cuda {
namespace {

constexpr int kTag = 2;
// Steps whose messages have not arrived. A stream holds about a thousand pieces of work, and to enqueue more would make
// the host wait for a device that waits for the host. A rank that waits for the oldest of so many messages gets it, as
// the others can go no further without it either.
constexpr std::uint32_t kMostAhead = 32;
constexpr std::uint32_t kEvents = 64;  // more, and so many that numbers of steps may begin again

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
    : direct_(direct), block_bytes_(block_bytes), comm_(comm) {
  MPI_Type_contiguous(static_cast<int>(block_bytes), MPI_BYTE, &block_);
  MPI_Type_commit(&block_);
  for (std::uint32_t n = 0; n < kEvents; ++n) packed_.push_back(std::make_unique<Event>());
  if (ahead) signal_ = std::make_unique<StreamSignal>();
}

MpiMessages::~MpiMessages() {
  if (arrived_ != enqueued_) give_up();
  MPI_Type_free(&block_);
}

// Where an exception ends the run with messages under way. Memory of the device can only be given back when the device
// is done, so it goes on without them; MPI may read what it sends for as long as it likes.
void MpiMessages::give_up() noexcept {
  for (MPI_Request& request : receives_) {
    if (request != MPI_REQUEST_NULL) MPI_Cancel(&request);
  }
  wait_for(receives_);
  if (!all_done(sends_)) sent_host_.leave();
  if (signal_) signal_->set(enqueued_);
}

std::size_t MpiMessages::bytes() const {
  std::size_t blocks = 0;
  for (const HaloPart& part : parts_) blocks += part.blocks;
  return blocks * block_bytes_;
}

Event& MpiMessages::packed(std::uint32_t step) { return *packed_[step % kEvents]; }

void MpiMessages::set(std::vector<HaloPart> parts, const void* sent, void* received) {
  // A CUDA-aware MPI makes memory of a device known to others when it is first sent, which may wait for the device.
  unknown_to_mpi_ = direct_ && comm_.any(sent != sent_ || received != received_ || parts.size() != parts_.size());
  parts_ = std::move(parts);
  sent_ = sent;
  received_ = received;
  if (direct_) return;
  sent_host_.reserve(bytes());
  received_host_.reserve(bytes());
}

void MpiMessages::start(cudaStream_t stream) {
  if (!direct_) check(cudaMemcpyAsync(sent_host_.data(), sent_, bytes(), cudaMemcpyDeviceToHost, stream), "halo");
  packed(enqueued_).record(stream);
}

bool MpiMessages::may_be_ahead() { return signal_ && !std::exchange(unknown_to_mpi_, false); }

void MpiMessages::finish(cudaStream_t stream) {
  ++enqueued_;
  if (may_be_ahead()) {
    signal_->precede(stream, enqueued_);
  } else {
    deliver();
  }
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
