// The nearest of the words that would have been right.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace breccia::scene {

/// `; did you mean "x"?` for the candidate within a third of the length of `word` (edit distance, neighbours swapped
/// count one); empty if there is none.
std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

}  // namespace breccia::scene
