// The launches of a step as a graph that one call repeats.
#pragma once

#include "cuda/stream.hpp"

namespace breccia::cuda {

class StepGraph {
 public:
  StepGraph() = default;
  ~StepGraph() { clear(); }
  StepGraph(const StepGraph&) = delete;
  StepGraph& operator=(const StepGraph&) = delete;

  /// Runs what `enqueue` launches on the stream; captured at the first call for this dt and repeated afterwards.
  template <class Enqueue>
  void run(cudaStream_t stream, double step, Enqueue&& enqueue) {
    if (executable_ == nullptr || step != step_) {
      clear();
      cudaGraph_t graph = nullptr;
      check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capture of a step");
      enqueue();
      check(cudaStreamEndCapture(stream, &graph), "capture of a step");
      check(cudaGraphInstantiate(&executable_, graph, 0), "graph of a step");
      check(cudaGraphDestroy(graph), "graph of a step");
      step_ = step;
    }
    check(cudaGraphLaunch(executable_, stream), "launch of a step");
  }
  /// To be called when anything but dt changes.
  void clear() {
    if (executable_ != nullptr) (void)cudaGraphExecDestroy(executable_);
    executable_ = nullptr;
  }

 private:
  cudaGraphExec_t executable_ = nullptr;
  double step_ = 0.0;
};

}  // namespace breccia::cuda
