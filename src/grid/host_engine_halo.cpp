// Sums to the owners of nodes, velocities back: what a pass and the grid update do about it, and when.
#include <omp.h>

#include <algorithm>

#include "grid/host_engine.hpp"

namespace breccia::grid {

template <class P>
void HostEngine<P>::send_sums() {
  shared_updated_ = false;
  if (!has_neighbours()) return;
  sum_exchange_.send(sums_.data());
  sum_exchange_.clear_sent(sums_.data());
}

template <class P>
void HostEngine<P>::progress(const NodeArguments<P>* arguments) {
  // MPI belongs to the thread that started it.
  if (omp_get_thread_num() != 0 || !sum_exchange_.travelling()) return;
  if (shared_updated_) {
    static_cast<void>(velocity_exchange_.arrived());
  } else if (sum_exchange_.arrived() && arguments != nullptr) {
    update_shared(*arguments);
  }
}

template <class P>
void HostEngine<P>::update_shared(const NodeArguments<P>& arguments) {
  noted("shared nodes", [&] {
    sum_exchange_.add_received(sums_.data());
    for (std::size_t n = 0; n < ordered_.shared_sums(); ++n) ordered_.add_up(n, columns_, sums_.data(), rows_.data());
    for (const PeriodImages::Image& image : images_.shared()) rows_[image.block] = kAllRows;  // what came has no marks
    images_.fold(images_.shared(), columns_, sums_.data(), rows_.data());
    for (std::uint32_t b = 0; b < owned_blocks_; ++b) {
      if (block_sums_[b] != BlockSums::kShared) continue;
      rows_[b] = kAllRows;
      kernels_.update_blocks(arguments, b, b + 1);
    }
    boundaries_.apply_to_shared(velocities_.data());
    copy_to_images(images_.shared());
    velocity_exchange_.send(velocities_.data());
  });
  shared_updated_ = true;
}

template <class P>
void HostEngine<P>::finish_sums(const NodeArguments<P>& arguments) {
  if (!sum_exchange_.travelling()) return;
  noted("wait for sums", [&] { sum_exchange_.finish(); });
  if (!shared_updated_) update_shared(arguments);
  const mpi::Flights& sums = sum_exchange_.flights();
  note("sums", Timeline::Lane::kMessages, sums.sent, sums.here);
  if (!setup_.numerics.overlap) wait_for_velocities();
}

template <class P>
void HostEngine<P>::finish_velocities() {
  if (velocity_exchange_.travelling()) wait_for_velocities();
  velocity_exchange_.take_received(velocities_.data());
}

template <class P>
void HostEngine<P>::copy_to_images(std::span<const PeriodImages::Image> images) {
  for (const PeriodImages::Image& image : images) {
    for (std::uint32_t n = 0; n < kBlockNodes; ++n) {
      for (std::uint32_t h = 0; h < 2; ++h) {
        const auto half = [&](std::uint32_t block) {
          return velocities_.data() +
                 std::size_t{velocity_half(columns_.blocks()[block].node(n), h)} * kVelocityChannels;
        };
        std::copy_n(half(image.original), kVelocityChannels, half(image.block));
      }
    }
  }
}

template <class P>
void HostEngine<P>::wait_for_velocities() {
  noted("wait for velocities", [&] { velocity_exchange_.finish(); });
  const mpi::Flights& velocities = velocity_exchange_.flights();
  note("velocities", Timeline::Lane::kMessages, velocities.sent, velocities.here);
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid
