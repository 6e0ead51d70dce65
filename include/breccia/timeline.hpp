// What a rank did when: bars of a picture of the last steps.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace breccia {

class Timeline {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Lane : std::uint8_t { kStages, kTiles, kMessages };
  struct Bar {
    std::string name;
    Lane lane;
    Clock::time_point begin, end;
  };
  /// Steps that are kept at least; at most twice as many.
  static constexpr std::size_t kSteps = 100;

  /// A step begins: bars older than the last kSteps steps are forgotten now and then.
  void begin_step() {
    if (++steps_ % kSteps != 0) return;
    bars_.erase(bars_.begin(), bars_.begin() + static_cast<std::ptrdiff_t>(older_));
    older_ = bars_.size();
  }
  void add(std::string_view name, Lane lane, Clock::time_point begin, Clock::time_point end) {
    bars_.push_back({std::string(name), lane, begin, end});
  }
  [[nodiscard]] const std::vector<Bar>& bars() const { return bars_; }

 private:
  std::vector<Bar> bars_;
  std::size_t steps_ = 0;
  std::size_t older_ = 0;  // bars of the steps before the last multiple of kSteps
};

}  // namespace breccia
