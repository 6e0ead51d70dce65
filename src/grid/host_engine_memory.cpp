// What the engine holds when. Where nodes are few beside particles, the memory of an array is given back around a
// sorting while nobody needs it: that of the sums before the half step that only gathers, of the nodes' velocities from
// the sorting to the next grid update, of the velocity gradients after the half step that only scatters. Where nodes
// are many, to clear them anew would cost more than it gives.
#include <algorithm>

#include "grid/host_engine.hpp"

namespace breccia::grid {

template <class P>
bool HostEngine<P>::has_few_nodes() const {
  return 8 * places() * kChannels * sizeof(Real) < store_.packs() * kLanes * store_.record_bytes();
}

template <class P>
bool HostEngine<P>::outgrows_cache() const {
  // At 1.4 particles a cell to ask for nodes costs 2 % at 43 MB, gives 1 % at 86 MB and a third at 200
  // (docs/performance.md): beyond what a processor's last cache has for one program beside others.
  constexpr std::size_t kCache = std::size_t{64} << 20;
  return 2 * places() * kChannels * sizeof(Real) + store_.packs() * kLanes * store_.record_bytes() > kCache;
}

// What the array held may be lost: its callers know that nobody reads it.
template <class P>
void HostEngine<P>::hold(LargeArray<Real>& values, std::size_t places) {
  if (places * kChannels > values.capacity()) {
    release(values);
    // Where nodes are many, some room for the next sortings.
    values.reserve((has_few_nodes() ? places : places + places / 32) * kChannels);
  }
  values.resize(places * kChannels, Real(0));
}

template <class P>
void HostEngine<P>::hold_sums() {
  // The grid update has cleared every sum.
  hold(sums_, columns_.places());
}

template <class P>
void HostEngine<P>::hold_velocities() {
  // Read are velocities of nodes that a scatter has reached since; loaded are those beside them, too.
  hold(velocities_, places());
}

template <class P>
void HostEngine<P>::drop_sums() {
  if (has_few_nodes()) release(sums_);
}

template <class P>
void HostEngine<P>::drop_velocities() {
  if (has_few_nodes()) release(velocities_);
}

template <class P>
void HostEngine<P>::drop_gradients() {
  // A lone particle keeps its own from step to step.
  if (has_few_nodes() && lone_.particles == 0) store_.drop_gradients();
}

template <class P>
std::size_t HostEngine<P>::bytes_held() const {
  return store_.bytes() + (sums_.capacity() + velocities_.capacity()) * sizeof(Real) +
         flaw_codes_.capacity() * sizeof(material::FlawCode) + lone_pull_.capacity() * sizeof(LonePull<P>);
}

template <class P>
void HostEngine<P>::count_bytes(std::size_t beside) {
  most_bytes_ = std::max(most_bytes_, bytes_held() + beside);
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid
