#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace phantom::core {

/// List of at most `Most` items that are kept in place: it never allocates, and is trivially copyable if T
/// is. Real-time safe: yes, as T is.
template <class T, std::size_t Most>
class BoundedList {
 public:
  static constexpr std::size_t kMax = Most;

  /// Adds an item at the end. Returns false, and changes nothing, if there is no room.
  bool push_back(const T& item) noexcept {
    if (count_ == Most) return false;
    items_[count_++] = item;
    return true;
  }
  /// Keeps the first `count` items, and adds default ones up to it; at most Most.
  void resize(std::size_t count) noexcept {
    count = std::min(count, Most);
    for (std::size_t i = count_; i < count; ++i) items_[i] = T{};
    count_ = count;
  }
  void clear() noexcept { count_ = 0; }

  std::size_t size() const noexcept { return count_; }
  bool empty() const noexcept { return count_ == 0; }
  bool full() const noexcept { return count_ == Most; }
  T& operator[](std::size_t i) noexcept { return items_[i]; }
  const T& operator[](std::size_t i) const noexcept { return items_[i]; }
  const T& front() const noexcept { return items_[0]; }
  T& back() noexcept { return items_[count_ - 1]; }
  const T& back() const noexcept { return items_[count_ - 1]; }
  T* begin() noexcept { return items_.data(); }
  T* end() noexcept { return items_.data() + count_; }
  const T* begin() const noexcept { return items_.data(); }
  const T* end() const noexcept { return items_.data() + count_; }

  friend bool operator==(const BoundedList& a, const BoundedList& b) noexcept {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  std::array<T, Most> items_{};
  std::size_t count_ = 0;
};

}  // namespace phantom::core
