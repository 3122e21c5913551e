#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/simulation/mesh_world.hpp"
#include "common/simulation/multibody.hpp"

namespace phantom::simulation {

/// An object of the cell that nothing holds.
struct LooseObject {
  std::uint16_t id = 0;
  geometry::TriangleMesh mesh_O;  ///< in the object's frame
  LooseBody body;
};

/// A point of the arm's surface, where it is now.
struct ArmPoint {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  std::size_t link = 0;
};

/// Finds where loose objects touch the cell's fixed bodies, the arm and one another.
///
/// Points on an object's surface, its outermost corners first, meet the meshes of all others, and so do the
/// arm's points: edges that cross between such points pass through one another. Once in a step the points are
/// chosen that may touch, deep ones and far from one another, so that what lies is borne at its corners; in
/// each sub-step the contacts are exact for them. What has not moved for a while, and has nothing near that
/// moves, rests: it stays where it is and costs nothing.
class LooseObjects {
 public:
  static constexpr std::size_t kPointsOfObject = 64;
  static constexpr std::size_t kOnArm = 8;    ///< greatest number of contacts of an object with the arm
  static constexpr std::size_t kOnFixed = 6;  ///< and with fixed bodies
  static constexpr std::size_t kOnOther = 4;  ///< and of its points with one other object

  /// Who may touch: a point of `owner` and the surface of `surface`.
  struct Pair {
    static constexpr std::int32_t kArm = -1;    ///< as owner
    static constexpr std::int32_t kFixed = -1;  ///< as surface
    std::int32_t owner = kArm;                  ///< index of the object with the point
    std::int32_t surface = kFixed;              ///< index of the object with the surface
    std::uint32_t point = 0;                    ///< of the arm's or the object's points
    friend bool operator==(const Pair&, const Pair&) = default;
  };
  struct Touch {
    Pair pair;
    std::uint16_t object = 0;  ///< id of the body with the surface
    Eigen::Vector3d point_W_m, normal_W;
    double depth_m = 0.0;  ///< > 0
  };

  /// `fixed` must outlive it. `arm_points`: how many the arm has. Objects without triangles are refused:
  /// std::runtime_error.
  LooseObjects(std::vector<LooseObject> objects, const ContactWorld& fixed, std::size_t arm_points);

  std::size_t size() const noexcept { return objects_.size(); }
  std::vector<LooseBody> bodies() const;
  std::uint16_t id(std::size_t object) const noexcept { return objects_[object].id; }

  /// Once in a step: sets where object `object` is. Real-time safe: yes, as what is below.
  void move(std::size_t object, const geometry::Pose& X_WO) noexcept { objects_[object].X_WO = X_WO; }
  /// Once in a step, before choose(): takes how fast an object moves (Multibody::speed).
  void take_speed(std::size_t object, double speed_m_s, double dt_s) noexcept;
  /// Once in a step, after move(): chooses the pairs that touch or may touch when points move by `reach_m`.
  void choose(std::span<const ArmPoint> arm, double reach_m) noexcept;
  /// Returns whether an object rests until the next choose().
  bool rests(std::size_t object) const noexcept { return objects_[object].still_s >= kRestsAfter_s; }
  std::span<const Pair> pairs() const noexcept { return {pairs_.data(), pairs_.size()}; }
  /// Returns whether the point of `pair` touches now, and how. `p_W_m`: where it is, of the arm; those of
  /// objects are known after move().
  bool touches(const Pair& pair, const Eigen::Vector3d& arm_point_W_m, Touch& touch) const noexcept;

 private:
  // A point at its last look-up: since then its distance has changed by at most the way it has moved.
  struct Seen {
    Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
    double distance_m = -1e9;  // not yet looked up
    bool is_farther(const Eigen::Vector3d& now_m, double reach_m) const noexcept {
      const double spare_m = distance_m - reach_m;
      return spare_m > 0.0 && (now_m - p_m).squaredNorm() < spare_m * spare_m;
    }
  };
  struct Object {
    std::uint16_t id;
    LooseBody body;
    MeshWorld surface_O;
    std::vector<Eigen::Vector3d> points_O_m;
    Eigen::Vector3d centre_O_m;
    double radius_m;
    geometry::Pose X_WO;
    double still_s;            // for how long it has not moved
    std::vector<Seen> seen_W;  // its points among the fixed bodies
    std::vector<Seen> arm_O;   // the arm's points at its surface
  };
  struct Near {
    Pair pair;
    Eigen::Vector3d p_W_m;
    double distance_m;
  };
  static constexpr double kRestsAfter_s = 0.25;
  void near_fixed(std::size_t object, double reach_m) noexcept;
  void near_one_another(std::size_t index, std::size_t other, double reach_m) noexcept;
  bool was_chosen(const Pair& pair) const noexcept;
  void near_object(std::int32_t owner, std::uint32_t point, const Eigen::Vector3d& p_W_m, std::size_t object,
                   double reach_m) noexcept;
  void keep(std::size_t most) noexcept;

  std::vector<Object> objects_;
  const ContactWorld& fixed_;
  std::vector<Near> near_;  // of the pair of bodies that is looked at; reserved
  std::vector<Pair> pairs_, last_pairs_;
};

}  // namespace phantom::simulation
