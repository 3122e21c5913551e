#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/core/bounded_list.hpp"

namespace phantom::percept {

/// How what the arm feels contradicts the model.
enum class DoubtKind : std::uint8_t {
  kForceInFreeSpace,  ///< something is touched where the model has no surface within its error
  kNoForceInside      ///< the arm rests deep inside a body of the model, and nothing is touched
};
inline constexpr std::size_t kDoubtKinds = 2;

/// A moment's contradiction.
struct DoubtEvidence {
  DoubtKind kind = DoubtKind::kForceInFreeSpace;
  std::uint64_t workspace_version = 0;  ///< of the model that is contradicted
  std::uint32_t link = 0;
  /// Where: of a force at a known place, that place; else the place of the link that is nearest to a body.
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  bool located = false;      ///< the position is where the force acts
  double force_N = -1.0;     ///< −1: not known
  std::uint16_t object = 0;  ///< whose fluid or body is there; 0: none reaches so far
  /// From the position to that body's surface; negative: so deep inside. NaN: farther than its fluid reaches.
  double residual_m = 0.0;
  /// The least shift of that object by which its surface is at the position; 0: not known.
  Eigen::Vector3d shift_W_m = Eigen::Vector3d::Zero();
};

/// A contradiction that has lasted.
struct ModelDoubt {
  std::uint32_t number = 0;  ///< running number, from 1
  std::uint32_t place = 0;   ///< index among the places that are kept, below ModelDoubtMonitor::kPlaces
  DoubtEvidence at;          ///< as it began
};

/// When a contradiction counts.
struct DoubtTiming {
  double after_s = 0.05;          ///< a force counts once it has lasted so long
  double rest_s = 0.5;            ///< so long must the arm rest without a force
  double clear_after_s = 0.3;     ///< a doubt no longer holds once nothing has contradicted for so long
  double apart_m = 0.03;          ///< evidence so far from a doubt that holds is of another one
  double least_interval_s = 0.5;  ///< from one doubt of a kind to the next: an arm may slide along something
};

/// Turns contradictions between model and feeling into doubts: raises each once, at the place where it began,
/// keeps its place for a correction, and ends it with hysteresis. One of each kind holds at a time. The
/// newest kPlaces places are kept, doubts of one kind and link within `apart_m` in one place. Real-time safe:
/// yes.
class ModelDoubtMonitor {
 public:
  static constexpr std::size_t kPlaces = 16;

  struct Changes {
    core::BoundedList<ModelDoubt, kDoubtKinds> ended, raised;
    bool empty() const noexcept { return ended.empty() && raised.empty(); }
  };

  explicit ModelDoubtMonitor(const DoubtTiming& timing = {}) noexcept : timing_(timing) {}

  /// Takes what contradicts the model now, of each kind once at most. A `dt_s` that is NaN or negative counts
  /// as 0.
  void step(std::span<const DoubtEvidence> evidence, double dt_s, Changes& changes) noexcept;
  /// Ends all doubts that hold, because nothing is known any more. Their places stay.
  void close(Changes& changes) noexcept;

  /// The doubt of a kind that holds; none: none does.
  const std::optional<ModelDoubt>& holding(DoubtKind kind) const noexcept {
    return of_kind_[static_cast<std::size_t>(kind)].holding;
  }
  bool holds() const noexcept { return of_kind_[0].holding || of_kind_[1].holding; }

 private:
  struct OfKind {
    std::optional<DoubtEvidence> beginning;  // of what contradicts, and does not hold yet
    double lasted_s = 0.0, quiet_s = 0.0, since_raise_s = 1e9;
    std::optional<ModelDoubt> holding;
  };
  bool is_same(const DoubtEvidence& a, const DoubtEvidence& b) const noexcept;
  void follow(OfKind& of, const DoubtEvidence& evidence, double dt_s, Changes& changes) noexcept;
  void rest(OfKind& of, double dt_s, Changes& changes) noexcept;
  void raise(OfKind& of, Changes& changes) noexcept;
  std::uint32_t place_for(const DoubtEvidence& evidence) noexcept;

  DoubtTiming timing_;
  std::array<OfKind, kDoubtKinds> of_kind_;
  std::array<std::optional<DoubtEvidence>, kPlaces> places_;
  std::uint32_t next_place_ = 0, raised_ = 0;
};

}  // namespace phantom::percept
