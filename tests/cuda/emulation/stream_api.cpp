// Streams, events and graphs of the emulated runtime: what is enqueued runs when it must.
#include "tests/cuda/emulation/stream_api.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <utility>
#include <vector>

#include "tests/cuda/emulation/cuda_emulation.hpp"

struct EmulatedGraph {
  std::vector<std::function<void()>> work;
  std::uint64_t launches = 0;
};
struct EmulatedEvent {
  EmulatedStream* stream = nullptr;  // null: never recorded
  std::uint64_t after = 0;           // that much of the stream's work
};

namespace breccia::cuda_emulation {

// A stream that goes on before anybody waits for it, or none (a number beyond the last).
std::size_t early_stream(std::size_t streams);
void run_kernel(const std::string& kernel, dim3 grid, dim3 block, std::size_t shared_bytes,
                const std::function<void()>& body);

namespace {

std::uint64_t launches = 0;
std::uint64_t synchronisations = 0;
std::vector<EmulatedStream*> streams;

// The host waits: for ever, where the stream waits for the host.
void finish(EmulatedStream* stream, std::uint64_t count) {
  if (!stream->run_until(count)) throw EmulationError("the host waits for a stream that waits for the host");
}

}  // namespace

void run_all() {
  for (EmulatedStream* stream : streams) finish(stream, stream->enqueued);
}

bool driver_is(std::string_view kind) {
  const char* driver = std::getenv("BRECCIA_EMULATED_DRIVER");
  return driver != nullptr && driver == kind;
}

bool host_is_awaited() {
  const auto waits = [](const EmulatedStream::Work& work) { return work.waits_for_host && !work.may_begin(); };
  return std::any_of(streams.begin(), streams.end(),
                     [&](const EmulatedStream* s) { return std::any_of(s->waiting.begin(), s->waiting.end(), waits); });
}

void refuse_where_host_is_awaited(const std::string& what) {
  if (host_is_awaited()) throw EmulationError(what + " while a stream waits for the host");
}

std::uint64_t launch_count() { return launches; }
std::uint64_t synchronisation_count() { return synchronisations; }

void launch(const std::string& kernel, dim3 grid, dim3 block, std::size_t shared_bytes, cudaStream_t stream,
            std::function<void()> body) {
  ++(stream->capturing == nullptr ? launches : stream->capturing->launches);
  stream->enqueue([=, body = std::move(body)] { run_kernel(kernel, grid, block, shared_bytes, body); });
}

}  // namespace breccia::cuda_emulation

namespace {

void append(EmulatedStream& stream, EmulatedStream::Work work) {
  using namespace breccia::cuda_emulation;
  stream.waiting.push_back(std::move(work));
  ++stream.enqueued;
  const std::size_t early = early_stream(streams.size());
  if (early < streams.size()) streams[early]->run_until(streams[early]->enqueued);
}

}  // namespace

void EmulatedStream::enqueue(std::function<void()> work) {
  if (capturing != nullptr) {
    capturing->work.push_back(std::move(work));
  } else {
    append(*this, {std::move(work), {}});
  }
}

void EmulatedStream::hold(std::function<bool()> has_come, bool of_the_host) {
  if (capturing != nullptr) throw breccia::cuda_emulation::EmulationError("a graph that waits is not emulated");
  append(*this, {[] {}, std::move(has_come), of_the_host});
}

bool EmulatedStream::run_until(std::uint64_t count) {
  while (done < count) {
    if (waiting.front().may_begin && !waiting.front().may_begin()) return false;
    if (breccia::cuda_emulation::driver_is("serial") && breccia::cuda_emulation::host_is_awaited()) return false;
    const Work work = std::move(waiting.front());
    waiting.pop_front();
    ++done;
    work.run();
  }
  return true;
}

namespace {
int emulated_wait_value(cudaStream_t stream, unsigned long long address, std::uint32_t value, unsigned) {
  if (breccia::cuda_emulation::driver_is("hasty")) return 0;
  // NOLINTNEXTLINE(performance-no-int-to-ptr): to the driver an address is a number
  auto* const number = reinterpret_cast<std::uint32_t*>(address);
  stream->hold([=] { return static_cast<std::int32_t>(std::atomic_ref(*number).load() - value) >= 0; }, true);
  return 0;
}
}  // namespace
cudaError_t cudaGetDriverEntryPointByVersion(const char* name, void** function, unsigned, unsigned long long,
                                             cudaDriverEntryPointQueryResult* found) {
  const bool old = breccia::cuda_emulation::driver_is("old");
  *found = old ? cudaDriverEntryPointSymbolNotFound : cudaDriverEntryPointSuccess;
  *function = nullptr;
  if (!old && std::string_view(name) == "cuStreamWaitValue32")
    *function = reinterpret_cast<void*>(&emulated_wait_value);
  return cudaSuccess;
}
cudaError_t cudaStreamCreate(cudaStream_t* stream) {
  breccia::cuda_emulation::refuse_where_host_is_awaited("a stream is made");
  *stream = new EmulatedStream;
  breccia::cuda_emulation::streams.push_back(*stream);
  return cudaSuccess;
}
cudaError_t cudaStreamCreateWithPriority(cudaStream_t* stream, unsigned, int) { return cudaStreamCreate(stream); }
cudaError_t cudaDeviceGetStreamPriorityRange(int* lowest, int* highest) {
  *lowest = 0;
  *highest = -5;
  return cudaSuccess;
}
// To ask in a loop is to wait, which is counted, and in which the device gets on.
cudaError_t cudaStreamQuery(cudaStream_t stream) {
  if (stream->done == stream->enqueued) return cudaSuccess;
  ++breccia::cuda_emulation::synchronisations;
  stream->run_until(stream->done + 1);
  return cudaErrorNotReady;
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  breccia::cuda_emulation::run_all();
  std::erase(breccia::cuda_emulation::streams, stream);
  delete stream;
  return cudaSuccess;
}
cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  ++breccia::cuda_emulation::synchronisations;
  if (stream->capturing != nullptr) return cudaErrorInvalidValue;
  breccia::cuda_emulation::finish(stream, stream->enqueued);
  return cudaSuccess;
}
cudaError_t cudaDeviceSynchronize() {
  ++breccia::cuda_emulation::synchronisations;
  breccia::cuda_emulation::run_all();
  return cudaSuccess;
}
cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned) {
  *event = new EmulatedEvent;
  return cudaSuccess;
}
cudaError_t cudaEventDestroy(cudaEvent_t event) {
  delete event;
  return cudaSuccess;
}
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  if (stream->capturing != nullptr) return cudaErrorInvalidValue;  // not emulated
  *event = {stream, stream->enqueued};
  return cudaSuccess;
}
cudaError_t cudaEventSynchronize(cudaEvent_t event) {
  ++breccia::cuda_emulation::synchronisations;
  if (event->stream != nullptr) breccia::cuda_emulation::finish(event->stream, event->after);
  return cudaSuccess;
}
cudaError_t cudaEventQuery(cudaEvent_t event) {
  return event->stream == nullptr || event->stream->done >= event->after ? cudaSuccess : cudaErrorNotReady;
}
cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned) {
  if (event->stream == nullptr) return cudaSuccess;
  stream->hold([then = *event] { return then.stream->run_until(then.after); }, false);
  return cudaSuccess;
}
cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode) {
  if (stream->capturing != nullptr) return cudaErrorInvalidValue;
  stream->capturing = new EmulatedGraph;
  return cudaSuccess;
}
cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  *graph = stream->capturing;
  stream->capturing = nullptr;
  return cudaSuccess;
}
cudaError_t cudaGraphInstantiate(cudaGraphExec_t* executable, cudaGraph_t graph, unsigned long long) {
  *executable = new EmulatedGraph(*graph);
  return cudaSuccess;
}
cudaError_t cudaGraphLaunch(cudaGraphExec_t executable, cudaStream_t stream) {
  breccia::cuda_emulation::launches += executable->launches;
  stream->enqueue([graph = *executable] {
    for (const auto& work : graph.work) work();
  });
  return cudaSuccess;
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  return cudaSuccess;
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t executable) {
  delete executable;
  return cudaSuccess;
}
