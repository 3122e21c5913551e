#pragma once

#include <Eigen/Core>
#include <optional>

#include "components/synthetic_viewer/render/frame.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"

namespace phantom::synthetic_viewer {

/// What the visual aids of a view show (fig. 6.19). Vectors in W.
struct Aids {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();    ///< worst sensor, or the look-at point
  Eigen::Vector3d pgv = Eigen::Vector3d::Zero();           ///< towards the object; 0: no direction
  std::optional<double> pgs_Pa_s_per_m;                    ///< strength of the gradient; none: not known
  double gap_m = 0.1;                                      ///< distance along the PGV to the object's surface
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< of the sensor
  MotionClass motion = MotionClass::kNone;                 ///< gives the motion arrow its colour
  double closeness = 0.0;
  double scale = 1.0;  ///< of all sizes that are not measures themselves: `size` times aids_scale()
  double size = 1.0;   ///< of the scene (scene_scale()): of all lengths that are stated here
};

/// Returns the scale at which aids hide neither the object nor the gap: 1 for an object 24 mm thick or
/// thicker, and a gap of 50 mm or wider, less in proportion; a tenth at least, and no less than 0.4 for the
/// gap. `thickness_m` 0: not known. `size`: Aids::size. The look-at point's marker is then at most half as
/// thick as the object.
double aids_scale(double thickness_m, double gap_m, double size = 1.0);

/// Returns the colour for a result of the unsafe-motion detector: grey, green, amber or red.
Colour motion_colour(MotionClass motion);

/// Returns the colour for a closeness 0…1: from blue through yellow to red.
Colour closeness_colour(double closeness);

/// Returns the colour `share` (0…1) of the way from a to b.
Colour mix(const Colour& a, const Colour& b, double share);

/// How many heads the motion's arrow has, so that its colour is not the only sign: dangerous 3, neutral 2,
/// else 1.
int motion_heads(MotionClass motion);

/// What the length of the PGV's arrow says.
enum class PgvLength {
  kInverseStrength,  ///< the stronger the gradient, the shorter: as near as the object (thesis 6.6.3a)
  kStrength,         ///< the stronger, the longer (fig. 6.16)
  kGap               ///< distance to the object
};
struct PgvArrow {
  PgvLength length = PgvLength::kInverseStrength;
  double half_strength_Pa_s_per_m = 8.0;  ///< strength at which the arrow has half its greatest length
};

/// Returns the length of the PGV's arrow, m, at a scale of 1: with s = PGS / half strength, 0.15 m / (1 + s)
/// or 0.15 m · s / (1 + s), 30 mm at least; by the gap, or where the strength is not known, the gap within 50
/// to 120 mm.
double pgv_arrow_m(const Aids& aids, const PgvArrow& arrow);

/// Adds the arrows of PGV and motion. The motion's is as long as the way of the next 0.5 s, within 60 (times
/// the scale) to 300 mm. Arrows are as thick as the scale says.
void add_arrows(Frame& frame, const Aids& aids, const PgvArrow& arrow);

/// Adds a translucent cone along the PGV with its tip at the object, and the plane normal to the PGV at that
/// tip. Near a convex surface that plane is the tangent plane; over a concave one it shows the hollow.
void add_cone_and_plane(Frame& frame, const Aids& aids);

/// Marks a point of W with a sphere, and a translucent one of 2.2 times its radius.
void add_marker(Frame& frame, const Eigen::Vector3d& position_m, double radius_m, const Colour& colour);

}  // namespace phantom::synthetic_viewer
