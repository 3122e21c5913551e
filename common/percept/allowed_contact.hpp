#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace phantom::percept {

/// Objects that the arm, or one of its links, may touch. Their fluid counts as free space there, for drag and
/// for alerts, so that intended contact is not resisted. Where fluids overlap, a voxel belongs only to the
/// object of greater μ. Muting that object also mutes the fluid of the other object in the voxel. Bounded;
/// copying uses no heap.
class AllowedContact {
 public:
  static constexpr std::size_t kMax = 16;
  /// Link number that means the whole arm; it is free because link 0, the base, does not move.
  static constexpr std::size_t kWholeArm = 0;

  /// Mutes `object` (1 or more) on link `link`, or on the whole arm. Returns false if there is no room.
  bool add(std::uint16_t object, std::size_t link) noexcept {
    if (count_ == kMax) return false;
    entries_[count_++] = {object, link};
    return true;
  }
  std::size_t size() const noexcept { return count_; }
  friend bool operator==(const AllowedContact&, const AllowedContact&) = default;

  /// Calls visit(object, link) for each entry.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t i = 0; i < count_; ++i) visit(entries_[i].object, entries_[i].link);
  }

  /// Returns whether anything is muted on this link. If not, the voxels' objects need not be looked up.
  bool concerns(std::size_t link) const noexcept {
    return std::any_of(entries_.begin(), entries_.begin() + count_,
                       [&](const Entry& entry) { return entry.is_on(link); });
  }
  bool mutes(std::size_t link, std::uint16_t object) const noexcept {
    return std::any_of(entries_.begin(), entries_.begin() + count_,
                       [&](const Entry& entry) { return entry.object == object && entry.is_on(link); });
  }

 private:
  struct Entry {
    std::uint16_t object = 0;
    std::size_t link = kWholeArm;
    bool is_on(std::size_t l) const noexcept { return link == kWholeArm || link == l; }
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::array<Entry, kMax> entries_{};
  std::size_t count_ = 0;
};

}  // namespace phantom::percept
