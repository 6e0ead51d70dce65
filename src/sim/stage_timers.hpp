// Wall time of the named stages of the step: what --profile prints and summary.json keeps.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "breccia/timeline.hpp"

namespace breccia::sim {

class StageTimers {
 public:
  struct Stage {
    std::string name;  ///< "whole: part" for a part of the stage "whole"
    double seconds = 0.0;
    std::uint64_t calls = 0;
  };

  /// Runs `work` and books its time under `name`.
  template <class F>
  decltype(auto) operator()(std::string_view name, F&& work) {
    const Running running(stage(name), timeline_);
    return work();
  }

  /// Books a part of a stage that is measured elsewhere, as "whole: part". Its time is in that of the whole, too.
  void add_part(std::string_view whole, std::string_view part, double seconds) {
    Stage& s = stage(std::string(whole) + ": " + std::string(part));
    s.seconds += seconds;
    ++s.calls;
  }

  [[nodiscard]] const std::vector<Stage>& stages() const { return stages_; }
  /// Notes every stage in `timeline` from now on.
  void record(Timeline* timeline) { timeline_ = timeline; }

 private:
  using Clock = std::chrono::steady_clock;

  // Books the time when it goes out of scope, also on an exception.
  class Running {
   public:
    Running(Stage& stage, Timeline* timeline) : stage_(stage), timeline_(timeline), start_(Clock::now()) {}
    ~Running() {
      const Clock::time_point end = Clock::now();
      stage_.seconds += std::chrono::duration<double>(end - start_).count();
      ++stage_.calls;
      if (timeline_ != nullptr) timeline_->add(stage_.name, Timeline::Lane::kStages, start_, end);
    }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

   private:
    Stage& stage_;
    Timeline* timeline_;
    Clock::time_point start_;
  };

  Stage& stage(std::string_view name) {
    for (Stage& s : stages_) {
      if (s.name == name) return s;
    }
    // Stages do not nest, so a reference is never held across this.
    return stages_.emplace_back(Stage{std::string(name)});
  }

  std::vector<Stage> stages_;
  Timeline* timeline_ = nullptr;
};

}  // namespace breccia::sim
