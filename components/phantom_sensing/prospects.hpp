#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "common/core/bounded_list.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::phantom_sensing {

/// A sensor at which a hit may threaten, as a quick look has it.
struct Prospect {
  std::size_t sensor = 0;
  std::size_t fluid = 0;  ///< whose voxel it is: 0 the workspace's, k + 1 that of the other link k
  workspace::Index3 voxel{};
  double mu = 0.0;           ///< Pa·s/m
  double speed_share = 0.0;  ///< speed, of the limit that holds at this μ
  double closing_m_s = 0.0;  ///< speed up the gradient of μ; negative: it leaves
};

/// What may threaten one link: for each object the sensor in the thickest fluid (rule 1), the one that
/// exceeds the speed limit most (rule 2), and those above it, or else near it, that near fastest (rule 3). At
/// most kMaxObjects; of more, those in the thickest fluid. Real-time safe: yes.
class Prospects {
 public:
  static constexpr std::size_t kMaxObjects = 12, kNearing = 3;

  struct OfObject {
    std::uint16_t object = 0;
    Prospect thickest, fastest;
    core::BoundedList<Prospect, kNearing> nearing;  ///< fastest first
  };

  void clear() noexcept { objects_.clear(); }
  /// Returns whether offer() may keep a prospect whose `closing_m_s` is an upper bound.
  bool may_matter(std::uint16_t object, const Prospect& prospect,
                  bool counts_at_any_direction) const noexcept;
  /// `counts_at_any_direction`: rule 2 may hold there.
  void offer(std::uint16_t object, const Prospect& prospect, bool counts_at_any_direction) noexcept;
  /// As offer(), of the link's worst sensor, which is preferred to any other in fluid of the same μ.
  void offer_worst(std::uint16_t object, Prospect prospect) noexcept;
  const OfObject* begin() const noexcept { return objects_.begin(); }
  const OfObject* end() const noexcept { return objects_.end(); }

 private:
  OfObject* place_of(std::uint16_t object, const Prospect& prospect) noexcept;
  core::BoundedList<OfObject, kMaxObjects> objects_;
};

/// A sensor in thin fluid that is too fast, as a quick look has it: rule 3 holds there if it nears.
struct FastPlace {
  std::uint32_t sensor = 0;
  std::uint16_t object = 0;
  workspace::Index3 voxel{};
  float mu = 0.0F;      ///< Pa·s/m
  float cosine = 0.0F;  ///< of the angle between motion and gradient, by central differences
  float share = 0.0F;   ///< of the speed limit
};

}  // namespace phantom::phantom_sensing
