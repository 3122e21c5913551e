#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace phantom::percept {

/// Objects that the arm, or one of its links, is meant to touch: their fluid counts as free space there, for
/// drag and for alerts, because intended contact must not be fought. Where fluids overlap a voxel belongs to
/// the object of greater μ alone: the fluid of another object that such a voxel hides is muted with it.
/// Bounded; copying takes no heap.
class AllowedContact {
 public:
  static constexpr std::size_t kMost = 16;
  static constexpr std::size_t kWholeArm =
      0;  ///< as link: the base does not move, so that its number is free

  /// Mutes `object` (1 or more) on link `link`, or on the whole arm. False if there is no place left.
  bool add(std::uint16_t object, std::size_t link) noexcept {
    if (count_ == kMost) return false;
    entries_[count_++] = {object, link};
    return true;
  }
  std::size_t size() const noexcept { return count_; }
  friend bool operator==(const AllowedContact&, const AllowedContact&) = default;

  /// Calls visit(object, link) for each.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t i = 0; i < count_; ++i) visit(entries_[i].object, entries_[i].link);
  }

  /// Whether anything is muted on this link: if not, no voxel's object need be looked at.
  bool concerns(std::size_t link) const noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      if (entries_[i].link == kWholeArm || entries_[i].link == link) return true;
    }
    return false;
  }
  bool mutes(std::size_t link, std::uint16_t object) const noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      if (entries_[i].object == object && (entries_[i].link == kWholeArm || entries_[i].link == link))
        return true;
    }
    return false;
  }

 private:
  struct Entry {
    std::uint16_t object = 0;
    std::size_t link = kWholeArm;
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::array<Entry, kMost> entries_{};
  std::size_t count_ = 0;
};

}  // namespace phantom::percept
