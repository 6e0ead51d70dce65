// Scan and radix sort against the standard library, in every order of lanes and blocks.
#include "cuda/primitives.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace breccia::cuda {
namespace {

using cuda_emulation::Order;

class Primitives : public testing::TestWithParam<Order> {
 protected:
  void SetUp() override {
    cuda_emulation::set_order(GetParam(), 11);
    ASSERT_EQ(cudaStreamCreate(&stream_), cudaSuccess);
  }
  void TearDown() override { cudaStreamDestroy(stream_); }

  cudaStream_t stream_ = nullptr;
  PrimitiveScratch scratch_;
};

TEST_P(Primitives, ScanSumsAllBefore) {
  // One thread, one block, a ragged end, two levels of block sums.
  for (const unsigned count : {1U, 5U, 1024U, 1025U, 5000U, 1100000U}) {
    if (count > 10000 && GetParam() != Order::kForward) continue;  // seconds
    std::vector<unsigned> values(count);
    for (unsigned i = 0; i < count; ++i) values[i] = (i * 2654435761U) >> 30;
    DeviceArray<unsigned> device(count);
    device.upload(values, stream_);
    exclusive_scan(device.data(), count, scratch_, stream_);
    std::vector<unsigned> expected(count);
    std::exclusive_scan(values.begin(), values.end(), expected.begin(), 0U);
    EXPECT_EQ(device.download(count, stream_), expected) << count;
  }
}

TEST_P(Primitives, SortIsStable) {
  for (const unsigned count : {1U, 63U, 2048U, 7001U}) {
    std::mt19937_64 random(count);
    std::vector<std::uint64_t> keys(count);
    for (std::uint64_t& key : keys) key = random() % 700;  // many alike
    std::vector<unsigned> values(count);
    std::iota(values.begin(), values.end(), 0U);
    DeviceArray<std::uint64_t> device_keys(count);
    DeviceArray<unsigned> device_values(count);
    device_keys.upload(keys, stream_);
    device_values.upload(values, stream_);
    radix_sort(device_keys, device_values, count, 0, 10, scratch_, stream_);
    std::stable_sort(values.begin(), values.end(), [&](unsigned a, unsigned b) { return keys[a] < keys[b]; });
    std::sort(keys.begin(), keys.end());
    EXPECT_EQ(device_values.download(count, stream_), values) << count;
    EXPECT_EQ(device_keys.download(count, stream_), keys) << count;
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, Primitives, testing::Values(Order::kForward, Order::kReverse, Order::kRandom));

}  // namespace
}  // namespace breccia::cuda
