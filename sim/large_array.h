// A large array on huge pages.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

namespace twilight {

/// n floats, not initialised, aligned to 2 MiB where the system is asked for huge pages: the
/// first touch of 4 KiB pages costs as much as the kernels written there.
class LargeArray {
 public:
  LargeArray() = default;
  explicit LargeArray(std::size_t n) {
    constexpr std::size_t kHugePage = std::size_t{2} << 20;
    const std::size_t bytes = (n * sizeof(float) + kHugePage - 1) / kHugePage * kHugePage;
    if (bytes == 0) return;
    values_.reset(static_cast<float*>(std::aligned_alloc(kHugePage, bytes)));
    if (!values_) throw std::bad_alloc();
    ::madvise(values_.get(), bytes, MADV_HUGEPAGE);  // advice: the array serves without
  }
  explicit operator bool() const { return values_ != nullptr; }
  float* data() { return values_.get(); }
  const float* data() const { return values_.get(); }

 private:
  struct Free {
    void operator()(float* p) const { std::free(p); }
  };
  std::unique_ptr<float[], Free> values_;
};

}  // namespace twilight
