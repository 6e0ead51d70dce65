// Streams of a device, and events that order them.
#pragma once

#include "cuda/check.hpp"

namespace breccia::cuda {

class Stream {
 public:
  enum class Priority { kNormal, kHigh };

  /// Thread blocks of a stream of high priority take the next free multiprocessor, before those that wait already.
  explicit Stream(Priority priority = Priority::kNormal) {
    int lowest = 0;
    int highest = 0;
    check(cudaDeviceGetStreamPriorityRange(&lowest, &highest), "stream");
    check(cudaStreamCreateWithPriority(&stream_, cudaStreamNonBlocking, priority == Priority::kHigh ? highest : lowest),
          "stream");
  }
  ~Stream() { (void)cudaStreamDestroy(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

/// A moment of a stream.
class Event {
 public:
  Event() { check(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming), "event"); }
  ~Event() { (void)cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  /// When all that was enqueued so far is done.
  void record(cudaStream_t stream) { check(cudaEventRecord(event_, stream), "event"); }
  /// What is enqueued on `stream` from now on comes after the moment.
  void precede(cudaStream_t stream) const { check(cudaStreamWaitEvent(stream, event_, 0), "event"); }
  /// Whether it has come; the host does not wait.
  [[nodiscard]] bool has_come() const {
    const cudaError_t status = cudaEventQuery(event_);
    if (status == cudaErrorNotReady) return false;
    check(status, "event");
    return true;
  }
  /// The host waits for it.
  void wait() const { check(cudaEventSynchronize(event_), "event"); }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace breccia::cuda
